/// Follows a surface whose triangles stay the same, as the frames of a sequence: points of the first frame's surface
/// are tied to the body that was fitted to it, each moving with the parts on which it lay, and the next frames' angles
/// are those that bring the tied points nearest to where the surface's points have gone. Nothing is searched, so that a
/// surface that stays stays, and clothes or hair that keep a distance from the body keep it. From a frame that jumps,
/// the parts' rotations in closed form lead the way.
///   SurfaceTrack track(model, full_level, tree, surface, fit, facing);
///   SurfaceTrack::Step step = track.follow(surface.moved(points, triangles), fit);     with the last frame's fit
/// Units     metres, radians
/// Numerics  double. A further frame of a transfer, fingers and skinning included, takes 3.6 ms on one core of an EPYC
///           with AVX-512; with the body fitted anew to each frame it took 17 to 24. Eight characters of a shooter that
///           run: 6 to 17e-4 for five of them instead of 11 to 28e-4
/// Threads   a track may be followed by several threads at a time
/// Source    Nocedal and Wright, "Numerical Optimization", 2006, section 10.3 (Levenberg and Marquardt)
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/matrix3.hpp>
#include <npt/base/rigid.hpp>
#include <npt/base/sort.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/body_tables.hpp>
#include <npt/body/kinematics.hpp>
#include <npt/body/sparse_matrix.hpp>
#include <npt/config.hpp>
#include <npt/estimate/body_level.hpp>
#include <npt/estimate/differentiable_body.hpp>
#include <npt/estimate/fit_surface.hpp>
#include <npt/estimate/fitted_body.hpp>
#include <npt/estimate/robust_distance.hpp>
#include <npt/mesh/closest_point.hpp>
#include <npt/mesh/skinning.hpp>
#include <npt/solve/nearest_rotation.hpp>
#include <npt/solve/normal_equations.hpp>

#include <algorithm>
#include <array>
#include <cmath>
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

  /// level: the model's full one; tree: of its triangles; facing: as CorrespondenceFit's.
  BasicSurfaceTrack(const BodyModel& model, const BodyLevel& level, TriangleTree tree, const FitSurface& surface,
                    const BodyFit& fit, double facing)
      : body_(tied(model, level, std::move(tree), surface, fit, facing, samples_, parts_)), rest_(samples_.size()) {
    const std::vector<double> x(body_.parameter_count());
    DifferentiableBody::State state;
    body_.forward(as_span(x), state, as_span(rest_));
  }

  /// The angles and the place of the next frame, from those of the last one; its shape is the last one's.
  /// Requires  a surface moved from the one that the track began with
  Step follow(const FitSurface& surface, const BodyFit& last) const {
    std::vector<double> x{last.translation.x, last.translation.y, last.translation.z};
    x.insert(x.end(), last.axis_angles.begin(), last.axis_angles.end());
    Solver solver(*this, surface, x);
    if (solver.off() > jump) {
      const std::vector<double> other = by_parts(surface);
      if (Solver parts(*this, surface, other); parts.off() < solver.off()) solver = std::move(parts);
    }
    solver.run();
    x = solver.x();
    Step step{last, solver.off()};
    step.body.translation = {x[0], x[1], x[2]};
    for (std::size_t i = 3; i < x.size(); ++i) step.body.axis_angles[i - 3] = static_cast<float>(x[i]);
    return step;
  }

 private:
  static constexpr std::size_t most_samples = 800;
  static constexpr double jump = 0.05;  ///< metres, median

  Vec3d target(const FitSurface& surface, std::size_t k) const { return surface.samples()[samples_[k]].point; }

  /// Each part turned by itself to where its points are; parts of too few points go with the one above.
  std::vector<double> by_parts(const FitSurface& surface) const {
    constexpr double few = 8;
    const std::size_t joints = body_.joint_count();
    std::vector<Vec3d> from(joints), to(joints);
    std::vector<double> count(joints);
    for (std::size_t k = 0; k < rest_.size(); ++k)
      from[parts_[k]] += rest_[k], to[parts_[k]] += target(surface, k), ++count[parts_[k]];
    std::vector<std::array<Vec3d, 3>> columns(joints);
    for (std::size_t k = 0; k < rest_.size(); ++k) {
      const std::size_t j = parts_[k];
      const Vec3d p = rest_[k] - from[j] / count[j], q = target(surface, k) - to[j] / count[j];
      columns[j][0] += q * p.x, columns[j][1] += q * p.y, columns[j][2] += q * p.z;
    }
    std::vector<double> x(body_.parameter_count());
    std::vector<Matrix3> rotations(joints);
    for (std::size_t j = 0; j < joints; ++j) {
      const Matrix3 above = j > 0 ? rotations[static_cast<std::size_t>(body_.parents()[j])] : Matrix3::identity();
      rotations[j] = count[j] < few ? above : matrix_of(nearest_rotation(columns[j]));
      const Vec3d angles = axis_angle(above.transposed() * rotations[j]);
      x[3 + 3 * j] = angles.x, x[4 + 3 * j] = angles.y, x[5 + 3 * j] = angles.z;
    }
    DifferentiableBody::State state;
    std::vector<Vec3d> points(rest_.size());
    body_.forward(as_span(x), state, as_span(points));
    Vec3d shift;
    for (std::size_t k = 0; k < points.size(); ++k) shift += target(surface, k) - points[k];
    shift = shift / std::max(1.0, static_cast<double>(points.size()));
    x[0] = shift.x, x[1] = shift.y, x[2] = shift.z;
    return x;
  }

  class Solver {
   public:
    Solver(const BasicSurfaceTrack& track, const FitSurface& surface, const std::vector<double>& x)
        : track_(&track), surface_(&surface), anchor_(x), now_(placed(x)), equations_(x.size()), row_(x.size()) {}

    const std::vector<double>& x() const noexcept { return now_.x; }

    /// The median distance between tied points and the surface's.
    double off() const {
      std::vector<double> distances(now_.points.size());
      for (std::size_t k = 0; k < distances.size(); ++k) distances[k] = length(now_.points[k] - target(k));
      return distances.empty() ? 0 : median(std::span(distances));
    }

    void run() {
      double damping = 1e-4;
      for (int i = 0; i < 12; ++i) {
        scale_ = std::max(least_scale, 2 * off());
        const double before = value(now_);
        linearise();
        bool better = false;
        double largest = 0;
        for (int attempt = 0; attempt < 4 && !better; ++attempt) {
          std::vector<double> trial = now_.x;
          const std::vector<double> step = equations_.solve(damping, 1e-6);
          largest = 0;
          for (const double s : step) largest = std::max(largest, std::abs(s));
          const double share = largest > most_turn ? most_turn / largest : 1;
          for (std::size_t k = 0; k < step.size(); ++k) trial[k] += share * step[k];
          Place there = placed(std::move(trial));
          better = value(there) <= before;
          damping = better ? std::max(0.1 * damping, 1e-6) : std::max(10 * damping, 1e-3);
          if (better) now_ = std::move(there);
        }
        if (!better || largest < enough) return;
      }
    }

   private:
    static constexpr double least_scale = 0.05, most_turn = 0.7, enough = 5e-4, anchored = 2e-3;

    /// Parameters, and where they put the tied points.
    struct Place {
      std::vector<double> x;
      DifferentiableBody::State state;
      std::vector<Vec3d> points;
    };

    Place placed(std::vector<double> x) const {
      Place place{std::move(x), {}, std::vector<Vec3d>(track_->samples_.size())};
      track_->body_.forward(place.x, place.state, place.points);
      return place;
    }

    Vec3d target(std::size_t k) const { return track_->target(*surface_, k); }

    double value(const Place& place) const {
      double sum = 0;
      for (std::size_t k = 0; k < place.points.size(); ++k) {
        const Vec3d d = place.points[k] - target(k);
        sum += robust_squared(dot(d, d), scale_);
      }
      double anchor = 0;
      for (std::size_t i = 3; i < place.x.size(); ++i) anchor += (place.x[i] - anchor_[i]) * (place.x[i] - anchor_[i]);
      return per_square_metre * sum / static_cast<double>(place.points.size()) + anchored * anchor;
    }

    /// About where it is now.
    void linearise() {
      const auto& [x, state, points] = now_;
      track_->body_.derivatives(x, state, derivatives_);
      equations_.clear();
      for (std::uint32_t k = 0; k < points.size(); ++k) {
        const Vec3d d = points[k] - target(k);
        const double share = scale_ * scale_ / (dot(d, d) + scale_ * scale_);
        const double weight = per_square_metre * share * share / static_cast<double>(points.size());
        const auto add = [&](Vec3d direction, double residual) {
          track_->body_.row(now_.state, derivatives_, {k, k, k}, {1, 0, 0}, direction, row_);
          equations_.add(as_span(row_), weight, residual);
        };
        add({1, 0, 0}, d.x);
        add({0, 1, 0}, d.y);
        add({0, 0, 1}, d.z);
      }
      for (std::size_t i = 3; i < x.size(); ++i) {
        equations_.add_to_matrix(i, i, anchored);
        equations_.add_to_right(i, anchored * (x[i] - anchor_[i]));
      }
    }

    const BasicSurfaceTrack* track_;
    const FitSurface* surface_;
    std::vector<double> anchor_;  ///< what the surface doesn't say stays where it begins
    double scale_ = least_scale;
    Place now_;
    DifferentiableBody::Derivatives derivatives_;
    NormalEquations equations_;
    std::vector<double> row_;
  };

  /// A body whose vertices are the surface's points as they lie on the resting body, and the joints.
  static DifferentiableBody tied(const BodyModel& model, const BodyLevel& level, TriangleTree tree,
                                 const FitSurface& surface, const BodyFit& fit, double facing,
                                 std::vector<std::uint32_t>& samples, std::vector<std::uint32_t>& parts) {
    const std::vector<Rigid> motions = model.bone_motions(as_span(fit.betas), as_span(fit.axis_angles));
    const std::vector<Vec3d> posed = fitted_points(model, fit);
    tree.move(as_span(posed), level.triangles());
    BodyTables tables;
    tables.parents = model.tables().parents;
    tables.weights.columns = tables.parents.size();
    const auto add = [&tables](Vec3d p) {
      for (const double c : {p.x, p.y, p.z}) tables.v_template.push_back(static_cast<float>(c));
      tables.weights.end_row();
    };
    std::vector<std::uint32_t> vertices;
    for (std::uint32_t k = 0; k < std::min(most_samples, surface.samples().size()); ++k) {
      const FitSurface::Sample& s = surface.samples()[k];
      const ClosestPoint c = tree.closest(s.point, [&](std::uint32_t t) {
        const auto& [p, q, r] = level.triangles()[t];
        const double cosine = dot(cross(posed[q] - posed[p], posed[r] - posed[p]), s.normal);
        return facing == 0 || facing * cosine > 0;
      });
      if (c.triangle == no_index) continue;
      std::map<std::uint32_t, double> weights;
      const SparseMatrix& skin = model.tables().weights;
      for (std::size_t corner = 0; corner < 3; ++corner) {
        const std::size_t v = level.triangles()[c.triangle][corner];
        for (std::size_t i = skin.start[v]; i < skin.start[v + 1]; ++i)
          weights[skin.column[i]] += c.weights[corner] * static_cast<double>(skin.value[i]);
      }
      Affine moved{Matrix3{}, fit.translation};
      for (const auto& [j, w] : weights) {
        add_motion(moved, motions[j], w);
        tables.weights.append(j, static_cast<float>(w));
      }
      add(inverse(moved)(s.point));
      vertices.push_back(static_cast<std::uint32_t>(samples.size()));
      samples.push_back(k);
      const auto less = [](const auto& a, const auto& b) { return a.second < b.second; };
      parts.push_back(std::max_element(weights.begin(), weights.end(), less)->first);
    }
    tables.J_regressor.columns = vertices.size() + tables.parents.size();
    const std::vector<Vec3d> joints = model.joints(as_span(fit.betas));
    for (std::size_t j = 0; j < joints.size(); ++j) {
      tables.weights.append(static_cast<std::uint32_t>(j), 1);
      add(joints[j]);
      tables.J_regressor.append(static_cast<std::uint32_t>(vertices.size() + j), 1);
      tables.J_regressor.end_row();
    }
    return DifferentiableBody(BodyModel(std::move(tables), "track"), std::move(vertices));
  }

  std::vector<std::uint32_t> samples_;  ///< [n] of the surface
  std::vector<std::uint32_t> parts_;    ///< [n] joints that move them most
  DifferentiableBody body_;             ///< n points
  std::vector<Vec3d> rest_;             ///< [n]
};

}  // namespace npt::inline NPT_ABI
