/// Fits a body model to a mesh of any vertex order: translation, pose and shape, by L-BFGS on the distance of the
/// surfaces.
///   1. starts   the rest pose in several directions, its limbs set one by one to the best of a coarse grid
///   2. search   each start is optimised on a coarse body, first the pose and then the shape with it, with a wide
///   kernel
///               and strong priors, until two starts have led to one place; then limbs are looked over once more
///   3. finish   all vertices, narrow kernel, weak priors
/// A fit needs no landmarks, no skeleton and no correspondences; faces are needed, for a surface to measure distances
/// from.
/// Units     those of the model, metres. A mesh in another unit is an error
/// Numerics  double. Bodies made by the model come back to 1 mm RMS over vertices (docs/baselines.md)
/// Threads   a fitter may be used by several threads at a time; a fit itself runs in its caller's
/// Errors    npt::Error for a mesh without a triangle that has an area, and for one of quite another size than the
///           model
/// Source    Wang et al., CVPR 2020, supplement C.1
#pragma once

#include <npt/base/error.hpp>
#include <npt/base/vec3.hpp>
#include <npt/baseline/fit/body_distance.hpp>
#include <npt/baseline/fit/fit_target.hpp>
#include <npt/baseline/fit/lbfgs.hpp>
#include <npt/baseline/fit/start_poses.hpp>
#include <npt/body/body_level.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/fitted_body.hpp>
#include <npt/body/people_plan.hpp>
#include <npt/body/pose_prior.hpp>
#include <npt/body/skeleton.hpp>
#include <npt/config.hpp>
#include <npt/estimate/robust_distance.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/solve/dense_cholesky.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

struct BodyFitOptions {
  std::size_t coarse_vertices = 500;  ///< of the body that the search uses
  std::size_t probes = 2500;          ///< vertices that the finish measures at, of all
  std::size_t samples = 3000;         ///< points of the mesh that the finish measures at
  int yaws = 8;                       ///< directions that a start may face
  std::size_t starts = 6;             ///< at most so many are optimised
};

class BodyFitter {
 public:
  explicit BodyFitter(std::shared_ptr<const BodyModel> model, const BodyFitOptions& options = {})
      : model_(checked(std::move(model))),
        options_(checked(options)),
        tiny_(*model_, BodySketch::vertices),
        coarse_(*model_, options.coarse_vertices),
        full_(BodyLevel::full(*model_, options.probes)),
        prior_(model_->joint_count() == smpl_joint_count ? PosePrior(*model_, people_plan()) : PosePrior(*model_)) {}

  const BodyModel& model() const noexcept { return *model_; }

  /// `name` stands in errors. start: a fit to begin with, such as a reader's; the search follows only where it isn't
  /// good.
  BodyFit fit(std::span<const Vec3d> points, std::span<const Triangle> triangles, const std::string& name = "mesh",
              const BodyFit* start = nullptr) const {
    const FitTarget target(points, triangles, options_.samples, name);
    check_size(target, name);
    BodyFit result;
    Candidate best = search(target, start, result);
    BodyDistance distance(full_, target, finish, prior_);
    descend(distance, finish, 60, model_->shape_count(), best, result);
    result.distance = std::sqrt(distance.data_value() / (per_square_metre * (1 + finish.mesh_share)));
    result.translation = {best.x[0], best.x[1], best.x[2]};
    const auto shape = best.x.begin() + 3 + static_cast<std::ptrdiff_t>(3 * model_->joint_count());
    std::transform(best.x.begin() + 3, shape, std::back_inserter(result.axis_angles), to_float);
    std::transform(shape, best.x.end(), std::back_inserter(result.betas), to_float);
    return result;
  }

 private:
  static constexpr BodyDistanceOptions first{
      .scale = 0.3, .pose_prior = 0.3, .shape_prior = 0.05, .bend_prior = 0.1, .mesh_points = 500};
  static constexpr BodyDistanceOptions second{
      .scale = 0.2, .pose_prior = 0.1, .shape_prior = 0.02, .bend_prior = 0.1, .mesh_points = 500};
  static constexpr BodyDistanceOptions third{
      .scale = 0.1, .pose_prior = 0.03, .shape_prior = 0.005, .bend_prior = 0.01, .mesh_points = 500};
  static constexpr BodyDistanceOptions finish{
      .scale = 0.05, .pose_prior = 0.002, .shape_prior = 0.0005, .bend_prior = 0.001, .mesh_points = 3000};

  /// In square centimetres, after the search: bodies that the model made end below 1, wrong poses above 3.
  static constexpr double good = 1.5;

  /// In square metres: upright bodies start at 0.010 to 0.024, lying ones at 0.041 and more.
  static constexpr double poor_sketch = 0.03;

  /// Parameters and their distance, or sketch.
  struct Candidate {
    std::vector<double> x;
    double value = 0;
  };

  static float to_float(double v) { return static_cast<float>(v); }

  static std::shared_ptr<const BodyModel> checked(std::shared_ptr<const BodyModel> model) {
    if (!model) throw Error({.file = "body", .found = "none", .expected = "a body model"});
    if (model->triangles().empty()) throw Error({.file = "body", .found = "no triangles", .expected = "a surface"});
    return model;
  }

  static BodyFitOptions checked(const BodyFitOptions& options) {
    const auto wrong = [](const char* what, std::size_t found, const char* expected) {
      throw Error({.file = what, .found = std::to_string(found), .expected = expected});
    };
    if (options.coarse_vertices < 100) wrong("coarse vertices", options.coarse_vertices, "at least 100");
    if (options.probes < 100) wrong("probes", options.probes, "at least 100");
    if (options.samples < 100) wrong("samples", options.samples, "at least 100");
    if (options.yaws < 1) wrong("yaws", 0, "at least 1");
    return options;
  }

  /// The area hardly depends on the pose, and a factor of 3 in length is more than people differ by.
  void check_size(const FitTarget& target, const std::string& name) const {
    const double area = full_.area();
    const double ratio = std::sqrt(target.area() / area);
    if (ratio > 1.0 / 3 && ratio < 3) return;
    throw Error({.file = name,
                 .found = "a surface of " + std::to_string(target.area()),
                 .expected = "about that of the body model, " + std::to_string(area) + ": the model's unit"});
  }

  Candidate search(const FitTarget& target, const BodyFit* given, BodyFit& result) const {
    BodySketch sketch(tiny_, target);
    BodyDistance distance(coarse_, target, first, prior_);
    std::vector<Candidate> found;
    if (given) {
      Candidate& start = found.emplace_back(candidate_of(*given));
      descend(distance, second, 25, model_->shape_count(), start, result);
      descend(distance, third, 60, model_->shape_count(), start, result);
      ++result.starts;
      if (start.value < good) return start;
    }
    for (Candidate& start : starts(sketch)) {
      optimise(distance, start, result);
      ++result.starts;
      const bool again = std::ranges::any_of(found, [&](const Candidate& other) { return same(start, other); });
      found.push_back(std::move(start));
      if (again) break;
    }
    Candidate best = *std::ranges::min_element(found, {}, &Candidate::value);
    free_limbs(sketch, distance, best, result);
    return best;
  }

  Candidate candidate_of(const BodyFit& fit) const {
    if (fit.axis_angles.size() != 3 * model_->joint_count() || fit.betas.size() > model_->shape_count())
      throw Error({.file = "start",
                   .found = std::to_string(fit.axis_angles.size()) + " angles, " + std::to_string(fit.betas.size()) +
                            " shape parameters",
                   .expected = std::to_string(3 * model_->joint_count()) + " angles, at most " +
                               std::to_string(model_->shape_count()) + " shape parameters"});
    Candidate candidate;
    candidate.x = {fit.translation.x, fit.translation.y, fit.translation.z};
    candidate.x.insert(candidate.x.end(), fit.axis_angles.begin(), fit.axis_angles.end());
    candidate.x.insert(candidate.x.end(), fit.betas.begin(), fit.betas.end());
    candidate.x.resize(tiny_.body().parameter_count());
    return candidate;
  }

  /// A limb may be stuck, such as an arm inside the trunk. Or two may have changed places. Where the fit isn't good,
  /// both arms, both legs and then each limb start anew, straight at first, from the poses of the grid that suit the
  /// rest of the body best.
  void free_limbs(BodySketch& sketch, BodyDistance& distance, Candidate& best, BodyFit& result) const {
    if (model_->joint_count() != smpl_joint_count) return;
    static constexpr std::array<std::array<std::size_t, 2>, 6> limb_pairs{
        {{0, 1}, {2, 3}, {0, 0}, {1, 1}, {2, 2}, {3, 3}}};
    for (std::size_t i = 0; i < 2 * limb_pairs.size() && best.value > good; ++i) {
      const auto& pair = limb_pairs[i % limb_pairs.size()];
      Candidate other = best;
      for (const std::size_t limb : pair) put(limbs()[limb].front(), other);
      std::fill(other.x.end() - static_cast<std::ptrdiff_t>(model_->shape_count()), other.x.end(), 0.0);
      other.value = sketch(other.x);
      for (int round = 0; round < 2; ++round)
        for (const std::size_t limb : pair) set_limb(sketch, limb, other);
      optimise(distance, other, result);
      if (other.value < best.value) best = other;
    }
  }

  /// Whether two searches ended at one place: coarse vertices within 1 cm RMS.
  bool same(const Candidate& a, const Candidate& b) const {
    if (std::abs(a.value - b.value) > 0.05 * std::min(a.value, b.value)) return false;
    std::vector<Vec3d> p(tiny_.body().vertex_count()), q(p.size());
    DifferentiableBody::State state;
    tiny_.body().forward(a.x, state, p);
    tiny_.body().forward(b.x, state, q);
    double sum = 0;
    for (std::size_t i = 0; i < p.size(); ++i) sum += tiny_.probes()[i].area * dot(p[i] - q[i], p[i] - q[i]);
    return sum < 1e-4;
  }

  void optimise(BodyDistance& distance, Candidate& candidate, BodyFit& result) const {
    descend(distance, first, 15, 0, candidate, result);
    descend(distance, second, 25, model_->shape_count(), candidate, result);
    descend(distance, third, 30, model_->shape_count(), candidate, result);
  }

  /// L-BFGS from `candidate` in the first `shapes` shape parameters. Where the closest points jump, a line search may
  /// find nothing: then it starts again from there, up to three times.
  void descend(BodyDistance& distance, const BodyDistanceOptions& options, int iterations, std::size_t shapes,
               Candidate& candidate, BodyFit& result) const {
    const std::size_t n = 3 + 3 * model_->joint_count() + shapes;
    std::vector<double> y(n), step(n), all(candidate.x.size());
    for (int round = 0; round < 3 && iterations > 0; ++round) {
      BodyDistanceOptions now = options;
      if (round == 1) now.facing = -2;
      distance.set_options(now);
      const DenseCholesky curvature = body_curvature(coarse_, prior_, options, candidate.x, n);
      const std::vector<double> from = candidate.x;
      const auto move = [&](std::span<const double> to) {
        std::ranges::copy(to, step.begin());
        curvature.solve_upper(step);
        for (std::size_t i = 0; i < n; ++i) candidate.x[i] = from[i] + step[i];
      };
      const auto objective = [&](std::span<const double> at, std::span<double> gradient) {
        move(at);
        const double value = distance(candidate.x, all);
        std::copy_n(all.begin(), n, gradient.begin());
        curvature.solve_lower(gradient);
        return value;
      };
      std::ranges::fill(y, 0.0);
      const LbfgsResult r = minimise_lbfgs(
          objective, y,
          {.memory = 20, .max_iterations = iterations, .gradient_tolerance = 1e-6, .least_decrease = 1e-3});
      move(y);
      candidate.value = r.value;
      result.evaluations += r.evaluations;
      iterations -= r.iterations;
      if (r.converged) break;
    }
  }

  /// For each direction the rest pose with its limbs set; the best ones first. Where no upright one fits, the mesh may
  /// lie, or come from a program with another vertical axis.
  std::vector<Candidate> starts(BodySketch& sketch) const {
    const std::vector<Vec3d> directions = start_directions(options_.yaws);
    const auto upright = static_cast<std::size_t>(options_.yaws);
    std::vector<Candidate> all, others;
    for (std::size_t i = 0; i < directions.size(); ++i) {
      Candidate candidate;
      candidate.x.assign(tiny_.body().parameter_count(), 0.0);
      candidate.x[3] = directions[i].x, candidate.x[4] = directions[i].y, candidate.x[5] = directions[i].z;
      candidate.value = sketch(candidate.x);
      if (i < upright) set_limbs(sketch, candidate);
      (i < upright ? all : others).push_back(std::move(candidate));
    }
    if (std::ranges::min(all, {}, &Candidate::value).value > poor_sketch) {
      std::ranges::stable_sort(others, {}, &Candidate::value);
      others.resize(std::min(others.size(), upright));
      for (Candidate& candidate : others) {
        set_limbs(sketch, candidate);
        all.push_back(std::move(candidate));
      }
    }
    std::ranges::stable_sort(all, {}, &Candidate::value);
    all.resize(std::min(all.size(), std::max<std::size_t>(1, options_.starts)));
    return all;
  }

  static const std::array<std::vector<LimbPose>, 4>& limbs() {
    static const std::array<std::vector<LimbPose>, 4> all = limb_poses();
    return all;
  }

  static void put(const LimbPose& pose, Candidate& candidate) {
    for (std::size_t i = 0; i < pose.joints.size(); ++i) {
      const Vec3d a = pose.axis_angles[i];
      double* to = &candidate.x[3 + 3 * pose.joints[i]];
      to[0] = a.x, to[1] = a.y, to[2] = a.z;
    }
  }

  /// Sets a limb to the pose of the grid at which the sketch is least, if that is less than `candidate.value`.
  static void set_limb(BodySketch& sketch, std::size_t limb, Candidate& candidate) {
    const Candidate current = candidate;
    for (const LimbPose& pose : limbs()[limb]) {
      Candidate other = current;
      put(pose, other);
      other.value = sketch(other.x);
      if (other.value < candidate.value) candidate = std::move(other);
    }
  }

  /// All limbs, twice: legs first, since they are the heavier ones.
  void set_limbs(BodySketch& sketch, Candidate& candidate) const {
    if (model_->joint_count() != smpl_joint_count) return;
    for (int round = 0; round < 2; ++round)
      for (const std::size_t limb : {2U, 3U, 0U, 1U}) set_limb(sketch, limb, candidate);
  }

  std::shared_ptr<const BodyModel> model_;
  BodyFitOptions options_;
  BodyLevel tiny_, coarse_, full_;
  PosePrior prior_;
};

}  // namespace npt::inline NPT_ABI
