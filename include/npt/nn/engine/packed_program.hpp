/// A program with its weights, packed once for the kernels. It doesn't refer to the model it was made from.
#pragma once

#include <npt/base/aligned.hpp>
#include <npt/config.hpp>
#include <npt/nn/engine/precision.hpp>
#include <npt/nn/graph/program.hpp>
#include <npt/nn/kernel/panel.hpp>
#include <npt/nn/kernel/product.hpp>
#include <npt/nn/simd/amx.hpp>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

namespace npt::inline NPT_ABI::engine {

/// The factors of products in a precision, which is not `automatic`.
inline kernel::ProductFormat format_of(Precision precision) {
  if (simd::has_matrix_registers()) return {.parts = parts_of(precision)};
  return {.pairs = precision == Precision::bf16};
}

/// From this many rows of its widest convolution on, a network is faster with bf16x3 than in fp32. On a Xeon with AMX,
/// two threads, with 1027, 259 and 131 rows: the forward pass at 6890 vertices 1.6, 1.32 and 1.13 times, a training
/// step 1.5, 1.27 and 1.13 times.
inline constexpr int rows_for_bf16x3 = 128;

/// What `precision` stands for in a program or tape: itself, unless it is `automatic`.
template <class T, class Program>
Precision resolve(Precision precision, const Program& program) {
  if (precision != Precision::automatic) return precision;
  int widest = 0;
  for (int i = 0; i < program.stage_count; ++i) widest = std::max(widest, program.stage(i).rows);
  return std::is_same_v<T, float> && simd::has_matrix_registers() && widest >= rows_for_bf16x3 ? Precision::bf16x3
                                                                                               : Precision::native;
}

/// One stage's weights. Columns that meet a pooled source are kept apart: their product is the same at every vertex and
/// becomes part of the bias (the compact feature's first decoder convolution shrinks from 1027 to 3 columns).
template <class T>
struct PackedStage {
  kernel::ProductWeights<T> weights;  ///< per-vertex columns, in the order of the sources
  AlignedBuffer<T> pooled_weights;    ///< [pooled columns][rows]
  int pooled_columns = 0;
};

template <class T>
class PackedProgram {
 public:
  PackedProgram(const graph::Program& program, std::span<const T> parameters, Precision precision = Precision::native)
      : program_(program), precision_(precision), format_(format_of(precision)) {
    for (int i = 0; i < program_.stage_count; ++i) {
      stages_.push_back(pack(program_.stage(i), parameters));
      const kernel::ProductWeights<T>& weights = stages_.back().weights;
      operand_words_ = std::max(operand_words_, weights.operand_words(kernel::group_panels<T>));
      operand_values_ = std::max(operand_values_, weights.operand_values());
    }
    copy_pointwise_parameters(parameters);
  }

  const graph::Program& program() const { return program_; }
  /// Differs from that of every other packed program of the process, 0 is none's: what an engine knows its codes by.
  std::uint64_t id() const { return id_; }
  Precision precision() const { return precision_; }
  /// Words of the largest operand on matrix registers.
  std::size_t operand_words() const { return operand_words_; }
  /// Elements of what such an operand keeps in T.
  std::size_t operand_values() const { return operand_values_; }
  /// Steps of the sum, and so rows of the operand tile, that `channels` channels of one source take.
  int steps(int channels) const { return format_.pairs ? (channels + 1) / 2 : channels; }
  const PackedStage<T>& stage(int i) const { return stages_[static_cast<std::size_t>(i)]; }
  /// Parameters of pointwise layers; steps' offsets in program() refer to it.
  const T* pointwise_parameters() const { return pointwise_.data(); }

 private:
  /// A stage's weights [rows][columns] and bias as one matrix, folded convolutions multiplied in.
  struct Matrix {
    std::vector<double> weights, bias;
  };
  static Matrix folded(const graph::Stage& stage, std::span<const T> parameters) {
    const auto index = [](int i) { return static_cast<std::size_t>(i); };
    Matrix matrix{std::vector<double>(index(stage.rows) * index(stage.columns)), {}};
    for (int r = 0; r < stage.rows; ++r) matrix.bias.push_back(static_cast<double>(parameters[index(stage.bias + r)]));
    std::size_t first = 0;  // column of the inner convolution's operand
    for (int f = 0; f < stage.folded_count; ++f) {
      const graph::Folded& inner = stage.folded[index(f)];
      const std::size_t columns = index(inner.columns);
      const std::vector<double> weights(parameters.begin() + inner.weight,
                                        parameters.begin() + inner.weight + inner.rows * inner.columns);
      for (int r = 0; r < stage.rows; ++r)
        for (int m = 0; m < inner.rows; ++m) {
          const auto outer = static_cast<double>(parameters[index(stage.weight + r * inner.rows + m)]);
          double* NPT_RESTRICT to = matrix.weights.data() + index(r) * index(stage.columns) + first;
          const double* NPT_RESTRICT from = weights.data() + index(m) * columns;
          for (std::size_t k = 0; k < columns; ++k) to[k] += outer * from[k];
          matrix.bias[index(r)] += outer * static_cast<double>(parameters[index(inner.bias + m)]);
        }
      first += columns;
    }
    return matrix;
  }

  PackedStage<T> pack(const graph::Stage& stage, std::span<const T> parameters) const {
    std::vector<int> columns;  // of the weight matrix, in the order in which the prologue lays out their operands
    std::vector<int> pooled;
    for (int s = 0; s < stage.source_count; ++s) {
      const graph::Source& source = stage.sources[static_cast<std::size_t>(s)];
      const bool is_pooled = program_.activation(source.activation).storage == graph::Storage::pooled;
      for (int c = 0; c < source.channels; ++c) (is_pooled ? pooled : columns).push_back(source.first + c);
      if (!is_pooled && precision_ != Precision::native && source.channels % 2 != 0) columns.push_back(padding);
    }
    // Matrix registers need none behind the last: there they have zeros anyway.
    if (format_.parts > 0 && !columns.empty() && columns.back() == padding) columns.pop_back();
    const Matrix matrix = stage.folded_count == 0 ? Matrix{} : folded(stage, parameters);
    const auto weight = [&](int row, int column) {
      const std::size_t at =
          static_cast<std::size_t>(row) * static_cast<std::size_t>(stage.columns) + static_cast<std::size_t>(column);
      return stage.folded_count == 0 ? parameters[static_cast<std::size_t>(stage.weight) + at]
                                     : static_cast<T>(matrix.weights[at]);
    };
    const auto bias = [&](int row) {
      if (stage.bias_is_dead) return T(0);
      return stage.folded_count == 0 ? parameters[static_cast<std::size_t>(stage.bias) + static_cast<std::size_t>(row)]
                                     : static_cast<T>(matrix.bias[static_cast<std::size_t>(row)]);
    };
    const auto column_weight = [&](int row, int k) {
      const int column = columns[static_cast<std::size_t>(k)];
      return column == padding ? T(0) : weight(row, column);
    };
    PackedStage<T> packed;
    packed.weights.pack(stage.rows, static_cast<int>(columns.size()), format_, column_weight, bias);
    packed.pooled_columns = static_cast<int>(pooled.size());
    packed.pooled_weights = AlignedBuffer<T>(pooled.size() * static_cast<std::size_t>(stage.rows));
    T* out = packed.pooled_weights.data();
    for (const int column : pooled)
      for (int row = 0; row < stage.rows; ++row) *out++ = weight(row, column);
    return packed;
  }

  /// Calls f(step) for every pointwise step of the program.
  template <class F>
  void for_each_step(F&& f) {
    const auto each = [&f](graph::Chain& chain) {
      for (int c = 0; c < chain.count; ++c) f(chain.steps[static_cast<std::size_t>(c)]);
    };
    for (graph::Stage& stage : program_.stages) {
      for (graph::Source& source : stage.sources) each(source.chain);
      each(stage.epilogue);
    }
    for (graph::Activation& activation : program_.activations) each(activation.chain);
  }

  void copy_pointwise_parameters(std::span<const T> parameters) {
    constexpr std::size_t align = simd_alignment / sizeof(T);
    const auto padded = [](int n) { return (static_cast<std::size_t>(n) + align - 1) / align * align; };
    std::size_t total = 0;
    for_each_step([&](graph::Step& step) {
      for (const int size : step.sizes) total += padded(size);
    });
    pointwise_ = AlignedBuffer<T>(total);
    std::size_t next = 0;
    for_each_step([&](graph::Step& step) {
      for (std::size_t i = 0; i < step.parameters.size(); ++i) {
        if (step.parameters[i] < 0) continue;
        const auto from =
            parameters.subspan(static_cast<std::size_t>(step.parameters[i]), static_cast<std::size_t>(step.sizes[i]));
        for (std::size_t k = 0; k < from.size(); ++k) pointwise_[next + k] = from[k];
        step.parameters[i] = static_cast<int>(next);
        next += padded(step.sizes[i]);
      }
    });
  }

  static constexpr int padding = -1;  ///< a column without a channel

  static std::uint64_t draw_id() {
    static std::atomic<std::uint64_t> last{0};
    return ++last;
  }

  std::uint64_t id_ = draw_id();
  graph::Program program_;
  Precision precision_;
  kernel::ProductFormat format_;
  std::size_t operand_words_ = 0, operand_values_ = 0;
  std::vector<PackedStage<T>> stages_;
  AlignedBuffer<T> pointwise_;
};

}  // namespace npt::inline NPT_ABI::engine
