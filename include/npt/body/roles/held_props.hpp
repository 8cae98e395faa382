/// What hands hold, as weapons: meshes that one joint of a forearm or hand carries whole, where another mesh bends with
/// that arm. Rigs of stiff parts have no such other mesh: there each part is the body's own.
///   std::vector<bool> held = held_props(mesh, nearest_roles(motion, roles));
/// Shapes    [V] of the mesh
#pragma once

#include <npt/body/roles/joint_role.hpp>
#include <npt/config.hpp>
#include <npt/scene/motion_mesh.hpp>
#include <npt/scene/scene.hpp>

#include <array>
#include <cstddef>
#include <map>
#include <vector>

namespace npt::inline NPT_ABI {

/// Below the elbow.
constexpr bool is_of_forearm(JointRole role) {
  return is_of_limb(role) && (part_of(role) == LimbPart::lower_arm || part_of(role) == LimbPart::hand ||
                              part_of(role) >= LimbPart::thumb_1);
}

/// nearest: [joints] the part of the body that each belongs to
inline std::vector<bool> held_props(const MotionMesh& mesh, const std::vector<JointRole>& nearest) {
  std::map<std::size_t, std::size_t> carrier;  // of each node: its one joint, or no_item
  for (std::size_t v = 0; v < mesh.vertex_count(); ++v)
    for (std::size_t i = mesh.start[v]; i < mesh.start[v + 1]; ++i) {
      const std::size_t joint = mesh.influences[i].joint;
      if (const auto [own, first] = carrier.try_emplace(mesh.node[v], joint); own->second != joint)
        own->second = no_item;
    }
  std::array<bool, 2> bends{};  // [sides]
  for (std::size_t v = 0; v < mesh.vertex_count(); ++v)
    if (const JointRole role = nearest[mesh.main_joint(v)]; is_of_forearm(role) && carrier[mesh.node[v]] == no_item)
      bends[side_of(role)] = true;
  std::vector<bool> held(mesh.vertex_count());
  for (std::size_t v = 0; v < mesh.vertex_count(); ++v)
    if (const std::size_t joint = carrier[mesh.node[v]]; joint != no_item && is_of_forearm(nearest[joint]))
      held[v] = bends[side_of(nearest[joint])];
  return held;
}

}  // namespace npt::inline NPT_ABI
