/// What a character holds: swords, staffs and guns that are separate components. A blade that passes a thigh is nearer
/// to that than to the hand, and would go with it. Long thin pieces that stand off the body nearly everywhere and begin
/// near a hand are its, and so are small ones beside these (an edge, a guard, a hilt).
/// Measured, a robot with a sword of four pieces in 14 moments of its clips, PMD x 1e-4: 277 instead of 553.
/// Shapes    points: [P] of the mesh, in the body's coordinates; distances: [P] of these from the body
/// Units     metres
/// Source    ours
#pragma once

#include <npt/base/matrix3.hpp>
#include <npt/base/vec3.hpp>
#include <npt/config.hpp>
#include <npt/mesh/closest_point.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/union_find.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

namespace skeleton::internal {

NPT_INLINE_CLASS(class, Props);
template <class>
class BasicProps {
 public:
  /// off: distance from the body from which on a point stands off it. hands: points of the left and the right one
  BasicProps(std::span<const Vec3d> points, std::span<const Triangle> triangles, std::span<const double> distances,
             double off, const std::array<std::vector<Vec3d>, 2>& hands)
      : points_(points), hands_(hands), pieces_(points.size()) {
    for (const Triangle& t : triangles) pieces_.unite(t[0], t[1]), pieces_.unite(t[1], t[2]);
    measure(triangles, distances, off);
    std::vector<Triangle> of_rods;
    for (auto& [root, piece] : things_)
      if (const auto along = rod(piece)) piece.side = nearest_hand(piece, *along);
    for (const Triangle& t : triangles)
      if (const Piece* piece = find(t[0]); piece != nullptr && piece->side) of_rods.push_back(t);
    if (!of_rods.empty()) take_small_ones(of_rods);
  }

  /// The side of the hand that holds a point: 0 left, 1 right.
  std::optional<std::size_t> side(std::uint32_t point) {
    const Piece* piece = find(point);
    return piece == nullptr ? std::nullopt : piece->side;
  }

 private:
  // Of the robot's sword: blade and edge 0.2 and 0.16 m long, less than 0.015 m across, off the body with 0.8 to 1 of
  // their area, the blade 0 to 0.08 m from the fitted hand; guard and hilt 0.5 of a percent of the mesh's area. Wings,
  // antennae and straps of 15 other characters are 0.2 m and more from a hand or thicker.
  static constexpr double least_length = 0.1, most_thickness = 0.15, least_off = 0.7, most_share = 0.1;
  static constexpr double reach = 0.12, other_hand = 1.6;
  static constexpr double beside = 0.02, small_share = 0.02, small_off = 0.3;

  struct Piece {
    double area = 0, off = 0;
    Vec3d sum{};
    Matrix3 squares{};
    std::vector<std::uint32_t> points{};
    std::optional<std::size_t> side{};

    Vec3d mean() const { return sum / area; }
  };

  Piece* find(std::uint32_t point) {
    const auto at = things_.find(pieces_.find(point));
    return at == things_.end() ? nullptr : &at->second;
  }

  /// Pieces of which enough is off the body; they are few.
  void measure(std::span<const Triangle> triangles, std::span<const double> distances, double off) {
    std::vector<double> area(points_.size()), far(points_.size());
    for (const Triangle& t : triangles) {
      const double own = area_of(t);
      const std::uint32_t piece = pieces_.find(t[0]);
      area[piece] += own, total_ += own;
      if (std::min({distances[t[0]], distances[t[1]], distances[t[2]]}) > off) far[piece] += own;
    }
    for (std::uint32_t p = 0; p < points_.size(); ++p)
      if (far[p] > small_off * area[p] && area[p] < most_share * total_) things_[p] = {.area = area[p], .off = far[p]};
    if (things_.empty()) return;
    for (const Triangle& t : triangles)
      if (Piece* piece = find(t[0])) {
        const Vec3d middle = (points_[t[0]] + points_[t[1]] + points_[t[2]]) / 3;
        piece->sum += middle * area_of(t);
        piece->squares += outer(middle, middle) * area_of(t);
      }
    for (std::uint32_t p = 0; p < points_.size(); ++p)
      if (Piece* piece = find(p)) piece->points.push_back(p);
  }
  double area_of(const Triangle& t) const {
    return 0.5 * length(cross(points_[t[1]] - points_[t[0]], points_[t[2]] - points_[t[0]]));
  }

  static Matrix3 covariance(const Piece& piece) {
    return piece.squares * (1 / piece.area) - outer(piece.mean(), piece.mean());
  }
  /// Along which it is longest, by power iteration; unit. Slender ones end in a few steps. The longest row is never at
  /// right angles to it.
  static Vec3d axis(const Matrix3& covariance) {
    Vec3d along = *std::max_element(covariance.rows.begin(), covariance.rows.end(),
                                    [](Vec3d a, Vec3d b) { return dot(a, a) < dot(b, b); });
    for (int i = 0; i < 30; ++i) along = normalised(covariance * along);
    return along;
  }
  /// A rod's axis; nothing where a piece is none.
  static std::optional<Vec3d> rod(const Piece& piece) {
    if (piece.off < least_off * piece.area) return std::nullopt;
    const Matrix3 c = covariance(piece);
    const Vec3d along = axis(c);
    const double first = dot(along, c * along), others = c.rows[0].x + c.rows[1].y + c.rows[2].z - first;
    if (first > least_length * least_length && others < most_thickness * most_thickness * first) return along;
    return std::nullopt;
  }

  /// Of its ends, a sixth of the length each, the one that is nearer to a hand; nothing where none is, or both are.
  std::optional<std::size_t> nearest_hand(const Piece& piece, Vec3d along) const {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const std::uint32_t p : piece.points) {
      const double t = dot(points_[p], along);
      low = std::min(low, t), high = std::max(high, t);
    }
    const double sixth = (high - low) / 6;
    std::array<double, 2> least{1, 1};
    for (const std::uint32_t p : piece.points) {
      const double t = dot(points_[p], along);
      if (t > low + sixth && t < high - sixth) continue;
      for (std::size_t side = 0; side < 2; ++side)
        for (const Vec3d q : hands_[side]) least[side] = std::min(least[side], length(points_[p] - q));
    }
    const std::size_t side = least[0] < least[1] ? 0 : 1;
    if (least[side] > reach || other_hand * least[side] > least[1 - side]) return std::nullopt;
    return side;
  }

  void take_small_ones(const std::vector<Triangle>& of_rods) {
    const TriangleTree rods(points_, of_rods);
    std::vector<std::pair<Piece*, std::size_t>> found;
    for (auto& [root, piece] : things_) {
      if (piece.side || (piece.area > small_share * total_ && !rod(piece))) continue;
      for (const std::uint32_t p : piece.points)
        if (const ClosestPoint c = rods.closest(points_[p]); c.squared_distance < beside * beside) {
          found.emplace_back(&piece, *find(of_rods[c.triangle][0])->side);
          break;
        }
    }
    for (const auto& [piece, side] : found) piece->side = side;
  }

  std::span<const Vec3d> points_;
  const std::array<std::vector<Vec3d>, 2>& hands_;
  UnionFind pieces_;
  std::map<std::uint32_t, Piece> things_;  ///< by their first points
  double total_ = 0;
};

}  // namespace skeleton::internal

}  // namespace npt::inline NPT_ABI
