/// How far a posed body and a mesh are apart, as a smooth function of the body's parameters that L-BFGS can minimise.
///   E(x) = sum_i a_i rho(|v_i(x) - mesh|^2) + sum_k b_k rho(|q_k - body(x)|^2) + priors
/// v_i are the body's vertices with a_i their share of its area, q_k points of the mesh spread evenly. A distance from
/// a surface is that to its closest point whose normal faces the same way. Closest points are found anew at every x,
/// so E is what it says and not a surrogate with fixed pairs; the gradient follows from them, as they do not change to
/// first order.
/// Units     E in square centimetres for meshes in metres
/// Numerics  rho(s) = s c^2 / (s + c^2) (Geman and McClure): a point farther away than a few c stops counting. Sums are
///           in index order, so that results don't depend on the executor
/// Source    Wang et al., CVPR 2020, supplement C.1; priors: Bogo et al., "Keep it SMPL", ECCV 2016, section 3.3
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/baseline/fit/fit_target.hpp>
#include <npt/body/body_level.hpp>
#include <npt/body/differentiable_body.hpp>
#include <npt/body/pose_prior.hpp>
#include <npt/config.hpp>
#include <npt/estimate/robust_distance.hpp>
#include <npt/mesh/closest_point.hpp>
#include <npt/solve/dense_cholesky.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// What is minimised besides the distance, and how.
struct BodyDistanceOptions {
  double scale = 0.1;             ///< c, in metres
  double facing = 0.0;            ///< least cosine between the normals of a point and of its closest point
  double pose_prior = 0.0;        ///< times PosePrior's quadratic part
  double shape_prior = 0.0;       ///< times |betas|^2
  double bend_prior = 0.0;        ///< times its one-sided part
  double mesh_share = 1.0;        ///< weight of the sum over the mesh's points
  std::size_t mesh_points = 700;  ///< of the target's points, so many are used
};

class BodyDistance {
 public:
  /// All three must outlive this.
  BodyDistance(const BodyLevel& level, const FitTarget& target, const BodyDistanceOptions& options,
               const PosePrior& prior)
      : level_(level),
        target_(target),
        options_(options),
        prior_(prior),
        tree_(level.tree()),
        points_(level.body().vertex_count()),
        gradient_(points_.size()),
        on_mesh_(level.probes().size(), no_index),
        on_body_(std::min(options.mesh_points, target.samples().size()), no_index) {}

  const BodyDistanceOptions& options() const noexcept { return options_; }
  void set_options(const BodyDistanceOptions& options) {
    options_ = options;
    on_body_.assign(std::min(options.mesh_points, target_.samples().size()), no_index);
  }

  /// The value at x, [3 + 3 J + S]; the gradient is written to `gradient`, of the same size.
  double operator()(std::span<const double> x, std::span<double> gradient) {
    const DifferentiableBody& body = level_.body();
    body.forward(x, state_, points_);
    std::fill(gradient_.begin(), gradient_.end(), Vec3d{});
    data_value_ = from_body() + from_mesh();
    body.backward(x, state_, gradient_, gradient);
    return data_value_ + priors(x, gradient);
  }

  /// The value of the last call without the priors.
  double data_value() const noexcept { return data_value_; }

 private:
  /// rho(s) and its derivative.
  std::array<double, 2> robust(double s) const {
    const double c = options_.scale * options_.scale, share = c / (s + c);
    return {s * share, share * share};
  }

  double from_body() {
    double value = 0;
    for (std::size_t i = 0; i < on_mesh_.size(); ++i) {
      const BodyLevel::Probe& probe = level_.probes()[i];
      const Vec3d point = points_[probe.vertex], normal = level_.body().carried(probe.vertex, probe.normal, state_);
      const double least = options_.facing * length(normal);
      const ClosestPoint c = target_.tree().closest(
          point, [&](std::uint32_t t) { return !target_.oriented(t) || dot(normal, target_.normal(t)) > least; },
          on_mesh_[i]);
      on_mesh_[i] = c.triangle;
      const double weight = per_square_metre * probe.area;
      if (c.triangle == no_index) {
        value += weight * options_.scale * options_.scale;
        continue;
      }
      const auto [rho, slope] = robust(c.squared_distance);
      value += weight * rho;
      gradient_[probe.vertex] += (point - c.point) * (2 * weight * slope);
    }
    return value;
  }

  double from_mesh() {
    if (options_.mesh_share == 0) return 0;
    tree_.move(points_, level_.triangles());
    const double weight = per_square_metre * options_.mesh_share / static_cast<double>(on_body_.size());
    double value = 0;
    for (std::size_t k = 0; k < on_body_.size(); ++k) {
      const FitTarget::Sample& sample = target_.samples()[k];
      const ClosestPoint c = tree_.closest(
          sample.point, [&](std::uint32_t t) { return faces(t, sample); }, on_body_[k]);
      on_body_[k] = c.triangle;
      if (c.triangle == no_index) {
        value += weight * options_.scale * options_.scale;
        continue;
      }
      const auto [rho, slope] = robust(c.squared_distance);
      value += weight * rho;
      const Vec3d g = (c.point - sample.point) * (2 * weight * slope);
      for (std::size_t corner = 0; corner < 3; ++corner)
        gradient_[level_.triangles()[c.triangle][corner]] += g * c.weights[corner];
    }
    return value;
  }

  bool faces(std::uint32_t triangle, const FitTarget::Sample& sample) const {
    if (sample.normal == Vec3d{}) return true;
    const Triangle& t = level_.triangles()[triangle];
    const Vec3d normal = cross(points_[t[1]] - points_[t[0]], points_[t[2]] - points_[t[0]]);
    return dot(normal, sample.normal) > options_.facing * length(normal);
  }

  double priors(std::span<const double> x, std::span<double> gradient) const {
    const std::size_t angles = 3 * level_.body().joint_count();
    double value = prior_(x.subspan(3, angles), options_.pose_prior, options_.bend_prior, gradient.subspan(3, angles));
    for (std::size_t i = 3 + angles; i < x.size(); ++i) {
      value += options_.shape_prior * x[i] * x[i];
      gradient[i] += 2 * options_.shape_prior * x[i];
    }
    return value;
  }

  const BodyLevel& level_;
  const FitTarget& target_;
  BodyDistanceOptions options_;
  const PosePrior& prior_;
  TriangleTree tree_;
  double data_value_ = 0;
  DifferentiableBody::State state_;
  std::vector<Vec3d> points_, gradient_;
  std::vector<std::uint32_t> on_mesh_, on_body_;  ///< closest triangles of the last call: where the next search starts
};

namespace fit::internal {

/// [n parameters][4 vertices] Derivatives of the level's vertices: along the normal, and weakly along each axis, for
/// where the surface slides in itself. By differences: exact ones would be no better a guess.
inline std::vector<double> distance_jacobian(const BodyLevel& level, std::span<const double> at, std::size_t n) {
  constexpr double change = 1e-4, slide = 0.15;
  const DifferentiableBody& body = level.body();
  std::vector<double> x(at.begin(), at.end());
  std::vector<Vec3d> here(body.vertex_count()), moved(here.size()), normals(here.size());
  DifferentiableBody::State state;
  body.forward(x, state, here);
  for (std::size_t v = 0; v < here.size(); ++v)
    normals[v] = normalised(body.carried(v, level.probes()[v].normal, state));
  std::vector<double> jacobian;
  jacobian.reserve(n * 4 * here.size());
  for (std::size_t p = 0; p < n; ++p) {
    x[p] = at[p] + change;
    body.forward(x, state, moved);
    x[p] = at[p];
    for (std::size_t v = 0; v < here.size(); ++v) {
      const Vec3d d = (moved[v] - here[v]) * (std::sqrt(level.probes()[v].area) / change);
      jacobian.insert(jacobian.end(), {dot(d, normals[v]), slide * d.x, slide * d.y, slide * d.z});
    }
  }
  return jacobian;
}

}  // namespace fit::internal

/// How steeply the distance of a body from a surface that it nearly lies on grows with its first n parameters: the
/// Gauss-Newton matrix of the distances along the normals and the priors' own, factored as L L^T. Every vertex of
/// `level` must be a probe. L-BFGS in its coordinates, x = x0 + L^-T y, sees all directions about equally steep: in
/// plain parameters a finger's angle moves the surface a thousandth of what the translation does, and 80 iterations
/// left 2 mm where 15 now leave 1 mm (median of 40 random bodies).
/// Errors    npt::Error for parameters that are not finite
/// Source    Nocedal and Wright, "Numerical Optimization", 2006, sections 5.1 (preconditioning) and 10.3
inline DenseCholesky body_curvature(const BodyLevel& level, const PosePrior& prior, const BodyDistanceOptions& options,
                                    std::span<const double> at, std::size_t n) {
  const std::vector<double> jacobian = fit::internal::distance_jacobian(level, at, n);
  const std::size_t rows = jacobian.size() / n, joints = level.body().joint_count();
  const double weight = 2 * per_square_metre * (1 + options.mesh_share);
  std::vector<double> matrix(n * n);
  for (std::size_t p = 0; p < n; ++p)
    for (std::size_t q = 0; q <= p; ++q) {
      double sum = 0;
      for (std::size_t r = 0; r < rows; ++r) sum += jacobian[p * rows + r] * jacobian[q * rows + r];
      matrix[p * n + q] = weight * sum;
    }
  // Against parameters that move nothing.
  for (std::size_t p = 0; p < n; ++p) matrix[p * n + p] += 1e-3;
  for (std::size_t p = 3 + 3 * joints; p < n; ++p) matrix[p * n + p] += 2 * options.shape_prior;
  for (std::size_t i = 0; i < 3 * joints; ++i)
    for (std::size_t k = 0; k <= i; ++k) matrix[(3 + i) * n + 3 + k] += 2 * options.pose_prior * prior.stiffness(i, k);
  return DenseCholesky(n, std::move(matrix));
}

}  // namespace npt::inline NPT_ABI
