/// Interprets a packed program: the forward pass.
#pragma once

#include <npt/config.hpp>
#include <npt/engine/packed_program.hpp>
#include <npt/engine/row_transforms.hpp>
#include <npt/engine/workspace.hpp>
#include <npt/kernel/amx_product.hpp>
#include <npt/kernel/moments.hpp>
#include <npt/kernel/pointwise.hpp>
#include <npt/parallel/executor.hpp>
#include <npt/simd/amx.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <type_traits>

namespace npt::inline NPT_ABI::engine {

/// One pass over the sides in `memory`. A short-lived object: it only holds references.
template <class T>
class Forward {
 public:
  Forward(const PackedProgram<T>& packed, const RowTransforms<T>& transforms, WorkspaceStorage<T>& memory)
      : packed_(packed), program_(packed.program()), transforms_(transforms), memory_(memory) {}

  /// The encoder: memory.pose to `code`.
  template <Executor E>
  void encode(CodeStorage<T>& code, const E& executor) {
    code_ = own_code_ = &code;
    const MeshBatch<T>& side = memory_.pose;
    side.split(code.coordinates);
    code.first_item.clear();
    for (const Instance<T>& pose : side.instances) code.first_item.push_back(pose.first_item);
    for (const Activation& t : program_.activations)
      if (t.storage == Storage::code) code.tiles[index(t.place)].grow_to(side.items.size() * code_stride(t));
    prepare(side, true, executor.slots());
    for (int s = 0; s < program_.encoder_sweeps; ++s) run(program_.sweep(s), side, executor);
  }

  /// The decoder: `code` and memory.identity to the results.
  template <Executor E>
  void decode(const CodeStorage<T>& code, const E& executor) {
    code_ = &code;
    own_code_ = nullptr;
    run_decoder(executor);
  }

  /// The same for a code that nobody reads afterwards and of which each identity takes its own pose, group by group:
  /// its memory becomes the decoder's first feature map.
  template <Executor E>
  void decode_and_consume(CodeStorage<T>& code, const E& executor) {
    code_ = &code;
    own_code_ = program_.code_alias >= 0 ? &code : nullptr;
    run_decoder(executor);
  }

 private:
  using Activation = graph::Activation;
  using Stage = graph::Stage;
  using Storage = graph::Storage;
  struct Partial {
    std::size_t mean = 0, squares = 0, maximum = 0;  ///< offsets in memory_.partial of [items][rows]
  };

  /// Memory of a slot for operands on matrix registers.
  struct Operands {
    kernel::Word* words;
    T* values;
  };

  static constexpr std::size_t index(int i) { return static_cast<std::size_t>(i); }

  // ---- memory ----

  /// The feature map that the decoder overwrites must have the wider of both strides.
  std::size_t code_stride(const Activation& t) const {
    int channels = t.channels;
    if (program_.code_alias >= 0)
      channels = std::max(channels, program_.buffer_channels[1][index(program_.code_alias)]);
    return kernel::tile_size(channels);
  }
  std::size_t buffer_stride(int b, bool over_pose) const {
    if (!over_pose && b == program_.code_alias) {
      for (const Activation& t : program_.activations)
        if (t.storage == Storage::code && t.place == 0) return code_stride(t);
    }
    return kernel::tile_size(program_.buffer_channels[over_pose ? 0 : 1][index(b)]);
  }

  template <Executor E>
  void run_decoder(const E& executor) {
    const MeshBatch<T>& side = memory_.identity;
    side.split(memory_.identity_coordinates);
    prepare(side, false, executor.slots());
    for (int s = program_.encoder_sweeps; s < program_.sweep_count; ++s) run(program_.sweep(s), side, executor);
  }

  void prepare(const MeshBatch<T>& side, bool over_pose, int slots) {
    for (int b = 0; b < program_.buffer_count; ++b) {
      const bool consume = !over_pose && own_code_ != nullptr && b == program_.code_alias;
      buffer_stride_[index(b)] = buffer_stride(b, over_pose);
      if (!consume) memory_.buffers[index(b)].grow_to(side.items.size() * buffer_stride_[index(b)]);
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
      widest = activation.channels > widest ? activation.channels : widest;
      if (activation.from_pose != over_pose) continue;
      MeshValues<T>& values = over_pose ? own_code_->values[index(t)] : memory_.values[index(t)];
      values.stride = activation.storage == Storage::pooled ? index(activation.channels) * kernel::panel_width<T>
                      : activation.moments                  ? 2 * index(activation.channels)
                                                            : 0;
      values.values.grow_to(side.instances.size() * values.stride);
    }
    memory_.sums.grow_to(2 * index(widest));
  }

  const MeshValues<T>& values_of(int t) const {
    return program_.activation(t).from_pose ? code_->values[index(t)] : memory_.values[index(t)];
  }
  /// For the sweep's own outputs.
  MeshValues<T>& own_values_of(int t) {
    return program_.activation(t).from_pose ? own_code_->values[index(t)] : memory_.values[index(t)];
  }

  /// The instance of an activation's own side that an item of the running side reads.
  int instance_for(const Activation& t, const Item& item, bool over_pose) const {
    if (over_pose || !t.from_pose) return item.instance;
    return memory_.identity.instances[index(item.instance)].code;
  }

  /// Number of the item on the activation's own side.
  std::size_t item_of(const Activation& t, const Item& item, std::size_t number, bool over_pose) const {
    if (over_pose || !t.from_pose) return number;
    return index(code_->first_item[index(instance_for(t, item, over_pose))] + item.group);
  }

  /// Where the stage that runs writes its output.
  T* output_tile(int t, std::size_t number, T* scratch) {
    const Activation& activation = program_.activation(t);
    if (activation.storage == Storage::buffer)
      return buffer_[index(activation.place)] + number * buffer_stride_[index(activation.place)];
    if (activation.storage == Storage::code)
      return own_code_->tiles[index(activation.place)].data() + number * code_stride(activation);
    return scratch + scratch_offset_[index(activation.place)];
  }

  /// Where an activation's tile for this item lies.
  const T* tile(int t, const Item& item, std::size_t number, bool over_pose, const T* scratch) const {
    const Activation& activation = program_.activation(t);
    switch (activation.storage) {
      case Storage::input:
        return (activation.from_pose ? code_->coordinates : memory_.identity_coordinates).data() +
               item_of(activation, item, number, over_pose) * kernel::tile_size(3);
      case Storage::scratch:
      case Storage::none:
        return scratch + scratch_offset_[index(activation.place)];
      case Storage::buffer:
        return buffer_[index(activation.place)] + number * buffer_stride_[index(activation.place)];
      case Storage::code:
        return code_->tiles[index(activation.place)].data() +
               item_of(activation, item, number, over_pose) * code_stride(activation);
      case Storage::pooled:
        break;
    }
    NPT_ASSERT(false);
    return nullptr;
  }

  // ---- one sweep ----

  template <Executor E>
  void run(const graph::Sweep& sweep, const MeshBatch<T>& side, const E& executor) {
    add_pooled_sources(sweep, side);
    place_partials(sweep, side);
    executor.for_each(static_cast<int>(side.items.size()), [&](int number, int slot) {
      T* scratch = memory_.scratch.data() + index(slot) * scratch_stride_;
      for (int i = sweep.first_stage; i < sweep.first_stage + sweep.stage_count; ++i)
        run_stage(i, sweep, side, index(number), scratch,
                  {memory_.words.data() + index(slot) * packed_.operand_words(),
                   memory_.operands.data() + index(slot) * packed_.operand_values()});
    });
    for (int i = sweep.first_stage; i < sweep.first_stage + sweep.stage_count; ++i) merge(i, sweep, side);
  }

  /// Biases of this sweep's stages with the pooled sources' products, for every mesh.
  void add_pooled_sources(const graph::Sweep& sweep, const MeshBatch<T>& side) {
    std::size_t total = 0;
    for (int i = sweep.first_stage; i < sweep.first_stage + sweep.stage_count; ++i) {
      if (packed_.stage(i).pooled_columns == 0) continue;
      bias_offset_[index(i)] = total;
      total += side.instances.size() * bias_stride(i);
    }
    memory_.bias.grow_to(total + kernel::bias_slack);
    for (int i = sweep.first_stage; i < sweep.first_stage + sweep.stage_count; ++i)
      if (packed_.stage(i).pooled_columns != 0)
        for (int m = 0; m < static_cast<int>(side.instances.size()); ++m) add_pooled_sources(i, sweep, m);
  }

  /// Elements of a mesh's biases that hold pooled sources' products.
  std::size_t bias_stride(int i) const {
    return index(program_.stage(i).rows) * (packed_.parts() > 0 ? index(kernel::AmxWeights::bias_width) : 1);
  }

  void add_pooled_sources(int i, const graph::Sweep& sweep, int mesh) {
    const Stage& stage = program_.stage(i);
    const PackedStage<T>& packed = packed_.stage(i);
    T* NPT_RESTRICT bias = memory_.bias.data() + bias_offset_[index(i)] + index(mesh) * bias_stride(i);
    for (int r = 0; r < stage.rows; ++r) bias[r] = packed.own_bias(r);
    const T* NPT_RESTRICT weights = packed.pooled_weights.data();
    for (int s = 0; s < stage.source_count; ++s) {
      const graph::Source& source = stage.sources[index(s)];
      const Activation& activation = program_.activation(source.activation);
      if (activation.storage != Storage::pooled) continue;
      const T* values = values_of(source.activation).of(instance_for(activation, Item{mesh, 0, 0}, sweep.over_pose));
      for (int c = 0; c < source.channels; ++c, weights += stage.rows) {
        const T x = values[index(c) * kernel::panel_width<T>];
        for (int r = 0; r < stage.rows; ++r) bias[r] += weights[r] * x;
      }
    }
    if constexpr (std::is_same_v<T, float>)
      if (packed_.parts() > 0) kernel::spread_biases(bias, stage.rows);
  }

  /// Room for what each group contributes to moments and maxima.
  void place_partials(const graph::Sweep& sweep, const MeshBatch<T>& side) {
    std::size_t total = 0;
    const auto place = [&](std::size_t& offset, int channels) {
      offset = total;
      total += side.items.size() * index(channels);
    };
    for (int i = sweep.first_stage; i < sweep.first_stage + sweep.stage_count; ++i) {
      const Stage& stage = program_.stage(i);
      Partial& partial = partial_[index(i)];
      if (program_.activation(stage.output).moments) {
        place(partial.mean, stage.rows);
        place(partial.squares, stage.rows);
      }
      if (stage.gathers_maxima) place(partial.maximum, stage.rows);
    }
    memory_.partial.grow_to(total);
  }

  // ---- one stage of one group ----

  using Args = std::array<kernel::PointwiseArgs<T>, graph::max_chain>;

  /// What the steps of a chain read when it is applied to (a part of) activation t.
  Args arguments(const graph::Chain& chain, int t, const Item& item, std::size_t number, bool over_pose, T* scratch) {
    Args args;
    for (int c = 0; c < chain.count; ++c) {
      const graph::Step& step = chain.steps[index(c)];
      kernel::PointwiseArgs<T>& a = args[index(c)];
      for (std::size_t k = 0; k < step.parameters.size(); ++k)
        if (step.parameters[k] >= 0) a.parameters[k] = packed_.pointwise_parameters() + step.parameters[k];
      if (step.normalises) {
        const Activation& activation = program_.activation(t);
        a.mean = values_of(t).of(instance_for(activation, item, over_pose));
        a.inverse_deviation = a.mean + activation.channels;
      }
      if (step.other >= 0) {
        a.other = tile(step.other, item, number, over_pose, scratch);
        a.other_channels = program_.activation(step.other).channels;
      }
    }
    return args;
  }

  /// Runs the sources through their chains into the operand tile, or finds the tile that already is the operand.
  const T* operand(const Stage& stage, const Item& item, std::size_t number, bool over_pose, T* scratch, int steps) {
    if (stage.direct) return tile(stage.sources[0].activation, item, number, over_pose, scratch);
    T* packed = scratch + scratch_offset_[index(stage.operand_scratch)];
    T* to = packed;
    for (int s = 0; s < stage.source_count; ++s) {
      const graph::Source& source = stage.sources[index(s)];
      if (program_.activation(source.activation).storage == Storage::pooled) continue;
      const Args args = arguments(source.chain, source.activation, item, number, over_pose, scratch);
      transforms_.prologue[index(source.chain.signature)](
          {.from = tile(source.activation, item, number, over_pose, scratch),
           .to = to,
           .from_stride = kernel::panel_stride<T>(source.channels),
           .to_stride = kernel::panel_stride<T>(steps),
           .first_panel = 0,
           .panels = kernel::used_panels<T>(item.valid),
           .first_channel = 0,
           .rows = source.channels,
           .args = args.data()});
      to += index(packed_.steps(source.channels)) * kernel::panel_width<T>;
    }
    return packed;
  }

  /// Panel p of the operand for matrix registers, in the memory of panel `place`.
  kernel::AmxOperand split_operand(int i, const Item& item, std::size_t number, bool over_pose, T* scratch,
                                   const Operands& memory, int p, int place) {
    const Stage& stage = program_.stage(i);
    const kernel::AmxWeights& weights = packed_.stage(i).amx_weights;
    kernel::Word* words = memory.words + weights.panel_words() * index(place);
    const int valid = item.valid - p * kernel::panel_width<T>;
    if (stage.direct) {
      const T* source = tile(stage.sources[0].activation, item, number, over_pose, scratch);
      return kernel::split_panel(weights, source + kernel::panel_stride<T>(weights.columns()) * index(p), valid, words);
    }
    T* values = memory.values + kernel::panel_stride<T>(weights.value_rows()) * index(place);
    const auto row = [&](int column) { return values + index(weights.value_row(column)) * kernel::panel_width<T>; };
    int column = 0;
    for (int s = 0; s < stage.source_count; ++s) {
      const graph::Source& source = stage.sources[index(s)];
      if (program_.activation(source.activation).storage == Storage::pooled) continue;
      if (column % 2 != 0) std::fill_n(row(column++), kernel::panel_width<T>, T(0));  // words hold pairs of one source
      const Args args = arguments(source.chain, source.activation, item, number, over_pose, scratch);
      const T* panel = tile(source.activation, item, number, over_pose, scratch) +
                       kernel::panel_stride<T>(source.channels) * index(p);
      for (int c = 0, rows = 0; c < source.channels; c += rows, column += rows) {
        const bool split = column < weights.word_columns();
        rows = std::min(source.channels - c, split ? weights.word_columns() - column : source.channels);
        rows = std::min(rows, kernel::AmxWeights::value_strip);
        transforms_.prologue[index(source.chain.signature)]({.from = panel + index(c) * kernel::panel_width<T>,
                                                             .to = row(column),
                                                             .from_stride = 0,
                                                             .to_stride = 0,
                                                             .first_panel = p,
                                                             .panels = 1,
                                                             .first_channel = c,
                                                             .rows = rows,
                                                             .args = args.data()});
        if (split) kernel::split_channels(row(column), rows, weights.parts(), words, column / 2);
      }
    }
    kernel::end_channels(words, (std::min(column, weights.word_columns()) + 1) / 2, weights.parts());
    return {words, values, row(weights.word_columns()), kernel::used_halves(valid)};
  }

  void run_stage(int i, const graph::Sweep& sweep, const MeshBatch<T>& side, std::size_t number, T* scratch,
                 const Operands& memory) {
    const Stage& stage = program_.stage(i);
    const Item& item = side.items[number];
    if constexpr (std::is_same_v<T, float>) {
      if (packed_.parts() > 0) {
        const kernel::AmxWeights& weights = packed_.stage(i).amx_weights;
        [[maybe_unused]] const simd::MatrixRegisters registers;
        const bool by_panel =
            weights.panel_by_panel() && !overwrites_sources(stage, item, number, sweep.over_pose, scratch);
        std::array<kernel::AmxOperand, index(kernel::group_panels<T>)> operands{};
        multiply(
            i, sweep, side, number, scratch, weights, weights.bias(), by_panel,
            [&](int panel) {
              operands[index(panel)] =
                  split_operand(i, item, number, sweep.over_pose, scratch, memory, panel, by_panel ? 0 : panel);
            },
            [&](int block, int panel, const T* bias, T* to) {
              weights.multiply(block, operands[index(panel)], bias, to);
            });
        return;
      }
    }
    const kernel::PackedWeights<T>& weights = packed_.stage(i).weights;
    const int steps = weights.k_count();
    const T* operand_tile = operand(stage, item, number, sweep.over_pose, scratch, steps);
    multiply(
        i, sweep, side, number, scratch, weights, weights.bias(), false, [](int) {},
        [&](int block, int panel, const T* bias, T* to) {
          micro_kernel(weights.rows(block))(steps, weights.block(block),
                                            operand_tile + kernel::panel_stride<T>(steps) * index(panel), bias, to);
        });
  }

  /// Whether the output's tile lies where a narrower one does that the prologue reads: its first panel then covers others of
  /// that tile.
  bool overwrites_sources(const Stage& stage, const Item& item, std::size_t number, bool over_pose, T* scratch) {
    const T* out = output_tile(stage.output, number, scratch);
    const auto overwrites = [&](int t) {
      const Activation& activation = program_.activation(t);
      return activation.storage != Storage::pooled && activation.channels < stage.rows &&
             tile(t, item, number, over_pose, scratch) == out;
    };
    for (int s = 0; s < stage.source_count; ++s) {
      const graph::Source& source = stage.sources[index(s)];
      if (overwrites(source.activation)) return true;
      for (int c = 0; c < source.chain.count; ++c) {
        const int other = source.chain.steps[index(c)].other;
        if (other >= 0 && overwrites(other)) return true;
      }
    }
    return false;
  }

  /// The product and what follows it. make_operand(panel) comes first for each panel; product(block, panel, bias, to) computes a block's rows of
  /// one. `by_panel`: see AmxWeights::panel_by_panel.
  template <class Weights, class MakeOperand, class Product>
  void multiply(int i, const graph::Sweep& sweep, const MeshBatch<T>& side, std::size_t number, T* scratch,
                const Weights& weights, const T* own_bias, bool by_panel, MakeOperand&& make_operand,
                Product&& product) {
    const Stage& stage = program_.stage(i);
    const Item& item = side.items[number];
    const int panels = kernel::used_panels<T>(item.valid);
    const Args args = arguments(stage.epilogue, stage.output, item, number, sweep.over_pose, scratch);
    T* out = output_tile(stage.output, number, scratch);
    const std::size_t out_stride = kernel::panel_stride<T>(stage.rows);
    const T* bias = packed_.stage(i).pooled_columns == 0
                        ? own_bias
                        : memory_.bias.data() + bias_offset_[index(i)] + index(item.instance) * bias_stride(i);
    const kernel::RowTransform<T> transform = transforms_.epilogue[index(stage.epilogue.signature)];
    alignas(simd_alignment) T raw[index(Weights::tallest_block) * kernel::panel_width<T>];

    const auto compute = [&](int b, int p) {
      const int row = weights.first_row(b);
      const bool in_place = stage.epilogue.count == 0 && weights.writes_exactly(b);
      T* to = out + out_stride * index(p) + index(row) * kernel::panel_width<T>;
      product(b, p, Weights::bias_at(bias, row), in_place ? to : raw);
      if (!in_place)
        transform({.from = raw,
                   .to = to,
                   .from_stride = 0,
                   .to_stride = 0,
                   .first_panel = p,
                   .panels = 1,
                   .first_channel = row,
                   .rows = weights.rows(b),
                   .args = args.data()});
    };
    for (int p = 0; p < panels; ++p) {
      make_operand(p);
      for (int b = 0; by_panel && b < weights.block_count(); ++b) compute(b, p);
    }
    for (int b = 0; b < weights.block_count(); ++b) {
      for (int p = 0; !by_panel && p < panels; ++p) compute(b, p);
      const int row = weights.first_row(b);
      gather(i, number, item.valid, row, weights.rows(b), out + index(row) * kernel::panel_width<T>, out_stride);
    }
    if (stage.output == program_.output) {
      T* result = side.instances[index(item.instance)].result.data();
      kernel::join_coordinates(out, item.valid, result + 3 * index(item.group) * kernel::group_width);
    }
  }

  kernel::MicroKernel<T> micro_kernel(int rows) const {
    if constexpr (std::is_same_v<T, float>)
      if (packed_.precision() == Precision::bf16)
        return kernel::micro_kernels<T, kernel::Product::bf16_pairs>[index(rows)];
    return kernel::micro_kernels<T>[index(rows)];
  }

  void gather(int i, std::size_t number, int valid, int row, int rows, const T* values, std::size_t stride) {
    const Stage& stage = program_.stage(i);
    const Partial& partial = partial_[index(i)];
    const std::size_t at = number * index(stage.rows) + index(row);
    T* partials = memory_.partial.data();
    if (program_.activation(stage.output).moments)
      kernel::gather_moments(values, stride, valid, rows, partials + partial.mean + at,
                             partials + partial.squares + at);
    if (stage.gathers_maxima) kernel::gather_maxima(values, stride, valid, rows, partials + partial.maximum + at);
  }

  // ---- the barrier ----

  void merge(int i, const graph::Sweep& sweep, const MeshBatch<T>& side) {
    const Stage& stage = program_.stage(i);
    const Partial& partial = partial_[index(i)];
    if (program_.activation(stage.output).moments) {
      for (int m = 0; m < static_cast<int>(side.instances.size()); ++m) {
        const Instance<T>& mesh = side.instances[index(m)];
        const std::size_t first = index(mesh.first_item) * index(stage.rows);
        T* mean = own_values_of(stage.output).of(m);
        kernel::merge_moments(memory_.partial.data() + partial.mean + first,
                              memory_.partial.data() + partial.squares + first, mesh.vertices, stage.rows,
                              memory_.sums.data(), mean, mean + stage.rows);
      }
    }
    if (stage.gathers_maxima)
      for (int t = 0; t < program_.activation_count; ++t)
        if (program_.activation(t).pooled_from == stage.output)
          for (int m = 0; m < static_cast<int>(side.instances.size()); ++m) pool(t, m, partial, sweep, side);
  }

  /// The groups' maxima merged, then the layers that stand between convolution and max_pool.
  void pool(int t, int m, const Partial& partial, const graph::Sweep& sweep, const MeshBatch<T>& side) {
    const Activation& activation = program_.activation(t);
    const Instance<T>& mesh = side.instances[index(m)];
    T* pooled = own_values_of(t).of(m);  // a tile of one panel, of which only the first lane counts
    const T* maxima = memory_.partial.data() + partial.maximum + index(mesh.first_item) * index(activation.channels);
    for (int c = 0; c < activation.channels; ++c) {
      T best = maxima[c];
      for (int g = 1; g < kernel::group_count(mesh.vertices); ++g)
        best = kernel::larger_or_nan(best, maxima[index(g) * index(activation.channels) + index(c)]);
      pooled[index(c) * kernel::panel_width<T>] = best;
    }
    const Args args = arguments(activation.chain, activation.pooled_from, Item{m, 0, 0}, 0, sweep.over_pose, nullptr);
    transforms_.epilogue[index(activation.chain.signature)]({.from = pooled,
                                                             .to = pooled,
                                                             .from_stride = 0,
                                                             .to_stride = 0,
                                                             .first_panel = 0,
                                                             .panels = 1,
                                                             .first_channel = 0,
                                                             .rows = activation.channels,
                                                             .args = args.data()});
  }

  const PackedProgram<T>& packed_;
  const graph::Program& program_;
  RowTransforms<T> transforms_;
  WorkspaceStorage<T>& memory_;
  const CodeStorage<T>* code_ = nullptr;
  CodeStorage<T>* own_code_ = nullptr;  ///< the code, if it may be written
  std::array<T*, graph::max_buffers> buffer_{};
  std::array<std::size_t, graph::max_buffers> buffer_stride_{};
  std::array<std::size_t, graph::max_stages> scratch_offset_{};
  std::array<std::size_t, graph::max_stages> bias_offset_{};
  std::array<Partial, graph::max_stages> partial_{};
  std::size_t scratch_stride_ = 0;
};

}  // namespace npt::inline NPT_ABI::engine
