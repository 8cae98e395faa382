/// Follows a surface whose triangles stay the same, as the frames of a sequence: points of the first frame's surface are
/// tied to the body that was fitted to it, each moving with the parts on which it lay, and the next frames' angles are
/// those that bring the tied points nearest to where the surface's points have gone. Nothing is searched, so that a
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

#include <npt/body/body_model.hpp>
#include <npt/body/body_tables.hpp>
#include <npt/body/kinematics.hpp>
#include <npt/body/sparse_matrix.hpp>
#include <npt/config.hpp>
#include <npt/core/matrix3.hpp>
#include <npt/core/sort.hpp>
#include <npt/core/vec3.hpp>
#include <npt/fit/body_fit.hpp>
#include <npt/fit/body_level.hpp>
#include <npt/fit/differentiable_body.hpp>
#include <npt/fit/fit_surface.hpp>
#include <npt/fit/robust_distance.hpp>
#include <npt/linear/nearest_rotation.hpp>
#include <npt/linear/normal_equations.hpp>
#include <npt/surface/closest_point.hpp>

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

class SurfaceTrack {
 public:
  struct Step {
    BodyFit body;
    double off = 0;  ///< median distance between tied points and the surface's, in metres
  };

  /// level: the model's full one; tree: of its triangles; facing: as ReadingFit's.
  SurfaceTrack(const BodyModel& model, const BodyLevel& level, TriangleTree tree, const FitSurface& surface,
               const BodyFit& fit, double facing)
      : body_(tied(model, level, std::move(tree), surface, fit, facing, samples_, parts_)), rest_(samples_.size()) {
    const std::vector<double> x(body_.parameter_count());
    DifferentiableBody::State state;
    body_.forward(x, state, rest_);
  }

  /// The angles and the place of the next frame, from those of the last one; its shape is the last one's.
  /// Requires  a surface moved from the one that the track began with
  Step follow(const FitSurface& surface, const BodyFit& last) const {
    std::vector<double> x{last.translation.x, last.translation.y, last.translation.z};
    x.insert(x.end(), last.axis_angles.begin(), last.axis_angles.end());
    Solver solver(*this, surface);
    if (solver.median_off(x) > jump) {
      std::vector<double> other = by_parts(surface);
      if (solver.median_off(other) < solver.median_off(x)) x = std::move(other);
    }
    solver.run(x);
    Step step{last, solver.median_off(x)};
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
      const std::array<Vec3d, 3> own = nearest_rotation(columns[j]).columns();
      rotations[j] = count[j] < few ? above : Matrix3::from_columns(own[0], own[1], own[2]);
      const Vec3d angles = axis_angle(above.transposed() * rotations[j]);
      x[3 + 3 * j] = angles.x, x[4 + 3 * j] = angles.y, x[5 + 3 * j] = angles.z;
    }
    DifferentiableBody::State state;
    std::vector<Vec3d> points(rest_.size());
    body_.forward(x, state, points);
    Vec3d shift;
    for (std::size_t k = 0; k < points.size(); ++k) shift += target(surface, k) - points[k];
    shift = shift / std::max(1.0, static_cast<double>(points.size()));
    x[0] = shift.x, x[1] = shift.y, x[2] = shift.z;
    return x;
  }

  class Solver {
   public:
    Solver(const SurfaceTrack& track, const FitSurface& surface)
        : track_(track),
          surface_(surface),
          equations_(track.body_.parameter_count()),
          row_(track.body_.parameter_count()) {}

    void run(std::vector<double>& x) {
      anchor_ = x;
      double damping = 1e-4;
      for (int i = 0; i < 12; ++i) {
        scale_ = std::max(least_scale, 2 * median_off(x));
        const double before = value(x, state_, points_);
        linearise(x);
        bool better = false;
        double largest = 0;
        for (int attempt = 0; attempt < 4 && !better; ++attempt) {
          std::vector<double> trial = x;
          const std::vector<double> step = equations_.solve(damping, 1e-6);
          largest = 0;
          for (const double s : step) largest = std::max(largest, std::abs(s));
          const double share = largest > most_turn ? most_turn / largest : 1;
          for (std::size_t k = 0; k < step.size(); ++k) trial[k] += share * step[k];
          better = value(trial, trial_state_, trial_points_) <= before;
          damping = better ? std::max(0.1 * damping, 1e-6) : std::max(10 * damping, 1e-3);
          if (better) x = std::move(trial);
        }
        if (!better || largest < enough) return;
      }
    }

    double median_off(const std::vector<double>& x) {
      points_.resize(track_.samples_.size());
      track_.body_.forward(x, state_, points_);
      std::vector<double> off(points_.size());
      for (std::size_t k = 0; k < off.size(); ++k) off[k] = length(points_[k] - target(k));
      return off.empty() ? 0 : median(std::span(off));
    }

   private:
    static constexpr double least_scale = 0.05, most_turn = 0.7, enough = 5e-4, per_square_metre = 1e4, anchored = 2e-3;

    Vec3d target(std::size_t k) const { return track_.target(surface_, k); }

    double value(const std::vector<double>& x, DifferentiableBody::State& state, std::vector<Vec3d>& points) {
      points.resize(track_.samples_.size());
      track_.body_.forward(x, state, points);
      double sum = 0;
      for (std::size_t k = 0; k < points.size(); ++k) {
        const Vec3d d = points[k] - target(k);
        sum += robust_squared(dot(d, d), scale_);
      }
      double anchor = 0;
      for (std::size_t i = 3; i < x.size(); ++i) anchor += (x[i] - anchor_[i]) * (x[i] - anchor_[i]);
      return per_square_metre * sum / static_cast<double>(points.size()) + anchored * anchor;
    }

    /// At state_ and points_.
    void linearise(const std::vector<double>& x) {
      track_.body_.derivatives(x, state_, derivatives_);
      equations_.clear();
      for (std::uint32_t k = 0; k < points_.size(); ++k) {
        const Vec3d d = points_[k] - target(k);
        const double share = scale_ * scale_ / (dot(d, d) + scale_ * scale_);
        const double weight = per_square_metre * share * share / static_cast<double>(points_.size());
        const auto add = [&](Vec3d direction, double residual) {
          track_.body_.row(state_, derivatives_, {k, k, k}, {1, 0, 0}, direction, row_);
          equations_.add(row_, weight, residual);
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

    const SurfaceTrack& track_;
    const FitSurface& surface_;
    std::vector<double> anchor_;  ///< what the surface doesn't say stays where it begins
    double scale_ = least_scale;
    std::vector<Vec3d> points_, trial_points_;
    DifferentiableBody::State state_, trial_state_;
    DifferentiableBody::Derivatives derivatives_;
    NormalEquations equations_;
    std::vector<double> row_;
  };

  /// A body whose vertices are the surface's points as they lie on the resting body, and the joints.
  static DifferentiableBody tied(const BodyModel& model, const BodyLevel& level, TriangleTree tree,
                                 const FitSurface& surface, const BodyFit& fit, double facing,
                                 std::vector<std::uint32_t>& samples, std::vector<std::uint32_t>& parts) {
    std::vector<RigidMotion> motions = model.bone_motions(fit.betas, fit.axis_angles);
    for (RigidMotion& m : motions) m.shift += fit.translation;
    std::vector<float> xyz(3 * model.vertex_count());
    model.posed(fit.betas, fit.axis_angles, xyz);
    std::vector<Vec3d> posed(model.vertex_count());
    for (std::size_t v = 0; v < posed.size(); ++v)
      posed[v] = Vec3f{xyz[3 * v], xyz[3 * v + 1], xyz[3 * v + 2]}.as<double>() + fit.translation;
    tree.move(posed, level.triangles());
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
      Matrix3 linear{};
      Vec3d shift;
      for (const auto& [j, w] : weights) {
        linear = linear + motions[j].rotation * w;
        shift += motions[j].shift * w;
        tables.weights.append(j, static_cast<float>(w));
      }
      const Vec3d off = s.point - shift, a = linear.rows[0], b = linear.rows[1], d = linear.rows[2];
      add((cross(b, d) * off.x + cross(d, a) * off.y + cross(a, b) * off.z) / dot(a, cross(b, d)));
      vertices.push_back(static_cast<std::uint32_t>(samples.size()));
      samples.push_back(k);
      parts.push_back(std::ranges::max_element(weights, {}, [](const auto& entry) { return entry.second; })->first);
    }
    tables.J_regressor.columns = vertices.size() + tables.parents.size();
    const std::vector<Vec3d> joints = model.joints(fit.betas);
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
