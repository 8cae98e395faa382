/// The shape of a person's body around its skeleton, as far as motions must know it: rings around the trunk from the
/// crotch to the shoulders, points of the arms' skin, hands and thighs.
///   BodyShape shape = body_shape(scene, motion, roles);   of the scene that the motion was made of
/// Shapes    places in metres with y up, as bound; [sides]: left, right
/// Limits    the body is bound upright; sleeves and robes count as what they are skinned to
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/matrix3.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/roles/facing.hpp>
#include <npt/body/roles/held_props.hpp>
#include <npt/body/roles/joint_role.hpp>
#include <npt/body/roles/joint_roles.hpp>
#include <npt/body/roles/nearest_roles.hpp>
#include <npt/config.hpp>
#include <npt/mesh/closest_point.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/scene/motion.hpp>
#include <npt/scene/motion_mesh.hpp>
#include <npt/scene/scene.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

inline constexpr std::size_t ring_sectors = 24;

/// A level cut through the trunk. radii: by angle from the body's left over its front
struct BodyRing {
  std::size_t joint = no_item;  ///< that it moves with
  Vec3d centre{};
  std::array<double, ring_sectors> radii{};
};

/// A point of the skin, and the joint that moves it most.
struct ArmPoint {
  std::size_t joint = no_item;
  Vec3d place{};
  double slack = 0;  ///< how deep it may press into the trunk
};

/// A hand as a ball.
struct BodyHand {
  std::size_t joint = no_item;
  Vec3d centre{};
  double radius = 0;
};

struct BodyShape {
  std::vector<BodyRing> rings{};                ///< the lowest first; empty: nothing is known
  std::array<std::vector<ArmPoint>, 2> arms{};  ///< [sides] without the third next to the shoulder
  std::array<BodyHand, 2> hands{};              ///< [sides] radius 0: not known
  std::array<double, 2> thighs{};               ///< [sides] radii around the bones; 0: not known
  Matrix3 frame = Matrix3::identity();          ///< left, up and forward as columns
  bool empty() const { return rings.empty(); }
};

/// Of the source and the target; empty where there is no mesh.
struct RetargetShapes {
  BodyShape source{}, target{};
};

namespace internal {

class BodyShapeMaker {
 public:
  BodyShapeMaker(const Scene& scene, const Motion& motion, const JointRoles& roles)
      : roles_(roles), mesh_(motion_mesh(scene, motion)), bound_(bound_worlds(motion)) {
    const std::vector<JointRole> nearest = nearest_roles(motion, roles);
    const std::vector<bool> held = held_props(mesh_, nearest);
    for (std::size_t v = 0; v < mesh_.vertex_count(); ++v)
      role_.push_back(held[v] ? JointRole::none : nearest[mesh_.main_joint(v)]);
    std::vector<Vec3d> positions;
    for (const Affine& world : bound_) positions.push_back(world.shift);
    const BodyAxes axes = body_axes(roles.joints, positions).upright();
    shape_.frame = Matrix3::from_columns(axes.left, axes.up, axes.forward);
  }

  BodyShape make() {
    if (mesh_.triangles.empty() || roles_.joint(JointRole::hips) == no_item) return {};
    add_rings();
    for (std::size_t side = 0; side < 2; ++side) {
      add_arm(side);
      add_hand(side);
      shape_.thighs[side] = thigh(side);
    }
    return std::move(shape_);
  }

 private:
  static constexpr std::size_t ring_count = 12, arm_points = 48;
  static constexpr double arm_begin = 1.0 / 3;  ///< of the upper arm

  Vec3d place(std::size_t joint) const { return bound_[joint].shift; }

  /// Between the thighs' joints and the shoulders' joints.
  void add_rings() {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (std::size_t side = 0; side < 2; ++side) {
      if (const std::size_t j = roles_.joint(LimbPart::upper_leg, side); j != no_item) low = std::min(low, place(j).y);
      if (const std::size_t j = roles_.joint(LimbPart::upper_arm, side); j != no_item)
        high = std::max(high, place(j).y);
    }
    double trunk_low = std::numeric_limits<double>::infinity(), trunk_high = -trunk_low;
    for (std::size_t v = 0; v < role_.size(); ++v)
      if (is_of_trunk(role_[v])) {
        trunk_low = std::min(trunk_low, mesh_.positions[v].y);
        trunk_high = std::max(trunk_high, mesh_.positions[v].y);
      }
    low = std::max(std::min(low, trunk_low + 0.5 * (high - trunk_low)), trunk_low);
    high = std::min(high, trunk_high);
    if (!(high > low)) return;
    for (std::size_t i = 0; i < ring_count; ++i) {
      const double share = (static_cast<double>(i) + 0.5) / ring_count;
      BodyRing ring = cut(low + (high - low) * share);
      if (ring.radii[0] > 0) shape_.rings.push_back(ring);
    }
  }

  /// A piece of the cut, seen from the ring's centre; `out`: the normal of the surface that it lies on.
  struct Piece {
    Vec3d a, b, out;
  };
  std::vector<Piece> pieces_at(double y) const {
    std::vector<Piece> pieces;
    const Matrix3 to_frame = shape_.frame.transposed();
    for (const Triangle& t : mesh_.triangles) {
      if (!is_of_trunk(role_[t[0]]) || !is_of_trunk(role_[t[1]]) || !is_of_trunk(role_[t[2]])) continue;
      const std::array<Vec3d, 3> corners{mesh_.positions[t[0]], mesh_.positions[t[1]], mesh_.positions[t[2]]};
      std::array<Vec3d, 2> ends{};
      std::size_t count = 0;
      for (std::size_t i = 0; i < 3 && count < 2; ++i) {
        const Vec3d a = corners[i], b = corners[(i + 1) % 3];
        if ((a.y < y) != (b.y < y)) ends[count++] = a + (b - a) * ((y - a.y) / (b.y - a.y));
      }
      if (count == 2)
        pieces.push_back({to_frame * ends[0], to_frame * ends[1],
                          to_frame * cross(corners[1] - corners[0], corners[2] - corners[0])});
    }
    return pieces;
  }

  BodyRing cut(double y) const {
    std::vector<Piece> pieces = pieces_at(y);
    BodyRing ring{ring_joint(y), {}, {}};
    if (pieces.size() < 3) return ring;
    Vec3d low = pieces[0].a, high = low;
    for (const Piece& piece : pieces)
      for (const Vec3d p : {piece.a, piece.b}) {
        low = {std::min(low.x, p.x), p.y, std::min(low.z, p.z)};
        high = {std::max(high.x, p.x), p.y, std::max(high.z, p.z)};
      }
    const Vec3d centre = (low + high) * 0.5;
    ring.centre = shape_.frame * centre;
    for (Piece& piece : pieces) piece.a = piece.a - centre, piece.b = piece.b - centre;
    for (std::size_t s = 0; s < ring_sectors; ++s) {
      const double angle = 2 * std::numbers::pi * static_cast<double>(s) / ring_sectors;
      ring.radii[s] = radius(pieces, {std::cos(angle), 0, std::sin(angle)});
    }
    // Near the crotch and the neck the trunk's skin may only be a patch at one side: no ring. Sides that are skinned to
    // the thighs are filled in between front and back.
    if (largest_gap(ring) > ring_sectors * 5 / 12) return {};
    fill_gaps(ring);
    return ring;
  }

  /// Where a ray from the centre leaves the body: where it has left all the layers that it begins in. What hangs over
  /// beyond a gap, as the hat of a mushroom, isn't in the way of an arm under it.
  static double radius(const std::vector<Piece>& pieces, Vec3d ray) {
    std::vector<std::pair<double, int>> crossings;
    int layers = 0;
    for (const Piece& piece : pieces) {
      const double from = piece.a.z * ray.x - piece.a.x * ray.z, to = piece.b.z * ray.x - piece.b.x * ray.z;
      if ((from < 0) == (to < 0)) continue;
      const Vec3d p = piece.a + (piece.b - piece.a) * (from / (from - to));
      if (dot(p, ray) <= 0) continue;
      crossings.emplace_back(dot(p, ray), dot(piece.out, ray) > 0 ? 1 : -1);
      layers += crossings.back().second;
    }
    std::sort(crossings.begin(), crossings.end());
    const int sign = layers < 0 ? -1 : 1;  // of a file whose faces look inwards
    int left = std::abs(layers);
    for (const auto& [distance, out] : crossings) {
      left -= sign * out;
      if (left <= 0 && layers != 0) return distance;
    }
    return crossings.empty() ? 0 : crossings.back().first;
  }
  static std::size_t largest_gap(const BodyRing& ring) {
    std::size_t most = 0, run = 0;
    for (std::size_t s = 0; s < 2 * ring_sectors; ++s) {
      run = ring.radii[s % ring_sectors] == 0 ? run + 1 : 0;
      most = std::max(most, run);
    }
    return most;
  }
  /// Sectors that the surface leaves open, as under arms, between their neighbours.
  static void fill_gaps(BodyRing& ring) {
    const std::array<double, ring_sectors> known = ring.radii;
    for (std::size_t s = 0; s < ring_sectors; ++s) {
      if (known[s] > 0) continue;
      std::size_t before = 1, behind = 1;
      while (before < ring_sectors && known[(s + ring_sectors - before) % ring_sectors] == 0) ++before;
      while (behind < ring_sectors && known[(s + behind) % ring_sectors] == 0) ++behind;
      const double a = known[(s + ring_sectors - before) % ring_sectors], b = known[(s + behind) % ring_sectors];
      const auto share = static_cast<double>(before) / static_cast<double>(before + behind);
      ring.radii[s] = a + (b - a) * share;
    }
  }
  std::size_t ring_joint(double y) const {
    std::size_t joint = roles_.joint(JointRole::hips);
    for (const JointRole role : {JointRole::spine, JointRole::chest, JointRole::upper_chest})
      if (const std::size_t own = roles_.joint(role); own != no_item && place(own).y <= y) joint = own;
    return joint;
  }

  bool is_of_arm(JointRole role, std::size_t side, Vec3d p) const {
    if (!is_of_limb(role) || side_of(role) != side) return false;
    if (is_of_forearm(role)) return true;
    const std::size_t shoulder = roles_.joint(LimbPart::upper_arm, side),
                      elbow = roles_.joint(LimbPart::lower_arm, side);
    return part_of(role) == LimbPart::upper_arm && elbow != no_item &&
           closest_on_segment(p, place(shoulder), place(elbow)) > arm_begin;
  }

  /// Next to the shoulder arm and trunk press against each other whenever an arm hangs; to keep them apart lifts it.
  /// So an arm may press in by two thirds of its thickness at the shoulder, and by less and less towards the elbow. Of
  /// the depth of people's clips on seven monsters 84 % goes then, and the mean 95th percentile of joint errors between
  /// these is 4.7 % of the height. The whole thickness: 73 %, 4.1 %; half of it: 89 %, 4.8 %. Makers press arms in as
  /// deep: the mushroom king's own run by 4.2 mm in the mean.
  double slack(std::size_t vertex, std::size_t side) const {
    if (role_[vertex] != limb_role(LimbPart::upper_arm, side)) return 0;
    const Vec3d p = mesh_.positions[vertex], shoulder = place(roles_.joint(LimbPart::upper_arm, side)),
                elbow = place(roles_.joint(LimbPart::lower_arm, side));
    const double along = closest_on_segment(p, shoulder, elbow);
    return 2.0 / 3 * (1 - along) * length(p - (shoulder + (elbow - shoulder) * along));
  }

  /// Points far from each other: each is the farthest from those before it.
  void add_arm(std::size_t side) {
    std::vector<std::size_t> vertices;
    for (std::size_t v = 0; v < role_.size(); ++v)
      if (is_of_arm(role_[v], side, mesh_.positions[v])) vertices.push_back(v);
    std::vector<double> distances(vertices.size(), std::numeric_limits<double>::infinity());
    for (std::size_t n = 0; n < std::min(arm_points, vertices.size()); ++n) {
      const auto farthest =
          static_cast<std::size_t>(std::max_element(distances.begin(), distances.end()) - distances.begin());
      const std::size_t vertex = vertices[farthest];
      const Vec3d p = mesh_.positions[vertex];
      shape_.arms[side].push_back({mesh_.main_joint(vertex), p, slack(vertex, side)});
      for (std::size_t i = 0; i < vertices.size(); ++i)
        distances[i] = std::min(distances[i], length(mesh_.positions[vertices[i]] - p));
    }
  }

  /// The third of the arm's skin that is farthest from the elbow where there is no hand.
  void add_hand(std::size_t side) {
    const std::size_t hand = roles_.joint(LimbPart::hand, side), elbow = roles_.joint(LimbPart::lower_arm, side);
    if (elbow == no_item) return;
    std::vector<Vec3d> points;
    double far = 0;
    for (const ArmPoint& point : shape_.arms[side]) far = std::max(far, length(point.place - place(elbow)));
    for (std::size_t v = 0; v < role_.size(); ++v) {
      const JointRole role = role_[v];
      if (!is_of_limb(role) || side_of(role) != side) continue;
      const LimbPart part = part_of(role);
      const bool tip =
          hand == no_item && part == LimbPart::lower_arm && length(mesh_.positions[v] - place(elbow)) > 2 * far / 3;
      if (part == LimbPart::hand || part >= LimbPart::thumb_1 || tip) points.push_back(mesh_.positions[v]);
    }
    if (points.empty()) return;
    Vec3d low = points[0], high = low;
    for (const Vec3d p : points) {
      low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    }
    const Vec3d size = high - low;
    // A hand is flat and long: the middle one of its sizes is its breadth.
    const double breadth =
        size.x + size.y + size.z - std::max({size.x, size.y, size.z}) - std::min({size.x, size.y, size.z});
    shape_.hands[side] = {hand == no_item ? elbow : hand, (low + high) * 0.5, 0.5 * breadth};
  }

  /// The median distance from the bone, of skin of its lower two thirds.
  double thigh(std::size_t side) const {
    const std::size_t hip = roles_.joint(LimbPart::upper_leg, side), knee = roles_.joint(LimbPart::lower_leg, side);
    if (hip == no_item || knee == no_item) return 0;
    std::vector<double> distances;
    for (std::size_t v = 0; v < role_.size(); ++v) {
      if (role_[v] != limb_role(LimbPart::upper_leg, side)) continue;
      const double along = closest_on_segment(mesh_.positions[v], place(hip), place(knee));
      if (along > 1.0 / 3 && along < 1)
        distances.push_back(length(mesh_.positions[v] - (place(hip) + (place(knee) - place(hip)) * along)));
    }
    if (distances.empty()) return 0;
    const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
    std::nth_element(distances.begin(), middle, distances.end());
    return *middle;
  }

  const JointRoles& roles_;
  MotionMesh mesh_;
  std::vector<Affine> bound_;
  std::vector<JointRole> role_;  ///< [V] none: of what hands hold
  BodyShape shape_;
};

}  // namespace internal

/// Requires  the motion and the roles of a skeleton of the scene. Empty where no skin moves with the skeleton, and for
/// animals.
inline BodyShape body_shape(const Scene& scene, const Motion& motion, const JointRoles& roles) {
  if (roles.kind() != SkeletonKind::person) return {};
  return internal::BodyShapeMaker(scene, motion, roles).make();
}

}  // namespace npt::inline NPT_ABI
