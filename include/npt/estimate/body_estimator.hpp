/// Reads how a body lies in a mesh: a network reads where each point belongs on a resting body, and the body with
/// proportions is fitted to points and places. What doesn't fit well is looked at again: limbs in other poses, the mesh
/// from other sides, with another axis up.
/// Shapes    meshes: [V, 3] floats with triangles
/// Threads   all members are const and may be called by any number of threads at a time
/// Numerics  the same bits for any number of threads
/// Errors    npt::Error for a mesh without triangles that have an area, and for coordinates that are not finite
/// Source    docs/how-it-works.md
#pragma once

#include <npt/base/control.hpp>
#include <npt/base/default_executor.hpp>
#include <npt/base/error.hpp>
#include <npt/base/matrix3.hpp>
#include <npt/base/sort.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/kinematics.hpp>
#include <npt/body/mannequin/finger_joints.hpp>
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/body/proportions.hpp>
#include <npt/body/skeleton.hpp>
#include <npt/config.hpp>
#include <npt/estimate/body_estimate.hpp>
#include <npt/estimate/body_look_up.hpp>
#include <npt/estimate/confidence.hpp>
#include <npt/estimate/correspondence_estimator.hpp>
#include <npt/estimate/correspondence_fit.hpp>
#include <npt/estimate/finger_fit.hpp>
#include <npt/estimate/fit_surface.hpp>
#include <npt/estimate/fitted_body.hpp>
#include <npt/estimate/limb_search.hpp>
#include <npt/estimate/limb_swap.hpp>
#include <npt/estimate/part_motion.hpp>
#include <npt/mesh/figure_pieces.hpp>
#include <npt/mesh/mesh_view.hpp>
#include <npt/mesh/points.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/mesh/weld.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

struct BodyEstimatorOptions {
  std::size_t read_points = 1500;  ///< of a surface that the network reads
  int turns = 8;                   ///< in which it reads them; half of them where one of these reads well
  bool all_views = false;          ///< all of them, also where one of the first half reads well
  /// Seven candidates instead of the fit's own three: of 110 natural poses 4 instead of 6 end beyond 3 cm, for a tenth
  /// of the time.
  CorrespondenceFitOptions fit{.candidates = 7};
};

template <class Exec = DefaultExecutor>
class BasicBodyEstimator {
 public:
  explicit BasicBodyEstimator(BasicCorrespondenceEstimator<Exec> reader, BodyEstimatorOptions options = {})
      : reader_(std::move(reader)),
        options_(std::move(options)),
        fitter_(std::make_unique<CorrespondenceFitter>(
            std::make_shared<const BodyModel>(with_proportions(mannequin(), human_proportion_deviations)),
            options_.fit)),
        fingers_(std::make_shared<const BodyModel>(with_finger_joints(fitter_->model()))),
        limbs_(fitter_->shared_model()) {}

  /// SMPL's 24 joints: what is fitted.
  const BodyModel& body() const noexcept { return fitter_->model(); }
  /// With finger joints, 40.
  const BodyModel& fingered_body() const noexcept { return fingers_.model(); }

  /// How a body lies in a mesh, or in some of its pieces where the whole is no person: on a floor, beside another.
  BodyEstimate read(const MeshView& mesh, const Control& control = {}) const {
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
    BodyEstimate reading;
    reading.followed = frame;
    reading.contradiction = last.contradiction;
    reading.confidence = last.confidence;
    reading.metres = last.metres;
    reading.centre = last.centre;
    reading.figure = last.figure;
    std::vector<Triangle> kept;
    reading.surface = std::make_shared<const FitSurface>(
        last.surface->moved(as_span(reading.points_of(mesh)), figure_triangles(mesh, last.figure, kept)));
    reading.track = last.track ? last.track : fitter_->track(*last.surface, last.fit);
    SurfaceTrack::Step step = reading.track->follow(*reading.surface, last.fit.body);
    if (step.off > lost) return anew ? *std::move(anew) : read(mesh);
    reading.fit = last.fit;
    reading.fit.body = std::move(step.body);
    reading.hands = fingers_(*reading.surface, reading.fit, last.hands);
    return reading;
  }

 private:
  BodyEstimate read_whole(const MeshView& mesh, const Control& control) const {
    control.step(0);
    BodyEstimate reading;
    reading.surface = surface_of(mesh, reading);
    if (mesh.xyz.size() < 3 * fewest_vertices) return reading;
    const FitSurface& surface = *reading.surface;
    const auto samples = surface.samples().first(std::min(options_.read_points, surface.samples().size()));
    std::vector<Correspondences> readings = read_turns(samples, Matrix3::identity());
    if (least_residual(readings) > hopeless_residual) {
      const Turn best = best_turn(samples);
      if (best.residual > hopeless_residual) return reading;  // nothing like a person
      readings = read_turns(samples, best.upright);
    }
    control.step(0.2);
    fit(surface, readings, reading);
    const BodyEstimate first = reading;
    Searched searched;
    control.step(0.4);
    search_limbs(surface, readings, reading, searched);
    control.step(0.6);
    if (likely(reading) && in_doubt(reading)) read_again(surface, samples, reading);
    control.step(0.8);
    if (reading.likeness() < sure_fit) read_turned(surface, samples, reading);
    control.step(0.9);
    if (likely(reading)) repair_limb_swap(mesh, surface, reading);
    if (reading.fit.body.axis_angles.empty()) return reading;
    reading.contradiction = contradiction_of(samples, reading);
    if (reading.contradiction > clear_contradiction) look_from_front(surface, samples, first, reading);
    reading.confidence = reader_.confidence()(reading.features());
    reading.hands = fingers_(surface, reading.fit);
    return reading;
  }

  /// Below it nothing is looked at again: people in clothes and without have 0.02 to 0.06, wrong fits 0.07 and more.
  static constexpr double clear_contradiction = 0.06;

  /// Of characters whose limbs are thick or short, surfaces alone choose wrongly: what the network says of the mesh as
  /// it stands now is fitted, too, and the fit stays whose contradiction times distance is clearly the least. By
  /// contradiction alone one of 84 people in the accuracy tests loses a leg. first: before limbs were searched
  /// Measured with one network: joints within 5 % of the height in 45 of 75 moments of odd characters before, 55 after.
  void look_from_front(const FitSurface& surface, std::span<const FitSurface::Sample> samples,
                       const BodyEstimate& first, BodyEstimate& reading) const {
    constexpr double clearly = 0.9;
    const auto off = [](const BodyEstimate& e) { return e.contradiction * e.fit.relative_distance; };
    const auto take = [&](BodyEstimate other) {
      if (other.fit.body.axis_angles.empty()) return false;
      other.contradiction = contradiction_of(samples, other);
      if (off(other) > clearly * off(reading)) return false;
      reading = std::move(other);
      return true;
    };
    take(first);
    for (int round = 0; round < 2; ++round) {
      BodyEstimate other = reading;
      const Matrix3 upright = reading.joint_rotation(0).transposed();
      fit(surface, reader_.read(samples, {.turns = 1, .upright = upright}), other);
      if (!take(std::move(other))) return;
    }
  }

  /// A look that the fit had no part in choosing, and that shows what is wrong with it.
  double contradiction_of(std::span<const FitSurface::Sample> samples, const BodyEstimate& reading) const {
    const auto few = samples.first(std::min<std::size_t>(samples.size(), 500));
    const Matrix3 upright = reading.joint_rotation(0).transposed();
    const Correspondences seen = std::move(reader_.read(few, {.turns = 1, .upright = upright}).front());
    const BodyLookUp fitted(body(), reading.fit.body, reading.fit.facing);
    double sum = 0;
    std::uint32_t hint = no_index;
    for (std::size_t i = 0; i < few.size(); ++i) {
      const Vec3d place = fitted.place(fitted(few[i].point, few[i].normal, hint)).rest;
      sum += std::min(length(place - seen[i].place), BodyEstimate::most_contradiction);
    }
    return sum / static_cast<double>(few.size());
  }

  /// Metres between tied points and the surface's, in the median, beyond which a frame is no next one: another person
  /// or another character. Of the frames of eight characters' runs it is 0.5 cm, 1.5 at most.
  static constexpr double lost = 0.02;

  /// A fit with a likeness from here on needs no second look from other sides: of people standing upright most end at
  /// 0.98.
  static constexpr double sure_fit = 0.92;

  /// A mesh of fewer vertices has no limbs that bend: no person, but a tetrahedron reads like one from some sides, and
  /// took 3 s.
  static constexpr std::size_t fewest_vertices = 32;
  /// What is hardly like a person isn't worth a second look.
  static bool likely(const BodyEstimate& reading) {
    return reading.fit.confidence() > 0.7 && reading.fit.correspondence_residual < 0.15;
  }
  static bool in_doubt(const BodyEstimate& reading) {
    return reading.likeness() < sure_fit || reading.doubtful(LimbPair::legs) || reading.doubtful(LimbPair::arms);
  }

  /// Where a body's joints are.
  using Joints = std::vector<Vec3d>;

  static bool same_pose(const Joints& a, const Joints& b) {
    constexpr double apart = 0.01;  // metres
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](Vec3d p, Vec3d q) { return length(p - q) < apart; });
  }

  /// Poses from which limbs of one mesh were searched. Another look mostly ends where the first one did, and a search
  /// from there finds the same again.
  class Searched {
   public:
    /// Whether the pose is a new one for the pair.
    bool add(LimbPair pair, Joints joints) {
      for (const auto& known : poses_)
        if (known.first == pair && same_pose(known.second, joints)) return false;
      poses_.emplace_back(pair, std::move(joints));
      return true;
    }

   private:
    std::vector<std::pair<LimbPair, Joints>> poses_;
  };

  /// Half of the turns; the other half, between them, only where not even the best of these explains its points well.
  std::vector<Correspondences> read_turns(std::span<const FitSurface::Sample> samples, const Matrix3& upright) const {
    const int half = (options_.turns + 1) / 2;
    std::vector<Correspondences> readings = reader_.read(samples, {.turns = half, .upright = upright});
    if (!options_.all_views && least_residual(readings) < good_residual) return readings;
    const Matrix3 between = rotation_matrix({0, std::numbers::pi / half, 0});
    for (Correspondences& r : reader_.read(samples, {.turns = half, .upright = between * upright}))
      readings.push_back(std::move(r));
    return readings;
  }

  /// A second look in the directions between the first ones, the likeliest readings fitted each for itself, until one
  /// ends in the same pose; kept where it is nearer.
  void read_again(const FitSurface& surface, std::span<const FitSurface::Sample> samples, BodyEstimate& reading) const {
    constexpr std::size_t looks = 3;
    const Matrix3 between = rotation_matrix({0, std::numbers::pi / options_.turns, 0});
    const std::vector<Correspondences> readings = reader_.read(samples, {.turns = options_.turns, .upright = between});
    std::vector<std::pair<double, std::size_t>> ranked;
    ranked.reserve(readings.size());
    for (const Correspondences& r : readings) ranked.emplace_back(motion_of(r).residual, ranked.size());
    std::sort(ranked.begin(), ranked.end());
    Searched searched;
    search_limbs(surface, readings, reading, searched);
    for (std::size_t i = 0; in_doubt(reading) && i < std::min(looks, ranked.size()); ++i) {
      const Correspondences& r = readings[ranked[i].second];
      BodyEstimate other = reading;
      fit(surface, std::span(&r, 1), other);
      const bool confirmed = !other.fit.body.axis_angles.empty() &&
                             same_pose(fitted_joints(body(), other.fit.body), fitted_joints(body(), reading.fit.body));
      if (other.fit.relative_distance < 1.3 * reading.fit.relative_distance)
        search_limbs(surface, std::span(&r, 1), other, searched);
      if (other.likeness() > 0.5 * reading.likeness() && other.fit.relative_distance < reading.fit.relative_distance)
        reading = std::move(other);
      if (confirmed) return;
    }
  }

  /// Other poses of arms or legs that are in doubt, unless they were searched from this pose before.
  void search_limbs(const FitSurface& surface, std::span<const Correspondences> readings, BodyEstimate& reading,
                    Searched& searched) const {
    if (reading.fit.confidence() < 0.7) return;
    std::vector<LimbSearch::Angles> read;
    for (int round = 0; round < 2; ++round) {
      const double before = reading.fit.relative_distance;
      for (const LimbPair pair : {LimbPair::legs, LimbPair::arms}) {
        if (!reading.doubtful(pair) || !searched.add(pair, fitted_joints(body(), reading.fit.body))) continue;
        if (read.empty()) read = read_angles(readings, reading);
        const std::vector<BodyFit> starts =
            limbs_(surface, reading.fit.body, pair, reading.fit.facing, read, 8, executor());
        reading.fit = fitter_->nearest(surface, reading.fit, starts, executor());
      }
      if (reading.fit.relative_distance > 0.97 * before) return;
    }
  }

  /// Where limbs that touch or cross were taken for each other, a fit from places that were mended along the surface;
  /// kept where it comes as near and tears the surface apart less.
  void repair_limb_swap(const MeshView& mesh, const FitSurface& surface, BodyEstimate& reading) const {
    constexpr double least_torn = 0.015;
    if (!limbs_touch(body(), reading.fit.body)) return;
    const Welding welding = weld(mesh.xyz);
    const std::vector<Triangle> triangles = welding.welded(mesh.triangles);
    const std::vector<Vec3d> all = reading.points_of(mesh);
    std::vector<Vec3d> points;
    points.reserve(welding.point_count());
    for (const std::uint32_t v : welding.vertex_of) points.push_back(all[v]);
    const auto limb_swap_of = [&](const CorrespondenceFit& fit) {
      return LimbSwap(BodyLookUp(body(), fit.body, fit.facing), points, triangles);
    };
    const LimbSwap now = limb_swap_of(reading.fit);
    if (now.torn() < least_torn) return;
    const std::optional<Correspondences> mended = now.mended();
    if (!mended) return;
    BodyEstimate other = reading;
    fit(surface, std::span(&*mended, 1), other);
    if (other.fit.body.axis_angles.empty() || other.fit.relative_distance > 1.05 * reading.fit.relative_distance ||
        limb_swap_of(other.fit).torn() > 0.6 * now.torn())
      return;
    // What the network read is no surer for that.
    other.fit.correspondence_residual = reading.fit.correspondence_residual;
    if (other.likeness() > std::min(0.8, reading.likeness() - 0.02)) reading = std::move(other);
  }

  /// Of each reading the angles of the motion, limbs hung on the fitted trunk.
  std::vector<LimbSearch::Angles> read_angles(std::span<const Correspondences> readings,
                                              const BodyEstimate& reading) const {
    constexpr std::array limb_roots =
        joint_indices(SmplJoint::left_hip, SmplJoint::right_hip, SmplJoint::left_collar, SmplJoint::right_collar);
    std::vector<LimbSearch::Angles> all;
    const std::vector<Rigid> fitted = body().bone_motions(reading.fit.body.betas, reading.fit.body.axis_angles);
    for (const Correspondences& r : readings) {
      const PartMotion motion = motion_of(r);
      LimbSearch::Angles& angles = all.emplace_back(motion.axis_angles.begin(), motion.axis_angles.end());
      for (const std::size_t j : limb_roots) {
        const auto parent = static_cast<std::size_t>(smpl_parents[j]);
        set_joint_rotation(as_span(angles), j, fitted[parent].rotation.transposed() * motion.parts[j].rotation);
      }
    }
    return all;
  }

  /// Reads meshes that lie, stand on their hands, or have another vertical axis: turned so that each axis points up,
  /// few points in four directions; the best by the motion's residual is read and fitted, unless the trunk lies there
  /// as it was read before, and kept where it is better.
  void read_turned(const FitSurface& surface, std::span<const FitSurface::Sample> samples,
                   BodyEstimate& reading) const {
    const Turn best = best_turn(samples);
    if (reading.likeness() > 0) {
      // Half a radian or so: then the trunk lies where it was read before, and the fit would end where it is.
      constexpr double same_root = 0.9;
      const bool same = (best.root - reading.joint_rotation(0)).squared_norm() < same_root * same_root;
      if (best.residual > (same ? 0.9 : 1.1) * reading.fit.correspondence_residual) return;
    }
    BodyEstimate other = reading;
    const std::vector<Correspondences> turned = read_turns(samples, best.upright);
    fit(surface, turned, other);
    Searched searched;
    search_limbs(surface, turned, other, searched);
    if (other.likeness() > reading.likeness()) reading = std::move(other);
  }

  /// Residual of the best of several readings, from few points, beyond which a mesh isn't worth a fit: people have 0.02
  /// to 0.12 and some 0.17 before limbs are swapped, a tetrahedron or a cube 0.2 and more.
  static constexpr double hopeless_residual = 0.19;
  /// The same, below which half of the turns are enough.
  static constexpr double good_residual = 0.05;

  double least_residual(std::span<const Correspondences> readings) const {
    double least = std::numeric_limits<double>::infinity();
    for (const Correspondences& r : readings) least = std::min(least, motion_of(r).residual);
    return least;
  }
  /// From few of its points.
  PartMotion motion_of(const Correspondences& r) const {
    return part_motion(fitter_->correspondence_template(), std::span(r).first(std::min<std::size_t>(r.size(), 400)));
  }

  struct Turn {
    Matrix3 upright = Matrix3::identity();
    double residual = std::numeric_limits<double>::infinity();
    Matrix3 root;  ///< the trunk's rotation as it is read then
  };

  /// Of the turns that make another axis point up the one whose readings, of few points, fit best.
  Turn best_turn(std::span<const FitSurface::Sample> samples) const {
    const double h = std::numbers::pi / 2;
    const std::array<Vec3d, 5> turns{{{2 * h, 0, 0}, {h, 0, 0}, {-h, 0, 0}, {0, 0, h}, {0, 0, -h}}};
    const auto few = samples.first(std::min<std::size_t>(samples.size(), 500));
    Turn best;
    for (const Vec3d turn : turns) {
      const Matrix3 upright = rotation_matrix(turn);
      for (const Correspondences& r : reader_.read(few, {.turns = 4, .upright = upright}))
        if (const PartMotion motion = motion_of(r); motion.residual < best.residual)
          best = {upright, motion.residual, motion.parts[0].rotation};
    }
    return best;
  }

  /// Fits the body; a mesh of quite another size than any body's keeps none.
  void fit(const FitSurface& surface, std::span<const Correspondences> readings, BodyEstimate& reading) const {
    try {
      reading.fit = fitter_->fit(surface, readings, executor());
    } catch (const Error&) {
      reading.fit = {};
    }
  }

  /// The surface at about a body's size, about its own centre.
  std::shared_ptr<const FitSurface> surface_of(const MeshView& mesh, BodyEstimate& reading) const {
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
    return std::make_shared<const FitSurface>(std::span<const Vec3d>(points), mesh.triangles, FitSurface::default_count,
                                              std::string(mesh.name));
  }

  const Exec& executor() const { return reader_.engine().executor(); }

  BasicCorrespondenceEstimator<Exec> reader_;
  BodyEstimatorOptions options_;
  std::unique_ptr<const CorrespondenceFitter> fitter_;
  FingerFitter fingers_;
  LimbSearch limbs_;
};

using BodyEstimator = BasicBodyEstimator<>;

}  // namespace npt::inline NPT_ABI
