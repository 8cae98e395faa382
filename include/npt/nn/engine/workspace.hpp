/// The memory of a running network. It only ever grows, so that a warm call allocates nothing.
#pragma once

#include <npt/base/aligned.hpp>
#include <npt/config.hpp>
#include <npt/nn/graph/graph.hpp>
#include <npt/nn/graph/program.hpp>
#include <npt/nn/kernel/amx_kernel.hpp>
#include <npt/nn/kernel/panel.hpp>

#include <array>
#include <cstddef>
#include <vector>

namespace npt::inline NPT_ABI::engine {

/// The vertices of one side of a call: those of its encoded input, or those of the result.
template <class T>
struct BatchMesh {
  std::array<const T*, static_cast<std::size_t>(graph::max_inputs)>
      inputs{};         ///< [V, channels]; null: of the other side
  T* result = nullptr;  ///< [V, 3]; null: of the other side
  int vertices = 0;
  int first_item = 0;  ///< number of its first group among all of its MeshBatch
  int code = 0;        ///< of the result's side: number of the encoded input that it takes
};

/// One group of one mesh: what a task works on.
struct Item {
  int mesh;
  int group;
  int valid;  ///< vertices in the group
};

/// One side of a batch's calls, and their groups of vertices.
template <class T>
struct MeshBatch {
  std::vector<BatchMesh<T>> meshes;
  std::vector<Item> items;

  void clear() {
    meshes.clear();
    items.clear();
  }
  void add(BatchMesh<T> mesh) {
    mesh.first_item = static_cast<int>(items.size());
    for (int g = 0; g < kernel::group_count(mesh.vertices); ++g) {
      const int before = g * kernel::group_width;
      const int rest = mesh.vertices - before;
      items.push_back({static_cast<int>(meshes.size()), g, rest < kernel::group_width ? rest : kernel::group_width});
    }
    meshes.push_back(mesh);
  }
  /// An input's numbers to tiles [items].
  void split(int input, int channels, AlignedBuffer<T>& tiles) const {
    tiles.grow_to(items.size() * kernel::tile_size(channels));
    for (std::size_t i = 0; i < items.size(); ++i) {
      const T* values =
          meshes[static_cast<std::size_t>(items[i].mesh)].inputs[static_cast<std::size_t>(input)] +
          static_cast<std::size_t>(channels) * static_cast<std::size_t>(items[i].group) * kernel::group_width;
      kernel::split_vertices(values, channels, items[i].valid, tiles.data() + i * kernel::tile_size(channels));
    }
  }
};

/// Values that the stages of one side leave for each mesh: an activation's mean and 1 / deviation, or pooled maxima.
template <class T>
struct MeshValues {
  AlignedBuffer<T> values;
  std::size_t stride = 0;  ///< elements a mesh
  T* of(int mesh) { return values.data() + static_cast<std::size_t>(mesh) * stride; }
  const T* of(int mesh) const { return values.data() + static_cast<std::size_t>(mesh) * stride; }
};

/// What the encoder leaves for the decoder, of one or several meshes: feature maps, moments, pooled features.
template <class T>
struct CodeStorage {
  std::vector<int> first_item;                               ///< by mesh
  AlignedBuffer<T> input;                                    ///< [items] tiles of the encoded input
  std::array<AlignedBuffer<T>, graph::max_buffers> tiles;    ///< by code activation: [items] tiles
  std::array<MeshValues<T>, graph::max_activations> values;  ///< by activation

  std::size_t size() const {
    std::size_t n = input.size();
    for (const auto& b : tiles) n += b.size();
    for (const auto& v : values) n += v.values.size();
    return n;
  }
};

/// The memory of one call. Not for use by two calls at a time.
template <class T>
struct WorkspaceStorage {
  MeshBatch<T> encoded, main;  ///< the sides of the calls: encoded inputs, and all the rest
  CodeStorage<T> code;
  std::array<AlignedBuffer<T>, static_cast<std::size_t>(graph::max_inputs)>
      inputs;  ///< by input of the main side: [items] tiles
  std::array<AlignedBuffer<T>, graph::max_buffers> buffers;
  std::array<MeshValues<T>, graph::max_activations> values;  ///< by activation
  AlignedBuffer<T> partial;  ///< by group: means and squared differences, or maxima, of the running sweep's outputs
  AlignedBuffer<T> bias;     ///< by mesh: biases that hold a pooled source's share
  AlignedBuffer<T> scratch;  ///< [slots of the executor][scratch tiles of the program]
  AlignedBuffer<kernel::Word> words;  ///< [slots of the executor] operands on matrix registers
  AlignedBuffer<T> operands;          ///< [slots of the executor] what is kept of them in T
  AlignedBuffer<double> sums;         ///< for merging moments

  std::size_t bytes() const {
    std::size_t n = code.size() + partial.size() + bias.size() + scratch.size() + operands.size();
    for (const auto& b : inputs) n += b.size();
    for (const auto& b : buffers) n += b.size();
    for (const auto& v : values) n += v.values.size();
    return n * sizeof(T) + words.size() * sizeof(kernel::Word) + sums.size() * sizeof(double);
  }
};

template <class T, class Exec>
class Core;

}  // namespace npt::inline NPT_ABI::engine

namespace npt::inline NPT_ABI {

/// Scratch memory of an engine's call, for hosts that want to say where it lives. An engine keeps its own otherwise.
template <class T = float>
class Workspace {
 public:
  /// Bytes held.
  std::size_t bytes() const { return storage_.bytes(); }

 private:
  template <class, class>
  friend class engine::Core;
  engine::WorkspaceStorage<T> storage_;
};

}  // namespace npt::inline NPT_ABI
