/// What a character wears that is a small piece of its own: buckles, pouches, badges, shoes. A hand before the belly is
/// nearer to a buckle than the belly is; and where an arm was fitted wrongly, a pouch at the other hip would go with
/// it, where crossed legs were, each shoe with the other foot. What the mesh itself says is surer: such a piece goes
/// with the larger piece that it lies on, where both would go with distant joints.
/// Measured, a man with two pouches and a buckle whose right arm is fitted across his belly: PMD 85 instead of 1457e-4.
/// Shapes    points: [P] of the mesh; joints: [P] the one that each goes with most, of J
/// Units     metres
/// Source    ours
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/body/skeleton.hpp>
#include <npt/config.hpp>
#include <npt/mesh/closest_point.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/normals.hpp>
#include <npt/mesh/topology.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

namespace skeleton::internal {

/// A piece that belongs with what it lies on.
struct Attachment {
  /// A point of a larger piece.
  struct Contact {
    Triangle triangle;
    std::array<double, 3> weights;
  };
  std::vector<std::uint32_t> points;
  std::vector<Contact> contacts;  ///< at least one
};

NPT_INLINE_CLASS(class, Attachments);
template <class>
class BasicAttachments {
 public:
  /// parents: [J] of the joints, -1 for the root
  BasicAttachments(std::span<const Vec3d> points, std::span<const Triangle> triangles,
                   std::span<const std::uint32_t> joints, std::span<const int> parents)
      : points_(points), joints_(joints), parents_(parents) {
    sort_out(triangles);
  }

  /// Those that go with other joints than what they lie on, ascending by their first points.
  std::vector<Attachment> misplaced() const {
    std::vector<Attachment> result;
    if (small_.empty() || large_.empty()) return result;
    const TriangleTree surface(points_, large_);
    std::vector<Vec3d> directions;
    for (const Triangle& t : large_)
      directions.push_back(cross(points_[t[1]] - points_[t[0]], points_[t[2]] - points_[t[0]]));
    for (const Piece& piece : small_)
      if (std::vector<Attachment::Contact> contacts = distant_contacts(piece, surface, directions); !contacts.empty())
        result.push_back({piece.points, std::move(contacts)});
    return result;
  }

 private:
  // Shares of the mesh's area. A hand has 0.02 to 0.03: one that is a piece of its own may lie on a hip, and faces it.
  // A pouch, which lies on a hip and faces it as well, has less; a shoe faces where the foot in it does.
  static constexpr double tiny = 0.01, largest = 0.04;
  static constexpr double reach = 0.03;
  static constexpr std::size_t distant = 4;  ///< more bones than these apart; a finger's last and the forearm are 4

  struct Piece {
    std::vector<std::uint32_t> points;
    bool tiny = false;
  };

  void sort_out(std::span<const Triangle> triangles) {
    const std::vector<std::uint32_t> piece = connected_components(triangles, points_.size());
    std::vector<double> area(points_.size());
    double total = 0;
    for (const Triangle& t : triangles) {
      const double own = 0.5 * length(cross(points_[t[1]] - points_[t[0]], points_[t[2]] - points_[t[0]]));
      area[piece[t[0]]] += own, total += own;
    }
    std::vector<std::uint32_t> number(points_.size(), no_index);
    for (std::uint32_t p = 0; p < points_.size(); ++p) {
      const double own = area[piece[p]];
      if (!(own > 0) || own > largest * total) continue;
      std::uint32_t& n = number[piece[p]];
      if (n == no_index) {
        n = static_cast<std::uint32_t>(small_.size());
        small_.push_back({.points = {}, .tiny = own < tiny * total});
      }
      small_[n].points.push_back(p);
    }
    if (small_.empty()) return;
    for (const Triangle& t : triangles)
      if (number[piece[t[0]]] == no_index) large_.push_back(t);
    normals_ = area_vectors(points_, triangles);
  }

  /// Where the points of a piece come near the surface, if most of these places go with distant joints.
  std::vector<Attachment::Contact> distant_contacts(const Piece& piece, const TriangleTree& surface,
                                                    std::span<const Vec3d> directions) const {
    const std::uint32_t own = joint_of(piece);
    std::vector<Attachment::Contact> contacts;
    std::size_t near = 0;
    for (const std::uint32_t p : piece.points) {
      const ClosestPoint c =
          piece.tiny
              ? surface.closest(points_[p])
              : surface.closest(points_[p], [&](std::uint32_t t) { return dot(directions[t], normals_[p]) > 0; });
      if (!(c.squared_distance < reach * reach)) continue;
      ++near;
      const Triangle& t = large_[c.triangle];
      const std::uint32_t corner =
          t[static_cast<std::size_t>(std::max_element(c.weights.begin(), c.weights.end()) - c.weights.begin())];
      if (bones_between(parents_, own, joints_[corner]) > distant) contacts.push_back({t, c.weights});
    }
    if (2 * contacts.size() <= near) contacts.clear();
    return contacts;
  }

  /// The joint that most of its points go with.
  std::uint32_t joint_of(const Piece& piece) const {
    std::vector<std::size_t> votes(parents_.size());
    for (const std::uint32_t p : piece.points) ++votes[joints_[p]];
    return static_cast<std::uint32_t>(std::max_element(votes.begin(), votes.end()) - votes.begin());
  }

  std::span<const Vec3d> points_;
  std::span<const std::uint32_t> joints_;
  std::span<const int> parents_;
  std::vector<Piece> small_;
  std::vector<Triangle> large_;
  std::vector<Vec3d> normals_;  ///< [P], of any length; empty where there are no small pieces
};

}  // namespace skeleton::internal

}  // namespace npt::inline NPT_ABI
