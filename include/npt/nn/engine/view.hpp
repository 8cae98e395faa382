/// Where things lie while a program runs.
#pragma once

#include <npt/config.hpp>
#include <npt/nn/engine/packed_program.hpp>
#include <npt/nn/engine/workspace.hpp>
#include <npt/nn/kernel/panel.hpp>
#include <npt/nn/kernel/pointwise.hpp>

#include <algorithm>
#include <array>
#include <cstddef>

namespace npt::inline NPT_ABI::engine {

/// One group of vertices that a thread carries through a sweep.
template <class T>
struct Task {
  const MeshBatch<T>& batch;  ///< over which the sweep runs
  bool encodes;               ///< these are the encoded inputs
  std::size_t number;         ///< of the group among all of these meshes'
  Item item;
  // the thread's own memory:
  T* scratch = nullptr;           ///< the program's scratch tiles
  kernel::Word* words = nullptr;  ///< an operand on matrix registers
  T* values = nullptr;            ///< what of it is kept in T
};

template <class T>
class View {
 public:
  View(const PackedProgram<T>& packed, WorkspaceStorage<T>& memory)
      : packed_(packed), program_(packed.program()), memory_(memory) {}

 protected:
  using Activation = graph::Activation;
  using Stage = graph::Stage;
  using Storage = graph::Storage;
  using Args = std::array<kernel::PointwiseArgs<T>, graph::max_chain>;

  static constexpr std::size_t index(int i) { return static_cast<std::size_t>(i); }

  /// A code that the pass reads. `writable`: the same, if the pass may write to it.
  void use(const CodeStorage<T>& code, CodeStorage<T>* writable) {
    code_ = &code;
    own_code_ = writable;
  }

  /// Makes space for a pass over `meshes` by an executor of so many slots.
  void prepare(const MeshBatch<T>& batch, bool encodes, int slots) {
    if (encodes)
      for (const Activation& a : program_.activations)
        if (a.storage == Storage::code) own_code_->tiles[index(a.place)].grow_to(batch.items.size() * code_stride(a));
    for (int b = 0; b < program_.buffer_count; ++b) {
      const bool consume = !encodes && own_code_ != nullptr && b == program_.code_alias;
      buffer_stride_[index(b)] = buffer_stride(b, encodes);
      if (!consume) memory_.buffers[index(b)].grow_to(batch.items.size() * buffer_stride_[index(b)]);
      buffer_[index(b)] = consume ? own_code_->tiles[0].data() : memory_.buffers[index(b)].data();
    }
    scratch_stride_ = 0;
    for (int s = 0; s < program_.scratch_count; ++s) {
      scratch_offset_[index(s)] = scratch_stride_;
      scratch_stride_ += kernel::tile_size(program_.scratch_channels[index(s)]);
    }
    memory_.scratch.grow_to(scratch_stride_ * index(slots));
    memory_.words.grow_to(packed_.operand_words() * index(slots));
    memory_.operands.grow_to(packed_.operand_values() * index(slots));
    int widest = 0;
    for (int t = 0; t < program_.activation_count; ++t) {
      const Activation& activation = program_.activation(t);
      widest = std::max(widest, activation.channels);
      if (activation.encoded != encodes) continue;
      MeshValues<T>& values = own_values_of(t);
      values.stride = activation.storage == Storage::pooled ? index(activation.channels) * kernel::panel_width<T>
                      : activation.moments                  ? 2 * index(activation.channels)
                                                            : 0;
      values.values.grow_to(batch.meshes.size() * values.stride);
    }
    memory_.sums.grow_to(2 * index(widest));
  }

  /// The task of group `number` on an executor's slot.
  Task<T> task(const MeshBatch<T>& batch, bool encodes, int number, int slot) {
    return {.batch = batch,
            .encodes = encodes,
            .number = index(number),
            .item = batch.items[index(number)],
            .scratch = memory_.scratch.data() + index(slot) * scratch_stride_,
            .words = memory_.words.data() + index(slot) * packed_.operand_words(),
            .values = memory_.operands.data() + index(slot) * packed_.operand_values()};
  }

  /// What the stages leave of an activation for each mesh.
  const MeshValues<T>& values_of(int t) const {
    return program_.activation(t).encoded ? code_->values[index(t)] : memory_.values[index(t)];
  }
  /// For the sweep's own outputs.
  MeshValues<T>& own_values_of(int t) {
    return program_.activation(t).encoded ? own_code_->values[index(t)] : memory_.values[index(t)];
  }

  /// The mesh of an activation's own side that mesh number `mesh` of the running side meets.
  int mesh_of(const Activation& a, int mesh, bool encodes) const {
    if (encodes || !a.encoded) return mesh;
    return memory_.main.meshes[index(mesh)].code;
  }

  /// Where the stage that runs writes its output.
  T* output_tile(int t, const Task<T>& task) const {
    const Activation& activation = program_.activation(t);
    if (activation.storage == Storage::buffer)
      return buffer_[index(activation.place)] + task.number * buffer_stride_[index(activation.place)];
    if (activation.storage == Storage::code)
      return own_code_->tiles[index(activation.place)].data() + task.number * code_stride(activation);
    return task.scratch + scratch_offset_[index(activation.place)];
  }
  /// Where a prologue leaves the stage's operand.
  T* operand_tile(const Stage& stage, const Task<T>& task) const {
    return task.scratch + scratch_offset_[index(stage.operand_scratch)];
  }

  /// Where an activation's tile for this group lies.
  const T* tile(int t, const Task<T>& task) const {
    const Activation& activation = program_.activation(t);
    switch (activation.storage) {
      case Storage::input:
        return (activation.encoded ? code_->input : memory_.inputs[index(activation.place)]).data() +
               number_of(activation, task) * kernel::tile_size(activation.channels);
      case Storage::scratch:
      case Storage::none:
        return task.scratch + scratch_offset_[index(activation.place)];
      case Storage::buffer:
        return buffer_[index(activation.place)] + task.number * buffer_stride_[index(activation.place)];
      case Storage::code:
        return code_->tiles[index(activation.place)].data() + number_of(activation, task) * code_stride(activation);
      case Storage::pooled:
        break;
    }
    NPT_ASSERT(false);
    return nullptr;
  }

  /// What the steps of a chain read when it is applied to (a part of) activation t.
  Args arguments(const graph::Chain& chain, int t, const Task<T>& task) const {
    Args args;
    for (int c = 0; c < chain.count; ++c) {
      const graph::Step& step = chain.steps[index(c)];
      kernel::PointwiseArgs<T>& a = args[index(c)];
      for (std::size_t k = 0; k < step.parameters.size(); ++k)
        if (step.parameters[k] >= 0) a.parameters[k] = packed_.pointwise_parameters() + step.parameters[k];
      if (step.normalises) {
        const Activation& activation = program_.activation(t);
        a.mean = values_of(t).of(mesh_of(activation, task.item.mesh, task.encodes));
        a.inverse_deviation = a.mean + activation.channels;
      }
      if (step.other >= 0) {
        a.other = tile(step.other, task);
        a.other_channels = program_.activation(step.other).channels;
      }
    }
    return args;
  }

  const PackedProgram<T>& packed_;
  const graph::Program& program_;
  WorkspaceStorage<T>& memory_;

 private:
  /// Number of the task's group on the activation's own side.
  std::size_t number_of(const Activation& a, const Task<T>& task) const {
    if (task.encodes || !a.encoded) return task.number;
    return index(code_->first_item[index(mesh_of(a, task.item.mesh, task.encodes))] + task.item.group);
  }

  /// The feature map that the decoder overwrites must have the wider of both strides.
  std::size_t code_stride(const Activation& a) const {
    int channels = a.channels;
    if (program_.code_alias >= 0)
      channels = std::max(channels, program_.buffer_channels[1][index(program_.code_alias)]);
    return kernel::tile_size(channels);
  }
  std::size_t buffer_stride(int b, bool encodes) const {
    if (!encodes && b == program_.code_alias) {
      for (const Activation& a : program_.activations)
        if (a.storage == Storage::code && a.place == 0) return code_stride(a);
    }
    return kernel::tile_size(program_.buffer_channels[encodes ? 0 : 1][index(b)]);
  }

  const CodeStorage<T>* code_ = nullptr;
  CodeStorage<T>* own_code_ = nullptr;
  std::array<T*, graph::max_buffers> buffer_{};
  std::array<std::size_t, graph::max_buffers> buffer_stride_{};
  std::array<std::size_t, graph::max_stages> scratch_offset_{};
  std::size_t scratch_stride_ = 0;
};

}  // namespace npt::inline NPT_ABI::engine
