/// What a tape keeps while it runs: packed weights, the activations of the forward pass, gradients on their way back. It only ever
/// grows, so that a warm step allocates nothing.
#pragma once

#include <npt/config.hpp>
#include <npt/core/aligned.hpp>
#include <npt/engine/workspace.hpp>
#include <npt/kernel/amx_product.hpp>
#include <npt/kernel/micro_kernel.hpp>
#include <npt/kernel/packed_weights.hpp>
#include <npt/kernel/panel.hpp>
#include <npt/tape/amx_outer_product.hpp>
#include <npt/tape/chain_loops.hpp>
#include <npt/tape/outer_product.hpp>
#include <npt/tape/tape.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <type_traits>
#include <vector>

namespace npt::inline NPT_ABI::tape {

/// A convolution's weights for the forward product, and transposed for the one that takes gradients back.
template <class T>
struct Weights {
  kernel::PackedWeights<T> forward;   ///< [rows][operand rows]
  kernel::PackedWeights<T> backward;  ///< [operand rows][rows], no bias
  kernel::AmxWeights amx_forward;     ///< the same, if products run on matrix registers
  kernel::AmxWeights amx_backward;

  std::size_t bytes() const { return forward.bytes() + backward.bytes() + amx_forward.bytes() + amx_backward.bytes(); }
};

/// A stage's product for one group: packed weights and an operand in either form.
template <class T>
class Product {
 public:
  /// `operand`: a tile of as many channels as the weights have columns, with `valid` vertices. `words`: memory for it in parts, if amx is not nullptr.
  Product(const kernel::PackedWeights<T>& plain, const T* operand) : plain_(&plain), operand_(operand) {}
  Product(const kernel::AmxWeights& amx, const T* operand, int valid, kernel::Word* words) : amx_(&amx) {
    if constexpr (std::is_same_v<T, float>)
      for (int p = 0; p < kernel::used_panels<T>(valid); ++p)
        panels_[static_cast<std::size_t>(p)] = kernel::split_panel(
            amx, operand + kernel::panel_stride<T>(amx.columns()) * static_cast<std::size_t>(p),
            valid - p * kernel::panel_width<T>, words + amx.panel_words() * static_cast<std::size_t>(p));
  }

  /// Most rows of a block.
  static constexpr int tallest_block = std::max(kernel::max_tile_rows, kernel::amx_block_rows);

  int block_count() const { return amx_ != nullptr ? amx_->block_count() : plain_->block_count(); }
  int first_row(int block) const { return amx_ != nullptr ? amx_->first_row(block) : plain_->first_row(block); }
  int rows(int block) const { return amx_ != nullptr ? amx_->rows(block) : plain_->rows(block); }
  const T* bias() const {
    if constexpr (std::is_same_v<T, float>)
      if (amx_ != nullptr) return amx_->bias();
    return plain_->bias();
  }
  /// Of a row, in biases like these.
  const T* bias_at(const T* biases, int row) const {
    if constexpr (std::is_same_v<T, float>)
      if (amx_ != nullptr) return kernel::AmxWeights::bias_at(biases, row);
    return kernel::PackedWeights<T>::bias_at(biases, row);
  }
  /// A block's rows of a panel, [rows(block)][panel_width]. `bias`: of the first of them; matrix registers read 16 at a time.
  void operator()(int block, int panel, const T* bias, T* to) const {
    const int height = rows(block);
    if constexpr (std::is_same_v<T, float>) {
      if (amx_ != nullptr) {
        const kernel::AmxOperand& operand = panels_[static_cast<std::size_t>(panel)];
        if (amx_->writes_exactly(block)) {
          amx_->multiply(block, operand, bias, to);
          return;
        }
        alignas(simd_alignment) float raw[kernel::amx_block_rows * kernel::panel_width<float>];
        amx_->multiply(block, operand, bias, raw);
        std::copy_n(raw, height * kernel::panel_width<float>, to);
        return;
      }
    }
    const int steps = plain_->k_count();
    kernel::micro_kernels<T>[static_cast<std::size_t>(height)](
        steps, plain_->block(block), operand_ + kernel::panel_stride<T>(steps) * static_cast<std::size_t>(panel), bias,
        to);
  }

 private:
  const kernel::PackedWeights<T>* plain_ = nullptr;
  const kernel::AmxWeights* amx_ = nullptr;
  const T* operand_ = nullptr;
  std::array<kernel::AmxOperand, kernel::group_panels<T>> panels_{};
};

/// Columns of the weights, by row of the operand tile.
inline int column_of_row(const Tape& tape, const Stage& stage, int row) {
  for (int r = 0; r < stage.path_count; ++r) {
    const ReadPath& path = stage.paths[static_cast<std::size_t>(r)];
    if (tape.activation(path.activation).pooled_from < 0 && row >= path.row && row < path.row + path.channels)
      return path.column + row - path.row;
  }
  NPT_ASSERT(false);
  return 0;
}

/// The memory of one tape.
template <class T>
struct Memory {
  engine::MeshBatch<T> pose, identity;
  AlignedBuffer<T> parameters;               ///< as Model::buffer(): pointwise layers and pooled columns read it
  std::vector<Weights<T>> weights;           ///< by stage
  std::vector<std::vector<int>> columns;     ///< by stage and row of the operand
  std::vector<AlignedBuffer<T>> transposed;  ///< by stage: [columns][rows], on the way to matrix registers

  // forward
  std::array<AlignedBuffer<T>, max_activations> maps;      ///< by activation: [items] tiles; pooled: [meshes] panels
  std::array<AlignedBuffer<int>, max_activations> argmax;  ///< pooled: [meshes][channels] vertex of the maximum
  std::array<AlignedBuffer<T>, max_adjoints> statistics;   ///< normalising adjoints: [meshes][mean, 1 / deviation]
  AlignedBuffer<T> partial;  ///< by item: means and squares, or maxima, of the running stage
  AlignedBuffer<T> bias;     ///< by mesh, of a stage that reads a pooled activation
  AlignedBuffer<double> sums;

  // backward
  std::array<std::array<AlignedBuffer<T>, max_adjoints>, 2> buffers;  ///< by side and buffer: [items] tiles
  std::array<AlignedBuffer<T>, max_adjoints> norm_partials;   ///< normalising adjoints: [items][two sums][channels]
  std::array<AlignedBuffer<T>, max_adjoints> norm_gradients;  ///< [meshes][two means][channels]
  std::array<AlignedBuffer<T>, max_activations> pooled_gradients;  ///< [meshes] panels, behind and before the chain
  std::array<AlignedBuffer<T>, max_activations> maximum_gradients;
  AlignedBuffer<T> pooled_sums;   ///< parameter sums of a pooled chain
  AlignedBuffer<T> chunks;        ///< [chunks] weight, bias and parameter sums of the running stage
  AlignedBuffer<T> bias_partial;  ///< [items][rows] of a stage that reads a pooled activation
  AlignedBuffer<T> mesh_bias;     ///< [meshes][rows]

  AlignedBuffer<T> scratch;  ///< [slots of the executor]
  std::size_t scratch_stride = 0;

  int parts = 0;                      ///< bfloat16 parts of a value in products; 0: they are computed in T
  AlignedBuffer<kernel::Word> words;  ///< [slots of the executor] operands on matrix registers
  std::size_t words_stride = 0;

  std::size_t bytes() const {
    std::size_t n = parameters.size() + partial.size() + bias.size() + chunks.size() + bias_partial.size() +
                    mesh_bias.size() + scratch.size();
    for (const auto& w : weights) n += w.bytes() / sizeof(T);
    n += words.size() * sizeof(kernel::Word) / sizeof(T);
    const auto add = [&n](const auto& list) {
      for (const auto& b : list) n += b.size();
    };
    add(maps);
    add(statistics);
    add(buffers[0]);
    add(buffers[1]);
    add(norm_partials);
    add(norm_gradients);
    add(pooled_gradients);
    add(maximum_gradients);
    return n * sizeof(T) + sums.size() * sizeof(double);
  }
};

/// Where things lie, for both directions.
template <class T>
class View {
 public:
  View(const Tape& tape, std::span<const ChainLoops<T>> loops, Memory<T>& memory)
      : tape_(tape), loops_(loops), memory_(memory) {}

 protected:
  using Args = std::array<kernel::PointwiseArgs<T>, graph::max_chain + 1>;

  static constexpr std::size_t index(int i) { return static_cast<std::size_t>(i); }

  const engine::MeshBatch<T>& side_of(bool pose) const { return pose ? memory_.pose : memory_.identity; }
  const ChainLoops<T>& loops(const Chain& chain) const { return loops_[index(chain.signature)]; }
  bool pooled(int t) const { return tape_.activation(t).pooled_from >= 0; }

  /// Number on the activation's own side of the item that a running item meets there.
  std::size_t item_on(const Activation& t, const engine::Item& item, std::size_t number, bool over_pose) const {
    if (over_pose || !t.from_pose) return number;
    return index(memory_.pose.instances[index(item.instance)].first_item + item.group);
  }
  T* tile(int t, const engine::Item& item, std::size_t number, bool over_pose) const {
    const Activation& activation = tape_.activation(t);
    return memory_.maps[index(t)].data() +
           item_on(activation, item, number, over_pose) * kernel::tile_size(activation.channels);
  }
  /// The tile of a adjoint's gradients.
  T* gradient_tile(int p, const engine::Item& item, std::size_t number, bool over_pose) const {
    const Adjoint& adjoint = tape_.adjoint(p);
    const Activation& activation = tape_.activation(adjoint.activation);
    return memory_.buffers[activation.from_pose ? 0 : 1][index(adjoint.buffer)].data() +
           item_on(activation, item, number, over_pose) * kernel::tile_size(activation.channels);
  }
  /// Mean and 1 / deviation of a normalising adjoint's norm for a mesh.
  T* statistics(int p, int mesh) const {
    return memory_.statistics[index(p)].data() +
           index(mesh) * 2 * index(tape_.activation(tape_.adjoint(p).activation).channels);
  }
  T* panel(AlignedBuffer<T>& panels, int channels, int mesh) const {
    return panels.data() + index(mesh) * kernel::panel_stride<T>(channels);
  }

  /// What the steps of a chain read; `adjoint` gives the norm's moments (-1: none).
  Args arguments(const Chain& chain, int adjoint, const engine::Item& item, std::size_t number, bool over_pose) const {
    Args args;
    for (int c = 0; c < chain.count; ++c) {
      const Step& step = chain.steps[index(c)];
      kernel::PointwiseArgs<T>& a = args[index(c)];
      for (std::size_t k = 0; k < step.parameters.size(); ++k)
        if (step.parameters[k] >= 0) a.parameters[k] = memory_.parameters.data() + step.parameters[k];
      if (step.normalises && adjoint >= 0) {
        a.mean = statistics(adjoint, item.instance);
        a.inverse_deviation = a.mean + tape_.activation(tape_.adjoint(adjoint).activation).channels;
      }
      if (step.other >= 0) {
        a.other = tile(step.other, item, number, over_pose);
        a.other_channels = tape_.activation(step.other).channels;
      }
    }
    return args;
  }

  /// Products over the vertices read up to a register's rows behind a tile.
  static constexpr std::size_t slack = index(kernel::panel_width<T>) * kernel::panel_width<T>;

  /// A pooled activation's maxima for a mesh, and what the layers behind them make of these: panels.
  T* pooled_maxima(int t, int mesh) const {
    return memory_.maps[index(t)].data() + index(mesh) * 2 * kernel::panel_stride<T>(tape_.activation(t).channels);
  }
  T* pooled_feature(int t, int mesh) const {
    return pooled_maxima(t, mesh) + kernel::panel_stride<T>(tape_.activation(t).channels);
  }

  /// A stage's operand for one group: the stored tile where that is it, else made in `tile_memory`.
  const T* operand(const Stage& stage, const engine::Item& item, std::size_t number, T* tile_memory) const {
    const ReadPath& first = stage.paths[0];
    if (stage.path_count == 1 && first.chain.count == 0 && !pooled(first.activation))
      return tile(first.activation, item, number, stage.from_pose);
    read_operand(stage, item, number, tile_memory);
    return tile_memory;
  }

  /// Makes a stage's operand for one group: its paths that are not pooled, one above the other.
  void read_operand(const Stage& stage, const engine::Item& item, std::size_t number, T* to) const {
    for (int r = 0; r < stage.path_count; ++r) {
      const ReadPath& path = stage.paths[index(r)];
      if (pooled(path.activation)) continue;
      Args args = arguments(path.chain, path.adjoint, item, number, stage.from_pose);
      T* rows = to + index(path.row) * kernel::panel_width<T>;
      args[index(path.chain.count)].other = rows;
      args[index(path.chain.count)].other_channels = stage.operand_rows;
      const ChainLoops<T>& chain = loops(path.chain);
      (path.adds ? chain.add : chain.read)({.from = tile(path.activation, item, number, stage.from_pose),
                                            .to = rows,
                                            .from_stride = kernel::panel_stride<T>(path.channels),
                                            .to_stride = kernel::panel_stride<T>(stage.operand_rows),
                                            .first_panel = 0,
                                            .panels = kernel::used_panels<T>(item.valid),
                                            .first_channel = 0,
                                            .rows = path.channels,
                                            .args = args.data()});
    }
  }

  /// Room for `words` words of each of an executor's slots.
  void reserve_words(std::size_t words, int slots) {
    constexpr std::size_t unit = simd_alignment / sizeof(kernel::Word);
    memory_.words_stride = std::max(memory_.words_stride, (words + unit - 1) / unit * unit);
    memory_.words.grow_to(memory_.words_stride * index(slots));
  }
  kernel::Word* words_of(int slot) const { return memory_.words.data() + index(slot) * memory_.words_stride; }

  const Tape& tape_;
  std::span<const ChainLoops<T>> loops_;
  Memory<T>& memory_;
};

}  // namespace npt::inline NPT_ABI::tape
