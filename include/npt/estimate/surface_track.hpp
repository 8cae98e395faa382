/// Follows a surface whose triangles stay the same, as the frames of a sequence: points of the first frame's surface
/// are tied to the body that was fitted to it, each moving with the parts on which it lay, and the next frames' angles
/// are those that bring the tied points nearest to where the surface's points have gone. Nothing is searched, so that a
/// surface that stays stays, and clothes or hair that keep a distance from the body keep it.
///   SurfaceTrack track(model, surface, fit, facing);
///   SurfaceTrack::Step step = track.follow(surface.moved(points, triangles), fit);     with the last frame's fit
/// Units     metres, radians
/// Numerics  double
/// Threads   a track may be followed by several threads at a time
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/as_span.hpp>
#include <npt/base/rigid.hpp>
#include <npt/base/sort.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/body_tables.hpp>
#include <npt/body/differentiable_body.hpp>
#include <npt/body/fitted_body.hpp>
#include <npt/body/point_equations.hpp>
#include <npt/config.hpp>
#include <npt/estimate/body_look_up.hpp>
#include <npt/estimate/robust_distance.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/sampled_surface.hpp>
#include <npt/mesh/skinning.hpp>
#include <npt/solve/damped_steps.hpp>
#include <npt/solve/normal_equations.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {
NPT_INLINE_CLASS(class, SurfaceTrack);
template <class>
class BasicSurfaceTrack {
 public:
  struct Step {
    BodyFit body;
    double off = 0;  ///< median distance between tied points and the surface's, in metres
  };

  /// facing: as CorrespondenceFit's.
  BasicSurfaceTrack(const BodyModel& model, const SampledSurface& surface, const BodyFit& fit, double facing)
      : body_(tied(model, surface.samples().first(std::min(most_samples, surface.samples().size())), fit, facing)) {}

  /// The angles and the place of the next frame, from those of the last one; its shape is the last one's.
  /// Requires  a surface moved from the one that the track began with
  Step follow(const SampledSurface& surface, const BodyFit& last) const {
    BodyFit body = last;
    body.betas.clear();
    const std::vector<double> x = parameters_of(body, body_.parameter_count());
    Solver solver(*this, surface, x);
    // From one natural pose to another it takes up to 30 steps, from frame to frame a few.
    take_damped_steps(solver, {.steps = 30, .enough = 1e-3});
    body = fit_of(solver.x(), body_.joint_count());
    body.betas = last.betas;
    return {std::move(body), solver.off()};
  }

 private:
  static constexpr std::size_t most_samples = 800;

  class Solver {
   public:
    Solver(const BasicSurfaceTrack& track, const SampledSurface& surface, const std::vector<double>& x)
        : track_(&track), surface_(&surface), anchor_(x), now_(placed(x)), equations_(x.size()) {}

    const std::vector<double>& x() const noexcept { return now_.x; }

    /// The median distance between tied points and the surface's.
    double off() const {
      std::vector<double> distances;
      for (std::size_t k = 0; k < now_.points.size(); ++k) distances.push_back(length(off_of(now_, k)));
      return distances.empty() ? 0 : median(std::span(distances));
    }

    /// take_damped_steps() asks these.
    double value() const { return value_of(now_); }
    double try_step(std::span<const double> step) {
      trial_ = placed(track_->body_.stepped(now_.x, step));
      whole_step_ = track_->body_.allowed_share(step) == 1;
      return value_of(trial_);
    }
    bool whole_step() const noexcept { return whole_step_; }
    void take_step() { std::swap(now_, trial_); }
    const NormalEquations& linearise() {
      scale_ = std::max(usual_error, 2 * off());
      PointEquations points(track_->body_, as_span(now_.x), now_.state, now_.points.size());
      for (std::uint32_t k = 0; k < now_.points.size(); ++k) {
        const Vec3d d = off_of(now_, k);
        points.add({k, k, k}, {1, 0, 0}, d,
                   per_square_metre * robust_weight(dot(d, d), scale_) / static_cast<double>(now_.points.size()));
      }
      equations_.clear();
      points.sum_into(equations_);
      for (std::size_t i = 3; i < now_.x.size(); ++i) {
        equations_.add_to_matrix(i, i, anchored);
        equations_.add_to_right(i, anchored * (now_.x[i] - anchor_[i]));
      }
      return equations_;
    }

   private:
    static constexpr double anchored = 2e-3;

    /// Parameters, and where they put the tied points.
    struct Place {
      std::vector<double> x;
      DifferentiableBody::State state;
      std::vector<Vec3d> points;
    };

    Place placed(std::vector<double> x) const {
      Place place{std::move(x), {}, std::vector<Vec3d>(track_->body_.vertex_count())};
      track_->body_.forward(place.x, place.state, place.points);
      return place;
    }

    Vec3d off_of(const Place& place, std::size_t k) const { return place.points[k] - surface_->samples()[k].point; }

    double value_of(const Place& place) const {
      double sum = 0, anchor = 0;
      for (std::size_t k = 0; k < place.points.size(); ++k) {
        const Vec3d d = off_of(place, k);
        sum += robust_squared(dot(d, d), scale_);
      }
      for (std::size_t i = 3; i < place.x.size(); ++i) anchor += (place.x[i] - anchor_[i]) * (place.x[i] - anchor_[i]);
      return per_square_metre * sum / static_cast<double>(place.points.size()) + anchored * anchor;
    }

    const BasicSurfaceTrack* track_;
    const SampledSurface* surface_;
    std::vector<double> anchor_;  ///< what the surface doesn't say stays where it begins
    double scale_ = usual_error;
    Place now_, trial_;
    bool whole_step_ = true;
    NormalEquations equations_;
  };

  /// A body whose vertices are the surface's points as they lie on the resting body, and the joints.
  static DifferentiableBody tied(const BodyModel& model, std::span<const SampledSurface::Sample> samples,
                                 const BodyFit& fit, double facing) {
    const std::vector<Rigid> motions = model.bone_motions(as_span(fit.betas), as_span(fit.axis_angles));
    const BodyLookUp look_up(model, fit, facing, model.joint_count());
    BodyTables tables;
    tables.parents = model.tables().parents;
    tables.weights.columns = tables.parents.size();
    const auto add = [&tables](Vec3d p) {
      for (const double c : {p.x, p.y, p.z}) tables.v_template.push_back(static_cast<float>(c));
      tables.weights.end_row();
    };
    std::vector<std::uint32_t> vertices;
    std::uint32_t hint = no_index;
    for (const SampledSurface::Sample& s : samples) {
      std::map<std::uint32_t, double> weights;
      look_up.for_each_weight(look_up(s.point, s.normal, hint),
                              [&weights](std::uint32_t joint, double weight) { weights[joint] += weight; });
      Affine moved{Matrix3{}, fit.translation};
      for (const auto& [j, w] : weights) {
        add_motion(moved, motions[j], w);
        tables.weights.append(j, static_cast<float>(w));
      }
      add(inverse(moved)(s.point));
      vertices.push_back(static_cast<std::uint32_t>(vertices.size()));
    }
    tables.J_regressor.columns = vertices.size() + tables.parents.size();
    for (const Vec3d joint : model.joints(as_span(fit.betas))) {
      const auto j = static_cast<std::uint32_t>(tables.J_regressor.rows);
      tables.weights.append(j, 1);
      add(joint);
      tables.J_regressor.append(static_cast<std::uint32_t>(vertices.size()) + j, 1);
      tables.J_regressor.end_row();
    }
    return DifferentiableBody(BodyModel(std::move(tables), "track"), std::move(vertices));
  }

  DifferentiableBody body_;  ///< of the surface's first points
};

}  // namespace npt::inline NPT_ABI
