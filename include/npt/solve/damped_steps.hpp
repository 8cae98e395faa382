/// Levenberg and Marquardt's method for a sum of squares whose terms may change from step to step, as closest points
/// do: a step is damped until it makes the sum less, and the next one is then damped less.
/// Source    Nocedal and Wright, "Numerical Optimization", 2006, section 10.3
#pragma once

#include <npt/config.hpp>
#include <npt/solve/normal_equations.hpp>

#include <algorithm>

namespace npt::inline NPT_ABI {

struct StepLimits {
  int steps = 5;         ///< at most
  double slack = 0;      ///< the sum may grow by this share of it in a step
  double enough = 1e-2;  ///< a whole step that takes a smaller share of the sum is the last one; below 0: none is
};

/// problem.linearise()     the NormalEquations about where it is
/// problem.value()         the sum there
/// problem.try_step(step)  the sum a step farther; the problem may shorten the step
/// problem.whole_step()    whether it took all of it
/// problem.take_step()     goes where the last try was
template <class Problem>
void take_damped_steps(Problem& problem, const StepLimits& limits) {
  constexpr int attempts = 3;
  double damping = 1e-3;
  for (int i = 0; i < limits.steps; ++i) {
    const NormalEquations& equations = problem.linearise();
    const double before = problem.value();
    bool better = false;
    for (int attempt = 0; attempt < attempts && !better; ++attempt) {
      const double after = problem.try_step(equations.solve(damping, 1e-4));
      better = after < before * (1 + limits.slack);
      damping = better ? std::max(damping * 0.3, 1e-5) : std::max(10 * damping, 1e-2);
      if (!better) continue;
      problem.take_step();
      if (before - after < limits.enough * before && problem.whole_step()) return;
    }
    if (!better) return;
  }
}

}  // namespace npt::inline NPT_ABI
