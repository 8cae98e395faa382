/// Pieces (connected components) of a character that follow what they touch, each as a whole:
///   loose      no place on the body is certain for it: a weapon, a horn, a hat's brim. What it touches is surer than
///              what is nearest: a blade that passes a thigh is nearer to that than to the hand
///   misplaced  small, and on another piece that follows a distant joint: a hand before the belly is nearer to a buckle
///              than the belly is; where a limb was fitted wrongly, a pouch or a shoe would follow the other one
/// Each is one unknown: the mean of the weights that it touches, the nearest contacts counting most. Loose pieces that
/// touch each other (a hilt, a guard, a blade) are solved for together, by sweeps in a fixed order.
/// Measured, 42 frames of 22 rigged characters: a mean of 169 mm RMS, 184 without; a trident stays in one piece.
/// Shapes    points: [P] of the mesh; weights: [P, stride] of J joints
/// Units     metres
/// Source    ours
#pragma once

#include <npt/base/as_span.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/kinematics.hpp>
#include <npt/config.hpp>
#include <npt/estimate/place_patches.hpp>
#include <npt/estimate/robust_distance.hpp>
#include <npt/mesh/closest_point.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/normals.hpp>
#include <npt/mesh/topology.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI {

namespace skeleton::internal {

/// Share of a mesh's area below which a small piece is tiny. A pouch, which lies on a hip and faces it, has less; a
/// hand that is a piece of its own, and may lie on a hip, has more.
inline constexpr double tiny_share = 0.01;

NPT_INLINE_CLASS(class, RigidPieces);
template <class>
class BasicRigidPieces {
 public:
  /// parents: [J] of the joints, -1 for the root; certain: [P] whether a point's weights are its own
  BasicRigidPieces(std::span<const Vec3d> points, std::span<const Triangle> triangles, std::span<const int> parents,
                   const std::vector<bool>& certain)
      : points_(points),
        triangles_(triangles),
        parents_(parents),
        piece_(connected_components(triangles, points.size())),
        moved_(points.size()) {
    const std::vector<double> share = area_shares(points, triangles, as_span(piece_));
    std::vector<bool> fast(points.size());
    for (std::uint32_t p = 0; p < points.size(); ++p)
      if (certain[p]) fast[piece_[p]] = true;
    std::vector<std::uint32_t> number(points.size(), no_index);
    for (std::uint32_t p = 0; p < points.size(); ++p) {
      const std::uint32_t root = piece_[p];
      if (!(share[root] > 0) || (fast[root] && share[root] > small_share)) continue;
      if (number[root] == no_index) {
        number[root] = static_cast<std::uint32_t>(pieces_.size());
        pieces_.push_back({.loose = !fast[root], .tiny = share[root] < tiny_share});
      }
      moved_[p] = true;
      pieces_[number[root]].points.push_back(p);
    }
    if (pieces_.empty()) return;
    for (const Triangle& t : triangles) (moved_[t[0]] ? others_ : still_).push_back(t);
  }

  void move(std::span<float> weights, std::size_t stride) {
    if (pieces_.empty()) return;
    std::vector<std::uint32_t> joints;  // [P] the one that each follows most
    for (std::size_t at = 0; at < weights.size(); at += stride) {
      const auto row = weights.subspan(at, stride);
      joints.push_back(static_cast<std::uint32_t>(std::max_element(row.begin(), row.end()) - row.begin()));
    }
    const TriangleTree still(points_, still_), others(points_, others_);
    const std::vector<Vec3d> normals = area_vectors(points_, triangles_);
    for (Piece& piece : pieces_) find_contacts(piece, still, others, normals, joints);
    constexpr int sweeps = 8;  // a sword has four pieces
    for (int sweep = 0; sweep < sweeps; ++sweep)
      for (const Piece& piece : pieces_)
        if (sweep == 0 ? !piece.contacts.empty() : piece.chained) take_mean(piece, weights, stride);
  }

 private:
  static constexpr double reach = 0.03;  ///< of a small piece
  /// Contacts at this distance count a quarter of those at none: parts that hold each other interpenetrate.
  /// Loose pieces touch others that are moved at twice that: with 3 cm a trident's prongs follow the thigh beside them.
  static constexpr double touch = 0.005;
  static constexpr std::size_t distant = 4;  ///< more bones than these apart; a finger's last and the forearm are 4

  /// A place on another piece; its weights are multiplied by how much it counts.
  struct Contact {
    Triangle triangle;
    std::array<double, 3> weights;
  };
  struct Piece {
    bool loose = false, tiny = false, chained = false;  ///< chained: touches pieces that are moved themselves
    std::vector<std::uint32_t> points{};
    std::vector<Contact> contacts{};  ///< none: it keeps its weights
  };

  Vec3d normal(const Triangle& t) const { return cross(points_[t[1]] - points_[t[0]], points_[t[2]] - points_[t[0]]); }

  /// All of a loose piece's points; of a small one's those near larger pieces, if most of these follow distant joints.
  void find_contacts(Piece& piece, const TriangleTree& still, const TriangleTree& others,
                     std::span<const Vec3d> normals, std::span<const std::uint32_t> joints) const {
    std::vector<std::size_t> votes(parents_.size());
    for (const std::uint32_t p : piece.points) ++votes[joints[p]];
    const auto own = static_cast<std::uint32_t>(std::max_element(votes.begin(), votes.end()) - votes.begin());
    std::size_t near = 0;
    std::uint32_t hint = no_index, other_hint = no_index;
    for (const std::uint32_t p : piece.points) {
      const auto under = [&](std::uint32_t number) {
        const Triangle& t = still_[number];
        return piece.loose || piece.tiny || dot(normal(t), normals[p]) > 0;
      };
      const double limit = piece.loose ? std::numeric_limits<double>::infinity() : reach * reach;
      ClosestPoint c = still.closest(points_[p], under, hint, limit);
      if (c.triangle != no_index) hint = c.triangle;
      const std::vector<Triangle>* triangles = &still_;
      if (piece.loose) {
        const auto other = [&](std::uint32_t number) { return piece_[others_[number][0]] != piece_[p]; };
        const double closer = std::min(c.squared_distance, 4 * touch * touch);
        if (const ClosestPoint d = others.closest(points_[p], other, other_hint, closer); d.triangle != no_index)
          c = d, triangles = &others_, other_hint = d.triangle;
      }
      if (c.triangle == no_index) continue;
      ++near;
      const Triangle& t = (*triangles)[c.triangle];
      const auto corner = std::max_element(c.weights.begin(), c.weights.end()) - c.weights.begin();
      if (!piece.loose && bones_between(parents_, own, joints[t[static_cast<std::size_t>(corner)]]) <= distant)
        continue;
      for (double& w : c.weights) w *= robust_weight(c.squared_distance, touch);
      piece.contacts.push_back({t, c.weights});
      piece.chained = piece.chained || moved_[t[0]];
    }
    if (!piece.loose && 2 * piece.contacts.size() <= near) piece.contacts.clear();
  }

  void take_mean(const Piece& piece, std::span<float> weights, std::size_t stride) const {
    std::vector<double> mean(stride);
    double sum = 0;
    for (const Contact& contact : piece.contacts)
      for (std::size_t k = 0; k < 3; ++k) {
        const auto row = weights.subspan(contact.triangle[k] * stride, stride);
        for (std::size_t j = 0; j < stride; ++j) mean[j] += contact.weights[k] * static_cast<double>(row[j]);
        sum += contact.weights[k];
      }
    for (const std::uint32_t p : piece.points)
      for (std::size_t j = 0; j < stride; ++j) weights[p * stride + j] = static_cast<float>(mean[j] / sum);
  }

  std::span<const Vec3d> points_;
  std::span<const Triangle> triangles_;
  std::span<const int> parents_;
  std::vector<std::uint32_t> piece_;      ///< [P] the least point of each
  std::vector<bool> moved_;               ///< [P] whether in pieces_
  std::vector<Piece> pieces_;             ///< that may be moved
  std::vector<Triangle> still_, others_;  ///< of pieces that stay as they are, and of those in pieces_
};

}  // namespace skeleton::internal

}  // namespace npt::inline NPT_ABI
