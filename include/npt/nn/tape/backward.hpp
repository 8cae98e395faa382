/// Runs a tape backwards: from the gradient of the result to those of all parameters and, if asked for, of the inputs.
///
/// Stages go last to first. One task carries a chunk of groups through a stage: the gradient of its output is finished
/// (through the norm that reads it), multiplied with the transposed weights and taken through the paths into their
/// adjoints, and collected for the gradient of the weights together with the operand, which is made again. Chunks are
/// as many as the shapes say, never as the threads, and are merged in order: the same bits for any number of threads.
#pragma once

#include <npt/base/executor.hpp>
#include <npt/config.hpp>
#include <npt/nn/tape/amx_outer_product.hpp>
#include <npt/nn/tape/chain_backward.hpp>
#include <npt/nn/tape/merge.hpp>
#include <npt/nn/tape/outer_product.hpp>
#include <npt/nn/tape/view.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>

namespace npt::inline NPT_ABI::tape {

template <class T>
class Backward : Merge<T> {
 public:
  Backward(const Tape& tape, std::span<const ChainLoops<T>> loops, Memory<T>& memory,
           const BatchGradients<T>& gradients)
      : Merge<T>(tape, loops, memory, gradients) {}

  /// The gradient of what Forward ran last on this memory.
  template <Executor E>
  void run(const E& executor) {
    prepare(executor);
    std::fill(gradients_.parameters.begin(), gradients_.parameters.end(), T(0));
    for (int i = tape_.stage_count - 1; i >= 0; --i)
      if (i == tape_.stage_count - 1 || has_gradient(tape_.stage(i).output)) run_stage(i, executor);
    for (int t = 0; t < tape_.inputs.count; ++t) leave_input_gradients(t, gradients_.inputs[index(t)]);
  }

 private:
  using typename Merge<T>::Args;
  using typename Merge<T>::ChunkLayout;
  using Merge<T>::index;
  using Merge<T>::slack;
  using Merge<T>::gradients_;
  using Merge<T>::tape_;
  using Merge<T>::memory_;

  // Every chunk has sums of its own, 4.2 MB for 1027 rows, which are added up at the end: enough groups must pay for
  // them. Batches that keep more than 16 threads busy are large, and pay with 32 groups a chunk.
  static constexpr int few_chunks = 16;
  static constexpr int least_items = 8;  ///< in a chunk, if there are several, up to few_chunks of them
  static constexpr int least_items_of_many = 32;

  // ---- what takes part ----

  /// Gradients are wanted everywhere but at the inputs; there if they are asked for, or if layers with learned
  /// parameters read them.
  void find_wanted() {
    for (int p = 0; p < tape_.adjoint_count; ++p) {
      const int input = tape_.activation(tape_.adjoint(p).activation).input;
      wanted_[index(p)] = input < 0 || !gradients_.inputs[index(input)].empty();
    }
    for (int i = 0; i < tape_.stage_count; ++i)
      for (int r = 0; r < tape_.stage(i).path_count; ++r)
        if (const ReadPath& path = tape_.stage(i).paths[index(r)];
            path.adjoint >= 0 && this->loops(path.chain).read_sums > 0)
          wanted_[index(path.adjoint)] = true;
  }
  bool wanted(int adjoint) const { return adjoint >= 0 && wanted_[index(adjoint)]; }
  /// Whether a gradient is to go back along a path.
  bool wants(const ReadPath& path) const {
    bool wants = wanted(path.adjoint);
    for (int s = 0; s < path.chain.count; ++s) wants = wants || wanted(path.other_adjoints[index(s)]);
    return wants;
  }
  bool has_gradient(int activation) const {
    bool found = false;
    this->for_each_adjoint(activation, [&](int) { found = true; });
    return found;
  }
  // ---- memory ----

  template <Executor E>
  void prepare(const E& executor) {
    find_wanted();
    for (std::size_t side = 0; side < 2; ++side)
      for (int b = 0; b < tape_.buffer_count[side]; ++b) {
        bool used = false;
        for (int p = 0; p < tape_.adjoint_count; ++p)
          used = used || (tape_.adjoint(p).buffer == b && wanted(p) &&
                          tape_.activation(tape_.adjoint(p).activation).encoded == (side == 0));
        if (used)
          memory_.buffers[side][index(b)].grow_to(this->batch_of(side == 0).items.size() *
                                                      kernel::tile_size(tape_.buffer_channels[side][index(b)]) +
                                                  slack);
      }
    for (int p = 0; p < tape_.adjoint_count; ++p) {
      const Adjoint& adjoint = tape_.adjoint(p);
      const Activation& activation = tape_.activation(adjoint.activation);
      const engine::MeshBatch<T>& batch = this->batch_of(activation.encoded);
      if (adjoint.normalises) {
        const std::size_t size = batch.items.size() * 2 * index(activation.channels);
        memory_.norm_partials[index(p)].grow_to(size);
        if (adjoint.starts_at_zero)
          std::fill(memory_.norm_partials[index(p)].data(), memory_.norm_partials[index(p)].data() + size, T(0));
        memory_.norm_gradients[index(p)].grow_to(batch.meshes.size() * 2 * index(activation.channels));
      }
      if (adjoint.starts_at_zero && wanted(p)) {
        T* first = memory_.buffers[activation.encoded ? 0 : 1][index(adjoint.buffer)].data();
        std::fill(first, first + batch.items.size() * kernel::tile_size(activation.channels), T(0));
      }
    }
    for (int t = 0; t < tape_.activation_count; ++t) {
      if (!this->pooled(t)) continue;
      const std::size_t size = this->batch_of(tape_.activation(t).encoded).meshes.size() *
                               kernel::panel_stride<T>(tape_.activation(t).channels);
      memory_.pooled_gradients[index(t)].grow_to(size);
      memory_.maximum_gradients[index(t)].grow_to(size);
      std::fill(memory_.pooled_gradients[index(t)].data(), memory_.pooled_gradients[index(t)].data() + size, T(0));
    }
    // A task's scratch: a tile for the operand and later the gradient, one for a gradient that only maxima make, and
    // the collected operands of the weights' gradient.
    std::size_t tiles = 0, collected = 0, words = 0;
    for (int i = 0; i < tape_.stage_count; ++i) {
      const Stage& stage = tape_.stage(i);
      tiles = std::max(tiles, kernel::tile_size(std::max(stage.operand_rows, stage.rows)) + slack);
      with_shape(stage, [&](const auto& shape) {
        collected = std::max(collected, shape.collected_values());
        collected_words_ = std::max(collected_words_, shape.collected_words());
      });
      words = std::max(words, memory_.weights[index(i)].backward.operand_words(kernel::group_panels<T>));
    }
    this->reserve_words(collected_words_ + words, executor.slots());
    tile_stride_ = round_up(tiles);
    memory_.scratch_stride = std::max(memory_.scratch_stride, 2 * tile_stride_ + round_up(collected));
    memory_.scratch.grow_to(memory_.scratch_stride * index(executor.slots()));
  }
  static constexpr std::size_t round_up(std::size_t n) {
    constexpr std::size_t unit = simd_alignment / sizeof(T);
    return (n + unit - 1) / unit * unit;
  }

  /// Calls f with the shape of the weights' gradient on the unit that multiplies. The bias is the weight of one more
  /// operand row, of ones.
  template <class F>
  void with_shape(const Stage& stage, F&& f) const {
    const int rows = stage.rows, columns = stage.operand_rows + 1;
    if constexpr (kernel::ProductFormat::has_parts<T>) {
      if (memory_.format.parts > 0) {
        f(AmxOuterShape::of(rows, columns, memory_.format.parts));
        return;
      }
    }
    f(OuterShape<T>::of(rows, columns));
  }

  // ---- one stage ----

  template <Executor E>
  void run_stage(int i, const E& executor) {
    with_shape(tape_.stage(i), [&](const auto& shape) { run_stage(i, shape, executor); });
  }

  template <class Shape, Executor E>
  void run_stage(int i, const Shape& shape, const E& executor) {
    const Stage& stage = tape_.stage(i);
    const engine::MeshBatch<T>& batch = this->batch_of(stage.encodes);
    reads_pooled_ = stage.operand_rows != stage.columns;
    this->for_each_adjoint(stage.output, [&](int p) { this->merge_adjoint(p, batch, executor); });
    if (reads_pooled_) memory_.bias_partial.grow_to(batch.items.size() * index(stage.rows));
    const ChunkLayout layout = lay_out(stage, shape, static_cast<int>(batch.items.size()));
    memory_.chunks.grow_to(layout.size * index(layout.count));
    executor.for_each(layout.count, [&](int chunk, int slot) {
      run_chunk(i, shape, layout, chunk, memory_.scratch.data() + index(slot) * memory_.scratch_stride,
                this->words_of(slot));
    });
    this->merge_chunks(i, shape, layout, executor);
    if (reads_pooled_) this->take_to_pooled(stage, batch, executor);
  }

  template <class Shape>
  ChunkLayout lay_out(const Stage& stage, const Shape& shape, int items) const {
    ChunkLayout layout;
    std::size_t next = stage.product ? round_up(shape.result_size()) : 0;
    const auto take = [&next](std::size_t size) {
      const std::size_t at = next;
      next += round_up(size);
      return at;
    };
    for (int r = 0; r < stage.path_count; ++r) {
      const ReadPath& path = stage.paths[index(r)];
      if (!this->pooled(path.activation))
        layout.paths[index(r)] = take(index(path.channels) * index(this->loops(path.chain).read_sums));
    }
    this->for_each_adjoint(stage.output, [&](int p) {
      if (tape_.adjoint(p).normalises)
        layout.adjoints[index(p)] = take(index(stage.rows) * index(this->loops(tape_.adjoint(p).prefix).prefix_sums));
    });
    layout.size = next;
    // A power of two, so that equal threads get equally many, and enough groups in each to pay for the sums.
    int chunks = 1;
    while (2 * chunks * (chunks < few_chunks ? least_items : least_items_of_many) <= items) chunks *= 2;
    layout.items = (items + chunks - 1) / chunks;
    layout.count = (items + layout.items - 1) / layout.items;
    return layout;
  }

  /// One chunk of a stage, by one thread.
  struct ChunkTask {
    int i;  ///< number of the stage
    const Stage& stage;
    const ChunkLayout& layout;
    T* sums;              ///< the chunk's
    T* tile;              ///< scratch: the operand, then the gradient of the output
    T* spare;             ///< scratch: a gradient that only maxima make
    kernel::Word* words;  ///< scratch: an operand on matrix registers
  };

  template <class Shape>
  void run_chunk(int i, const Shape& shape, const ChunkLayout& layout, int chunk, T* scratch, kernel::Word* words) {
    const Stage& stage = tape_.stage(i);
    [[maybe_unused]] const kernel::ProductScope scope(memory_.format);
    T* sums = start(layout, chunk, Shape::overwrites && stage.product ? shape.result_size() : 0);
    auto product = make_outer_product(shape, scratch + 2 * tile_stride_, words, sums);
    run_groups({i, stage, layout, sums, scratch, scratch + tile_stride_, words + collected_words_}, chunk, product);
  }
  /// A chunk's sums, of which all behind the first `open` are made zero.
  T* start(const ChunkLayout& layout, int chunk, std::size_t open) const {
    T* sums = memory_.chunks.data() + index(chunk) * layout.size;
    std::fill(sums + std::min(open, layout.size), sums + layout.size, T(0));
    return sums;
  }

  template <class Product>
  void run_groups(const ChunkTask& chunk_task, int chunk, Product& product) {
    const Stage& stage = chunk_task.stage;
    const engine::MeshBatch<T>& batch = this->batch_of(stage.encodes);
    const int items = chunk_task.layout.items;
    bool propagates = false;  // to a path that wants it
    for (int r = 0; r < stage.path_count; ++r) propagates = propagates || wants(stage.paths[index(r)]);
    const int last = std::min(static_cast<int>(batch.items.size()), (chunk + 1) * items);
    for (int number = chunk * items; number < last; ++number) {
      const Task task = this->task(stage, index(number));
      if (stage.product)
        product.collect_b(this->operand(stage, task, chunk_task.tile), stage.operand_rows, stage.operand_rows,
                          task.item.valid);
      const T* gradient = output_gradient(chunk_task, task);
      if (reads_pooled_) keep_sums(stage, task, gradient);
      if (stage.product) {
        product.collect_a(gradient, stage.rows, task.item.valid);
        if (product.full() || number + 1 == last) product.multiply();
      }
      if (!propagates) continue;
      if (stage.product)
        take_through_weights(chunk_task, task, gradient);
      else
        take_along_paths(chunk_task, task, 0, stage.rows, gradient, kernel::panel_stride<T>(stage.rows));
    }
  }

  /// The gradient of a stage's output for one group: in place where one adjoint holds it, else made in `tile`.
  const T* output_gradient(const ChunkTask& chunk, const Task& task) const {
    const Stage& stage = chunk.stage;
    T *const tile = chunk.tile, *const spare = chunk.spare;
    if (chunk.i == tape_.stage_count - 1) {
      kernel::split_vertices(
          gradients_.result[index(task.item.mesh)].data() + 3 * index(task.item.group) * kernel::group_width, 3,
          task.item.valid, tile);
      return tile;
    }
    int adjoints = 0, pools = 0, only = -1;
    this->for_each_adjoint(stage.output, [&](int p) {
      ++adjoints;
      only = p;
      this->for_each_pool(p, [&](int) { ++pools; });
    });
    if (adjoints == 1 && pools == 0 && !tape_.adjoint(only).normalises) return this->gradient_tile(only, task);
    const std::size_t size = kernel::tile_size(stage.rows);
    bool adds = false;
    this->for_each_adjoint(stage.output, [&](int p) {
      const Adjoint& adjoint = tape_.adjoint(p);
      T* upstream = adjoint.dense ? this->gradient_tile(p, task) : spare;
      if (!adjoint.dense) std::fill(spare, spare + size, T(0));
      this->for_each_pool(p, [&](int t) { scatter_to_maxima(t, task.item, upstream); });
      if (!adjoint.normalises) {
        for (std::size_t k = 0; k < size; ++k) tile[k] = adds ? tile[k] + upstream[k] : upstream[k];
      } else {
        finish(chunk, task, p, upstream, adds);
      }
      adds = true;
    });
    return tile;
  }

  /// Adds what a maximum leaves to the vertices that had it.
  void scatter_to_maxima(int t, const engine::Item& item, T* tile) const {
    const int channels = tape_.activation(t).channels;
    const int* argmax = memory_.argmax[index(t)].data() + index(item.mesh) * index(channels);
    const T* gradient = this->panel(memory_.maximum_gradients[index(t)], channels, item.mesh);
    for (int c = 0; c < channels; ++c) {
      const int v = argmax[c] - item.group * kernel::group_width;
      if (v < 0 || v >= item.valid) continue;
      tile[kernel::panel_stride<T>(channels) * index(v / kernel::panel_width<T>) +
           index(c * kernel::panel_width<T> + v % kernel::panel_width<T>)] +=
          gradient[index(c) * kernel::panel_width<T>];
    }
  }

  /// From the output of the norm that adjoint p lies behind to the stored activation, into the chunk's tile.
  void finish(const ChunkTask& chunk, const Task& task, int p, const T* upstream, bool adds) const {
    const Stage& stage = chunk.stage;
    const Adjoint& adjoint = tape_.adjoint(p);
    const std::size_t stride = kernel::panel_stride<T>(stage.rows);
    const Args args = this->arguments(adjoint.prefix, -1, task);
    const T* moments = this->statistics(p, task.item.mesh);
    const T* means = this->norm_gradient(p, task.item.mesh);
    const T* values = this->tile(stage.output, task);
    // Other's gradients of layers in front of a norm are not kept: lowering stores such an input first.
    this->loops(adjoint.prefix)
        .finish({.rows = {.values = values,
                          .values_stride = stride,
                          .upstream = upstream,
                          .upstream_stride = stride,
                          .downstream = chunk.tile,
                          .downstream_stride = stride,
                          .adds = adds,
                          .valid = task.item.valid,
                          .first_channel = 0,
                          .rows = stage.rows,
                          .args = args.data(),
                          .parameter_sums = chunk.sums + chunk.layout.adjoints[index(p)],
                          .norm_sums = {nullptr, nullptr},
                          .other = {}},
                 .norm = {moments, moments + stage.rows, means, means + stage.rows}});
  }

  /// The gradient's sum over the group's vertices: what a pooled feature, the same at all of them, is multiplied with.
  void keep_sums(const Stage& stage, const Task& task, const T* gradient) {
    const std::size_t stride = kernel::panel_stride<T>(stage.rows);
    const int panels = kernel::used_panels<T>(task.item.valid);
    T* sums = memory_.bias_partial.data() + task.number * index(stage.rows);
    for (int r = 0; r < stage.rows; ++r) {
      simd::Batch<T> sum = simd::broadcast(T(0));
      for (int p = 0; p < panels; ++p)
        for (int q = 0; q < kernel::panel_registers; ++q)
          sum += simd::load(gradient + index(r) * kernel::panel_width<T> + kernel::register_offset<T>(stride, p, q));
      sums[r] = simd::reduce_add(sum);
    }
  }

  /// The gradient of the operand, a block of rows at a time, and on along the paths.
  void take_through_weights(const ChunkTask& chunk, const Task& task, const T* gradient) {
    const kernel::ProductWeights<T>& weights = memory_.weights[index(chunk.i)].backward;
    const int panels = kernel::used_panels<T>(task.item.valid);
    const kernel::GroupProduct<T> product(weights, gradient, task.item.valid, chunk.words);
    alignas(simd_alignment) T raw[index(kernel::ProductWeights<T>::tallest_block) * kernel::group_width];
    for (int b = 0; b < weights.block_count(); ++b) {
      const int row = weights.first_row(b), rows = weights.rows(b);
      if (!any_wants(chunk.stage, row, rows)) continue;
      const std::size_t raw_stride = kernel::panel_stride<T>(rows);
      const T* bias = weights.bias_at(weights.bias(), row);
      for (int p = 0; p < panels; ++p) product.multiply_exactly(b, p, bias, raw + raw_stride * index(p));
      take_along_paths(chunk, task, row, rows, raw, raw_stride);
    }
  }

  bool any_wants(const Stage& stage, int row, int rows) const {
    bool wants = false;
    for (int r = 0; r < stage.path_count; ++r) {
      const ReadPath& path = stage.paths[index(r)];
      wants = wants || (this->wants(path) && path.row < row + rows && row < path.row + path.channels);
    }
    return wants;
  }

  /// Rows row .. row + rows - 1 of the operand's gradient (at `upstream`) into the adjoints of the paths that made
  /// them.
  void take_along_paths(const ChunkTask& chunk, const Task& task, int row, int rows, const T* upstream,
                        std::size_t upstream_stride) {
    const Stage& stage = chunk.stage;
    for (int r = 0; r < stage.path_count; ++r) {
      const ReadPath& path = stage.paths[index(r)];
      if (this->pooled(path.activation)) continue;
      const int begin = std::max(row, path.row), end = std::min(row + rows, path.row + path.channels);
      if (begin >= end) continue;
      const Activation& activation = tape_.activation(path.activation);
      const ChainLoops<T>& loops = this->loops(path.chain);
      const int first = begin - path.row;
      const std::size_t own = this->item_on(activation, task);
      const Args args = this->arguments(path.chain, path.adjoint, task);
      T* norm_sums = nullptr;
      if (path.norm >= 0)
        norm_sums =
            memory_.norm_partials[index(path.adjoint)].data() + own * 2 * index(activation.channels) + index(first);
      BackwardRange<T> range{
          .values = this->tile(path.activation, task) + index(first) * kernel::panel_width<T>,
          .values_stride = kernel::panel_stride<T>(activation.channels),
          .upstream = upstream + index(begin - row) * kernel::panel_width<T>,
          .upstream_stride = upstream_stride,
          .downstream = nullptr,
          .downstream_stride = kernel::panel_stride<T>(activation.channels),
          .adds = !path.overwrites,
          .valid = task.item.valid,
          .first_channel = first,
          .rows = end - begin,
          .args = args.data(),
          .parameter_sums = chunk.sums + chunk.layout.paths[index(r)] + index(first) * index(loops.read_sums),
          .norm_sums = {norm_sums, norm_sums == nullptr ? nullptr : norm_sums + activation.channels},
          .other = {}};
      if (wanted(path.adjoint)) {
        range.downstream = this->gradient_tile(path.adjoint, task) + index(first) * kernel::panel_width<T>;
        loops.backward(range);
      }
      if (loops.backward_others == nullptr) continue;
      bool others = false;
      for (int s = 0; s < path.chain.count; ++s)
        if (wanted(path.other_adjoints[index(s)])) {
          range.other[s] = this->gradient_tile(path.other_adjoints[index(s)], task);
          others = true;
        }
      if (others) loops.backward_others(range);
    }
  }

  /// Activation t is input number t.
  void leave_input_gradients(int t, std::span<const std::span<T>> to) const {
    if (to.empty()) return;
    const Activation& activation = tape_.activation(t);
    const engine::MeshBatch<T>& batch = this->batch_of(activation.encoded);
    for (const std::span<T>& gradient : to) std::fill(gradient.begin(), gradient.end(), T(0));
    this->for_each_adjoint(t, [&](int p) {
      for (std::size_t number = 0; number < batch.items.size(); ++number) {
        const engine::Item& item = batch.items[number];
        kernel::join_vertices(
            this->gradient_tile(p, {item, number, activation.encoded}), activation.channels, item.valid,
            to[index(item.mesh)].data() + index(activation.channels) * index(item.group) * kernel::group_width);
      }
    });
  }

  std::array<bool, max_adjoints> wanted_{};
  std::size_t tile_stride_ = 0;
  std::size_t collected_words_ = 0;  ///< of a slot, in front of an operand's
  bool reads_pooled_ = false;        ///< the running stage reads a pooled activation
};

}  // namespace npt::inline NPT_ABI::tape
