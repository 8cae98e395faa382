/// The memory of a running network. It only ever grows, so that a warm call allocates nothing.
#pragma once

#include <npt/base/aligned.hpp>
#include <npt/config.hpp>
#include <npt/nn/graph/program.hpp>
#include <npt/nn/kernel/amx_kernel.hpp>
#include <npt/nn/kernel/panel.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI::engine {

/// One mesh of a batch: a pose or an identity.
template <class T>
struct BatchMesh {
  std::span<const T> coordinates;  ///< [V, 3]
  std::span<T> result;             ///< [V, 3], identities only
  int vertices = 0;
  int first_item = 0;  ///< number of its first group among all of its MeshBatch
  int code = 0;        ///< identities: the pose that it takes
};

/// One group of one mesh: what a task works on.
struct Item {
  int mesh;
  int group;
  int valid;  ///< vertices in the group
};

/// The poses of a batch, or its identities, and their groups of vertices.
template <class T>
struct MeshBatch {
  std::vector<BatchMesh<T>> meshes;
  std::vector<Item> items;

  void clear() {
    meshes.clear();
    items.clear();
  }
  void add(BatchMesh<T> mesh) {
    mesh.vertices = static_cast<int>(mesh.coordinates.size() / 3);
    mesh.first_item = static_cast<int>(items.size());
    for (int g = 0; g < kernel::group_count(mesh.vertices); ++g) {
      const int before = g * kernel::group_width;
      const int rest = mesh.vertices - before;
      items.push_back({static_cast<int>(meshes.size()), g, rest < kernel::group_width ? rest : kernel::group_width});
    }
    meshes.push_back(mesh);
  }
  /// Coordinates to tiles [items].
  void split(AlignedBuffer<T>& tiles) const {
    tiles.grow_to(items.size() * kernel::tile_size(3));
    for (std::size_t i = 0; i < items.size(); ++i) {
      const T* xyz = meshes[static_cast<std::size_t>(items[i].mesh)].coordinates.data() +
                     3 * static_cast<std::size_t>(items[i].group) * kernel::group_width;
      kernel::split_coordinates(xyz, items[i].valid, tiles.data() + i * kernel::tile_size(3));
    }
  }
};

/// Values that the stages of one side leave for each mesh: an activation's mean and 1 / deviation, or its pooled
/// maxima.
template <class T>
struct MeshValues {
  AlignedBuffer<T> values;
  std::size_t stride = 0;  ///< elements a mesh
  T* of(int mesh) { return values.data() + static_cast<std::size_t>(mesh) * stride; }
  const T* of(int mesh) const { return values.data() + static_cast<std::size_t>(mesh) * stride; }
};

/// What the encoder leaves for the decoder, for one or several poses: feature maps, moments, pooled features.
template <class T>
struct CodeStorage {
  std::vector<int> first_item;                               ///< by pose
  AlignedBuffer<T> coordinates;                              ///< [items] coordinate tiles
  std::array<AlignedBuffer<T>, graph::max_buffers> tiles;    ///< by code activation: [items] tiles
  std::array<MeshValues<T>, graph::max_activations> values;  ///< by activation

  std::size_t size() const {
    std::size_t n = coordinates.size();
    for (const auto& b : tiles) n += b.size();
    for (const auto& v : values) n += v.values.size();
    return n;
  }
};

/// The memory of one call. Not for use by two calls at a time.
template <class T>
struct WorkspaceStorage {
  MeshBatch<T> pose, identity;
  CodeStorage<T> code;
  AlignedBuffer<T> identity_coordinates;  ///< [items] coordinate tiles
  std::array<AlignedBuffer<T>, graph::max_buffers> buffers;
  std::array<MeshValues<T>, graph::max_activations> values;  ///< by activation
  AlignedBuffer<T> partial;  ///< by group: means and squared differences, or maxima, of the running sweep's outputs
  AlignedBuffer<T> bias;     ///< by mesh: biases that hold a pooled source's share
  AlignedBuffer<T> scratch;  ///< [slots of the executor][scratch tiles of the program]
  AlignedBuffer<kernel::Word> words;  ///< [slots of the executor] operands on matrix registers
  AlignedBuffer<T> operands;          ///< [slots of the executor] what is kept of them in T
  AlignedBuffer<double> sums;         ///< for merging moments

  std::size_t bytes() const {
    std::size_t n =
        code.size() + identity_coordinates.size() + partial.size() + bias.size() + scratch.size() + operands.size();
    for (const auto& b : buffers) n += b.size();
    for (const auto& v : values) n += v.values.size();
    return n * sizeof(T) + words.size() * sizeof(kernel::Word) + sums.size() * sizeof(double);
  }
};

template <class T, class Exec>
class Core;

}  // namespace npt::inline NPT_ABI::engine

namespace npt::inline NPT_ABI {

/// An encoded pose, to be given to many identities. Belongs to the engine that made it, as long as that lives: the
/// engine may be moved, and every other one refuses the code.
template <class T = float>
class PoseCode {
 public:
  /// Vertices of the pose mesh; 0: nothing encoded yet.
  int vertices() const { return vertices_; }

 private:
  template <class, class>
  friend class engine::Core;
  int vertices_ = 0;
  std::uint64_t program_ = 0;  ///< PackedProgram::id of the engine that made it
  engine::CodeStorage<T> storage_;
};

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
