/// Runs a tape backwards: from the gradient of the result to those of all parameters and, if asked for, of both meshes.
///
/// Stages go last to first. One task carries a chunk of groups through a stage: the gradient of its output is finished (through the
/// norm that reads it), multiplied with the transposed weights and taken through the paths into their adjoints, and collected for the
/// gradient of the weights together with the operand, which is made again. Chunks are as many as the shapes say, never as the
/// threads, and are merged in order: the same bits for any number of threads.
#pragma once

#include <npt/config.hpp>
#include <npt/parallel/executor.hpp>
#include <npt/simd/amx.hpp>
#include <npt/tape/amx_outer_product.hpp>
#include <npt/tape/chain_backward.hpp>
#include <npt/tape/memory.hpp>
#include <npt/tape/outer_product.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <type_traits>

namespace npt::inline NPT_ABI::tape {

/// What a backward pass starts from and where it leaves its results.
template <class T>
struct BatchGradients {
  std::span<const std::span<const T>> result;  ///< by pair: [V, 3]
  std::span<T> parameters;                     ///< as Model::buffer(), overwritten
  std::span<const std::span<T>> pose;          ///< by pair: [Vp, 3], overwritten; none if empty
  std::span<const std::span<T>> identity;      ///< by pair: [V, 3]
};

template <class T>
class Backward : View<T> {
 public:
  Backward(const Tape& tape, std::span<const ChainLoops<T>> loops, Memory<T>& memory,
           const BatchGradients<T>& gradients)
      : View<T>(tape, loops, memory), gradients_(gradients) {}

  /// The gradient of what Forward ran last on this memory.
  template <Executor E>
  void run(const E& executor) {
    prepare(executor);
    std::fill(gradients_.parameters.begin(), gradients_.parameters.end(), T(0));
    for (int i = tape_.stage_count - 1; i >= 0; --i)
      if (i == tape_.stage_count - 1 || has_gradient(tape_.stage(i).output)) run_stage(i, executor);
    leave_input_gradients(0, gradients_.pose);
    leave_input_gradients(1, gradients_.identity);
  }

 private:
  using typename View<T>::Args;
  using View<T>::index;
  using View<T>::slack;
  using View<T>::tape_;
  using View<T>::memory_;

  // Every chunk has sums of its own, 4.2 MB for 1027 rows, which are added up at the end: enough groups must pay for them. Batches
  // that keep more than 16 threads busy are large, and pay with 32 groups a chunk.
  static constexpr int few_chunks = 16;
  static constexpr int least_items = 8;  ///< in a chunk, if there are several, up to few_chunks of them
  static constexpr int least_items_of_many = 32;

  // ---- what takes part ----

  /// Whether gradients are wanted there: everywhere but at the inputs, unless they are asked for.
  bool wanted(int adjoint) const {
    if (adjoint < 0) return false;
    const int input = tape_.activation(tape_.adjoint(adjoint).activation).input;
    return input < 0 || !(input == 0 ? gradients_.pose : gradients_.identity).empty();
  }
  bool has_gradient(int activation) const {
    bool found = false;
    for_each_adjoint(activation, [&](int) { found = true; });
    return found;
  }
  template <class F>
  void for_each_adjoint(int activation, F&& f) const {
    for (int p = 0; p < tape_.adjoint_count; ++p)
      if (tape_.adjoint(p).activation == activation) f(p);
  }
  template <class F>
  void for_each_pool(int adjoint, F&& f) const {
    for (int t = 0; t < tape_.activation_count; ++t)
      if (this->pooled(t) && tape_.activation(t).adjoint == adjoint) f(t);
  }

  // ---- memory ----

  template <Executor E>
  void prepare(const E& executor) {
    for (std::size_t side = 0; side < 2; ++side)
      for (int b = 0; b < tape_.buffer_count[side]; ++b) {
        bool used = false;
        for (int p = 0; p < tape_.adjoint_count; ++p)
          used = used || (tape_.adjoint(p).buffer == b && wanted(p) &&
                          tape_.activation(tape_.adjoint(p).activation).from_pose == (side == 0));
        if (used)
          memory_.buffers[side][index(b)].grow_to(
              this->side_of(side == 0).items.size() * kernel::tile_size(tape_.buffer_channels[side][index(b)]) + slack);
      }
    for (int p = 0; p < tape_.adjoint_count; ++p) {
      const Adjoint& adjoint = tape_.adjoint(p);
      const Activation& activation = tape_.activation(adjoint.activation);
      const engine::MeshBatch<T>& side = this->side_of(activation.from_pose);
      if (adjoint.normalises) {
        const std::size_t size = side.items.size() * 2 * index(activation.channels);
        memory_.norm_partials[index(p)].grow_to(size);
        if (adjoint.starts_at_zero)
          std::fill(memory_.norm_partials[index(p)].data(), memory_.norm_partials[index(p)].data() + size, T(0));
        memory_.norm_gradients[index(p)].grow_to(side.instances.size() * 2 * index(activation.channels));
      }
      if (adjoint.starts_at_zero && wanted(p)) {
        T* first = memory_.buffers[activation.from_pose ? 0 : 1][index(adjoint.buffer)].data();
        std::fill(first, first + side.items.size() * kernel::tile_size(activation.channels), T(0));
      }
    }
    for (int t = 0; t < tape_.activation_count; ++t) {
      if (!this->pooled(t)) continue;
      const std::size_t size = this->side_of(tape_.activation(t).from_pose).instances.size() *
                               kernel::panel_stride<T>(tape_.activation(t).channels);
      memory_.pooled_gradients[index(t)].grow_to(size);
      memory_.maximum_gradients[index(t)].grow_to(size);
      std::fill(memory_.pooled_gradients[index(t)].data(), memory_.pooled_gradients[index(t)].data() + size, T(0));
    }
    // A task's scratch: a tile for the operand and later the gradient, one for a gradient that only maxima make, and the collected
    // operands of the weights' gradient.
    std::size_t tiles = 0, collected = 0, words = 0;
    for (int i = 0; i < tape_.stage_count; ++i) {
      const Stage& stage = tape_.stage(i);
      tiles = std::max(tiles, kernel::tile_size(std::max(stage.operand_rows, stage.rows)) + slack);
      if (memory_.parts > 0) {
        const AmxOuterShape shape = amx_shape(stage);
        collected_words_ = std::max(collected_words_, shape.a_size() + shape.b_size());
        words = std::max(words, memory_.weights[index(i)].amx_backward.operand_words(kernel::group_panels<T>));
      } else {
        const OuterShape<T> shape = outer_shape(stage);
        collected = std::max(collected, round_up(shape.a_size()) + shape.b_size());
      }
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

  /// The bias is the weight of one more operand row, of ones.
  static OuterShape<T> outer_shape(const Stage& stage) { return OuterShape<T>::of(stage.rows, stage.operand_rows + 1); }
  AmxOuterShape amx_shape(const Stage& stage) const {
    return AmxOuterShape::of(stage.rows, stage.operand_rows + 1, memory_.parts);
  }

  /// Where a chunk keeps its sums.
  struct ChunkLayout {
    std::size_t size = 0;
    std::array<std::size_t, max_paths> paths{};
    std::array<std::size_t, max_adjoints> adjoints{};
    int count = 0;  ///< of chunks
    int items = 0;  ///< in each but the last
  };

  // ---- one stage ----

  template <Executor E>
  void run_stage(int i, const E& executor) {
    if (memory_.parts > 0)
      run_stage(i, amx_shape(tape_.stage(i)), executor);
    else
      run_stage(i, outer_shape(tape_.stage(i)), executor);
  }

  template <class Shape, Executor E>
  void run_stage(int i, const Shape& shape, const E& executor) {
    const Stage& stage = tape_.stage(i);
    const engine::MeshBatch<T>& side = this->side_of(stage.from_pose);
    reads_pooled_ = stage.operand_rows != stage.columns;
    for_each_adjoint(stage.output, [&](int p) { merge_adjoint(p, side, executor); });
    if (reads_pooled_) memory_.bias_partial.grow_to(side.items.size() * index(stage.rows));
    const ChunkLayout layout = lay_out(stage, shape, static_cast<int>(side.items.size()));
    memory_.chunks.grow_to(layout.size * index(layout.count));
    executor.for_each(layout.count, [&](int chunk, int slot) {
      run_chunk(i, shape, layout, chunk, memory_.scratch.data() + index(slot) * memory_.scratch_stride,
                this->words_of(slot));
    });
    merge_chunks(i, shape, layout, executor);
    if (reads_pooled_) take_to_pooled(stage, side, executor);
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
    for_each_adjoint(stage.output, [&](int p) {
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

  void run_chunk(int i, const OuterShape<T>& shape, const ChunkLayout& layout, int chunk, T* scratch,
                 kernel::Word* words) {
    T* collected = scratch + 2 * tile_stride_;
    OuterProduct<T> product(shape, collected, collected + round_up(shape.a_size()), start(layout, chunk, 0));
    run_groups(i, layout, chunk, scratch, words, product);
  }
  void run_chunk(int i, const AmxOuterShape& shape, const ChunkLayout& layout, int chunk, T* scratch,
                 kernel::Word* words) {
    if constexpr (std::is_same_v<T, float>) {
      [[maybe_unused]] const simd::MatrixRegisters registers;
      AmxOuterProduct product(shape, words, words + shape.a_size(),
                              start(layout, chunk, tape_.stage(i).product ? shape.result_size() : 0));
      run_groups(i, layout, chunk, scratch, words + collected_words_, product);
    }
  }
  /// A chunk's sums, of which all behind the first `open` are made zero.
  T* start(const ChunkLayout& layout, int chunk, std::size_t open) const {
    T* sums = memory_.chunks.data() + index(chunk) * layout.size;
    std::fill(sums + std::min(open, layout.size), sums + layout.size, T(0));
    return sums;
  }

  template <class Product>
  void run_groups(int i, const ChunkLayout& layout, int chunk, T* scratch, kernel::Word* words, Product& product) {
    const Stage& stage = tape_.stage(i);
    const engine::MeshBatch<T>& side = this->side_of(stage.from_pose);
    T* sums = memory_.chunks.data() + index(chunk) * layout.size;
    T* tile = scratch;
    T* spare = scratch + tile_stride_;
    bool propagates = false;  // to a path that wants it
    for (int r = 0; r < stage.path_count; ++r) propagates = propagates || wanted(stage.paths[index(r)].adjoint);
    const int last = std::min(static_cast<int>(side.items.size()), (chunk + 1) * layout.items);
    for (int number = chunk * layout.items; number < last; ++number) {
      const engine::Item& item = side.items[index(number)];
      if (stage.product)
        product.collect_b(this->operand(stage, item, index(number), tile), stage.operand_rows, stage.operand_rows,
                          item.valid);
      const T* gradient = output_gradient(i, item, index(number), tile, spare, layout, sums);
      if (reads_pooled_) keep_sums(stage, item, index(number), gradient);
      if (stage.product) {
        product.collect_a(gradient, stage.rows, item.valid);
        if (product.full() || number + 1 == last) product.multiply();
      }
      if (!propagates) continue;
      if (stage.product)
        take_through_weights(i, item, index(number), gradient, words, layout, sums);
      else
        take_along_paths(stage, item, index(number), 0, stage.rows, gradient, kernel::panel_stride<T>(stage.rows),
                         layout, sums);
    }
  }

  /// The gradient of a stage's output for one group: in place where one adjoint holds it, else made in `tile`.
  const T* output_gradient(int i, const engine::Item& item, std::size_t number, T* tile, T* spare,
                           const ChunkLayout& layout, T* sums) const {
    const Stage& stage = tape_.stage(i);
    if (i == tape_.stage_count - 1) {
      kernel::split_coordinates(
          gradients_.result[index(item.instance)].data() + 3 * index(item.group) * kernel::group_width, item.valid,
          tile);
      return tile;
    }
    int adjoints = 0, pools = 0, only = -1;
    for_each_adjoint(stage.output, [&](int p) {
      ++adjoints;
      only = p;
      for_each_pool(p, [&](int) { ++pools; });
    });
    if (adjoints == 1 && pools == 0 && !tape_.adjoint(only).normalises)
      return this->gradient_tile(only, item, number, stage.from_pose);
    const std::size_t size = kernel::tile_size(stage.rows);
    bool adds = false;
    for_each_adjoint(stage.output, [&](int p) {
      const Adjoint& adjoint = tape_.adjoint(p);
      T* upstream = adjoint.dense ? this->gradient_tile(p, item, number, stage.from_pose) : spare;
      if (!adjoint.dense) std::fill(spare, spare + size, T(0));
      for_each_pool(p, [&](int t) { scatter_to_maxima(t, item, upstream); });
      if (!adjoint.normalises) {
        for (std::size_t k = 0; k < size; ++k) tile[k] = adds ? tile[k] + upstream[k] : upstream[k];
      } else {
        finish(stage, p, item, number, upstream, tile, adds, sums + layout.adjoints[index(p)]);
      }
      adds = true;
    });
    return tile;
  }

  /// Adds what a maximum leaves to the vertices that had it.
  void scatter_to_maxima(int t, const engine::Item& item, T* tile) const {
    const int channels = tape_.activation(t).channels;
    const int* argmax = memory_.argmax[index(t)].data() + index(item.instance) * index(channels);
    const T* gradient = this->panel(memory_.maximum_gradients[index(t)], channels, item.instance);
    for (int c = 0; c < channels; ++c) {
      const int v = argmax[c] - item.group * kernel::group_width;
      if (v < 0 || v >= item.valid) continue;
      tile[kernel::panel_stride<T>(channels) * index(v / kernel::panel_width<T>) +
           index(c * kernel::panel_width<T> + v % kernel::panel_width<T>)] +=
          gradient[index(c) * kernel::panel_width<T>];
    }
  }

  void finish(const Stage& stage, int p, const engine::Item& item, std::size_t number, const T* upstream, T* tile,
              bool adds, T* sums) const {
    const Adjoint& adjoint = tape_.adjoint(p);
    const std::size_t stride = kernel::panel_stride<T>(stage.rows);
    const Args args = this->arguments(adjoint.prefix, -1, item, number, stage.from_pose);
    const T* moments = this->statistics(p, item.instance);
    const T* means = norm_gradient(p, item.instance);
    const T* values = this->tile(stage.output, item, number, stage.from_pose);
    // Other's gradients of layers in front of a norm are not kept: lowering stores such an input first.
    this->loops(adjoint.prefix)
        .finish({.rows = {.values = values,
                          .values_stride = stride,
                          .upstream = upstream,
                          .upstream_stride = stride,
                          .downstream = tile,
                          .downstream_stride = stride,
                          .adds = adds,
                          .valid = item.valid,
                          .first_channel = 0,
                          .rows = stage.rows,
                          .args = args.data(),
                          .parameter_sums = sums,
                          .norm_sums = {nullptr, nullptr},
                          .other = {}},
                 .norm = {moments, moments + stage.rows, means, means + stage.rows}});
  }

  /// The gradient's sum over the group's vertices: what a pooled feature, the same at all of them, is multiplied with.
  void keep_sums(const Stage& stage, const engine::Item& item, std::size_t number, const T* gradient) {
    const std::size_t stride = kernel::panel_stride<T>(stage.rows);
    const int panels = kernel::used_panels<T>(item.valid);
    T* sums = memory_.bias_partial.data() + number * index(stage.rows);
    for (int r = 0; r < stage.rows; ++r) {
      simd::Batch<T> sum = simd::broadcast(T(0));
      for (int p = 0; p < panels; ++p)
        for (int q = 0; q < kernel::panel_registers; ++q)
          sum += simd::load(gradient + index(r) * kernel::panel_width<T> + kernel::register_offset<T>(stride, p, q));
      sums[r] = simd::reduce_add(sum);
    }
  }

  /// The gradient of the operand, a block of rows at a time, and on along the paths.
  void take_through_weights(int i, const engine::Item& item, std::size_t number, const T* gradient, kernel::Word* words,
                            const ChunkLayout& layout, T* sums) {
    const Stage& stage = tape_.stage(i);
    const Weights<T>& weights = memory_.weights[index(i)];
    const int panels = kernel::used_panels<T>(item.valid);
    const Product<T> product = memory_.parts > 0 ? Product<T>(weights.amx_backward, gradient, item.valid, words)
                                                 : Product<T>(weights.backward, gradient);
    alignas(simd_alignment) T raw[index(Product<T>::tallest_block) * kernel::group_width];
    for (int b = 0; b < product.block_count(); ++b) {
      const int row = product.first_row(b), rows = product.rows(b);
      if (!any_wants(stage, row, rows)) continue;
      const std::size_t raw_stride = kernel::panel_stride<T>(rows);
      for (int p = 0; p < panels; ++p) product(b, p, product.bias_at(product.bias(), row), raw + raw_stride * index(p));
      take_along_paths(stage, item, number, row, rows, raw, raw_stride, layout, sums);
    }
  }

  bool any_wants(const Stage& stage, int row, int rows) const {
    bool wants = false;
    for (int r = 0; r < stage.path_count; ++r) {
      const ReadPath& path = stage.paths[index(r)];
      wants = wants || (wanted(path.adjoint) && path.row < row + rows && row < path.row + path.channels);
    }
    return wants;
  }

  /// Rows row .. row + rows - 1 of the operand's gradient (at `upstream`) into the adjoints of the paths that made them.
  void take_along_paths(const Stage& stage, const engine::Item& item, std::size_t number, int row, int rows,
                        const T* upstream, std::size_t upstream_stride, const ChunkLayout& layout, T* sums) {
    for (int r = 0; r < stage.path_count; ++r) {
      const ReadPath& path = stage.paths[index(r)];
      if (this->pooled(path.activation)) continue;
      const int begin = std::max(row, path.row), end = std::min(row + rows, path.row + path.channels);
      if (begin >= end) continue;
      const Activation& activation = tape_.activation(path.activation);
      const ChainLoops<T>& loops = this->loops(path.chain);
      const int first = begin - path.row;
      const std::size_t own = this->item_on(activation, item, number, stage.from_pose);
      const Args args = this->arguments(path.chain, path.adjoint, item, number, stage.from_pose);
      T* norm_sums = nullptr;
      if (path.norm >= 0)
        norm_sums =
            memory_.norm_partials[index(path.adjoint)].data() + own * 2 * index(activation.channels) + index(first);
      BackwardRange<T> range{
          .values = this->tile(path.activation, item, number, stage.from_pose) + index(first) * kernel::panel_width<T>,
          .values_stride = kernel::panel_stride<T>(activation.channels),
          .upstream = upstream + index(begin - row) * kernel::panel_width<T>,
          .upstream_stride = upstream_stride,
          .downstream = nullptr,
          .downstream_stride = kernel::panel_stride<T>(activation.channels),
          .adds = !path.overwrites,
          .valid = item.valid,
          .first_channel = first,
          .rows = end - begin,
          .args = args.data(),
          .parameter_sums = sums + layout.paths[index(r)] + index(first) * index(loops.read_sums),
          .norm_sums = {norm_sums, norm_sums == nullptr ? nullptr : norm_sums + activation.channels},
          .other = {}};
      if (wanted(path.adjoint)) {
        range.downstream =
            this->gradient_tile(path.adjoint, item, number, stage.from_pose) + index(first) * kernel::panel_width<T>;
        loops.backward(range);
      }
      if (loops.backward_others == nullptr) continue;
      bool others = false;
      for (int s = 0; s < path.chain.count; ++s)
        if (wanted(path.other_adjoints[index(s)])) {
          range.other[s] = this->gradient_tile(path.other_adjoints[index(s)], item, number, stage.from_pose);
          others = true;
        }
      if (others) loops.backward_others(range);
    }
  }

  // ---- barriers ----

  T* norm_gradient(int p, int mesh) const {
    return memory_.norm_gradients[index(p)].data() +
           index(mesh) * 2 * index(tape_.activation(tape_.adjoint(p).activation).channels);
  }

  /// The two means of a adjoint's gradients that its norm's derivative needs, and the gradients that maxima leave there.
  template <Executor E>
  void merge_adjoint(int p, const engine::MeshBatch<T>& side, const E& executor) {
    const Adjoint& adjoint = tape_.adjoint(p);
    const int channels = tape_.activation(adjoint.activation).channels;
    if (adjoint.normalises)
      executor.for_each(static_cast<int>(side.instances.size()), [&](int mesh, int) {
        const engine::Instance<T>& instance = side.instances[index(mesh)];
        T* NPT_RESTRICT means = norm_gradient(p, mesh);
        const std::size_t width = 2 * index(channels);
        std::fill(means, means + width, T(0));
        if (adjoint.dense)
          for (int g = 0; g < kernel::group_count(instance.vertices); ++g) {
            const T* NPT_RESTRICT partial =
                memory_.norm_partials[index(p)].data() + index(instance.first_item + g) * width;
            for (std::size_t k = 0; k < width; ++k) means[k] += partial[k];
          }
      });
    for_each_pool(p, [&](int t) {
      for (int mesh = 0; mesh < static_cast<int>(side.instances.size()); ++mesh) take_through_pool(t, p, mesh);
    });
    if (adjoint.normalises)
      for (int mesh = 0; mesh < static_cast<int>(side.instances.size()); ++mesh) {
        const T share = T(1) / static_cast<T>(side.instances[index(mesh)].vertices);
        T* means = norm_gradient(p, mesh);
        for (int k = 0; k < 2 * channels; ++k) means[k] *= share;
      }
  }

  void take_through_pool(int t, int p, int mesh) {
    const Activation& activation = tape_.activation(t);
    const ChainLoops<T>& loops = this->loops(activation.chain);
    const Args args =
        this->arguments(activation.chain, activation.adjoint, engine::Item{mesh, 0, 1}, 0, activation.from_pose);
    memory_.pooled_sums.grow_to(index(activation.channels) * index(loops.read_sums) + 1);
    T* sums = memory_.pooled_sums.data();
    std::fill(sums, sums + index(activation.channels) * index(loops.read_sums), T(0));
    T* means = tape_.adjoint(p).normalises ? norm_gradient(p, mesh) : nullptr;
    // `adds` is for the norm's sums, so the gradient itself starts from zero.
    T* gradient = this->panel(memory_.maximum_gradients[index(t)], activation.channels, mesh);
    std::fill(gradient, gradient + kernel::panel_stride<T>(activation.channels), T(0));
    loops.backward({.values = this->pooled_maxima(t, mesh),
                    .values_stride = 0,
                    .upstream = this->panel(memory_.pooled_gradients[index(t)], activation.channels, mesh),
                    .upstream_stride = 0,
                    .downstream = gradient,
                    .downstream_stride = 0,
                    .adds = true,
                    .valid = 1,
                    .first_channel = 0,
                    .rows = activation.channels,
                    .args = args.data(),
                    .parameter_sums = sums,
                    .norm_sums = {means, means == nullptr ? nullptr : means + activation.channels},
                    .other = {}});
    add_parameter_gradients(activation.chain, activation.norm + 1, activation.chain.count, activation.channels,
                            loops.read_sums, {sums, 1, 0});
  }

  /// Sums [channels][sums] of some chunks.
  struct ChunkSums {
    const T* first;
    int chunks;
    std::size_t stride;
    T operator()(std::size_t k) const {
      T total = first[k];
      for (int c = 1; c < chunks; ++c) total += first[index(c) * stride + k];
      return total;
    }
  };

  /// Gives the sums of steps begin .. end - 1 of a chain to their parameters.
  void add_parameter_gradients(const Chain& chain, int begin, int end, int channels, int sums_per_channel,
                               const ChunkSums& sums) {
    if (sums_per_channel == 0) return;
    const ChainLoops<T>& loops = this->loops(chain);
    int first = 0;
    for (int s = begin; s < end; ++s) {
      const Step& step = chain.steps[index(s)];
      int at = first;
      for (std::size_t k = 0; k < step.parameters.size() && at < first + loops.operation_sums[index(s)]; ++k) {
        if (step.parameters[k] < 0) continue;
        const bool by_channel = step.sizes[k] % channels == 0;
        const int elements = by_channel ? step.sizes[k] / channels : step.sizes[k];
        T* gradient = gradients_.parameters.data() + step.parameters[k];
        for (int c = 0; c < channels; ++c)
          for (int e = 0; e < elements; ++e)
            gradient[(by_channel ? c * elements : 0) + e] += sums(index(c) * index(sums_per_channel) + index(at + e));
        at += elements;
      }
      first += loops.operation_sums[index(s)];
    }
  }

  template <class Shape, Executor E>
  void merge_chunks(int i, const Shape& shape, const ChunkLayout& layout, const E& executor) {
    const Stage& stage = tape_.stage(i);
    const T* chunks = memory_.chunks.data();
    if (stage.product) {
      constexpr int strip = 32;
      executor.for_each((stage.rows + strip - 1) / strip, [&](int s, int) {
        merge_weights(i, shape, layout, s * strip, std::min(stage.rows, (s + 1) * strip));
      });
    }
    for (int r = 0; r < stage.path_count; ++r) {
      const ReadPath& path = stage.paths[index(r)];
      if (this->pooled(path.activation)) continue;
      add_parameter_gradients(path.chain, path.norm + 1, path.chain.count, path.channels,
                              this->loops(path.chain).read_sums,
                              {chunks + layout.paths[index(r)], layout.count, layout.size});
    }
    for_each_adjoint(stage.output, [&](int p) {
      const Adjoint& adjoint = tape_.adjoint(p);
      if (adjoint.normalises)
        add_parameter_gradients(adjoint.prefix, 0, adjoint.prefix.count, stage.rows,
                                this->loops(adjoint.prefix).prefix_sums,
                                {chunks + layout.adjoints[index(p)], layout.count, layout.size});
    });
  }

  template <class Shape>
  void merge_weights(int i, const Shape& shape, const ChunkLayout& layout, int begin, int end) {
    const Stage& stage = tape_.stage(i);
    const std::vector<int>& columns = memory_.columns[index(i)];
    for (int p = 0; p < shape.panels(); ++p) {
      const int width = shape.panel_columns(p);
      const int first = shape.first_column(p);
      const int used = std::min(width, stage.operand_rows - first);  // of the columns that are weights
      for (int r = begin; r < end; ++r) {
        T sum[std::max(kernel::panel_width<T>, AmxOuterShape::width)] = {};
        const T* from = memory_.chunks.data() + shape.at(r, first);
        for (int c = 0; c < layout.count; ++c, from += layout.size)
          for (int k = 0; k < width; ++k) sum[k] += from[k];
        T* gradient = gradients_.parameters.data() + stage.weight + r * stage.columns;
        for (int k = 0; k < used; ++k) gradient[columns[index(first + k)]] += sum[k];
        const int ones = stage.operand_rows - first;
        if (ones < width && !stage.bias_is_dead) gradients_.parameters[index(stage.bias + r)] += sum[ones];
      }
    }
  }

  /// The gradients of pooled features and of the weights that they meet.
  template <Executor E>
  void take_to_pooled(const Stage& stage, const engine::MeshBatch<T>& side, const E& executor) {
    const std::size_t meshes = side.instances.size();
    memory_.mesh_bias.grow_to(meshes * index(stage.rows));
    executor.for_each(static_cast<int>(meshes), [&](int mesh, int) {
      const engine::Instance<T>& instance = side.instances[index(mesh)];
      T* NPT_RESTRICT bias = memory_.mesh_bias.data() + index(mesh) * index(stage.rows);
      std::fill(bias, bias + stage.rows, T(0));
      for (int g = 0; g < kernel::group_count(instance.vertices); ++g) {
        const T* NPT_RESTRICT partial =
            memory_.bias_partial.data() + index(instance.first_item + g) * index(stage.rows);
        for (int r = 0; r < stage.rows; ++r) bias[r] += partial[r];
      }
      for (int r = 0; r < stage.path_count; ++r) {
        const ReadPath& path = stage.paths[index(r)];
        if (!this->pooled(path.activation)) continue;
        T* to = this->panel(memory_.pooled_gradients[index(path.activation)], path.channels, mesh);
        for (int row = 0; row < stage.rows; ++row) {
          const T* weights = memory_.parameters.data() + stage.weight + row * stage.columns + path.column;
          for (int c = 0; c < path.channels; ++c) to[index(c) * kernel::panel_width<T>] += weights[c] * bias[row];
        }
      }
    });
    constexpr int strip = 32;
    executor.for_each((stage.rows + strip - 1) / strip, [&](int s, int) {
      for (int r = 0; r < stage.path_count; ++r) {
        const ReadPath& path = stage.paths[index(r)];
        if (!this->pooled(path.activation)) continue;
        for (int mesh = 0; mesh < static_cast<int>(meshes); ++mesh) {
          const T* feature = this->pooled_feature(path.activation, mesh);
          for (int row = s * strip; row < std::min(stage.rows, (s + 1) * strip); ++row) {
            T* gradient = gradients_.parameters.data() + stage.weight + row * stage.columns + path.column;
            const T factor = memory_.mesh_bias[index(mesh) * index(stage.rows) + index(row)];
            for (int c = 0; c < path.channels; ++c) gradient[c] += factor * feature[index(c) * kernel::panel_width<T>];
          }
        }
      }
    });
  }

  void leave_input_gradients(int t, std::span<const std::span<T>> to) const {
    if (to.empty()) return;
    const engine::MeshBatch<T>& side = this->side_of(t == 0);
    for (const std::span<T>& gradient : to) std::fill(gradient.begin(), gradient.end(), T(0));
    for_each_adjoint(t, [&](int p) {
      for (std::size_t number = 0; number < side.items.size(); ++number) {
        const engine::Item& item = side.items[number];
        kernel::join_coordinates(this->gradient_tile(p, item, number, t == 0), item.valid,
                                 to[index(item.instance)].data() + 3 * index(item.group) * kernel::group_width);
      }
    });
  }

  const BatchGradients<T>& gradients_;
  std::size_t tile_stride_ = 0;
  std::size_t collected_words_ = 0;  ///< of a slot, in front of an operand's
  bool reads_pooled_ = false;        ///< the running stage reads a pooled activation
};

}  // namespace npt::inline NPT_ABI::tape
