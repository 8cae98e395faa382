/// Where things lie while a tape runs, in either direction.
#pragma once

#include <npt/base/aligned.hpp>
#include <npt/config.hpp>
#include <npt/nn/engine/workspace.hpp>
#include <npt/nn/kernel/panel.hpp>
#include <npt/nn/kernel/pointwise.hpp>
#include <npt/nn/kernel/product.hpp>
#include <npt/nn/tape/chain_loops.hpp>
#include <npt/nn/tape/memory.hpp>
#include <npt/nn/tape/tape.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>

namespace npt::inline NPT_ABI::tape {

/// One group of vertices that a task carries through a stage.
struct Task {
  engine::Item item;
  std::size_t number;  ///< of the group among all of the stage's side
  bool encodes;        ///< the stage's side is the encoded input's
};

template <class T>
class View {
 public:
  View(const Tape& tape, std::span<const ChainLoops<T>> loops, Memory<T>& memory)
      : tape_(tape), loops_(loops), memory_(memory) {}

 protected:
  using Args = std::array<kernel::PointwiseArgs<T>, graph::max_chain + 1>;

  static constexpr std::size_t index(int i) { return static_cast<std::size_t>(i); }

  Task task(const Stage& stage, std::size_t number) const {
    return {batch_of(stage.encodes).items[number], number, stage.encodes};
  }
  /// For what is done once a mesh, to a tile of one vertex.
  static Task mesh_task(int mesh, bool encodes) { return {{mesh, 0, 1}, 0, encodes}; }

  const engine::MeshBatch<T>& batch_of(bool encoded) const { return encoded ? memory_.encoded : memory_.main; }
  const ChainLoops<T>& loops(const Chain& chain) const { return loops_[index(chain.signature)]; }
  bool pooled(int t) const { return tape_.activation(t).pooled_from >= 0; }

  /// Number on the activation's own side of the item that a running item meets there.
  std::size_t item_on(const Activation& t, const Task& task) const {
    if (task.encodes || !t.encoded) return task.number;
    return index(memory_.encoded.meshes[index(task.item.mesh)].first_item + task.item.group);
  }
  T* tile(int t, const Task& task) const {
    const Activation& activation = tape_.activation(t);
    return memory_.maps[index(t)].data() + item_on(activation, task) * kernel::tile_size(activation.channels);
  }
  /// The tile of an adjoint's gradients.
  T* gradient_tile(int p, const Task& task) const {
    const Adjoint& adjoint = tape_.adjoint(p);
    const Activation& activation = tape_.activation(adjoint.activation);
    return memory_.buffers[activation.encoded ? 0 : 1][index(adjoint.buffer)].data() +
           item_on(activation, task) * kernel::tile_size(activation.channels);
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
  Args arguments(const Chain& chain, int adjoint, const Task& task) const {
    Args args;
    for (int c = 0; c < chain.count; ++c) {
      const Step& step = chain.steps[index(c)];
      kernel::PointwiseArgs<T>& a = args[index(c)];
      for (std::size_t k = 0; k < step.parameters.size(); ++k)
        if (step.parameters[k] >= 0) a.parameters[k] = memory_.parameters.data() + step.parameters[k];
      if (step.normalises && adjoint >= 0) {
        a.mean = statistics(adjoint, task.item.mesh);
        a.inverse_deviation = a.mean + tape_.activation(tape_.adjoint(adjoint).activation).channels;
      }
      if (step.other >= 0) {
        a.other = tile(step.other, task);
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
  const T* operand(const Stage& stage, const Task& task, T* tile_memory) const {
    const ReadPath& first = stage.paths[0];
    if (stage.path_count == 1 && first.chain.count == 0 && !pooled(first.activation))
      return tile(first.activation, task);
    read_operand(stage, task, tile_memory);
    return tile_memory;
  }

  /// Makes a stage's operand for one group: its paths that are not pooled, one above the other.
  void read_operand(const Stage& stage, const Task& task, T* to) const {
    for (int r = 0; r < stage.path_count; ++r) {
      const ReadPath& path = stage.paths[index(r)];
      if (pooled(path.activation)) continue;
      Args args = arguments(path.chain, path.adjoint, task);
      T* rows = to + index(path.row) * kernel::panel_width<T>;
      args[index(path.chain.count)].other = rows;
      args[index(path.chain.count)].other_channels = stage.operand_rows;
      const ChainLoops<T>& chain = loops(path.chain);
      (path.adds ? chain.add : chain.read)({.from = tile(path.activation, task),
                                            .to = rows,
                                            .from_stride = kernel::panel_stride<T>(path.channels),
                                            .to_stride = kernel::panel_stride<T>(stage.operand_rows),
                                            .first_panel = 0,
                                            .panels = kernel::used_panels<T>(task.item.valid),
                                            .first_channel = 0,
                                            .rows = path.channels,
                                            .args = args.data()});
    }
  }

  /// Space for `words` words of each of an executor's slots.
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
