/// Crossed limbs, read again by what the mesh is connected to. Where shins or forearms cross or lie side by side, a fit
/// may end with each in the other one's place: every point of the surface is near the body, and no distance shows it.
/// But the mesh's knee then leads into the other shin. Patches that are cut off (place_patches.hpp) and whose places'
/// mirror images would go on from what is around them belong to the other side; from the places so mended a body is
/// fitted anew.
/// Units     metres
/// Source    ours
#pragma once

#include <npt/base/executor.hpp>
#include <npt/base/vec3.hpp>
#include <npt/base/weighted_choice.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/body_plan.hpp>
#include <npt/body/fitted_body.hpp>
#include <npt/body/kinematics.hpp>
#include <npt/config.hpp>
#include <npt/estimate/body_look_up.hpp>
#include <npt/estimate/correspondence_fit.hpp>
#include <npt/estimate/part_motion.hpp>
#include <npt/estimate/place_patches.hpp>
#include <npt/estimate/robust_distance.hpp>
#include <npt/mesh/area_sampler.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/normals.hpp>
#include <npt/mesh/sampled_surface.hpp>
#include <npt/mesh/topology.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// Whether parts of a fitted body that aren't grown together come near each other. Without that limbs can't have been
/// taken for each other.
NPT_INLINE bool limbs_touch(const BodyModel& model, const BodyFit& fit) {
  // About a thousand vertices, of a person 4 cm apart.
  const std::size_t stride = std::max<std::size_t>(1, (model.vertex_count() + 500) / 1000);
  const std::vector<std::uint32_t> parts = model.tables().weights.heaviest_columns();
  const std::vector<Vec3d> points = fitted_points(model, fit);
  for (std::size_t a = 0; a < points.size(); a += stride)
    for (std::size_t b = 0; b < a; b += stride) {
      const Vec3d d = points[a] - points[b];
      if (dot(d, d) < usual_error * usual_error &&
          bones_between(as_span(model.tables().parents), parts[a], parts[b]) >= 4)
        return true;
    }
  return false;
}

NPT_INLINE_CLASS(class, LimbSwap);
/// A mesh and where its points lie on a body that was fitted to it.
template <class>
class BasicLimbSwap {
 public:
  /// points: [P], of a mesh whose vertices in one place are one. The plan must outlive it.
  template <Executor Exec = SerialExecutor>
  BasicLimbSwap(const BodyPlan& plan, const BodyLookUp& body, std::span<const Vec3d> points,
                std::span<const Triangle> triangles, const Exec& executor = Exec())
      : plan_(plan),
        points_(points),
        triangles_(triangles),
        places_(looked_up(body, points, triangles, executor)),
        patches_(plan, points, triangles, edges_of_triangles(triangles), places_) {}

  /// PlacePatches::torn
  double torn() const { return patches_.torn(); }

  /// Points of the surface, drawn by area, with mended places; without those that no mending brings together with what
  /// is around them, and without small pieces: which of two feet a shoe is on, no edge tells. Nothing where no point
  /// belongs to the other side, or too few are left.
  std::optional<Correspondences> mended() const {
    const std::vector<State> states = judged();
    if (std::find(states.begin(), states.end(), State::mirrored) == states.end()) return std::nullopt;
    const WeightedChoice areas = weigh_by_area(triangles_, [this](std::uint32_t v) { return points_[v]; });
    Correspondences reading;
    bool any_mirrored = false;
    for (const TrianglePoint& drawn : spread_points(areas, SampledSurface::default_count, 20261125)) {
      const Triangle& t = triangles_[drawn.triangle];
      const State state = states[patches_.patch(t[0])];
      if (state == State::doubted || patches_.piece_share(t[0]) < small_share ||
          patches_.patch(t[0]) != patches_.patch(t[1]) || patches_.patch(t[0]) != patches_.patch(t[2]))
        continue;
      PointCorrespondence& p = reading.emplace_back();
      p.point = (points_[t[0]] + points_[t[1]] + points_[t[2]]) / 3;
      p.normal = normalised(vector_of(t));
      p.place = (places_[t[0]].rest + places_[t[1]].rest + places_[t[2]].rest) / 3;
      if (state == State::mirrored) p.place.x = -p.place.x, any_mirrored = true;
    }
    if (!any_mirrored || reading.size() < BodyView::few) return std::nullopt;
    return reading;
  }

 private:
  enum class State { doubted, believed, mirrored };

  template <Executor Exec>
  static std::vector<BodyPlace> looked_up(const BodyLookUp& body, std::span<const Vec3d> points,
                                          std::span<const Triangle> triangles, const Exec& executor) {
    const std::vector<Vec3d> outward = area_vectors(points, triangles);
    std::vector<BodyPlace> places(points.size());
    body.for_each(points, as_span(outward), executor,
                  [&](std::size_t p, const auto& where) { places[p] = body.place(where); });
    return places;
  }

  BodyPlace mirrored(BodyPlace place) const {
    place.rest.x = -place.rest.x;
    place.part = static_cast<std::uint32_t>(plan_.joints[place.part].mirrored);
    return place;
  }

  /// [P] at the least point of each patch: from the greatest ones outwards, each by most edges to what is judged.
  std::vector<State> judged() const {
    std::vector<State> states(points_.size(), State::doubted);
    const std::vector<int> parents = plan_.parents();
    for (std::uint32_t p = 0; p < points_.size(); ++p)
      if (patches_.most_of_piece(p)) states[patches_.patch(p)] = State::believed;
    struct Votes {
      std::size_t mirrored = 0, all = 0;
    };
    for (bool changed = true; changed;) {
      changed = false;
      std::vector<Votes> votes(points_.size());
      for (const Edge& e : patches_.broken())
        for (const auto& [own, other] : {std::pair(e[0], e[1]), std::pair(e[1], e[0])}) {
          const State around = states[patches_.patch(other)];
          if (states[patches_.patch(own)] != State::doubted || around == State::doubted) continue;
          Votes& v = votes[patches_.patch(own)];
          ++v.all;
          const BodyPlace there = around == State::mirrored ? mirrored(places_[other]) : places_[other];
          if (continuous_places(plan_, as_span(parents), mirrored(places_[own]), there,
                                length(points_[own] - points_[other])))
            ++v.mirrored;
        }
      for (std::size_t p = 0; p < votes.size(); ++p)
        if (2 * votes[p].mirrored > votes[p].all) states[p] = State::mirrored, changed = true;
    }
    return states;
  }

  Vec3d vector_of(const Triangle& t) const {
    return cross(points_[t[1]] - points_[t[0]], points_[t[2]] - points_[t[0]]);
  }

  const BodyPlan& plan_;
  std::span<const Vec3d> points_;
  std::span<const Triangle> triangles_;
  std::vector<BodyPlace> places_;
  PlacePatches patches_;
};

}  // namespace npt::inline NPT_ABI
