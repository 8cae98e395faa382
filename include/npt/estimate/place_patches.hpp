/// Patches of a mesh on which the places of its points on a body are continuous. Where limbs touch or cross, some
/// points lie closest to the wrong one, and the mesh's edges lead from one place to a distant one: there patches end.
/// Shapes    points: [P]; edges: each once; places: [P]
/// Units     metres
#pragma once

#include <npt/base/as_span.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_plan.hpp>
#include <npt/body/kinematics.hpp>
#include <npt/config.hpp>
#include <npt/estimate/body_look_up.hpp>
#include <npt/estimate/robust_distance.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/normals.hpp>
#include <npt/mesh/topology.hpp>
#include <npt/mesh/union_find.hpp>

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI {

/// Share of a mesh's area below which a piece or a patch is small: a hand or a shoe has 0.02 to 0.04.
inline constexpr double small_share = 0.04;

/// Whether a surface may lead from one place to the other over so many metres. From a left limb to a right one only
/// where they are grown together: between thighs or collars, and not as far as legs stand apart at rest.
/// parents: the plan's
NPT_INLINE bool continuous_places(const BodyPlan& plan, std::span<const int> parents, const BodyPlace& a,
                                  const BodyPlace& b, double distance) {
  const bool across = plan.side(a.part) * plan.side(b.part) < 0;
  return length(a.rest - b.rest) <= (across ? usual_error + 2 * distance : 2 * usual_error + 3 * distance) &&
         bones_between(parents, a.part, b.part) <= (across ? 2 : 3);
}

NPT_INLINE_CLASS(class, PlacePatches);
template <class>
class BasicPlacePatches {
 public:
  BasicPlacePatches(const BodyPlan& plan, std::span<const Vec3d> points, std::span<const Triangle> triangles,
                    std::span<const Edge> edges, std::span<const BodyPlace> places) {
    const std::vector<int> parents = plan.parents();
    UnionFind patches(points.size()), pieces(points.size());
    for (const Edge& e : edges) {
      pieces.unite(e[0], e[1]);
      if (continuous_places(plan, as_span(parents), places[e[0]], places[e[1]], length(points[e[0]] - points[e[1]])))
        patches.unite(e[0], e[1]);
      else
        broken_.push_back(e);
    }
    patch_ = patches.sets();
    piece_ = pieces.sets();
    share_ = area_shares(points, triangles, as_span(patch_));
    piece_share_ = area_shares(points, triangles, as_span(piece_));
  }

  /// The least point of a point's patch.
  std::uint32_t patch(std::uint32_t point) const { return patch_[point]; }
  /// A patch's share of the mesh's area.
  double share(std::uint32_t point) const { return share_[patch_[point]]; }
  /// The share of a point's piece (connected component).
  double piece_share(std::uint32_t point) const { return piece_share_[piece_[point]]; }
  /// Whether a patch is more than half of its piece.
  bool most_of_piece(std::uint32_t point) const { return 2 * share(point) > piece_share(point); }
  /// Edges between patches.
  std::span<const Edge> broken() const noexcept { return as_span(broken_); }

  /// Share of the mesh's area that is cut off from the greatest patches of its pieces. Meshes that were read right have
  /// 0 to 0.015, where hands touch thighs and upper arms the chest; crossed shins that end in each other's feet 0.05.
  double torn() const {
    std::vector<double> greatest(share_.size());
    for (std::uint32_t p = 0; p < share_.size(); ++p)
      greatest[piece_[p]] = std::max(greatest[piece_[p]], share_[patch_[p]]);
    double sum = 0;
    for (std::uint32_t p = 0; p < share_.size(); ++p)
      if (piece_[p] == p) sum += piece_share_[p] - greatest[p];
    return sum;
  }

 private:
  std::vector<std::uint32_t> patch_, piece_;  ///< [P] the least point of each
  std::vector<double> share_, piece_share_;   ///< [P] at the least point of each
  std::vector<Edge> broken_;
};

}  // namespace npt::inline NPT_ABI
