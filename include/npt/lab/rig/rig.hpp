/// A rigged character, ready to be posed: the joints of a scene's skins as one tree, all skinned surfaces in one bind
/// pose, their skin weights, and what is attached to a joint without a skin (a weapon, a hat).
///   const Rig rig = make_rig(read_scene("knight.glb"), "knight.glb");
///   RigMotion now = rig.motions(&rig.scene.clips[0], 0.5);
/// Shapes    binds, worlds, motions: [J]; positions: [V]; weights: [V, J], each row sums to 1
/// Numerics  a joint's motion takes the bind pose to the scene's coordinates; morph targets are left out
/// Errors    npt::Error for scenes without a skinned mesh, joints that have no inverse bind matrix that can be undone,
///           and surfaces without a triangle
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/error.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/sparse_matrix.hpp>
#include <npt/config.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/scene/clip.hpp>
#include <npt/scene/pose.hpp>
#include <npt/scene/scene.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

struct Rig {
  std::string name;                  ///< of the file, for messages
  Scene scene;                       ///< what it was made of; its clips
  std::vector<std::size_t> joints;   ///< [J] nodes, parents before children
  std::vector<std::size_t> parents;  ///< [J] the nearest joint above, or no_item
  std::vector<Affine> binds;         ///< [J] from the joint's coordinates to those of the bind pose
  std::vector<Vec3f> positions;      ///< [V] in the bind pose
  std::vector<Triangle> triangles;
  SparseMatrix weights;
  std::vector<bool> hangs;  ///< [V] belongs to a mesh without a skin, which moves with one joint

  std::size_t joint_count() const noexcept { return joints.size(); }
  const std::string& joint_name(std::size_t j) const { return scene.nodes[joints[j]].name; }
  Vec3d joint_place(std::size_t j) const { return binds[j].shift; }

  /// [J] from the bind pose to the scene at a time of a clip; nullptr: as it stands.
  std::vector<Affine> motions(const Clip* clip, double time) const {
    const ScenePose now = ScenePoser(scene, name).pose(clip, time);
    std::vector<Affine> result;
    result.reserve(joints.size());
    for (std::size_t j = 0; j < joints.size(); ++j) result.push_back(now.worlds[joints[j]] * inverse(binds[j]));
    return result;
  }
  /// [V, 3] in the scene.
  std::vector<float> posed(std::span<const Affine> by) const {
    std::vector<float> xyz;
    xyz.reserve(3 * positions.size());
    for (std::size_t v = 0; v < positions.size(); ++v) {
      Vec3d at;
      for (std::size_t i = weights.start[v]; i < weights.start[v + 1]; ++i)
        at += by[weights.column[i]](positions[v].as<double>()) * static_cast<double>(weights.value[i]);
      for (const double x : {at.x, at.y, at.z}) xyz.push_back(static_cast<float>(x));
    }
    return xyz;
  }
};

namespace rig::internal {

/// Of a file without its folder and extension.
inline std::string stem(const std::string& file) {
  const std::string name = file.substr(file.find_last_of("/\\") + 1);
  return name.substr(0, name.rfind('.'));
}

class RigMaker {
 public:
  RigMaker(Scene scene, std::string name) {
    rig_.name = std::move(name);
    rig_.scene = std::move(scene);
  }

  Rig make() {
    find_joints();
    const ScenePoser poser(rig_.scene, rig_.name);
    stands_ = poser.pose().worlds;
    for (const std::size_t n : rig_.scene.shown) add_mesh(n);
    rig_.weights.columns = rig_.joint_count();
    if (rig_.triangles.empty()) fail("", "no triangle on a skin", "a surface that joints move");
    return std::move(rig_);
  }

 private:
  [[noreturn]] void fail(std::string place, std::string found, std::string expected) const {
    throw Error({rig_.name, std::move(place), std::move(found), std::move(expected)});
  }

  /// All skins' joints, parents before children; the first skin that has a joint says where it is bound.
  void find_joints() {
    const Scene& scene = rig_.scene;
    bool used = false;
    for (const std::size_t n : scene.shown) used = used || scene.nodes[n].skin != no_item;
    if (!used)
      fail("", scene.skins.empty() ? "no skin" : "no mesh with a skin",
           "a rigged character: a mesh whose vertices have joints and weights");
    std::vector<bool> is_joint(scene.nodes.size());
    for (const Skin& skin : scene.skins)
      for (const std::size_t n : skin.joints) is_joint[n] = true;
    number_.assign(scene.nodes.size(), no_item);
    const auto add = [&](auto&& self, std::size_t n) -> void {
      if (number_[n] != no_item) return;
      std::size_t above = scene.nodes[n].parent;
      while (above != no_item && !is_joint[above]) above = scene.nodes[above].parent;
      if (above != no_item) self(self, above);
      number_[n] = rig_.joints.size();
      rig_.joints.push_back(n);
      rig_.parents.push_back(above == no_item ? no_item : number_[above]);
    };
    for (std::size_t n = 0; n < scene.nodes.size(); ++n)
      if (is_joint[n]) add(add, n);
    rig_.binds.resize(rig_.joints.size());
    bound_.assign(rig_.joints.size(), false);
    spaces_.assign(scene.skins.size(), Affine{});
    for (std::size_t s = 0; s < scene.skins.size(); ++s) bind(s);
  }

  /// Each skin has a bind pose of its own; joints that it shares with earlier ones say how to bring its meshes there.
  void bind(std::size_t s) {
    const Skin& skin = rig_.scene.skins[s];
    std::vector<Affine> own;
    for (std::size_t i = 0; i < skin.joints.size(); ++i) {
      const Affine& back = skin.inverse_binds[i];
      if (!(std::abs(back.linear.determinant()) > 0))
        fail("skin " + std::to_string(s) + ", joint '" + rig_.scene.nodes[skin.joints[i]].name + "'",
             "an inverse bind matrix without an inverse", "a matrix that can be undone");
      own.push_back(inverse(back));
    }
    Affine& space = spaces_[s];
    for (std::size_t i = 0; i < own.size(); ++i)
      if (const std::size_t j = number_[skin.joints[i]]; bound_[j]) {
        space = rig_.binds[j] * skin.inverse_binds[i];
        break;
      }
    for (std::size_t i = 0; i < own.size(); ++i)
      if (const std::size_t j = number_[skin.joints[i]]; !bound_[j]) rig_.binds[j] = space * own[i], bound_[j] = true;
  }

  void add_mesh(std::size_t n) {
    const SceneNode& node = rig_.scene.nodes[n];
    const SceneMesh& mesh = rig_.scene.meshes[node.mesh];
    std::size_t above = n;
    while (above != no_item && number_[above] == no_item) above = rig_.scene.nodes[above].parent;
    if (node.skin == no_item && above == no_item) return;  // stands beside the character
    std::vector<std::uint32_t> first;
    for (const VertexBlock& block : mesh.blocks) {
      first.push_back(static_cast<std::uint32_t>(rig_.positions.size()));
      if (node.skin != no_item && block.influences > 0)
        add_skinned(block, node.skin, node.name);
      else if (above != no_item)
        add_hanging(block, n, number_[above]);
      else
        fail("mesh '" + node.name + "'", "a skin and vertices without joints", "JOINTS_0 and WEIGHTS_0");
    }
    for (const ScenePrimitive& primitive : mesh.primitives)
      for (const Triangle& t : primitive.triangles)
        rig_.triangles.push_back(
            {first[primitive.block] + t[0], first[primitive.block] + t[1], first[primitive.block] + t[2]});
  }

  void add_skinned(const VertexBlock& block, std::size_t skin_number, const std::string& mesh) {
    const Skin& skin = rig_.scene.skins[skin_number];
    for (std::size_t v = 0; v < block.positions.size(); ++v) {
      std::map<std::uint32_t, float> row;
      float sum = 0;
      for (std::size_t i = v * block.influences; i < (v + 1) * block.influences; ++i) {
        if (!(block.weights[i] > 0)) continue;
        row[static_cast<std::uint32_t>(number_[skin.joints[block.joints[i]]])] += block.weights[i];
        sum += block.weights[i];
      }
      if (!(sum > 0))
        fail("mesh '" + mesh + "', vertex " + std::to_string(v), "no weight above 0", "weights that sum to 1");
      for (const auto& [joint, weight] : row) rig_.weights.append(joint, weight / sum);
      rig_.weights.end_row();
      rig_.positions.push_back(spaces_[skin_number](block.positions[v].as<double>()).template as<float>());
      rig_.hangs.push_back(false);
    }
  }

  void add_hanging(const VertexBlock& block, std::size_t node, std::size_t joint) {
    const Affine stands = stands_[rig_.joints[joint]];
    if (!(std::abs(stands.linear.determinant()) > 0))
      fail("joint '" + rig_.joint_name(joint) + "'", "a scale of 0", "one that can be undone");
    const Affine place = rig_.binds[joint] * inverse(stands) * stands_[node];
    for (const Vec3f p : block.positions) {
      rig_.positions.push_back(place(p.as<double>()).as<float>());
      rig_.weights.append(static_cast<std::uint32_t>(joint), 1.0F);
      rig_.weights.end_row();
      rig_.hangs.push_back(true);
    }
  }

  Rig rig_;
  std::vector<std::size_t> number_;  ///< [nodes] joint, or no_item
  std::vector<bool> bound_;
  std::vector<Affine> spaces_;  ///< [skins] from the skin's bind pose to the rig's
  std::vector<Affine> stands_;  ///< [nodes]
};

}  // namespace rig::internal

inline Rig make_rig(Scene scene, std::string name) {
  return rig::internal::RigMaker(std::move(scene), std::move(name)).make();
}

}  // namespace npt::inline NPT_ABI
