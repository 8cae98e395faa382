/// Fits a body to a surface of which it was read where each point belongs: Gauss-Newton steps from the motion in closed
/// form, in place of a search. Several candidate readings may be given, such as those of the mesh in turned directions.
///   E(x) = place weight * mean_k rho(|body(place_k) - point_k|^2)
///        + sum_i a_i rho(|v_i - surface|^2) + mean_k rho(|q_k - body|^2) + priors
///   1. motion    of every reading, from few points, and of the best ones with limbs swapped (part_motion.hpp)
///   2. coarse    a coarse body, first to the places of up to three of these, then, where it comes near, to the surface
///   3. finish    all vertices, both ways, with a kernel that narrows; where the body keeps a distance from it,
///                as under clothes, the places count too
/// Distances are taken along normals: the step is that of "point to plane"; where a point has left the other surface's
/// end, along the line to it.
/// Shapes    x as DifferentiableBody's: [translation, axis angles 24 x 3, betas S]
/// Units     those of the model, metres; E in square centimetres, as BodyDistance
/// Numerics  double; some 20 steps, 75 to 100 ms on one core of an EPYC with AVX-512, whatever the mesh's size. Of 50
///           mannequins in natural poses, read with errors of 5 cm, a tenth of the places wild and limbs swapped, 47
///           ended within 7 mm RMS over vertices and the others within 23; 50 people of another model's shapes at a
///           distance of 7 mm between surfaces, 3 of them with an arm twisted by more than 60 degrees. refit() takes 20
///           to 25 ms a frame
/// Threads   a fitter may be used by several threads at a time; a fit itself runs in its caller's
/// Errors    npt::Error for no reading or too few points, and for a surface of quite another size than the body
/// Source    Chen and Medioni, "Object modelling by registration of multiple range images", 1992 (point to plane);
///           Nocedal and Wright, "Numerical Optimization", 2006, section 10.3 (Levenberg and Marquardt)
#pragma once

#include <npt/body/body_model.hpp>
#include <npt/body/skeleton.hpp>
#include <npt/config.hpp>
#include <npt/core/error.hpp>
#include <npt/core/vec3.hpp>
#include <npt/fit/body_fit.hpp>
#include <npt/fit/body_level.hpp>
#include <npt/fit/differentiable_body.hpp>
#include <npt/fit/fit_surface.hpp>
#include <npt/fit/part_motion.hpp>
#include <npt/fit/pose_prior.hpp>
#include <npt/fit/robust_distance.hpp>
#include <npt/linear/normal_equations.hpp>
#include <npt/surface/closest_point.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <numbers>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// A mesh's points as they were read. Points should be drawn by area, in random order: the first n stand for all.
using Reading = std::vector<ReadPoint>;

struct ReadingFitOptions {
  std::size_t coarse_vertices = 1200;      ///< of the body that is fitted first
  std::size_t probes = 1500;               ///< vertices that the finish measures at
  std::size_t samples = 2000;              ///< points of the surface that the finish measures at
  std::size_t ranked_points = 400;         ///< of each reading, from which the best ones are chosen
  std::size_t candidates = 3;              ///< readings that are fitted coarsely, at most
  std::vector<double> shape_deviations{};  ///< [S] standard deviations of the betas; missing ones are 1
};

/// A body that was fitted to a read surface, and what tells how far to trust it.
struct ReadingFit {
  BodyFit body;
  /// Root of the mean squared distance between the surfaces, both ways, cut off at 5 cm, divided by the size of the
  /// surface (the root of its area over the body's).
  double relative_distance = 0;
  double mesh_explained = 0;    ///< share of the surface that has the body within 3 cm (times its size)
  double body_explained = 0;    ///< share of the body that has the surface within 3 cm
  double reading_residual = 0;  ///< PartMotion::residual of the reading that was taken
  std::size_t reading = 0;      ///< number of that
  double facing = 1;            ///< 1: the mesh's triangles turn outwards, -1: inwards, 0: can't be said
  /// As relative_distance, of each part alone.
  std::array<double, smpl_joint_count> part_distances{};

  /// From 0 to 1.
  double trust() const { return std::min(mesh_explained, body_explained); }
};

namespace fit::internal {

/// The weights and sizes of a stage.
struct ReadingStage {
  int iterations = 0;
  double enough = 1e-2;  ///< a step that makes E less by a smaller share of it is the last one
  /// E without priors at which they count as given, and places not at all; above, both grow along with it: the farther
  /// the body stays from the surface, as under clothes, the less the surface alone says.
  double usual_distance = 0;
  double slack = 0;           ///< E may grow by this share of it in a step: closest points jump
  double scale = 0.1;         ///< of the robust kernel, in metres
  double place_weight = 0;    ///< of the places
  double surface_weight = 1;  ///< of the distances
  double facing = 0;          ///< least cosine between normals
  double pose_prior = 0, bend_prior = 0, shape_prior = 0;
  double anchor = 0;  ///< times the squared change of the angles since the last frame
  std::size_t probes = 0, samples = 0, places = 0;
};

/// One fit: a surface, a reading, and where the body is.
class ReadingProblem {
 public:
  struct Match {
    Vec3d offset;         ///< from the mesh to the body
    double squared = -1;  ///< below 0: nothing near
    BodyPoint at;
    double weight = 0;
    double scale = 0.1;

    /// Its squared distance, cut off at the scale; all of that where nothing is near.
    double robust() const { return squared < 0 ? scale * scale : robust_squared(squared, scale); }
  };

  ReadingProblem(const BodyModel& model, const PosePrior& prior, std::span<const double> deviations,
                 const FitSurface& surface)
      : model_(model),
        prior_(prior),
        deviations_(deviations),
        surface_(surface),
        equations_(3 + 3 * model.joint_count() + model.shape_count()),
        row_(equations_.size()) {}

  std::vector<double>& x() noexcept { return x_; }
  const std::vector<double>& x() const noexcept { return x_; }
  double value() const noexcept { return value_; }
  int evaluations() const noexcept { return evaluations_; }

  void set_facing(double facing) { facing_ = facing; }
  /// Betas stay as they are, and the pose is drawn to what it is now.
  void follow() {
    fixed_shape_ = true;
    anchor_ = x_;
    equations_ = NormalEquations(3 + 3 * model_.joint_count());
    row_.assign(equations_.size(), 0.0);
  }

  /// `places` [n] are on the level's body: those of the motion for the level of the template.
  void set_places(std::span<const ReadPoint> points, const PartMotion& motion, std::span<const BodyPoint> places) {
    points_ = points;
    motion_ = &motion;
    places_ = places;
  }

  /// The level that distances are measured with from now on.
  void set_level(const BodyLevel& level, const TriangleTree& tree) {
    level_ = &level;
    tree_ = tree;
    points_of_body_.resize(level.body().vertex_count());
    mesh_hint_.assign(level.probes().size(), no_index);
    body_hint_.assign(surface_.samples().size(), no_index);
  }

  /// Levenberg and Marquardt's method.
  void run(const ReadingStage& stage) {
    stage_ = &stage;
    prior_share_ = place_share_ = 1;
    value_ = evaluate(x_, matches_, state_);
    if (stage.usual_distance > 0) {
      const double limit = 20, limit_of_places = 10;
      const double times = data_value_ / stage.usual_distance;
      prior_share_ = std::clamp(times, 1.0, limit);
      place_share_ = (std::clamp(times, 1.0, limit_of_places) - 1) / (limit_of_places - 1);
      value_ = evaluate(x_, matches_, state_);
    }
    double damping = 1e-3;
    for (int i = 0; i < stage.iterations; ++i) {
      linearise();
      bool better = false;
      for (int attempt = 0; attempt < 3 && !better; ++attempt) {
        std::vector<double> trial = x_;
        const std::vector<double> step = equations_.solve(damping, 1e-4);
        double largest = 0;
        for (std::size_t k = 3; k < 3 + 3 * model_.joint_count(); ++k) largest = std::max(largest, std::abs(step[k]));
        const double share = largest > 0.7 ? 0.7 / largest : 1;
        for (std::size_t k = 0; k < step.size(); ++k) trial[k] += share * step[k];
        wrap(trial);
        const double value = evaluate(trial, trial_matches_, trial_state_);
        if (value < value_ * (1 + stage.slack)) {
          better = true;
          const bool done = value_ - value < stage.enough * value_ && share == 1;
          std::swap(x_, trial);
          std::swap(matches_, trial_matches_);
          std::swap(state_, trial_state_);
          value_ = value;
          damping = std::max(damping * 0.3, 1e-5);
          if (done) return;
        } else {
          damping = std::max(10 * damping, 1e-2);
        }
      }
      if (!better) return;
    }
  }

  /// The sum of the distances without places and priors, at the scale of a stage.
  double distance(const ReadingStage& stage) {
    stage_ = &stage;
    evaluate(x_, matches_, state_);
    return data_value_;
  }
  std::span<const Match> matches() const noexcept { return matches_; }
  std::size_t probe_matches() const noexcept { return std::min(stage_->probes, level_->probes().size()); }
  const DifferentiableBody::State& state() const noexcept { return state_; }
  std::span<const Vec3d> body_points() const noexcept { return points_of_body_; }

 private:
  static constexpr double per_square_metre = 1e4;
  /// In deviations: from here on a beta costs hardly more, so that the prior may be strong enough that the body is not
  /// blown up to fill clothes and a stylised figure still keeps its proportions. With a third of the finest stage's
  /// weight dressed people ended at 12.7e-4 instead of 8.8e-4, others of the same set at 9.1e-4 instead of 9.6e-4, a
  /// knight at 6.3e-4 instead of 4.2e-4; with a fifteenth and no such limit the dressed ones at 18e-4.
  static constexpr double unusual_shape = 2;

  double place_weight() const { return place_share_ * stage_->place_weight; }

  /// Directions beyond half a turn are written the other way round.
  void wrap(std::vector<double>& x) const {
    for (std::size_t j = 0; j < model_.joint_count(); ++j) {
      double* a = &x[3 + 3 * j];
      const double angle = std::sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
      if (angle <= std::numbers::pi) continue;
      const double factor = (angle - 2 * std::numbers::pi) / angle;
      for (std::size_t k = 0; k < 3; ++k) a[k] *= factor;
    }
  }

  double evaluate(std::span<const double> x, std::vector<Match>& matches, DifferentiableBody::State& state) {
    ++evaluations_;
    const DifferentiableBody& body = level_->body();
    body.forward(x, state, points_of_body_);
    matches.clear();
    data_value_ = 0;
    if (stage_->surface_weight > 0) {
      from_body(state, matches);
      from_mesh(matches);
      for (const Match& m : matches) data_value_ += m.weight * m.robust();
    }
    double value = data_value_;
    const std::size_t surface_matches = matches.size();
    if (place_weight() > 0) from_places(matches);
    for (std::size_t i = surface_matches; i < matches.size(); ++i)
      value += matches[i].weight * robust_squared(matches[i].squared, matches[i].scale);
    return value + prior_value(x);
  }

  void from_body(const DifferentiableBody::State& state, std::vector<Match>& matches) {
    const std::span<const BodyLevel::Probe> probes = level_->probes();
    const std::size_t count = std::min(stage_->probes, probes.size());
    double area = 0;
    for (std::size_t i = 0; i < count; ++i) area += probes[i].area;
    const double limit = 9 * stage_->scale * stage_->scale, spacing = 0.7 * surface_.spacing();
    for (std::size_t i = 0; i < count; ++i) {
      const BodyLevel::Probe& probe = probes[i];
      const Vec3d point = points_of_body_[probe.vertex];
      const Vec3d normal = normalised(level_->body().carried(probe.vertex, probe.normal, state));
      const ClosestPoint c = surface_.tree().closest(
          point, [&](std::uint32_t k) { return faces(normal, surface_.samples()[k].normal); }, mesh_hint_[i], limit);
      mesh_hint_[i] = c.triangle;
      Match& m = matches.emplace_back();
      m.weight = stage_->surface_weight * per_square_metre * probe.area / area;
      m.scale = stage_->scale;
      if (c.triangle == no_index) continue;
      m.at = {{probe.vertex, probe.vertex, probe.vertex}, {1, 0, 0}, {}};
      m.offset = across(point - c.point, between(normal, surface_.samples()[c.triangle].normal), spacing);
      m.squared = dot(m.offset, m.offset);
    }
  }

  /// What of an offset from a sample counts: all along the normal; along the surface what goes beyond the next sample.
  static Vec3d across(Vec3d offset, Vec3d normal, double spacing) {
    const double height = dot(offset, normal);
    const Vec3d along = offset - normal * height;
    const double aside = length(along);
    return normal * height + (aside > spacing ? along * (1 - spacing / aside) : Vec3d{});
  }

  /// The direction between two normals: along it, points of one circle with these normals have no distance.
  /// Source: Rusinkiewicz, "A symmetric objective function for ICP", 2019.
  static Vec3d between(Vec3d body, Vec3d mesh) {
    const Vec3d sum = dot(body, mesh) < 0 ? body - mesh : body + mesh;
    return normalised(sum);
  }

  bool faces(Vec3d body, Vec3d mesh) const {
    const double cosine = dot(body, mesh);
    if (facing_ == 0) return mesh == Vec3d{} || std::abs(cosine) > stage_->facing;
    return mesh == Vec3d{} || facing_ * cosine > stage_->facing;
  }

  void from_mesh(std::vector<Match>& matches) {
    const std::span<const Triangle> triangles = level_->triangles();
    tree_.move(points_of_body_, triangles);
    const std::size_t count = std::min(stage_->samples, surface_.samples().size());
    const double limit = 9 * stage_->scale * stage_->scale;
    for (std::size_t k = 0; k < count; ++k) {
      const FitSurface::Sample& s = surface_.samples()[k];
      const ClosestPoint c = tree_.closest(
          s.point,
          [&](std::uint32_t t) {
            const auto& [p, q, r] = triangles[t];
            return faces(
                normalised(cross(points_of_body_[q] - points_of_body_[p], points_of_body_[r] - points_of_body_[p])),
                s.normal);
          },
          body_hint_[k], limit);
      body_hint_[k] = c.triangle;
      Match& m = matches.emplace_back();
      m.weight = stage_->surface_weight * per_square_metre / static_cast<double>(count);
      m.scale = stage_->scale;
      if (c.triangle == no_index) continue;
      m.at = {triangles[c.triangle], c.weights, {}};
      m.offset = c.point - s.point;
      m.squared = c.squared_distance;
    }
  }

  void from_places(std::vector<Match>& matches) {
    const std::size_t count = std::min(stage_->places, points_.size());
    double total = 0;
    for (std::size_t k = 0; k < count; ++k) total += motion_->certainty[k];
    for (std::size_t k = 0; k < count; ++k) {
      Match& m = matches.emplace_back();
      m.at = places_[k];
      const auto& [p, q, r] = m.at.corners;
      m.offset = points_of_body_[p] * m.at.weights[0] + points_of_body_[q] * m.at.weights[1] +
                 points_of_body_[r] * m.at.weights[2] - points_[k].point;
      m.squared = dot(m.offset, m.offset);
      m.weight = place_weight() * per_square_metre * motion_->certainty[k] / total;
      m.scale = 2 * stage_->scale;
    }
  }

  double deviation(std::size_t b) const { return b < deviations_.size() ? deviations_[b] : 1; }

  double prior_value(std::span<const double> x) {
    const std::size_t angles = 3 * model_.joint_count();
    std::ranges::fill(row_, 0.0);
    double value = prior_(x.subspan(3, angles), prior_share_ * stage_->pose_prior, prior_share_ * stage_->bend_prior,
                          std::span(row_).subspan(3, angles));
    if (fixed_shape_) {
      for (std::size_t i = 3; i < 3 + angles; ++i) value += stage_->anchor * (x[i] - anchor_[i]) * (x[i] - anchor_[i]);
      return value;
    }
    for (std::size_t b = 0; b < model_.shape_count(); ++b) {
      const double off = x[3 + angles + b] / deviation(b);
      value += prior_share_ * stage_->shape_prior * robust_squared(off * off, unusual_shape);
    }
    return value;
  }

  void linearise() {
    const DifferentiableBody& body = level_->body();
    body.derivatives(x_, state_, derivatives_);
    equations_.clear();
    const std::size_t from_places =
        matches_.size() - (place_weight() > 0 ? std::min(stage_->places, points_.size()) : 0);
    for (std::size_t i = 0; i < matches_.size(); ++i) {
      const Match& m = matches_[i];
      if (m.squared < 0) continue;
      const double share = m.scale * m.scale / (m.squared + m.scale * m.scale), weight = m.weight * share * share;
      if (i < from_places) {
        const double off = std::sqrt(m.squared);
        if (off < 1e-9) continue;
        add_row(body, m, m.offset / off, weight, off);
        continue;
      }
      add_row(body, m, {1, 0, 0}, weight, m.offset.x);
      add_row(body, m, {0, 1, 0}, weight, m.offset.y);
      add_row(body, m, {0, 0, 1}, weight, m.offset.z);
    }
    const std::size_t angles = 3 * model_.joint_count();
    std::ranges::fill(row_, 0.0);
    const std::span<const double> theta = std::span<const double>(x_).subspan(3, angles);
    prior_(theta, prior_share_ * stage_->pose_prior, prior_share_ * stage_->bend_prior,
           std::span(row_).subspan(3, angles));
    for (std::size_t i = 3; i < 3 + angles; ++i) equations_.add_to_right(i, 0.5 * row_[i]);
    prior_.add_curvature(theta, prior_share_ * stage_->pose_prior, prior_share_ * stage_->bend_prior, 3, equations_);
    if (fixed_shape_) {
      for (std::size_t i = 3; i < 3 + angles; ++i) {
        equations_.add_to_matrix(i, i, stage_->anchor);
        equations_.add_to_right(i, stage_->anchor * (x_[i] - anchor_[i]));
      }
      return;
    }
    for (std::size_t b = 0; b < model_.shape_count(); ++b) {
      const std::size_t i = 3 + angles + b;
      const double off = x_[i] / deviation(b), limit = unusual_shape * unusual_shape;
      const double share = limit / (off * off + limit) / deviation(b);
      const double weight = prior_share_ * stage_->shape_prior * share * share;
      equations_.add_to_matrix(i, i, weight);
      equations_.add_to_right(i, weight * x_[i]);
    }
  }

  void add_row(const DifferentiableBody& body, const Match& m, Vec3d direction, double weight, double residual) {
    body.row(state_, derivatives_, m.at.corners, m.at.weights, direction, row_);
    equations_.add(row_, weight, residual);
  }

  const BodyModel& model_;
  const PosePrior& prior_;
  std::span<const double> deviations_;
  const FitSurface& surface_;
  const ReadingStage* stage_ = nullptr;
  const BodyLevel* level_ = nullptr;
  std::span<const ReadPoint> points_;
  const PartMotion* motion_ = nullptr;
  std::span<const BodyPoint> places_;
  TriangleTree tree_{{}, {}};
  double facing_ = 1, prior_share_ = 1, place_share_ = 1, value_ = 0, data_value_ = 0;
  bool fixed_shape_ = false;
  int evaluations_ = 0;
  std::vector<double> x_, anchor_;
  std::vector<Vec3d> points_of_body_;
  std::vector<Match> matches_, trial_matches_;
  DifferentiableBody::State state_, trial_state_;
  DifferentiableBody::Derivatives derivatives_;
  NormalEquations equations_;
  std::vector<double> row_;
  std::vector<std::uint32_t> mesh_hint_, body_hint_;
};

}  // namespace fit::internal

class ReadingFitter {
 public:
  explicit ReadingFitter(std::shared_ptr<const BodyModel> model, ReadingFitOptions options = {})
      : model_(checked(std::move(model))),
        options_(std::move(options)),
        coarse_(*model_, options_.coarse_vertices),
        full_(BodyLevel::full(*model_, options_.probes)),
        coarse_tree_(coarse_.rest_points(), coarse_.triangles()),
        full_tree_(full_.rest_points(), full_.triangles()),
        template_(*model_, coarse_),
        prior_(PosePrior::natural(*model_)),
        main_part_(model_->tables().weights.heaviest_columns()) {
    for (const Triangle& t : full_.triangles()) {
      const std::span<const Vec3d> rest = full_.rest_points();
      area_ += 0.5 * length(cross(rest[t[1]] - rest[t[0]], rest[t[2]] - rest[t[0]]));
    }
  }
  ReadingFitter(const ReadingFitter&) = delete;
  ReadingFitter& operator=(const ReadingFitter&) = delete;

  const BodyModel& model() const noexcept { return *model_; }
  std::shared_ptr<const BodyModel> shared_model() const noexcept { return model_; }
  /// The resting body that places are read on.
  const ReadTemplate& read_template() const noexcept { return template_; }
  const ReadingFitOptions& options() const noexcept { return options_; }
  /// Of the resting body's surface, in square metres.
  double area() const noexcept { return area_; }

  ReadingFit fit(const FitSurface& surface, const Reading& reading) const {
    return fit(surface, std::span(&reading, 1));
  }

  /// The best of several readings of one surface.
  ReadingFit fit(const FitSurface& surface, std::span<const Reading> readings) const {
    if (readings.empty()) throw Error({.file = "reading", .found = "none", .expected = "at least one"});
    std::vector<Candidate> candidates = ranked(readings);
    check_size(candidates.front().motion.size);
    int evaluations = 0;
    for (Candidate& c : candidates) {
      const Reading& reading = readings[c.reading];
      if (options_.ranked_points < reading.size()) c.motion = part_motion(template_, reading, c.swapped);
      fit_places(surface, reading, c);
    }
    std::ranges::stable_sort(candidates, {}, &Candidate::value);
    // Distances after the places alone tell candidates apart where they differ much.
    while (candidates.size() > 1 && candidates.back().value > 1.3 * candidates.front().value) candidates.pop_back();
    for (Candidate& c : candidates) {
      fit_coarsely(surface, readings[c.reading], c);
      evaluations += c.evaluations;
    }
    const auto best = std::ranges::min_element(candidates, {}, &Candidate::value);
    ReadingFit result = finished(surface, *best, readings[best->reading]);
    result.body.evaluations += evaluations;
    result.body.starts = static_cast<int>(candidates.size());
    return result;
  }

  /// The nearest of fits that begin elsewhere, as LimbSearch finds places; `fit` itself where none is nearer.
  ReadingFit nearest(const FitSurface& surface, const ReadingFit& fit, std::span<const BodyFit> starts) const {
    std::vector<Candidate> candidates;
    int evaluations = 0;
    for (const BodyFit& start : starts) {
      Candidate& c = candidates.emplace_back();
      c.facing = fit.facing;
      c.motion.residual = fit.reading_residual;
      c.reading = fit.reading;
      fit::internal::ReadingProblem problem(*model_, prior_, options_.shape_deviations, surface);
      problem.x() = parameters(start);
      problem.set_facing(fit.facing);
      problem.set_level(coarse_, coarse_tree_);
      problem.run(astray);
      c.value = problem.distance(judged);
      c.x = problem.x();
      evaluations += problem.evaluations();
    }
    std::ranges::stable_sort(candidates, {}, &Candidate::value);
    ReadingFit best = fit;
    for (std::size_t i = 0; i < std::min<std::size_t>(candidates.size(), 2); ++i) {
      if (candidates[i].value > 1.3 * candidates.front().value) break;
      ReadingFit result = finished(surface, candidates[i]);
      if (result.relative_distance < best.relative_distance) best = std::move(result);
    }
    best.body.evaluations += evaluations;
    return best;
  }

  /// The next frame of a sequence: a few steps from the last one's fit, with its shape.
  ReadingFit refit(const FitSurface& surface, const ReadingFit& last) const {
    Candidate c;
    c.x = parameters(last.body);
    c.facing = last.facing;
    c.motion.residual = last.reading_residual;
    c.reading = last.reading;
    fit::internal::ReadingProblem problem(*model_, prior_, options_.shape_deviations, surface);
    problem.x() = c.x;
    problem.set_facing(c.facing);
    problem.follow();
    problem.set_level(coarse_, coarse_tree_);
    problem.run(following);
    problem.set_level(full_, full_tree_);
    problem.run(following_finish);
    return result_of(surface, problem, c);
  }

 private:
  using Stage = fit::internal::ReadingStage;

  static constexpr Stage places{.iterations = 4,
                                .scale = 0.15,
                                .place_weight = 1,
                                .surface_weight = 0,
                                .pose_prior = 0.1,
                                .bend_prior = 0.05,
                                .shape_prior = 0.5,
                                .places = 300};
  static constexpr Stage wide{.iterations = 4,
                              .scale = 0.12,
                              .place_weight = 0.2,
                              .surface_weight = 1,
                              .facing = 0.2,
                              .pose_prior = 0.03,
                              .bend_prior = 0.03,
                              .shape_prior = 0.15,
                              .probes = 300,
                              .samples = 400,
                              .places = 200};
  static constexpr Stage middle{.iterations = 4,
                                .scale = 0.08,
                                .place_weight = 0.02,
                                .surface_weight = 1,
                                .facing = 0.2,
                                .pose_prior = 0.005,
                                .bend_prior = 0.005,
                                .shape_prior = 0.025,
                                .probes = 500,
                                .samples = 600,
                                .places = 200};
  static constexpr Stage astray{.iterations = 6,
                                .scale = 0.08,
                                .surface_weight = 1,
                                .facing = 0.2,
                                .pose_prior = 0.003,
                                .bend_prior = 0.003,
                                .shape_prior = 0.025,
                                .probes = 400,
                                .samples = 500};
  static constexpr Stage judged{.scale = 0.1, .surface_weight = 1, .facing = 0.2, .probes = 300, .samples = 400};
  static constexpr Stage fine{.iterations = 4,
                              .usual_distance = 0.1,
                              .slack = 0.02,
                              .scale = 0.05,
                              .place_weight = 0.07,
                              .surface_weight = 1,
                              .facing = 0.2,
                              .pose_prior = 0.0005,
                              .bend_prior = 0.0005,
                              .shape_prior = 0.005,
                              .probes = 800,
                              .samples = 1000,
                              .places = 300};
  static constexpr Stage finest{.iterations = 5,
                                .enough = -1,
                                .usual_distance = 0.05,
                                .slack = 0.05,
                                .scale = 0.03,
                                .place_weight = 0.04,
                                .surface_weight = 1,
                                .facing = 0.3,
                                .pose_prior = 0.00005,
                                .bend_prior = 0.00005,
                                .shape_prior = 0.0015,
                                .probes = 1000,
                                .samples = 1100,
                                .places = 300};
  static constexpr Stage measured{.scale = 0.05, .surface_weight = 1, .facing = 0, .probes = 1000, .samples = 1500};
  static constexpr Stage following{.iterations = 4,
                                   .scale = 0.08,
                                   .surface_weight = 1,
                                   .facing = 0.2,
                                   .pose_prior = 0.001,
                                   .bend_prior = 0.001,
                                   .anchor = 0.2,
                                   .probes = 400,
                                   .samples = 500};
  static constexpr Stage following_finish{.iterations = 3,
                                          .slack = 0.02,
                                          .scale = 0.03,
                                          .surface_weight = 1,
                                          .facing = 0.3,
                                          .pose_prior = 0.00005,
                                          .bend_prior = 0.00005,
                                          .anchor = 0.2,
                                          .probes = 600,
                                          .samples = 800};

  struct Candidate {
    std::size_t reading = 0;
    SwappedLimbs swapped;
    PartMotion motion;
    std::vector<double> x;
    double value = std::numeric_limits<double>::infinity();
    double facing = 1;
    int evaluations = 0;
  };

  static std::shared_ptr<const BodyModel> checked(std::shared_ptr<const BodyModel> model) {
    if (!model) throw Error({.file = "body", .found = "none", .expected = "a body model"});
    if (model->triangles().empty()) throw Error({.file = "body", .found = "no triangles", .expected = "a surface"});
    return model;
  }

  /// Half and one and a half times the body's size fit as well as its own.
  static void check_size(double size) {
    if (size > 0.25 && size < 3) return;
    throw Error({.file = "surface",
                 .found = "a body " + std::to_string(size) + " times as large as the model",
                 .expected = "about its size: the model's unit, metres"});
  }

  std::vector<double> parameters(const BodyFit& body) const {
    std::vector<double> x{body.translation.x, body.translation.y, body.translation.z};
    x.insert(x.end(), body.axis_angles.begin(), body.axis_angles.end());
    x.insert(x.end(), body.betas.begin(), body.betas.end());
    x.resize(3 + 3 * model_->joint_count() + model_->shape_count());
    return x;
  }

  /// Readings, and the best ones with limbs swapped: the least residuals first; of equal ones, the earlier.
  std::vector<Candidate> ranked(std::span<const Reading> readings) const {
    std::vector<Candidate> all;
    const auto add = [&](std::size_t reading, SwappedLimbs swapped) {
      Candidate& c = all.emplace_back();
      c.reading = reading;
      c.swapped = swapped;
      const Reading& r = readings[reading];
      c.motion = part_motion(template_, std::span(r).first(std::min(options_.ranked_points, r.size())), swapped);
    };
    const auto sort = [&] { std::ranges::stable_sort(all, {}, [](const Candidate& c) { return c.motion.residual; }); };
    for (std::size_t i = 0; i < readings.size(); ++i) add(i, {});
    sort();
    const std::size_t whole = std::min<std::size_t>(all.size(), 2);
    for (std::size_t i = 0; i < whole; ++i)
      for (const SwappedLimbs swapped :
           {SwappedLimbs{true, false}, SwappedLimbs{false, true}, SwappedLimbs{true, true}})
        add(all[i].reading, swapped);
    sort();
    std::vector<Candidate> kept;
    for (Candidate& c : all) {
      if (kept.size() == std::max<std::size_t>(1, options_.candidates)) break;
      if (!kept.empty() && c.motion.residual > 1.4 * kept.front().motion.residual) break;
      if (std::ranges::none_of(kept, [&](const Candidate& other) { return same(c.motion, other.motion); }))
        kept.push_back(std::move(c));
    }
    return kept;
  }

  /// Whether two motions are too much alike for two fits.
  bool same(const PartMotion& a, const PartMotion& b) const {
    for (std::size_t j = 0; j < smpl_joint_count; ++j) {
      const Vec3d joint = template_.joints()[j];
      if (length(a.parts[j](joint) - b.parts[j](joint)) > 0.05 * a.size) return false;
      const bool end = j >= joint_index(SmplJoint::left_wrist) || smpl_parents[j] == 7 || smpl_parents[j] == 8;
      if (!end && (a.parts[j].rotation - b.parts[j].rotation).squared_norm() > 0.5) return false;
    }
    return true;
  }

  void fit_places(const FitSurface& surface, const Reading& reading, Candidate& c) const {
    fit::internal::ReadingProblem problem(*model_, prior_, options_.shape_deviations, surface);
    problem.x() = {c.motion.translation.x, c.motion.translation.y, c.motion.translation.z};
    problem.x().insert(problem.x().end(), c.motion.axis_angles.begin(), c.motion.axis_angles.end());
    problem.x().resize(3 + 3 * model_->joint_count() + model_->shape_count());
    problem.set_places(reading, c.motion, c.motion.places);
    problem.set_level(coarse_, coarse_tree_);
    problem.run(places);
    problem.distance(places);
    c.facing = facing_of(problem, reading, c.motion);
    problem.set_facing(c.facing);
    c.value = problem.distance(judged);
    c.x = problem.x();
    c.evaluations = problem.evaluations();
  }

  void fit_coarsely(const FitSurface& surface, const Reading& reading, Candidate& c) const {
    fit::internal::ReadingProblem problem(*model_, prior_, options_.shape_deviations, surface);
    problem.x() = c.x;
    problem.set_places(reading, c.motion, c.motion.places);
    problem.set_facing(c.facing);
    problem.set_level(coarse_, coarse_tree_);
    problem.run(wide);
    problem.run(middle);
    c.value = problem.distance(judged);
    c.x = problem.x();
    c.evaluations += problem.evaluations();
  }

  /// By a vote of the read points: whether the mesh's normals are those of the posed body.
  double facing_of(const fit::internal::ReadingProblem& problem, const Reading& reading,
                   const PartMotion& motion) const {
    std::size_t same = 0, opposite = 0;
    const std::span<const Vec3d> points = problem.body_points();
    for (std::size_t i = 0; i < motion.places.size(); ++i) {
      const auto& [p, q, r] = motion.places[i].corners;
      const double cosine = dot(normalised(cross(points[q] - points[p], points[r] - points[p])), reading[i].normal);
      same += cosine > 0.3;
      opposite += cosine < -0.3;
    }
    if (same > 2 * opposite) return 1;
    return opposite > 2 * same ? -1 : 0;
  }

  /// `reading`: the candidate's own where its places are still to count.
  ReadingFit finished(const FitSurface& surface, const Candidate& c, std::span<const ReadPoint> reading = {}) const {
    fit::internal::ReadingProblem problem(*model_, prior_, options_.shape_deviations, surface);
    problem.x() = c.x;
    problem.set_facing(c.facing);
    std::vector<BodyPoint> read_places;
    for (std::size_t i = 0; i < std::min(reading.size(), finest.places); ++i) {
      const ClosestPoint at = full_tree_.closest(c.motion.places[i].rest);
      read_places.push_back({full_.triangles()[at.triangle], at.weights, at.point});
    }
    problem.set_places(reading.first(read_places.size()), c.motion, read_places);
    problem.set_level(full_, full_tree_);
    problem.run(fine);
    problem.run(finest);
    return result_of(surface, problem, c);
  }

  ReadingFit result_of(const FitSurface& surface, fit::internal::ReadingProblem& problem, const Candidate& c) const {
    ReadingFit result;
    const double sum = problem.distance(measured);
    result.body.distance = std::sqrt(sum / (2 * BodyDistance::per_square_metre));
    const double size = std::sqrt(surface.area() / area_);
    result.relative_distance = result.body.distance / size;
    const std::size_t probes = problem.probe_matches();
    double body = 0, mesh = 0, body_all = 0, mesh_all = 0;
    std::array<double, smpl_joint_count> part_sums{}, part_weights{};
    for (std::size_t i = 0; i < problem.matches().size(); ++i) {
      const auto& m = problem.matches()[i];
      if (i < probes || m.squared >= 0) {
        const std::size_t vertex = i < probes ? full_.probes()[i].vertex : m.at.corners[0];
        const std::size_t part = main_part_[vertex];
        part_sums[part] += m.weight * m.robust();
        part_weights[part] += m.weight;
      }
      const bool near = m.squared >= 0 && m.squared < 0.03 * 0.03 * size * size;
      (i < probes ? body_all : mesh_all) += m.weight;
      if (near) (i < probes ? body : mesh) += m.weight;
    }
    for (std::size_t j = 0; j < smpl_joint_count; ++j)
      if (part_weights[j] > 0) result.part_distances[j] = std::sqrt(part_sums[j] / part_weights[j]) / size;
    result.body_explained = body_all > 0 ? body / body_all : 0;
    result.mesh_explained = mesh_all > 0 ? mesh / mesh_all : 0;
    result.reading = c.reading;
    result.reading_residual = c.motion.residual;
    result.facing = c.facing;
    result.body.evaluations = problem.evaluations();
    const std::vector<double>& x = problem.x();
    result.body.translation = {x[0], x[1], x[2]};
    const std::size_t shape = 3 + 3 * model_->joint_count();
    for (std::size_t i = 3; i < x.size(); ++i)
      (i < shape ? result.body.axis_angles : result.body.betas).push_back(static_cast<float>(x[i]));
    return result;
  }

  std::shared_ptr<const BodyModel> model_;
  ReadingFitOptions options_;
  BodyLevel coarse_, full_;
  TriangleTree coarse_tree_, full_tree_;  ///< at rest: fits move copies
  ReadTemplate template_;
  PosePrior prior_;
  std::vector<std::uint32_t> main_part_;  ///< [V] joint with the greatest weight
  double area_ = 0;
};

}  // namespace npt::inline NPT_ABI
