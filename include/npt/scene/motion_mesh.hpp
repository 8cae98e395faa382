/// The mesh that a motion's joints move: of the scene that the motion was made of, where its skins were bound.
///   MotionMesh mesh = motion_mesh(scene, motion);
///   std::vector<Vec3d> now = mesh.moved(motion, joint_worlds(motion, 0.5));
/// Vertices follow skins, or the joint that their node is attached to. Morph targets stay at rest.
/// Shapes    start: [V + 1] where a vertex's influences begin
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/vec3.hpp>
#include <npt/config.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/scene/motion.hpp>
#include <npt/scene/scene.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

struct MotionMesh {
  struct Influence {
    std::size_t joint = 0;  ///< of the motion
    double weight = 0;
  };

  std::vector<Vec3d> positions{};  ///< in metres with y up, where the joints were bound
  std::vector<Triangle> triangles{};
  std::vector<std::size_t> start{0};
  std::vector<Influence> influences{};  ///< not negative, a vertex's sum to 1
  std::vector<std::size_t> node{};      ///< [V] the scene's node that shows it
  std::vector<bool> skinned{};          ///< [joints] whether it moves vertices

  std::size_t vertex_count() const noexcept { return positions.size(); }

  /// The joint that moves a vertex most.
  std::size_t main_joint(std::size_t vertex) const {
    const Influence* best = &influences[start[vertex]];
    for (std::size_t i = start[vertex]; i < start[vertex + 1]; ++i)
      if (influences[i].weight > best->weight) best = &influences[i];
    return best->joint;
  }

  /// worlds: [joints] of the motion
  std::vector<Vec3d> moved(const Motion& motion, const std::vector<Affine>& worlds) const {
    const std::vector<Affine> bound = bound_worlds(motion);
    std::vector<Affine> ways(worlds.size());
    for (std::size_t j = 0; j < ways.size(); ++j)
      if (skinned[j]) ways[j] = worlds[j] * inverse(bound[j]);
    std::vector<Vec3d> places(positions.size());
    for (std::size_t v = 0; v < places.size(); ++v)
      for (std::size_t i = start[v]; i < start[v + 1]; ++i)
        places[v] += ways[influences[i].joint](positions[v]) * influences[i].weight;
    return places;
  }
};

namespace internal {

class MotionMeshMaker {
 public:
  MotionMeshMaker(const Scene& scene, const Motion& motion)
      : scene_(scene), bound_(bound_worlds(motion)), joint_of_(scene.nodes.size(), no_item) {
    for (std::size_t j = 0; j < motion.joints.size(); ++j)
      if (motion.joints[j].node != no_item) joint_of_[motion.joints[j].node] = j;
    mesh_.skinned.resize(motion.joints.size());
  }

  MotionMesh make() {
    for (const std::size_t n : scene_.shown) {
      const SceneMesh& mesh = scene_.meshes[scene_.nodes[n].mesh];
      std::vector<std::size_t> first;
      for (const VertexBlock& block : mesh.blocks) {
        first.push_back(mesh_.positions.size());
        const bool by_skin = scene_.nodes[n].skin != no_item && block.influences > 0;
        const std::size_t rigid = by_skin ? no_item : joint_above(n);
        if (by_skin)
          add_skinned(block, scene_.skins[scene_.nodes[n].skin]);
        else if (rigid != no_item && std::abs(bound_[rigid].linear.determinant()) > 0)
          add_rigid(block, n, rigid);
        else
          first.back() = no_item;
        mesh_.node.resize(mesh_.positions.size(), n);
      }
      for (const ScenePrimitive& part : mesh.primitives)
        if (first[part.block] != no_item)
          for (const Triangle& t : part.triangles) {
            const auto shift = static_cast<std::uint32_t>(first[part.block]);
            mesh_.triangles.push_back({t[0] + shift, t[1] + shift, t[2] + shift});
          }
    }
    return std::move(mesh_);
  }

 private:
  std::size_t joint_above(std::size_t node) const {
    while (node != no_item && joint_of_[node] == no_item) node = scene_.nodes[node].parent;
    return node == no_item ? no_item : joint_of_[node];
  }
  Affine own_of(std::size_t node) const {
    return scene_.nodes[node].matrix ? *scene_.nodes[node].matrix : scene_.nodes[node].place.affine();
  }

  void add_rigid(const VertexBlock& block, std::size_t node, std::size_t joint) {
    Affine inside;
    for (std::size_t n = node; joint_of_[n] != joint; n = scene_.nodes[n].parent) inside = own_of(n) * inside;
    mesh_.skinned[joint] = true;
    for (const Vec3f& p : block.positions) {
      mesh_.positions.push_back(bound_[joint](inside(p.as<double>())));
      mesh_.influences.push_back({joint, 1});
      mesh_.start.push_back(mesh_.influences.size());
    }
  }

  void add_skinned(const VertexBlock& block, const Skin& skin) {
    std::vector<std::size_t> joints;
    std::vector<Affine> ways;
    for (std::size_t i = 0; i < skin.joints.size(); ++i) {
      const std::size_t joint = joint_above(skin.joints[i]);
      const bool usable = joint != no_item && std::abs(bound_[joint].linear.determinant()) > 0;
      joints.push_back(usable ? joint : 0);
      ways.push_back(bound_[joints.back()] * skin.inverse_binds[i]);
      mesh_.skinned[joints.back()] = true;
    }
    for (std::size_t v = 0; v < block.positions.size(); ++v) {
      Vec3d place{};
      double sum = 0;
      for (std::size_t i = v * block.influences; i < (v + 1) * block.influences; ++i)
        sum += static_cast<double>(block.weights[i]);
      for (std::size_t i = v * block.influences; i < (v + 1) * block.influences; ++i) {
        const double weight = sum > 0 ? static_cast<double>(block.weights[i]) / sum : i % block.influences == 0 ? 1 : 0;
        if (weight == 0) continue;
        const std::size_t number = block.joints[i];
        place += ways[number](block.positions[v].as<double>()) * weight;
        mesh_.influences.push_back({joints[number], weight});
      }
      mesh_.positions.push_back(place);
      mesh_.start.push_back(mesh_.influences.size());
    }
  }

  const Scene& scene_;
  std::vector<Affine> bound_;
  std::vector<std::size_t> joint_of_;  ///< [nodes]
  MotionMesh mesh_;
};

}  // namespace internal

/// Requires  a motion whose joints name nodes of the scene. Empty where nothing is attached to them.
inline MotionMesh motion_mesh(const Scene& scene, const Motion& motion) {
  return internal::MotionMeshMaker(scene, motion).make();
}

}  // namespace npt::inline NPT_ABI
