/// What Gradients (nn/train/gradients.hpp) is apart from its network's type. Compiled once a scalar and executor, however
/// many networks a program trains.
#pragma once

#include <npt/base/error.hpp>
#include <npt/base/executor.hpp>
#include <npt/config.hpp>
#include <npt/nn/engine/packed_program.hpp>
#include <npt/nn/engine/transfer_pair.hpp>
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

/// Its long members are not inlined: where they are instantiated elsewhere (NPT_PREBUILT), what they call would be
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

  /// A batch through the network. Results are written, and what the gradient needs is kept. The pairs' meshes may be
  /// gone afterwards.
  NPT_NOINLINE void forward(std::span<const TransferPair<T>> pairs) {
    if (memory_->weights.empty())
      throw Error({.file = "gradients", .found = "no weights", .expected = "a call of load() before"});
    if (pairs.empty()) throw Error({.file = "batch", .found = "no pairs", .expected = "at least one"});
    memory_->pose.clear();
    memory_->identity.clear();
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      engine::check_pair(pairs[i], i, pairs.size(), tape_->paired);
      memory_->pose.add({.coordinates = pairs[i].pose, .result = {}, .code = static_cast<int>(i)});
      memory_->identity.add({.coordinates = pairs[i].identity, .result = pairs[i].result, .code = static_cast<int>(i)});
    }
    Forward<T>(*tape_, loops_, *memory_).run(executor_);
  }

  /// The gradient of the batch of the last forward(): result_gradient[i], [V, 3], is dL / d result of pair i.
  /// Overwrites parameter_gradient, which is laid out as Model::buffer() (attributes and padding get 0).
  void backward(std::span<const std::span<const T>> result_gradient, std::span<T> parameter_gradient) {
    backward({.result = result_gradient, .parameters = parameter_gradient, .pose = {}, .identity = {}});
  }
  /// Leaves the gradients of the meshes too, where they are asked for.
  NPT_NOINLINE void backward(const BatchGradients<T>& gradients) {
    const auto& pairs = memory_->identity.meshes;
    expect("parameter gradient", gradients.parameters.size(), parameter_count_);
    expect("result gradients", gradients.result.size(), pairs.size());
    for (std::size_t i = 0; i < pairs.size(); ++i)
      expect("result gradient", gradients.result[i].size(), pairs[i].coordinates.size());
    check_meshes("pose gradients", gradients.pose, memory_->pose);
    check_meshes("identity gradients", gradients.identity, memory_->identity);
    Backward<T>(*tape_, loops_, *memory_, gradients).run(executor_);
  }

 private:
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
  static void check_meshes(const char* what, std::span<const std::span<T>> gradients,
                           const engine::MeshBatch<T>& batch) {
    if (gradients.empty()) return;
    expect(what, gradients.size(), batch.meshes.size());
    for (std::size_t i = 0; i < gradients.size(); ++i)
      expect(what, gradients[i].size(), batch.meshes[i].coordinates.size());
  }
  const Tape* tape_;
  std::size_t parameter_count_;
  std::span<const ChainLoops<T>> loops_;
  Exec executor_;
  Precision precision_ = Precision::native;
  std::unique_ptr<Memory<T>> memory_;
};

}  // namespace npt::inline NPT_ABI::tape
