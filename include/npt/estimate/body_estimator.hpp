/// Estimates how a body of a kind lies in a mesh: a network says where each point belongs on a resting body, and the
/// body with proportions is fitted to points, their places and the surface. Of several fits the one stays that the
/// least speaks against (estimate_search.hpp).
/// Shapes    meshes: [V, 3] floats with triangles
/// Threads   all members are const and may be called by any number of threads at a time
/// Numerics  the same bits for any number of threads
/// Errors    npt::Error for a mesh without triangles that have an area, and for coordinates that are not finite
/// Source    docs/how-it-works.md
#pragma once

#include <npt/base/control.hpp>
#include <npt/base/default_executor.hpp>
#include <npt/base/error.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_kind.hpp>
#include <npt/body/body_model.hpp>
#include <npt/config.hpp>
#include <npt/estimate/body_estimate.hpp>
#include <npt/estimate/confidence.hpp>
#include <npt/estimate/correspondence_estimator.hpp>
#include <npt/estimate/correspondence_fit.hpp>
#include <npt/estimate/correspondence_views.hpp>
#include <npt/estimate/estimate_search.hpp>
#include <npt/estimate/finger_fit.hpp>
#include <npt/estimate/limb_search.hpp>
#include <npt/mesh/figure_pieces.hpp>
#include <npt/mesh/mesh_view.hpp>
#include <npt/mesh/points.hpp>
#include <npt/mesh/sampled_surface.hpp>
#include <npt/mesh/triangles.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

struct BodyEstimatorOptions {
  /// Of a surface that the network reads: a third of a first result's time. With 1000 or 750 3 of 300 people lose a
  /// limb: in wide poses (two seeds) the mean rises from 0.7 to 2.6e-4, and from 0.8 to 5.3e-4.
  std::size_t read_points = 1500;
  ViewOptions views;
  /// Views that are fitted, at most. Seven instead of three: of 110 natural poses 4 instead of 6 end beyond 3 cm, for a
  /// tenth of the time.
  std::size_t candidates = 7;
  std::size_t figure = 0;  ///< of several in a mesh, by number from 1 on (figures()); 0: the one that is recognised
};

template <class Exec = DefaultExecutor>
class BasicBodyEstimator {
 public:
  /// reader: of places on the kind's body at rest
  BasicBodyEstimator(BasicCorrespondenceEstimator<Exec> reader, std::shared_ptr<const BodyKind> kind,
                     BodyEstimatorOptions options = {})
      : reader_(std::move(reader)),
        options_(std::move(options)),
        fitter_(std::make_unique<CorrespondenceFitter>(kind, options_.candidates)),
        fingers_(kind),
        limbs_(std::move(kind)) {}

  const BodyKind& kind() const noexcept { return fitter_->kind(); }
  /// What is fitted.
  const BodyModel& body() const noexcept { return fitter_->model(); }
  const Exec& executor() const { return reader_.engine().executor(); }

  /// How a body lies in a mesh, or in some of its pieces where the whole is no person: on a floor, beside another.
  /// Errors    npt::Error for a mesh of several figures, but fewer than the one that is asked for
  BodyEstimate read(const MeshView& mesh, const Control& control = {}) const {
    if (options_.figure > 0) return read_figure(mesh, control);
    BodyEstimate best = read_whole(mesh, control);
    if (best.confidence >= least_confidence) return best;
    const Control stoppable{.progress = {}, .stop = control.stop};
    std::vector<Triangle> kept;
    for (std::vector<bool>& guess : figure_pieces(mesh)) {
      BodyEstimate part = read_whole({mesh.xyz, figure_triangles(mesh, guess, kept), mesh.name}, stoppable);
      // Else a club is taken for scenery and left behind where its bearer is hardly recognised.
      if (part.confidence < std::max(high_confidence, best.confidence)) continue;
      part.figure = std::move(guess);
      best = std::move(part);
    }
    return best;
  }

  /// The next frame of a sequence, from the last one's reading. Where that is hardly sure, the first, second, fourth,
  /// eighth ... frame is read for itself, too, and the sequence goes on from one that reads surely.
  BodyEstimate follow(const MeshView& mesh, const BodyEstimate& last) const {
    if (last.fit.body.axis_angles.empty()) return read(mesh);
    const std::size_t frame = last.followed + 1;
    std::optional<BodyEstimate> anew;
    if (std::has_single_bit(frame) && last.confidence < high_confidence) {
      anew = read(mesh);
      if (anew->confidence >= high_confidence) return *std::move(anew);
    }
    BodyEstimate reading = last;
    reading.followed = frame;
    std::vector<Triangle> kept;
    reading.surface = std::make_shared<const SampledSurface>(
        last.surface->moved(as_span(reading.points_of(mesh)), figure_triangles(mesh, last.figure, kept)));
    if (!reading.track) reading.track = fitter_->track(*last.surface, last.fit);
    SurfaceTrack::Step step = reading.track->follow(*reading.surface, last.fit.body);
    if (step.off > lost) return anew ? *std::move(anew) : read(mesh);
    reading.fit.body = std::move(step.body);
    reading.hands = fingers_(*reading.surface, reading.fit, last.hands);
    return reading;
  }

 private:
  /// A mesh of one figure is taken whole.
  BodyEstimate read_figure(const MeshView& mesh, const Control& control) const {
    std::vector<std::vector<bool>> all = figures(mesh);
    if (all.size() < 2) return read_whole(mesh, control);
    if (all.size() < options_.figure)
      throw Error({.file = std::string(mesh.name),
                   .found = std::to_string(all.size()) + " figures",
                   .expected = "at least " + std::to_string(options_.figure) + ", the number that is asked for"});
    std::vector<Triangle> kept;
    std::vector<bool>& own = all[options_.figure - 1];
    BodyEstimate part = read_whole({mesh.xyz, figure_triangles(mesh, own, kept), mesh.name}, control);
    part.figure = std::move(own);
    return part;
  }

  BodyEstimate read_whole(const MeshView& mesh, const Control& control) const {
    control.step(0);
    BodyEstimate nothing;
    nothing.fit.part_distances.resize(kind().joint_count());
    nothing.joint_confidence.resize(kind().joint_count());
    nothing.surface = surface_of(mesh, nothing);
    if (mesh.xyz.size() < 3 * fewest_vertices) return nothing;
    const auto all = nothing.surface->samples();
    const auto samples = all.first(std::min(options_.read_points, all.size()));
    const CorrespondenceViews<Exec> views(reader_, fitter_->correspondence_template(), options_.views);
    EstimateSearch<Exec> search(views, *fitter_, limbs_, executor(), mesh, samples, std::move(nothing));
    constexpr double steps = 4;
    control.step(1 / steps);
    search.first_views();
    const auto confident = [&] {
      return search.found() && reader_.confidence()(search.best().residuals) >= high_confidence;
    };
    control.step(2 / steps);
    if (!confident() || reader_.confidence().doubts_joint(search.best().residuals)) search.front_view();
    control.step(3 / steps);
    if (!confident()) search.other_axes();
    if (!search.found()) return search.best();
    search.repair_swaps();
    search.polish();
    BodyEstimate best = search.best();
    best.confidence = reader_.confidence()(best.residuals);
    best.joint_confidence = reader_.confidence().of_joints(best.residuals);
    best.hands = fingers_(*best.surface, best.fit);
    return best;
  }

  /// Metres between tied points and the surface's, in the median, beyond which a frame is no next one: another person
  /// or another character. Of the frames of eight characters' runs it is 0.5 cm, 1.5 at most.
  static constexpr double lost = 0.02;

  /// A mesh of fewer vertices has no limbs that bend: no person, but a tetrahedron reads like one from some sides, and
  /// took 3 s.
  static constexpr std::size_t fewest_vertices = 32;

  /// The surface at about a body's size, about its own centre.
  std::shared_ptr<const SampledSurface> surface_of(const MeshView& mesh, BodyEstimate& reading) const {
    double area = 0;
    Vec3d centre;
    for (const Triangle& t : mesh.triangles) {
      const Vec3d a = point_at(mesh.xyz, t[0]), b = point_at(mesh.xyz, t[1]), c = point_at(mesh.xyz, t[2]);
      const double own = 0.5 * length(cross(b - a, c - a));
      area += own;
      centre += (a + b + c) * (own / 3);
    }
    if (!(area > 0) || !std::isfinite(area))
      throw Error({.file = std::string(mesh.name),
                   .found = std::to_string(mesh.triangles.size()) + " triangles without an area",
                   .expected = "a surface"});
    reading.centre = centre / area;
    reading.metres = std::sqrt(fitter_->area() / area);
    const std::vector<Vec3d> points = reading.points_of(mesh);
    return std::make_shared<const SampledSurface>(std::span<const Vec3d>(points), mesh.triangles,
                                                  SampledSurface::default_count, std::string(mesh.name));
  }

  BasicCorrespondenceEstimator<Exec> reader_;
  BodyEstimatorOptions options_;
  std::unique_ptr<const CorrespondenceFitter> fitter_;
  FingerFitter fingers_;
  LimbSearch limbs_;
};

using BodyEstimator = BasicBodyEstimator<>;

}  // namespace npt::inline NPT_ABI
