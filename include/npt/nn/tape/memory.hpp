/// What a tape keeps while it runs: packed weights, the activations of the forward pass, gradients on their way back.
/// It only ever grows, so that a warm step allocates nothing.
#pragma once

#include <npt/base/aligned.hpp>
#include <npt/config.hpp>
#include <npt/nn/engine/workspace.hpp>
#include <npt/nn/kernel/panel.hpp>
#include <npt/nn/kernel/product.hpp>
#include <npt/nn/tape/chain_loops.hpp>
#include <npt/nn/tape/tape.hpp>

#include <array>
#include <cstddef>
#include <vector>

namespace npt::inline NPT_ABI::tape {

/// A convolution's weights for the forward product, and transposed for the one that takes gradients back.
template <class T>
struct Weights {
  kernel::ProductWeights<T> forward;   ///< [rows][operand rows]
  kernel::ProductWeights<T> backward;  ///< [operand rows][rows], no bias

  std::size_t bytes() const { return forward.bytes() + backward.bytes(); }
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
  engine::MeshBatch<T> encoded, main;        ///< the sides of the calls: encoded inputs, and all the rest
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

  kernel::ProductFormat format;       ///< what the factors of products are
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

}  // namespace npt::inline NPT_ABI::tape
