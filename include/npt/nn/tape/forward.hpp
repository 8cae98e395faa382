/// Runs a tape forwards: the network's result, with everything kept that its gradient needs.
#pragma once

#include <npt/base/executor.hpp>
#include <npt/config.hpp>
#include <npt/nn/kernel/moments.hpp>
#include <npt/nn/tape/view.hpp>

#include <algorithm>
#include <array>
#include <cstddef>

namespace npt::inline NPT_ABI::tape {

template <class T>
class Forward : View<T> {
 public:
  using View<T>::View;

  /// The calls in memory.encoded and memory.main to their results.
  template <Executor E>
  void run(const E& executor) {
    prepare(executor.slots());
    for (int t = 0; t < tape_.activation_count; ++t)
      if (const Activation& activation = tape_.activation(t); activation.input >= 0)
        this->batch_of(activation.encoded).split(activation.input, activation.channels, memory_.maps[index(t)]);
    for (int i = 0; i < tape_.stage_count; ++i) run_stage(i, executor);
  }

 private:
  using typename View<T>::Args;
  using View<T>::index;
  using View<T>::slack;
  using View<T>::tape_;
  using View<T>::memory_;

  void prepare(int slots) {
    std::size_t operand = 0;
    int widest = 0;
    for (int t = 0; t < tape_.activation_count; ++t) {
      const Activation& activation = tape_.activation(t);
      const engine::MeshBatch<T>& batch = this->batch_of(activation.encoded);
      widest = std::max(widest, activation.channels);
      if (this->pooled(t)) {
        memory_.maps[index(t)].grow_to(batch.meshes.size() * 2 * kernel::panel_stride<T>(activation.channels));
        memory_.argmax[index(t)].grow_to(batch.meshes.size() * index(activation.channels));
      } else {
        memory_.maps[index(t)].grow_to(batch.items.size() * kernel::tile_size(activation.channels) + slack);
      }
    }
    for (int p = 0; p < tape_.adjoint_count; ++p) {
      const Activation& activation = tape_.activation(tape_.adjoint(p).activation);
      if (tape_.adjoint(p).normalises)
        memory_.statistics[index(p)].grow_to(this->batch_of(activation.encoded).meshes.size() * 2 *
                                             index(activation.channels));
    }
    for (int i = 0; i < tape_.stage_count; ++i)
      operand = std::max(operand, kernel::tile_size(std::max(tape_.stage(i).operand_rows, tape_.stage(i).rows)));
    memory_.scratch_stride = std::max(memory_.scratch_stride, operand + slack);
    memory_.scratch.grow_to(memory_.scratch_stride * index(slots));
    std::size_t words = 0;
    for (const Weights<T>& w : memory_.weights)
      words = std::max(words, w.forward.operand_words(kernel::group_panels<T>));
    this->reserve_words(words, slots);
    sums_stride_ = 2 * index(widest);
    memory_.sums.grow_to(sums_stride_ * index(slots));
  }
  template <class F>
  void for_each_adjoint(int activation, F&& f) const {
    for (int p = 0; p < tape_.adjoint_count; ++p)
      if (tape_.adjoint(p).activation == activation && tape_.adjoint(p).normalises) f(p);
  }
  template <class F>
  void for_each_pool(int activation, F&& f) const {
    for (int t = 0; t < tape_.activation_count; ++t)
      if (tape_.activation(t).pooled_from == activation) f(t);
  }

  template <Executor E>
  void run_stage(int i, const E& executor) {
    const Stage& stage = tape_.stage(i);
    const engine::MeshBatch<T>& batch = this->batch_of(stage.encodes);
    array_size_ = batch.items.size() * index(stage.rows);
    std::size_t arrays = 0;
    for_each_adjoint(stage.output, [&](int p) {
      partial_[index(p)] = arrays * array_size_;
      arrays += 2;
    });
    for_each_pool(stage.output, [&](int t) { pool_partial_[index(t)] = arrays++ * array_size_; });
    memory_.partial.grow_to(arrays * array_size_);
    add_pooled(i, executor);
    executor.for_each(static_cast<int>(batch.items.size()), [&](int number, int slot) {
      run_task(i, this->task(stage, index(number)), memory_.scratch.data() + index(slot) * memory_.scratch_stride,
               this->words_of(slot));
    });
    executor.for_each(static_cast<int>(batch.meshes.size()),
                      [&](int mesh, int slot) { merge(stage, batch, mesh, slot); });
  }

  /// Biases with the products of pooled features, for every mesh.
  template <Executor E>
  void add_pooled(int i, const E& executor) {
    const Stage& stage = tape_.stage(i);
    has_pooled_ = stage.operand_rows != stage.columns;
    if (!has_pooled_) return;
    const std::size_t count = this->batch_of(stage.encodes).meshes.size();
    const kernel::ProductWeights<T>& packed = memory_.weights[index(i)].forward;
    bias_stride_ = index(stage.rows) * index(packed.bias_width());
    memory_.bias.grow_to(count * bias_stride_ + kernel::bias_slack);
    executor.for_each(static_cast<int>(count), [&](int mesh, int) {
      T* bias = memory_.bias.data() + index(mesh) * bias_stride_;
      for (int row = 0; row < stage.rows; ++row) {
        T sum = memory_.parameters[index(stage.bias + row)];
        for (int r = 0; r < stage.path_count; ++r) {
          const ReadPath& path = stage.paths[index(r)];
          if (!this->pooled(path.activation)) continue;
          const T* weights = memory_.parameters.data() + stage.weight + row * stage.columns + path.column;
          const T* feature = this->pooled_feature(path.activation, mesh);
          for (int c = 0; c < path.channels; ++c) sum += weights[c] * feature[index(c) * kernel::panel_width<T>];
        }
        bias[row] = sum;
      }
      packed.lay_out_biases(bias, stage.rows);
    });
  }

  void run_task(int i, const Task& task, T* scratch, kernel::Word* words) {
    const Stage& stage = tape_.stage(i);
    T* out = this->tile(stage.output, task);
    if (!stage.product) {
      this->read_operand(stage, task, out);
      for (int row = 0; row < stage.rows; row += kernel::max_tile_rows)
        gather(stage, task, row, std::min(kernel::max_tile_rows, stage.rows - row), out);
      if (i == tape_.stage_count - 1)
        kernel::join_vertices(
            out, 3, task.item.valid,
            memory_.main.meshes[index(task.item.mesh)].result + 3 * index(task.item.group) * kernel::group_width);
      return;
    }
    const kernel::ProductWeights<T>& weights = memory_.weights[index(i)].forward;
    [[maybe_unused]] const kernel::ProductScope scope(weights.format());
    const kernel::GroupProduct<T> product(weights, this->operand(stage, task, scratch), task.item.valid, words);
    const std::size_t out_stride = kernel::panel_stride<T>(stage.rows);
    const T* bias = has_pooled_ ? memory_.bias.data() + index(task.item.mesh) * bias_stride_ : weights.bias();
    for (int b = 0; b < weights.block_count(); ++b) {
      const int row = weights.first_row(b);
      for (int p = 0; p < kernel::used_panels<T>(task.item.valid); ++p)
        product.multiply_exactly(b, p, weights.bias_at(bias, row),
                                 out + out_stride * index(p) + index(row) * kernel::panel_width<T>);
      gather(stage, task, row, weights.rows(b), out);
    }
  }

  /// What rows of the output give to moments and maxima.
  void gather(const Stage& stage, const Task& task, int row, int rows, const T* out) {
    const std::size_t stride = kernel::panel_stride<T>(stage.rows);
    const T* values = out + index(row) * kernel::panel_width<T>;
    const std::size_t at = task.number * index(stage.rows) + index(row);
    for_each_adjoint(stage.output, [&](int p) {
      const Chain& prefix = tape_.adjoint(p).prefix;
      T* mean = memory_.partial.data() + partial_[index(p)] + at;
      if (prefix.count == 0) {
        kernel::gather_moments(values, stride, task.item.valid, rows, mean, mean + array_size_);
        return;
      }
      alignas(simd_alignment) T through[index(kernel::ProductWeights<T>::tallest_block) * kernel::group_width];
      const std::size_t through_stride = kernel::panel_stride<T>(rows);
      const Args args = this->arguments(prefix, -1, task);
      this->loops(prefix).read({.from = values,
                                .to = through,
                                .from_stride = stride,
                                .to_stride = through_stride,
                                .first_panel = 0,
                                .panels = kernel::used_panels<T>(task.item.valid),
                                .first_channel = row,
                                .rows = rows,
                                .args = args.data()});
      kernel::gather_moments(through, through_stride, task.item.valid, rows, mean, mean + array_size_);
    });
    for_each_pool(stage.output, [&](int t) {
      kernel::gather_maxima(values, stride, task.item.valid, rows,
                            memory_.partial.data() + pool_partial_[index(t)] + at);
    });
  }

  void merge(const Stage& stage, const engine::MeshBatch<T>& batch, int mesh, int slot) {
    const engine::BatchMesh<T>& instance = batch.meshes[index(mesh)];
    const std::size_t first = index(instance.first_item) * index(stage.rows);
    for_each_adjoint(stage.output, [&](int p) {
      T* mean = this->statistics(p, mesh);
      const T* partial = memory_.partial.data() + partial_[index(p)] + first;
      kernel::merge_moments(partial, partial + array_size_, instance.vertices, stage.rows,
                            memory_.sums.data() + index(slot) * sums_stride_, mean, mean + stage.rows);
    });
    for_each_pool(stage.output, [&](int t) { merge_pool(stage, instance, t, mesh, first); });
  }
  /// The first vertex of the group at which channel c has that value.
  int vertex_of(const Stage& stage, const engine::BatchMesh<T>& instance, int group, int c, T value) const {
    const T* row = memory_.maps[index(stage.output)].data() +
                   index(instance.first_item + group) * kernel::tile_size(stage.rows) +
                   index(c) * kernel::panel_width<T>;
    const int before = group * kernel::group_width;
    const int valid = std::min(kernel::group_width, instance.vertices - before);
    int v = 0;
    while (v < valid - 1 && row[kernel::panel_stride<T>(stage.rows) * index(v / kernel::panel_width<T>) +
                                index(v % kernel::panel_width<T>)] != value)
      ++v;
    return before + v;
  }

  void merge_pool(const Stage& stage, const engine::BatchMesh<T>& instance, int t, int mesh, std::size_t first) {
    const Activation& activation = tape_.activation(t);
    const T* maxima = memory_.partial.data() + pool_partial_[index(t)] + first;
    T* raw = this->pooled_maxima(t, mesh);
    int* argmax = memory_.argmax[index(t)].data() + index(mesh) * index(stage.rows);
    for (int c = 0; c < stage.rows; ++c) {
      int group = 0;
      T best = maxima[c];
      for (int g = 1; g < kernel::group_count(instance.vertices); ++g) {
        const T here = maxima[index(g) * index(stage.rows) + index(c)];
        if (best >= here || best != best) continue;
        best = here;
        group = g;
      }
      raw[index(c) * kernel::panel_width<T>] = best;
      argmax[c] = vertex_of(stage, instance, group, c, best);
    }
    const Args args = this->arguments(activation.chain, activation.adjoint, this->mesh_task(mesh, activation.encoded));
    this->loops(activation.chain)
        .read({.from = raw,
               .to = this->pooled_feature(t, mesh),
               .from_stride = 0,
               .to_stride = 0,
               .first_panel = 0,
               .panels = 1,
               .first_channel = 0,
               .rows = activation.channels,
               .args = args.data()});
  }

  bool has_pooled_ = false;      ///< the running stage reads a pooled activation
  std::size_t bias_stride_ = 0;  ///< its biases of a mesh
  // Offsets in memory.partial of arrays [items][channels]:
  std::array<std::size_t, max_adjoints> partial_{};          ///< by adjoint: of its means; squares stand behind
  std::array<std::size_t, max_activations> pool_partial_{};  ///< by pooled activation: of its maxima
  std::size_t array_size_ = 0;
  std::size_t sums_stride_ = 0;  ///< of a slot's scratch for merging moments
};

}  // namespace npt::inline NPT_ABI::tape
