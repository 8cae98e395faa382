/// Minimisation by L-BFGS, from the packaged library liblbfgs (double precision, a line search after More and Thuente).
///   minimise_lbfgs(objective, x, options)   objective(x, gradient) returns the value and fills the gradient
/// Shapes    x, gradient: [n]; x holds the start and then the best point found
/// Errors    what the objective throws comes out unchanged. A value or gradient that isn't finite ends the search at
///           the last good point; it is no error
/// Link      liblbfgs 1.10 (N. Okazaki, MIT licence); the target npt::baseline does
/// Source    Liu and Nocedal, "On the limited memory BFGS method for large scale optimization", 1989
#pragma once

#include <npt/config.hpp>

#include <lbfgs.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <exception>
#include <memory>
#include <new>
#include <span>
#include <type_traits>
#include <vector>

namespace npt::inline NPT_ABI {

struct LbfgsOptions {
  int memory = 10;                   ///< pairs of differences kept
  int max_iterations = 100;          ///< 0: until it converges
  double gradient_tolerance = 1e-6;  ///< stop where |gradient| < this * max(1, |x|)
  double least_decrease = 0;         ///< stop where the value fell by less than this share ...
  int over_iterations = 5;           ///< ... over so many iterations
};

struct LbfgsResult {
  double value = 0;        ///< at the x that is left
  int iterations = 0;      ///< steps taken
  int evaluations = 0;     ///< calls of the objective
  bool converged = false;  ///< by gradient or by decrease; false: iterations or the line search ran out
};

namespace linear::internal {

/// What liblbfgs's callbacks get. Exceptions must not pass through its C code.
template <class Objective>
struct LbfgsCall {
  Objective& objective;
  LbfgsResult result;
  std::exception_ptr failure{};
  std::vector<double> good{};  ///< of the last step whose value is a number
  bool is_lost = false;        ///< the last step's is none

  static lbfgsfloatval_t evaluate(void* instance, const lbfgsfloatval_t* x, lbfgsfloatval_t* gradient, int n,
                                  lbfgsfloatval_t /*step*/) {
    auto& call = *static_cast<LbfgsCall*>(instance);
    const auto size = static_cast<std::size_t>(n);
    // A failed objective is not asked again: NaN makes the line search give up, or progress() ends the search.
    if (call.failure) return std::nan("");
    try {
      const double value = call.objective(std::span<const double>(x, size), std::span<double>(gradient, size));
      // Where no step succeeds, the start is what is left.
      if (call.result.evaluations++ == 0) call.result.value = value;
      return value;
    } catch (...) {
      call.failure = std::current_exception();
      std::fill_n(gradient, size, 0.0);
      return std::nan("");
    }
  }
  static int progress(void* instance, const lbfgsfloatval_t* x, const lbfgsfloatval_t*, lbfgsfloatval_t value,
                      lbfgsfloatval_t, lbfgsfloatval_t, lbfgsfloatval_t, int n, int iteration, int) {
    auto& call = *static_cast<LbfgsCall*>(instance);
    // Compiled with -ffast-math, as Debian's is for ARM64, liblbfgs takes NaN for a decrease.
    call.is_lost = !std::isfinite(value);
    if (call.is_lost) return 1;
    call.good.assign(x, x + n);
    call.result.iterations = iteration;
    call.result.value = value;
    return call.failure ? 1 : 0;
  }
};

}  // namespace linear::internal

template <class Objective>
LbfgsResult minimise_lbfgs(Objective&& objective, std::span<double> x, const LbfgsOptions& options = {}) {
  static_assert(std::is_same_v<lbfgsfloatval_t, double>, "liblbfgs for double");
  if (x.empty()) return {.converged = true};
  // liblbfgs may want its own alignment.
  struct Free {
    void operator()(lbfgsfloatval_t* p) const { lbfgs_free(p); }
  };
  const std::unique_ptr<lbfgsfloatval_t, Free> point(lbfgs_malloc(static_cast<int>(x.size())));
  if (!point) throw std::bad_alloc();
  std::copy(x.begin(), x.end(), point.get());
  lbfgs_parameter_t parameters;
  lbfgs_parameter_init(&parameters);
  parameters.m = std::max(1, options.memory);
  parameters.max_iterations = std::max(0, options.max_iterations);
  parameters.epsilon = options.gradient_tolerance;
  parameters.past = options.least_decrease > 0 ? std::max(1, options.over_iterations) : 0;
  parameters.delta = options.least_decrease;
  using Call = linear::internal::LbfgsCall<std::remove_reference_t<Objective>>;
  Call call{.objective = objective, .result = {}};
  call.good.assign(x.begin(), x.end());
  const int status =
      lbfgs(static_cast<int>(x.size()), point.get(), nullptr, &Call::evaluate, &Call::progress, &call, &parameters);
  if (call.failure) std::rethrow_exception(call.failure);
  if (status == LBFGSERR_OUTOFMEMORY) throw std::bad_alloc();
  call.result.converged = status == LBFGS_SUCCESS || status == LBFGS_STOP || status == LBFGS_ALREADY_MINIMIZED;
  if (call.is_lost)
    std::copy(call.good.begin(), call.good.end(), x.begin());
  else if (std::all_of(point.get(), point.get() + x.size(), [](double v) { return std::isfinite(v); }))
    std::copy_n(point.get(), x.size(), x.begin());
  return call.result;
}

}  // namespace npt::inline NPT_ABI
