/// What is merged between the stages of a backward pass: sums over the vertices, maxima, and the chunks' sums.
#pragma once

#include <npt/base/executor.hpp>
#include <npt/config.hpp>
#include <npt/nn/kernel/panel.hpp>
#include <npt/nn/tape/amx_outer_product.hpp>
#include <npt/nn/tape/chain_backward.hpp>
#include <npt/nn/tape/view.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI::tape {

/// What a backward pass starts from and where it leaves its results.
template <class T>
struct BatchGradients {
  std::span<const std::span<const T>> result;  ///< by call: [V, 3]
  std::span<T> parameters;                     ///< as Model::buffer(), overwritten
  /// By input and call: [V, channels], overwritten; empty: not asked for.
  std::array<std::span<const std::span<T>>, static_cast<std::size_t>(graph::max_inputs)> inputs{};
};

/// The barriers of Backward (nn/tape/backward.hpp). Everything is added up in an order that the shapes alone say.
template <class T>
class Merge : protected View<T> {
 protected:
  Merge(const Tape& tape, std::span<const ChainLoops<T>> loops, Memory<T>& memory, const BatchGradients<T>& gradients)
      : View<T>(tape, loops, memory), gradients_(gradients) {}

  using typename View<T>::Args;
  using View<T>::index;
  using View<T>::slack;
  using View<T>::tape_;
  using View<T>::memory_;

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

  /// Where a chunk keeps its sums.
  struct ChunkLayout {
    std::size_t size = 0;
    std::array<std::size_t, max_paths> paths{};
    std::array<std::size_t, max_adjoints> adjoints{};
    int count = 0;  ///< of chunks
    int items = 0;  ///< in each but the last
  };

  T* norm_gradient(int p, int mesh) const {
    return memory_.norm_gradients[index(p)].data() +
           index(mesh) * 2 * index(tape_.activation(tape_.adjoint(p).activation).channels);
  }

  /// The two means of an adjoint's gradients that its norm's derivative needs, and the gradients that maxima leave
  /// there.
  template <Executor E>
  void merge_adjoint(int p, const engine::MeshBatch<T>& batch, const E& executor) {
    const Adjoint& adjoint = tape_.adjoint(p);
    const int channels = tape_.activation(adjoint.activation).channels;
    if (adjoint.normalises)
      executor.for_each(static_cast<int>(batch.meshes.size()), [&](int mesh, int) {
        const engine::BatchMesh<T>& instance = batch.meshes[index(mesh)];
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
      for (int mesh = 0; mesh < static_cast<int>(batch.meshes.size()); ++mesh) take_through_pool(t, p, mesh);
    });
    if (adjoint.normalises)
      for (int mesh = 0; mesh < static_cast<int>(batch.meshes.size()); ++mesh) {
        const T share = T(1) / static_cast<T>(batch.meshes[index(mesh)].vertices);
        T* means = norm_gradient(p, mesh);
        for (int k = 0; k < 2 * channels; ++k) means[k] *= share;
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

  /// The gradients of pooled features and of the weights that they meet.
  template <Executor E>
  void take_to_pooled(const Stage& stage, const engine::MeshBatch<T>& batch, const E& executor) {
    const std::size_t count = batch.meshes.size();
    memory_.mesh_bias.grow_to(count * index(stage.rows));
    executor.for_each(static_cast<int>(count), [&](int mesh, int) {
      const engine::BatchMesh<T>& instance = batch.meshes[index(mesh)];
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
        for (int mesh = 0; mesh < static_cast<int>(count); ++mesh) {
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

  const BatchGradients<T>& gradients_;

 private:
  void take_through_pool(int t, int p, int mesh) {
    const Activation& activation = tape_.activation(t);
    const ChainLoops<T>& loops = this->loops(activation.chain);
    const Args args = this->arguments(activation.chain, activation.adjoint, this->mesh_task(mesh, activation.encoded));
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
        const bool by_channel = step.per_channel[k];
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
};

}  // namespace npt::inline NPT_ABI::tape
