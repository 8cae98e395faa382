/// What Gradients (nn/train/gradients.hpp) is apart from its network's type. Compiled once a scalar and executor, however
/// many networks a program trains.
#pragma once

#include <npt/base/error.hpp>
#include <npt/base/executor.hpp>
#include <npt/config.hpp>
#include <npt/nn/engine/network_call.hpp>
#include <npt/nn/engine/packed_program.hpp>
#include <npt/nn/engine/workspace.hpp>
#include <npt/nn/graph/graph.hpp>
#include <npt/nn/kernel/matrix_product.hpp>
#include <npt/nn/simd/amx.hpp>
#include <npt/nn/tape/backward.hpp>
#include <npt/nn/tape/forward.hpp>
#include <npt/nn/tape/memory.hpp>

#include <algorithm>
#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI::tape {

/// Its long members are not inlined: where they are instantiated elsewhere (NPT_COMPILED), what they call would be
/// compiled again.
template <class T, class Exec>
class GradientCore {
 public:
  using Scalar = T;

  GradientCore(const Tape& tape, std::size_t parameters, std::span<const ChainLoops<T>> loops, Exec executor)
      : tape_(&tape),
        parameter_count_(parameters),
        loops_(loops),
        executor_(std::move(executor)),
        memory_(std::make_unique<Memory<T>>()) {}

  const Exec& executor() const { return executor_; }
  const Tape& tape() const { return *tape_; }
  /// Elements of a parameter buffer, Model::buffer().
  std::size_t parameter_count() const { return parameter_count_; }
  /// Bytes held.
  std::size_t bytes() const { return memory_->bytes(); }

  Precision precision() const { return precision_; }
  /// What products are computed in, from the next load() on. Everything else, sums and stored values too, stays T.
  /// Errors  npt::Error where this build or machine doesn't multiply bfloat16, or not in as many parts
  NPT_NOINLINE void set_precision(Precision precision) {
    precision = engine::resolve<T>(precision, *tape_);
    const int parts = parts_of(precision);
    if (parts > 0 && !(std::is_same_v<T, float> && kernel::has_word_products(parts)))
      throw Error({.file = "precision",
                   .found = std::string(name_of(precision)) + " in gradients compiled for " NPT_ISA_NAME,
                   .expected = parts == 1 ? "float and a processor with AVX512_BF16, or the native precision"
                                          : "float and a processor and a system with AMX, or the native precision"});
    precision_ = precision;
    *memory_ = Memory<T>{};
    memory_->format = {.parts = parts};
  }

  /// Takes new weights: after every step of the optimiser.
  NPT_NOINLINE void load(std::span<const T> parameters) {
    expect("parameters", parameters.size(), parameter_count_);
    Memory<T>& memory = *memory_;
    memory.parameters.grow_to(parameter_count_);
    std::ranges::copy(parameters, memory.parameters.data());
    if (memory.weights.empty()) {
      memory.weights.resize(static_cast<std::size_t>(tape_->stage_count));
      memory.transposed.resize(memory.weights.size());
      for (int i = 0; i < tape_->stage_count; ++i) {
        memory.columns.emplace_back();
        for (int row = 0; tape_->stage(i).product && row < tape_->stage(i).operand_rows; ++row)
          memory.columns.back().push_back(column_of_row(*tape_, tape_->stage(i), row));
      }
    }
    executor_.for_each(2 * tape_->stage_count, [&](int task, int) { pack(task / 2, task % 2 == 0); });
  }

  /// A batch through the network. Results are written, and what the gradient needs is kept. The calls' inputs may be
  /// gone afterwards.
  NPT_NOINLINE void forward(std::span<const NetworkCall<T>> calls) {
    if (memory_->weights.empty())
      throw Error({.file = "gradients", .found = "no weights", .expected = "a call of load() before"});
    if (calls.empty()) throw Error({.file = "batch", .found = "no calls", .expected = "at least one"});
    memory_->encoded.clear();
    memory_->main.clear();
    for (std::size_t i = 0; i < calls.size(); ++i) add(calls[i], i, calls.size());
    Forward<T>(*tape_, loops_, *memory_).run(executor_);
  }

  /// The gradient of the batch of the last forward(): result_gradient[i], [V, 3], is dL / d result of call i.
  /// Overwrites parameter_gradient, which is laid out as Model::buffer() (attributes and padding get 0).
  void backward(std::span<const std::span<const T>> result_gradient, std::span<T> parameter_gradient) {
    backward({.result = result_gradient, .parameters = parameter_gradient, .inputs = {}});
  }
  /// Leaves the gradients of the inputs too, where they are asked for.
  NPT_NOINLINE void backward(const BatchGradients<T>& gradients) {
    const auto& calls = memory_->main.meshes;
    expect("parameter gradient", gradients.parameters.size(), parameter_count_);
    expect("result gradients", gradients.result.size(), calls.size());
    for (std::size_t i = 0; i < calls.size(); ++i)
      expect("result gradient", gradients.result[i].size(), 3 * static_cast<std::size_t>(calls[i].vertices));
    for (int i = 0; i < tape_->inputs.count; ++i)
      check_input_gradients(tape_->inputs[i], gradients.inputs[static_cast<std::size_t>(i)],
                            i == tape_->inputs.encoded ? memory_->encoded : memory_->main);
    Backward<T>(*tape_, loops_, *memory_, gradients).run(executor_);
  }

 private:
  /// Call `number` of a batch. Each has its own encoded input here, the same one or not.
  void add(const NetworkCall<T>& call, std::size_t number, std::size_t count) {
    const graph::InputList& inputs = tape_->inputs;
    const engine::CallVertices vertices =
        engine::check_call(inputs, tape_->paired, call, count == 1 ? engine::only_call : number);
    engine::BatchMesh<T> encoded{.vertices = static_cast<int>(vertices.encoded)};
    engine::BatchMesh<T> main{
        .result = call.result.data(), .vertices = static_cast<int>(vertices.result), .code = static_cast<int>(number)};
    for (int i = 0; i < inputs.count; ++i)
      (i == inputs.encoded ? encoded : main).inputs[static_cast<std::size_t>(i)] = call.inputs[i].data();
    if (inputs.encoded >= 0) memory_->encoded.add(encoded);
    memory_->main.add(main);
  }

  void pack(int i, bool is_forward) {
    const Stage& stage = tape_->stage(i);
    if (!stage.product) return;
    const T* parameters = memory_->parameters.data();
    const T* weights = parameters + stage.weight;
    const std::vector<int>& columns = memory_->columns[static_cast<std::size_t>(i)];
    const auto weight = [&](int row, int k) {
      return weights[row * stage.columns + columns[static_cast<std::size_t>(k)]];
    };
    const auto bias = [&](int row) { return stage.bias_is_dead ? T(0) : parameters[stage.bias + row]; };
    const auto transposed = [&](int k, int row) { return weight(row, k); };
    const auto no_bias = [](int) { return T(0); };
    Weights<T>& packed = memory_->weights[static_cast<std::size_t>(i)];
    const kernel::ProductFormat format = memory_->format;
    // Columns that meet no pooled feature nearly always stand side by side: a matrix, which matrix registers want row
    // by row.
    const bool contiguous =
        columns.back() - columns.front() + 1 == stage.operand_rows && std::ranges::is_sorted(columns);
    const auto stride = static_cast<std::size_t>(stage.columns);
    if (format.parts == 0 || !contiguous) {
      if (is_forward)
        packed.forward.pack(stage.rows, stage.operand_rows, format, weight, bias);
      else
        packed.backward.pack(stage.operand_rows, stage.rows, format, transposed, no_bias);
    } else if (is_forward) {
      packed.forward.pack_matrix(stage.rows, stage.operand_rows, format, weights + columns.front(), stride, bias);
    } else {
      const auto rows = static_cast<std::size_t>(stage.rows);
      AlignedBuffer<T>& matrix = memory_->transposed[static_cast<std::size_t>(i)];
      matrix.grow_to(rows * stride);
      kernel::transpose_matrix(weights, stage.rows, stage.columns, matrix.data());
      packed.backward.pack_matrix(stage.operand_rows, stage.rows, format,
                                  matrix.data() + static_cast<std::size_t>(columns.front()) * rows, rows, no_bias);
    }
  }

  static void expect(const char* what, std::size_t found, std::size_t expected) {
    if (found != expected)
      throw Error({.file = what, .found = std::to_string(found), .expected = std::to_string(expected)});
  }
  static void check_input_gradients(const Input& input, std::span<const std::span<T>> gradients,
                                    const engine::MeshBatch<T>& batch) {
    if (gradients.empty()) return;
    expect(input.name, gradients.size(), batch.meshes.size());
    for (std::size_t i = 0; i < gradients.size(); ++i)
      expect(input.name, gradients[i].size(),
             static_cast<std::size_t>(input.channels) * static_cast<std::size_t>(batch.meshes[i].vertices));
  }

  const Tape* tape_;
  std::size_t parameter_count_;
  std::span<const ChainLoops<T>> loops_;
  Exec executor_;
  Precision precision_ = Precision::native;
  std::unique_ptr<Memory<T>> memory_;
};

}  // namespace npt::inline NPT_ABI::tape
