/// A scene as glTF describes one: nodes, meshes, skins, morph targets, clips. pose.hpp makes one npt::Mesh of it;
/// from_mesh.hpp makes a scene of a mesh.
/// Numbers are glTF's: metres, y up, seconds.
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/quaternion.hpp>
#include <npt/base/vec3.hpp>
#include <npt/config.hpp>
#include <npt/mesh/appearance.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/scene/clip.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace npt::inline NPT_ABI {

/// Marks what isn't there: a parent, a mesh, a skin, a material.
inline constexpr std::size_t no_item = static_cast<std::size_t>(-1);

/// Where a node stands in its parent.
struct NodePlace {
  Vec3d translation{};
  Quaternion rotation{};
  Vec3d scale{1, 1, 1};

  Affine affine() const {
    Matrix3 linear = matrix_of(rotation);
    for (Vec3d& row : linear.rows) row = {row.x * scale.x, row.y * scale.y, row.z * scale.z};
    return {linear, translation};
  }
};

struct SceneNode {
  std::string name{};
  std::size_t parent = no_item;
  NodePlace place{};
  std::optional<Affine> matrix{};  ///< instead of `place`; such a node is not animated
  std::size_t mesh = no_item, skin = no_item;
  std::vector<double> weights{};  ///< of its mesh's morph targets; empty: the mesh's own
  std::string bone{};             ///< what a VRM file calls it: "leftUpperArm"; empty: nothing
};

/// How far a morph target takes each vertex. normals: [V] or empty
struct MorphTarget {
  std::vector<Vec3f> positions{}, normals{};
};

/// Numbers at vertices that npt doesn't know the meaning of, and further colours: kept as they are.
struct VertexAttribute {
  std::string name{};           ///< as glTF names it: "_NAME", "COLOR_1"
  std::size_t width = 1;        ///< numbers a vertex: 1 to 4
  std::vector<float> values{};  ///< [V, width]
};

/// Whether an attribute is one of those: a name of somebody's own begins with "_".
inline bool is_other_attribute(std::string_view name) {
  const bool word = std::all_of(name.begin(), name.end(), [](char c) { return c > ' ' && c < '\x7F'; });
  return word && (name.starts_with('_') ||
                  (name.size() == 7 && name.starts_with("COLOR_") && name[6] >= '1' && name[6] <= '9'));
}

/// Vertices with all that belongs to them. [V] or empty, but for positions
struct VertexBlock {
  std::vector<Vec3f> positions{}, normals{};
  std::vector<std::vector<std::array<float, 2>>> texcoords{};  ///< by set; v counts from the image's top
  std::vector<std::array<float, 4>> colours{};
  bool with_alpha = false;
  std::size_t influences = 0;           ///< joints a vertex: 0, 4, 8, ...
  std::vector<std::uint16_t> joints{};  ///< [V, influences] numbers in the skin
  std::vector<float> weights{};         ///< [V, influences] not negative, each row sums to 1
  std::vector<MorphTarget> targets{};   ///< as many in each block of a mesh
  std::vector<VertexAttribute> others{};
};

/// Faces of one material, or points where there are none. Corners are vertices of a block.
struct ScenePrimitive {
  std::size_t block = 0, material = no_item;
  std::vector<Triangle> triangles{};
};

struct SceneMesh {
  std::string name{};
  std::vector<VertexBlock> blocks{};
  std::vector<ScenePrimitive> primitives{};
  std::vector<double> weights{};  ///< of the morph targets: one for each
};

struct Skin {
  std::string name{};
  std::vector<std::size_t> joints{};    ///< nodes
  std::vector<Affine> inverse_binds{};  ///< [joints] from the mesh to the joint's own coordinates
};

/// Nodes, meshes, skins and clips of a glTF file have the file's own numbers.
/// Invariants (checked by the reader): parents, meshes, skins, joints and nodes of channels are there; parents form no
/// circle; all numbers are finite.
struct Scene {
  std::vector<SceneNode> nodes{};
  std::vector<std::size_t> shown{};  ///< nodes with a mesh, in the order in which the scene names them
  std::vector<SceneMesh> meshes{};
  std::vector<Skin> skins{};
  std::vector<Clip> clips{};
  std::shared_ptr<const Appearance> appearance{};
};

}  // namespace npt::inline NPT_ABI
