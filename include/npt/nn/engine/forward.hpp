/// Interprets a packed program: the forward pass.
#pragma once

#include <npt/base/control.hpp>
#include <npt/base/executor.hpp>
#include <npt/config.hpp>
#include <npt/nn/engine/core_class.hpp>
#include <npt/nn/engine/packed_program.hpp>
#include <npt/nn/engine/view.hpp>
#include <npt/nn/engine/workspace.hpp>
#include <npt/nn/graph/lowering.hpp>
#include <npt/nn/kernel/moments.hpp>
#include <npt/nn/kernel/pointwise.hpp>
#include <npt/nn/kernel/product.hpp>

#include <algorithm>
#include <array>
#include <cstddef>

namespace npt::inline NPT_ABI::engine {

/// One pass over the meshes in `memory`. A short-lived object: it only holds references.
template <class T>
class Forward : View<T> {
 public:
  Forward(const PackedProgram<T>& packed, const RowTransforms<T>& transforms, WorkspaceStorage<T>& memory)
      : View<T>(packed, memory), transforms_(transforms) {}

  /// The encoder: memory.encoded to `code`.
  template <Executor E>
  void encode(CodeStorage<T>& code, const E& executor, const Control& control = {}) {
    this->use(code, &code);
    const MeshBatch<T>& batch = memory_.encoded;
    const int input = program_.inputs.encoded;
    batch.split(input, program_.inputs[input].channels, code.input);
    code.first_item.clear();
    for (const BatchMesh<T>& mesh : batch.meshes) code.first_item.push_back(mesh.first_item);
    this->prepare(batch, true, executor.slots());
    run_sweeps(0, program_.encoder_sweeps, batch, executor, control);
  }

  /// The decoder: `code` and memory.main to the results.
  template <Executor E>
  void decode(const CodeStorage<T>& code, const E& executor, const Control& control = {}) {
    this->use(code, nullptr);
    run_decoder(executor, control);
  }

  /// The decoder for a code that nobody reads afterwards and of which each call takes its own mesh, group by group:
  /// the code's memory becomes the first feature map.
  template <Executor E>
  void decode_and_consume(CodeStorage<T>& code, const E& executor) {
    this->use(code, program_.code_alias >= 0 ? &code : nullptr);
    run_decoder(executor, {});
  }

 private:
  using typename View<T>::Activation;
  using typename View<T>::Args;
  using typename View<T>::Stage;
  using typename View<T>::Storage;
  using View<T>::index;
  using View<T>::memory_;
  using View<T>::packed_;
  using View<T>::program_;

  struct Partial {
    std::size_t mean = 0, squares = 0, maximum = 0;  ///< offsets in memory_.partial of [items][rows]
  };

  template <Executor E>
  void run_decoder(const E& executor, const Control& control) {
    const MeshBatch<T>& batch = memory_.main;
    for (int i = 0; i < program_.inputs.count; ++i)
      if (i != program_.inputs.encoded) batch.split(i, program_.inputs[i].channels, memory_.inputs[index(i)]);
    this->prepare(batch, false, executor.slots());
    run_sweeps(program_.encoder_sweeps, program_.sweep_count, batch, executor, control);
  }

  template <Executor E>
  void run_sweeps(int first, int end, const MeshBatch<T>& batch, const E& executor, const Control& control) {
    for (int s = first; s < end; ++s) {
      control.step(static_cast<double>(s - first) / (end - first));
      run(program_.sweep(s), batch, executor);
    }
  }

  // ---- one sweep ----

  template <Executor E>
  void run(const graph::Sweep& sweep, const MeshBatch<T>& batch, const E& executor) {
    const int first = sweep.first_stage, end = first + sweep.stage_count;
    add_pooled_sources(sweep, batch);
    place_partials(sweep, batch);
    executor.for_each(static_cast<int>(batch.items.size()), [&](int number, int slot) {
      const Task<T> task = this->task(batch, sweep.encodes, number, slot);
      for (int i = first; i < end; ++i) run_stage(i, task);
    });
    for (int i = first; i < end; ++i) merge(i, batch, sweep.encodes);
  }

  /// Biases of this sweep's stages with the pooled sources' products, for every mesh.
  void add_pooled_sources(const graph::Sweep& sweep, const MeshBatch<T>& batch) {
    const int first = sweep.first_stage, end = first + sweep.stage_count;
    std::size_t total = 0;
    for (int i = first; i < end; ++i) {
      if (packed_.stage(i).pooled_columns == 0) continue;
      bias_offset_[index(i)] = total;
      total += batch.meshes.size() * bias_stride(i);
    }
    memory_.bias.grow_to(total + kernel::bias_slack);
    for (int i = first; i < end; ++i)
      if (packed_.stage(i).pooled_columns != 0)
        for (int m = 0; m < static_cast<int>(batch.meshes.size()); ++m) add_pooled_sources(i, m, sweep.encodes);
  }

  /// Elements of a mesh's biases that hold pooled sources' products.
  std::size_t bias_stride(int i) const {
    return index(program_.stage(i).rows) * index(packed_.stage(i).weights.bias_width());
  }
  T* mesh_biases(int i, int mesh) const {
    return memory_.bias.data() + bias_offset_[index(i)] + index(mesh) * bias_stride(i);
  }

  void add_pooled_sources(int i, int mesh, bool encodes) {
    const Stage& stage = program_.stage(i);
    const PackedStage<T>& packed = packed_.stage(i);
    T* NPT_RESTRICT bias = mesh_biases(i, mesh);
    for (int r = 0; r < stage.rows; ++r) bias[r] = packed.weights.bias(r);
    const T* NPT_RESTRICT weights = packed.pooled_weights.data();
    for (int s = 0; s < stage.source_count; ++s) {
      const graph::Source& source = stage.sources[index(s)];
      const Activation& activation = program_.activation(source.activation);
      if (activation.storage != Storage::pooled) continue;
      const T* values = this->values_of(source.activation).of(this->mesh_of(activation, mesh, encodes));
      for (int c = 0; c < source.channels; ++c, weights += stage.rows) {
        const T x = values[index(c) * kernel::panel_width<T>];
        for (int r = 0; r < stage.rows; ++r) bias[r] += weights[r] * x;
      }
    }
    packed.weights.lay_out_biases(bias, stage.rows);
  }

  /// Space for what each group contributes to moments and maxima.
  void place_partials(const graph::Sweep& sweep, const MeshBatch<T>& batch) {
    std::size_t total = 0;
    const auto place = [&](std::size_t& offset, int channels) {
      offset = total;
      total += batch.items.size() * index(channels);
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

  // ---- operands ----

  /// Runs the sources through their chains into the operand tile, or finds the tile that already is the operand.
  const T* operand(int i, const Task<T>& task) const {
    const Stage& stage = program_.stage(i);
    if (stage.direct) return this->tile(stage.sources[0].activation, task);
    T* operand = this->operand_tile(stage, task);
    T* to = operand;
    for (int s = 0; s < stage.source_count; ++s) {
      const graph::Source& source = stage.sources[index(s)];
      if (program_.activation(source.activation).storage == Storage::pooled) continue;
      const Args args = this->arguments(source.chain, source.activation, task);
      transforms_.prologue[index(source.chain.signature)](
          {.from = this->tile(source.activation, task),
           .to = to,
           .from_stride = kernel::panel_stride<T>(source.channels),
           .to_stride = kernel::panel_stride<T>(packed_.stage(i).weights.steps()),
           .first_panel = 0,
           .panels = kernel::used_panels<T>(task.item.valid),
           .first_channel = 0,
           .rows = source.channels,
           .args = args.data()});
      to += index(packed_.steps(source.channels)) * kernel::panel_width<T>;
    }
    return operand;
  }

  /// Panel p of the operand for matrix registers, in the memory of panel `place`.
  kernel::AmxOperand split_operand(int i, const Task<T>& task, int p, int place) const {
    const Stage& stage = program_.stage(i);
    const kernel::AmxWeights& weights = packed_.stage(i).weights.part_weights();
    kernel::Word* words = task.words + weights.panel_words() * index(place);
    const int valid = task.item.valid - p * kernel::panel_width<T>;
    if (stage.direct) {
      const T* source = this->tile(stage.sources[0].activation, task);
      return kernel::split_panel(weights, source + kernel::panel_stride<T>(weights.columns()) * index(p), valid, words);
    }
    T* values = task.values + kernel::panel_stride<T>(weights.value_rows()) * index(place);
    const auto row = [&](int column) { return values + index(weights.value_row(column)) * kernel::panel_width<T>; };
    int column = 0;
    for (int s = 0; s < stage.source_count; ++s) {
      const graph::Source& source = stage.sources[index(s)];
      if (program_.activation(source.activation).storage == Storage::pooled) continue;
      if (column % 2 != 0) std::fill_n(row(column++), kernel::panel_width<T>, T(0));  // words hold pairs of one source
      const Args args = this->arguments(source.chain, source.activation, task);
      const T* panel = this->tile(source.activation, task) + kernel::panel_stride<T>(source.channels) * index(p);
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

  /// Whether the output's tile lies where a narrower one does that the prologue reads: its first panel then covers
  /// others of that tile.
  bool overwrites_sources(const Stage& stage, const Task<T>& task) const {
    const T* out = this->output_tile(stage.output, task);
    bool overwrites = false;
    const auto check = [&](int t) {
      const Activation& activation = program_.activation(t);
      overwrites = overwrites || (activation.storage != Storage::pooled && activation.channels < stage.rows &&
                                  this->tile(t, task) == out);
    };
    for (int s = 0; s < stage.source_count; ++s) {
      check(stage.sources[index(s)].activation);
      graph::for_each_other(stage.sources[index(s)].chain, check);
    }
    return overwrites;
  }

  // ---- one stage of one group ----

  void run_stage(int i, const Task<T>& task) {
    const Stage& stage = program_.stage(i);
    const kernel::ProductWeights<T>& weights = packed_.stage(i).weights;
    [[maybe_unused]] const kernel::ProductScope scope(weights.format());
    kernel::GroupProduct<T> product(weights);
    if constexpr (kernel::ProductFormat::has_several_parts<T>) {
      if (weights.in_parts()) {
        const bool by_panel = weights.panel_by_panel() && !overwrites_sources(stage, task);
        multiply(i, task, product, by_panel,
                 [&](int p) { product.set_panel(p, split_operand(i, task, p, by_panel ? 0 : p)); });
        return;
      }
    }
    product.set_operand(operand(i, task));
    multiply(i, task, product, false, [](int) {});
  }

  /// The product and what follows it. make_panel(panel) comes first for each panel of the operand. `by_panel`: see
  /// AmxWeights::panel_by_panel.
  template <class MakePanel>
  void multiply(int i, const Task<T>& task, const kernel::GroupProduct<T>& product, bool by_panel,
                MakePanel&& make_panel) {
    const Stage& stage = program_.stage(i);
    const kernel::ProductWeights<T>& weights = packed_.stage(i).weights;
    const int panels = kernel::used_panels<T>(task.item.valid), blocks = weights.block_count();
    const Args args = this->arguments(stage.epilogue, stage.output, task);
    T* out = this->output_tile(stage.output, task);
    const std::size_t out_stride = kernel::panel_stride<T>(stage.rows);
    const T* bias = packed_.stage(i).pooled_columns == 0 ? weights.bias() : mesh_biases(i, task.item.mesh);
    const kernel::RowTransform<T> transform = transforms_.epilogue[index(stage.epilogue.signature)];
    alignas(simd_alignment) T raw[index(kernel::ProductWeights<T>::tallest_block) * kernel::panel_width<T>];

    const auto compute = [&](int b, int p) {
      const int row = weights.first_row(b);
      const bool in_place = stage.epilogue.count == 0 && weights.writes_exactly(b);
      T* to = out + out_stride * index(p) + index(row) * kernel::panel_width<T>;
      product.multiply(b, p, weights.bias_at(bias, row), in_place ? to : raw);
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
      make_panel(p);
      for (int b = 0; by_panel && b < blocks; ++b) compute(b, p);
    }
    for (int b = 0; b < blocks; ++b) {
      for (int p = 0; !by_panel && p < panels; ++p) compute(b, p);
      const int row = weights.first_row(b);
      gather(i, task, row, weights.rows(b), out + index(row) * kernel::panel_width<T>, out_stride);
    }
    if (stage.output == program_.output) {
      T* result = task.batch.meshes[index(task.item.mesh)].result;
      kernel::join_vertices(out, 3, task.item.valid, result + 3 * index(task.item.group) * kernel::group_width);
    }
  }

  void gather(int i, const Task<T>& task, int row, int rows, const T* values, std::size_t stride) {
    const Stage& stage = program_.stage(i);
    const Partial& partial = partial_[index(i)];
    const std::size_t at = task.number * index(stage.rows) + index(row);
    T* partials = memory_.partial.data();
    if (program_.activation(stage.output).moments)
      kernel::gather_moments(values, stride, task.item.valid, rows, partials + partial.mean + at,
                             partials + partial.squares + at);
    if (stage.gathers_maxima)
      kernel::gather_maxima(values, stride, task.item.valid, rows, partials + partial.maximum + at);
  }

  // ---- the barrier ----

  void merge(int i, const MeshBatch<T>& batch, bool encodes) {
    const Stage& stage = program_.stage(i);
    const Partial& partial = partial_[index(i)];
    const int count = static_cast<int>(batch.meshes.size());
    if (program_.activation(stage.output).moments) {
      for (int m = 0; m < count; ++m) {
        const BatchMesh<T>& mesh = batch.meshes[index(m)];
        const std::size_t first = index(mesh.first_item) * index(stage.rows);
        T* mean = this->own_values_of(stage.output).of(m);
        kernel::merge_moments(memory_.partial.data() + partial.mean + first,
                              memory_.partial.data() + partial.squares + first, mesh.vertices, stage.rows,
                              memory_.sums.data(), mean, mean + stage.rows);
      }
    }
    if (stage.gathers_maxima)
      for (int t = 0; t < program_.activation_count; ++t)
        if (program_.activation(t).pooled_from == stage.output)
          for (int m = 0; m < count; ++m) pool(t, partial.maximum, batch, m, encodes);
  }

  /// The groups' maxima merged, then the layers that stand between convolution and max_pool.
  void pool(int t, std::size_t maxima_offset, const MeshBatch<T>& batch, int m, bool encodes) {
    const Activation& activation = program_.activation(t);
    const BatchMesh<T>& mesh = batch.meshes[index(m)];
    T* pooled = this->own_values_of(t).of(m);  // a tile of one panel, of which only the first lane counts
    const T* maxima = memory_.partial.data() + maxima_offset + index(mesh.first_item) * index(activation.channels);
    for (int c = 0; c < activation.channels; ++c) {
      T best = maxima[c];
      for (int g = 1; g < kernel::group_count(mesh.vertices); ++g)
        best = kernel::larger_or_nan(best, maxima[index(g) * index(activation.channels) + index(c)]);
      pooled[index(c) * kernel::panel_width<T>] = best;
    }
    const Args args = this->arguments(activation.chain, activation.pooled_from,
                                      {.batch = batch, .encodes = encodes, .number = 0, .item = {m, 0, 0}});
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

  RowTransforms<T> transforms_;
  std::array<std::size_t, graph::max_stages> bias_offset_{};
  std::array<Partial, graph::max_stages> partial_{};
};

}  // namespace npt::inline NPT_ABI::engine
