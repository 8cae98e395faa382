// Defines check(), which network.hpp declares.
#include <doctest/doctest.h>

#include <npt/base/aligned.hpp>
#include <npt/base/random.hpp>
#include <npt/base/thread_executor.hpp>
#include <npt/nn/engine/core.hpp>
#include <npt/nn/kernel/panel.hpp>
#include <npt/nn/tape/gradient_core.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "composition.hpp"
#include "network.hpp"
#include "plain_loops.hpp"

namespace random_networks {

namespace {

using Values = std::vector<double>;

template <class T>
constexpr T nan = std::numeric_limits<T>::quiet_NaN();

/// Weights as npt::randomise's, but the same numbers in float and in double; attributes 1.7.
Values random_parameters(const Network& network, npt::Random& random) {
  Values buffer(static_cast<std::size_t>(network.buffer_size));
  constexpr double blends[3][2] = {{1, 0.1}, {0, 1}, {0.6, 0.5}};  // none is flat: max_pool knows no ties
  std::uint32_t blend = 0;
  for (const npt::NamedParameter& p : network.parameters) {
    const bool is_relu = p.name.ends_with(".relu"), is_tanh = p.name.ends_with(".tanh");
    if (is_relu) blend = random.below(3);
    const double deviation = p.parameter.rank == 3 ? 1 / std::sqrt(static_cast<double>(p.parameter.dims[1])) : 0.1;
    for (int i = 0; i < p.parameter.size(); ++i) {
      double value = deviation * random.normal();
      if (p.parameter.attribute) value = 1.7;
      if (is_relu || is_tanh) value = blends[blend][is_tanh ? 1 : 0];
      buffer[static_cast<std::size_t>(p.parameter.offset + i)] = static_cast<double>(static_cast<float>(value));
    }
  }
  return buffer;
}

Values random_numbers(std::size_t count, npt::Random& random) {
  Values numbers(count);
  for (double& x : numbers) x = static_cast<double>(static_cast<float>(random.uniform(-1, 1)));
  return numbers;
}

template <class T>
std::vector<T> cast(const Values& values) {
  return {values.begin(), values.end()};
}

template <class T>
std::vector<std::vector<T>> cast(const std::vector<Values>& list) {
  std::vector<std::vector<T>> all;
  for (const Values& values : list) all.push_back(cast<T>(values));
  return all;
}

double length(const auto& values) {
  double sum = 0;
  for (const auto x : values) sum += static_cast<double>(x) * static_cast<double>(x);
  return std::sqrt(sum);
}

/// Length of the difference over that of what is expected, or over `floor`. NaN counts as infinite.
double error_of(const auto& values, const auto& expected, double floor) {
  double sum = 0;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const double d = static_cast<double>(values[i]) - static_cast<double>(expected[i]);
    sum += d * d;
  }
  const double size = std::max(length(expected), floor);
  const double error = sum == 0 ? 0 : std::sqrt(sum) / size;
  return std::isnan(error) ? std::numeric_limits<double>::infinity() : error;
}

template <class T>
bool same_bits(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0;
}

/// What disagreed, one line each.
class Failures {
 public:
  void expect(bool right, const std::string& what) {
    if (right) return;
    if (++count_ <= 8) text_ += what + "\n";
  }
  void expect_at_most(double error, double most, const std::string& what) {
    char numbers[64];
    std::snprintf(numbers, sizeof numbers, ": %.3g, at most %.3g expected", error, most);
    expect(error <= most, what + numbers);
  }
  std::string text() const { return count_ <= 8 ? text_ : text_ + "and " + std::to_string(count_ - 8) + " more\n"; }

 private:
  std::string text_;
  int count_ = 0;
};

/// Two calls, what plain loops make of them, and how far rounding alone takes them from it.
struct Case {
  struct Call {
    std::vector<Values> inputs;
    Values from;  ///< gradient of the result
    Values result;
    std::vector<Values> to_inputs;
    double result_error_fp32 = 0, result_error_bf16 = 0;
  };
  std::vector<Call> calls;
  Values to_parameters;
  double gradient_error_fp32 = 0;  ///< largest of any tensor
  double kink = std::numeric_limits<double>::infinity();
};

/// Gradients that all but vanish are compared with a part of what stands beside them.
constexpr double floor_of_gradients = 1e-2;

template <class T>
std::span<const T> slice(const std::vector<T>& buffer, const npt::Parameter& p) {
  return std::span(buffer).subspan(static_cast<std::size_t>(p.offset), static_cast<std::size_t>(p.size()));
}

double floor_of_parameters(const Network& network, const Values& gradient) {
  double largest = 0;
  for (const npt::NamedParameter& p : network.parameters)
    largest = std::max(largest, length(slice(gradient, p.parameter)));
  return floor_of_gradients * largest;
}

/// `own_vertices`: of the encoded input.
Case case_of(const Network& network, const Values& parameters, int encoded, std::span<const std::size_t> own_vertices,
             std::span<const std::size_t> vertices, npt::Random& random) {
  Case c;
  c.to_parameters.assign(parameters.size(), 0);
  Values to_parameters_fp32 = c.to_parameters;
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    Case::Call p;
    for (int k = 0; k < network.graph->inputs.count; ++k)
      p.inputs.push_back(random_numbers(
          static_cast<std::size_t>(network.graph->inputs[k].channels) * (k == encoded ? own_vertices[i] : vertices[i]),
          random));
    p.from = random_numbers(3 * vertices[i], random);
    PlainLoops<double> plain(*network.graph, parameters);
    PlainLoops<double> bf16(*network.graph, parameters, true);
    PlainLoops<float> fp32(*network.graph, parameters);
    p.result = plain.forward(p.inputs);
    const auto gradients = plain.backward(p.from);
    c.kink = std::min(c.kink, plain.kink());
    p.to_inputs = gradients.inputs;
    const double floor = floor_of_gradients * length(p.from);
    p.result_error_bf16 = error_of(bf16.forward(p.inputs), p.result, 0);
    p.result_error_fp32 = error_of(fp32.forward(p.inputs), p.result, 0);
    const auto gradients_fp32 = fp32.backward(p.from);
    for (std::size_t k = 0; k < p.inputs.size(); ++k)
      c.gradient_error_fp32 =
          std::max(c.gradient_error_fp32, error_of(gradients_fp32.inputs[k], p.to_inputs[k], floor));
    for (std::size_t k = 0; k < parameters.size(); ++k) {
      c.to_parameters[k] += gradients.parameters[k];
      to_parameters_fp32[k] += static_cast<double>(gradients_fp32.parameters[k]);
    }
    c.calls.push_back(std::move(p));
  }
  const double floor = floor_of_parameters(network, c.to_parameters);
  for (const npt::NamedParameter& p : network.parameters)
    c.gradient_error_fp32 = std::max(c.gradient_error_fp32, error_of(slice(to_parameters_fp32, p.parameter),
                                                                     slice(c.to_parameters, p.parameter), floor));
  return c;
}

/// What is asked of a scalar: this error, or, where rounding hurts a network more than most, a multiple of what it does
/// to plain loops.
template <class T>
double tolerance(double error_fp32) {
  return std::is_same_v<T, float> ? std::max(1e-5, 40 * error_fp32) : std::max(1e-10, 1e-7 * error_fp32);
}

/// The engine rounds other factors than the plain loops do: it multiplies some convolutions together first.
double tolerance_bf16(double error_bf16) { return std::max(5e-2, 10 * error_bf16); }

/// Rounding may put a value on the other side of a kink, and then the gradient is another one.
template <class T>
constexpr double safe_distance = std::is_same_v<T, float> ? 1e-5 : 1e-11;

/// All inputs of a call but one.
template <class T>
npt::Inputs<T> inputs_of(const std::vector<std::vector<T>>& given, int without = -1) {
  npt::Inputs<T> inputs;
  for (std::size_t k = 0; k < given.size(); ++k)
    if (static_cast<int>(k) != without) inputs.push_back(given[k]);
  return inputs;
}

template <class T>
class EngineCheck {
 public:
  EngineCheck(const Values& parameters, const npt::graph::Program& program, npt::Precision precision,
              npt::engine::RowTransforms<T> rows, Failures& failures)
      : name_("engine " + std::string(std::is_same_v<T, float> ? "fp32 " : "fp64 ") + npt::name_of(precision)),
        bf16_(precision == npt::Precision::bf16),
        failures_(failures) {
    const std::vector<T> values = cast<T>(parameters);
    npt::AlignedBuffer<T> aligned(values.size());
    std::ranges::copy(values, aligned.data());
    for (const int threads : {1, 3})
      engines_.push_back(
          std::make_unique<Engine>(program, aligned.span(), precision, rows, npt::ThreadExecutor(threads)));
  }

  void operator()(const Case& c) {
    const int encoded = engines_[0]->inputs().encoded;
    std::vector<std::vector<std::vector<T>>> given;
    std::vector<std::vector<T>> first;
    for (const Case::Call& p : c.calls) {
      given.push_back(cast<T>(p.inputs));
      first.emplace_back(p.result.size(), nan<T>);
    }
    for (std::size_t i = 0; i < c.calls.size(); ++i) {
      const Case::Call& p = c.calls[i];
      const std::string at = name_ + ", " + std::to_string(p.result.size() / 3) + " vertices";
      const npt::Inputs<T> inputs = inputs_of(given[i]);
      (*engines_[0])(inputs, first[i]);
      const double error = error_of(first[i], p.result, 0);
      failures_.expect_at_most(error, bf16_ ? tolerance_bf16(p.result_error_bf16) : tolerance<T>(p.result_error_fp32),
                               at + ", result");
      for (const auto& engine : engines_) {
        std::vector<T> again(p.result.size(), nan<T>), decoded = again;
        (*engine)(inputs, again);
        failures_.expect(same_bits(again, first[i]), at + ": again, other bits");
        if (encoded < 0) continue;
        const auto code = engine->encode(inputs[encoded]);
        const npt::Inputs<T> others = inputs_of(given[i], encoded);
        engine->decode(code, others, decoded);
        failures_.expect(same_bits(decoded, first[i]), at + ": encoded and decoded, other bits");
        engine->decode(code, others, decoded);
        failures_.expect(same_bits(decoded, first[i]), at + ": encoded and decoded, other bits");
      }
    }
    std::vector<std::vector<T>> batch;
    for (const auto& r : first) batch.emplace_back(r.size(), nan<T>);
    std::vector<npt::NetworkCall<T>> calls;
    for (std::size_t i = 0; i < first.size(); ++i) calls.push_back({inputs_of(given[i]), batch[i]});
    engines_[1]->run(calls);
    for (std::size_t i = 0; i < first.size(); ++i)
      failures_.expect(same_bits(batch[i], first[i]), name_ + ": as a batch, other bits");
  }

 private:
  using Engine = npt::engine::Core<T, npt::ThreadExecutor>;
  std::string name_;
  bool bf16_;
  Failures& failures_;
  std::vector<std::unique_ptr<Engine>> engines_;
};

template <class T>
class TapeCheck {
 public:
  TapeCheck(const Network& network, const Values& parameters, std::span<const npt::tape::ChainLoops<T>> loops,
            Failures& failures)
      : name_(std::is_same_v<T, float> ? "tape fp32" : "tape fp64"),
        network_(network),
        parameters_(cast<T>(parameters)),
        failures_(failures) {
    for (const int threads : {1, 3}) {
      tapes_.push_back(std::make_unique<Tape>(*network.tape, parameters_.size(), loops, npt::ThreadExecutor(threads)));
      tapes_.back()->load(parameters_);
    }
  }

  void operator()(const Case& c) {
    const Run first = run(*tapes_[0], c);
    for (std::size_t i = 0; i < c.calls.size(); ++i) {
      const Case::Call& p = c.calls[i];
      const std::string at = name_ + ", " + std::to_string(p.result.size() / 3) + " vertices";
      failures_.expect_at_most(error_of(first.results[i], p.result, 0), tolerance<T>(p.result_error_fp32),
                               at + ", result");
      if (c.kink < safe_distance<T>) continue;
      const double floor = floor_of_gradients * length(p.from);
      for (std::size_t k = 0; k < p.inputs.size(); ++k)
        failures_.expect_at_most(error_of(first.to_inputs[k][i], p.to_inputs[k], floor),
                                 tolerance<T>(c.gradient_error_fp32), at + ", gradient of input " + input_names[k]);
    }
    if (c.kink >= safe_distance<T>) compare_parameters(first.to_parameters, c);
    for (const auto& tape : tapes_) {
      const Run again = run(*tape, c);
      for (std::size_t i = 0; i < c.calls.size(); ++i) {
        bool same = same_bits(again.results[i], first.results[i]);
        for (std::size_t k = 0; k < first.to_inputs.size(); ++k)
          same = same && same_bits(again.to_inputs[k][i], first.to_inputs[k][i]);
        failures_.expect(same, name_ + ": again, other bits in the result or the gradients of the inputs");
      }
      failures_.expect(same_bits(again.to_parameters, first.to_parameters),
                       name_ + ": again, other bits in the gradients of the parameters");
    }
  }

 private:
  using Tape = npt::tape::GradientCore<T, npt::ThreadExecutor>;

  struct Run {
    std::vector<std::vector<T>> results;
    std::vector<std::vector<std::vector<T>>> to_inputs;  ///< by input and call
    std::vector<T> to_parameters;
  };
  Run run(Tape& tape, const Case& c) {
    Run r;
    const std::size_t count = c.calls.front().inputs.size();
    std::vector<std::vector<std::vector<T>>> given;
    std::vector<std::vector<T>> from;
    r.to_inputs.resize(count);
    for (const Case::Call& p : c.calls) {
      given.push_back(cast<T>(p.inputs));
      from.push_back(cast<T>(p.from));
      r.results.emplace_back(p.result.size(), nan<T>);
      for (std::size_t k = 0; k < count; ++k) r.to_inputs[k].emplace_back(p.inputs[k].size(), nan<T>);
    }
    r.to_parameters.assign(parameters_.size(), nan<T>);
    std::vector<npt::NetworkCall<T>> calls;
    for (std::size_t i = 0; i < given.size(); ++i) calls.push_back({inputs_of(given[i]), r.results[i]});
    const std::vector<std::span<const T>> from_spans(from.begin(), from.end());
    npt::tape::BatchGradients<T> gradients{.result = from_spans, .parameters = r.to_parameters};
    std::vector<std::vector<std::span<T>>> input_spans;
    for (auto& of_calls : r.to_inputs) input_spans.emplace_back(of_calls.begin(), of_calls.end());
    for (std::size_t k = 0; k < count; ++k) gradients.inputs[k] = input_spans[k];
    tape.forward(calls);
    tape.backward(gradients);
    return r;
  }

  void compare_parameters(const std::vector<T>& found, const Case& c) {
    const double floor = floor_of_parameters(network_, c.to_parameters);
    for (const npt::NamedParameter& p : network_.parameters)
      failures_.expect_at_most(error_of(slice(found, p.parameter), slice(c.to_parameters, p.parameter), floor),
                               tolerance<T>(c.gradient_error_fp32), name_ + ", gradient of " + p.name);
  }

  std::string name_;
  const Network& network_;
  std::vector<T> parameters_;
  Failures& failures_;
  std::vector<std::unique_ptr<Tape>> tapes_;
};

/// Whether somewhere a vertex of the encoded input meets one of another.
bool pairs_vertices(const npt::graph::Graph& graph) {
  using npt::graph::NodeKind;
  std::vector<bool> pooled;
  for (int n = 0; n < graph.count; ++n) {
    const npt::graph::Node& node = graph[n];
    bool all_pooled = node.kind != NodeKind::input;
    for (const int operand : {node.first, node.second})
      if (operand >= 0 && !pooled[static_cast<std::size_t>(operand)]) {
        all_pooled = false;
        // Behind a feature of another input, too, values are computed beside that one's.
        if (graph.is_encoded(operand) && !graph.is_encoded(n)) return true;
      }
    pooled.push_back(all_pooled || node.kind == NodeKind::max_pool);
  }
  return false;
}

}  // namespace

void check(const Network& network, std::uint64_t seed) {
  Failures failures;
  npt::Random random(seed, 5);
  const Values parameters = random_parameters(network, random);
  const bool paired = pairs_vertices(*network.graph);
  if (network.program != nullptr)
    failures.expect(!network.program->paired || paired, "the engine pairs vertices without need");
  if (network.tape != nullptr) failures.expect(!network.tape->paired || paired, "the tape pairs vertices without need");

  constexpr int panel = npt::kernel::panel_width<float>, group = 96;
  constexpr std::size_t counts[] = {1, 2, 3, panel - 1, panel, panel + 1, group - 1, group, group + 1, 2 * group, 310};
  const auto draw = [&] { return counts[random.below(std::size(counts))]; };
  std::vector<Case> cases;
  for (int k = 0; k < 2; ++k) {
    std::size_t vertices[2] = {draw(), draw()}, own_vertices[2] = {draw(), draw()};
    if (paired) std::ranges::copy(vertices, own_vertices);
    cases.push_back(case_of(network, parameters, network.graph->inputs.encoded, own_vertices, vertices, random));
  }
  cases.push_back(cases.front());  // again, in memory that held other sizes

  const auto run = [&cases](auto check_case) {
    for (const Case& c : cases) check_case(c);
  };
  if (network.program != nullptr) {
    const auto native = npt::Precision::native;
    const npt::graph::Program& program = *network.program;
    const npt::engine::RowTransforms<float> rows{network.fp32.rows, network.fp32.rows};
    if (!network.fp32.rows.empty()) run(EngineCheck<float>(parameters, program, native, rows, failures));
    if (!network.fp64.rows.empty())
      run(EngineCheck<double>(parameters, program, native, {network.fp64.rows, network.fp64.rows}, failures));
    if (npt::simd::has_matrix_registers()) {  // which take the plain program
      if (!network.fp32.rows.empty())
        for (const auto precision : {npt::Precision::bf16, npt::Precision::bf16x3})
          run(EngineCheck<float>(parameters, program, precision, rows, failures));
    } else if (network.bf16_program != nullptr) {
      run(EngineCheck<float>(parameters, *network.bf16_program, npt::Precision::bf16,
                             {network.bf16_rows, network.fp32.rows}, failures));
    }
  }
  if (network.tape != nullptr) {
    if (!network.fp32.tape.empty()) run(TapeCheck<float>(network, parameters, network.fp32.tape, failures));
    if (!network.fp64.tape.empty()) run(TapeCheck<double>(network, parameters, network.fp64.tape, failures));
  }
  const std::string text = failures.text();
  if (!text.empty()) FAIL_CHECK("network ", seed, ":\n", network.text, text);
}

}  // namespace random_networks
