/// One fit of a body to a surface and its correspondences: what is summed, its derivatives, and stages of damped steps.
/// correspondence_fit.hpp says which stages follow each other, and gives E.
/// Shapes    x as DifferentiableBody's: [translation, axis angles J x 3, betas S]
/// Units     metres; E in square centimetres
/// Threads   one problem belongs to one thread
/// Source    Chen and Medioni, "Object modelling by registration of multiple range images", 1992 (point to plane)
#pragma once

#include <npt/base/as_span.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_level.hpp>
#include <npt/body/differentiable_body.hpp>
#include <npt/body/point_equations.hpp>
#include <npt/body/pose_prior.hpp>
#include <npt/config.hpp>
#include <npt/estimate/fit_stages.hpp>
#include <npt/estimate/part_motion.hpp>
#include <npt/estimate/robust_distance.hpp>
#include <npt/mesh/closest_point.hpp>
#include <npt/mesh/sampled_surface.hpp>
#include <npt/solve/damped_steps.hpp>
#include <npt/solve/normal_equations.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

namespace fit::internal {
NPT_INLINE_CLASS(class, CorrespondenceProblem);
/// One fit: a surface, and where the body is.
template <class>
class BasicCorrespondenceProblem {
 public:
  struct Match {
    Vec3d offset;         ///< from the mesh to the body
    double squared = -1;  ///< below 0: nothing near
    BodyPoint at{};
    double weight = 0;
    double scale = 0;
    bool is_place = false;  ///< else a distance from a surface, of which what lies along it hardly counts

    /// Its squared distance, cut off at the scale; all of that where nothing is near.
    double robust() const { return squared < 0 ? scale * scale : robust_squared(squared, scale); }
  };

  /// facing: as CorrespondenceFit's. All but x must outlive it.
  BasicCorrespondenceProblem(const PosePrior& prior, const SampledSurface& surface, const BodyLevel& level,
                             std::vector<double> x, double facing)
      : prior_(prior),
        surface_(surface),
        level_(level),
        tree_(level.tree()),
        mesh_tree_(surface.tree()),
        facing_(facing),
        x_(std::move(x)),
        points_of_body_(level.body().vertex_count()),
        equations_(level.body().parameter_count()),
        mesh_hint_(level.probes().size(), no_index),
        body_hint_(surface.samples().size(), no_index) {}

  const std::vector<double>& x() const noexcept { return x_; }

  /// Correspondences that count as well, and what their motion took their places for. Both must outlive it.
  void set_places(std::span<const PointCorrespondence> points, const PartMotion& motion) {
    points_ = points.first(std::min(points.size(), stage_places));
    motion_ = &motion;
    places_.clear();
    for (std::size_t k = 0; k < points_.size(); ++k) places_.push_back(level_.locate(motion.places[k]));
  }

  /// Takes the steps of a stage.
  void run(const FitStage& stage) {
    stage_ = &stage;
    prior_share_ = place_share_ = 1;
    value_ = evaluate(x_, matches_, state_);
    if (stage.usual_distance > 0) {
      const double limit = 20, limit_of_places = 10;
      const double times = data_value_ / stage.usual_distance;
      prior_share_ = std::clamp(times, 1.0, limit);
      place_share_ = (std::clamp(times, 1.0, limit_of_places) - 1) / (limit_of_places - 1);
      value_ = total(x_, matches_);
    }
    take_damped_steps(*this, stage.steps);
  }

  /// The sum of the distances without places and priors, at the scale of a stage.
  double distance(const FitStage& stage) {
    stage_ = &stage;
    evaluate(x_, matches_, state_);
    return data_value_;
  }
  /// Those of the last distance(): of probes, then of samples.
  std::span<const Match> matches() const noexcept { return matches_; }
  std::size_t probe_matches() const noexcept { return std::min(stage_->points, level_.probes().size()); }

  /// Whether the mesh's normals are those of the body, by a vote of all points: 1, -1, or 0 for a draw. From now on
  /// they count so. Where normals don't count distances are less, and wrong views of clothes with two walls win by it.
  double vote_on_facing(std::span<const PointCorrespondence> points, const PartMotion& motion) {
    std::size_t same = 0, opposite = 0;
    for (std::size_t k = 0; k < points.size(); ++k) {
      const double cosine = dot(normal_of(level_.locate(motion.places[k]).corners), points[k].normal);
      same += cosine > 0;
      opposite += cosine < 0;
    }
    facing_ = same > opposite ? 1 : same < opposite ? -1 : 0;
    return facing_;
  }

  /// take_damped_steps() asks these.
  double value() const noexcept { return value_; }
  double try_step(std::span<const double> step) {
    trial_ = level_.body().stepped(as_span(x_), step);
    whole_step_ = level_.body().allowed_share(step) == 1;
    return trial_value_ = evaluate(trial_, trial_matches_, trial_state_);
  }
  bool whole_step() const noexcept { return whole_step_; }
  void take_step() {
    std::swap(x_, trial_);
    std::swap(matches_, trial_matches_);
    std::swap(state_, trial_state_);
    value_ = trial_value_;
  }
  const NormalEquations& linearise() {
    PointEquations points(level_.body(), as_span(x_), state_, matches_.size());
    for (const Match& m : matches_) {
      if (m.squared < 0) continue;
      const double weight = m.weight * robust_weight(m.squared, m.scale), off = std::sqrt(m.squared);
      if (m.is_place)
        points.add(m.at.corners, m.at.weights, m.offset, weight);
      else if (off > 0)
        points.add(m.at.corners, m.at.weights, m.offset / off, weight, off);
    }
    equations_.clear();
    points.sum_into(equations_);
    const double prior = prior_share_ * stage_->prior;
    prior_.linearise(angles_of(as_span(x_)), prior, 3, equations_);
    for (std::size_t i = first_beta(); i < x_.size(); ++i) {
      const double weight = prior * stage_->shape_prior * robust_weight(x_[i] * x_[i], unusual_shape);
      equations_.add_to_matrix(i, i, weight);
      equations_.add_to_right(i, weight * x_[i]);
    }
    return equations_;
  }

 private:
  /// In deviations: from here on a beta costs hardly more, so that the prior may be strong enough that the body is not
  /// blown up to fill clothes and a stylised figure still keeps its proportions (docs/notes/tuned-numbers.md).
  static constexpr double unusual_shape = 2;

  std::size_t first_beta() const { return 3 + 3 * level_.body().joint_count(); }
  std::span<const double> angles_of(std::span<const double> x) const { return x.subspan(3, first_beta() - 3); }

  double evaluate(std::span<const double> x, std::vector<Match>& matches, DifferentiableBody::State& state) {
    level_.body().forward(x, state, as_span(points_of_body_));
    matches.clear();
    if (stage_->points > 0) {
      from_body(state, matches);
      from_mesh(matches);
    }
    data_value_ = 0;
    for (const Match& m : matches) data_value_ += m.weight * m.robust();
    return total(x, matches);
  }

  /// E of what was matched to the surface, with places and priors as much as they count now.
  double total(std::span<const double> x, std::vector<Match>& matches) const {
    const double prior = prior_share_ * stage_->prior;
    double value = data_value_ + from_places(matches) + prior_(angles_of(x), prior, prior);
    for (std::size_t i = first_beta(); i < x.size(); ++i)
      value += prior * stage_->shape_prior * robust_squared(x[i] * x[i], unusual_shape);
    return value;
  }

  Vec3d normal_of(const Triangle& t) const {
    const auto& [p, q, r] = t;
    return normalised(cross(points_of_body_[q] - points_of_body_[p], points_of_body_[r] - points_of_body_[p]));
  }

  void from_body(const DifferentiableBody::State& state, std::vector<Match>& matches) {
    const auto probes = level_.probes().first(probe_matches());
    double area = 0;
    for (const BodyLevel::Probe& probe : probes) area += probe.area;
    const double limit = 9 * stage_->scale * stage_->scale, spacing = 0.7 * surface_.spacing();
    for (std::size_t i = 0; i < probes.size(); ++i) {
      const BodyLevel::Probe& probe = probes[i];
      const Vec3d point = points_of_body_[probe.vertex];
      const Vec3d normal = normalised(level_.body().carried(probe.vertex, probe.normal, state));
      const ClosestPoint c = mesh_tree_.closest(
          point, [&](std::uint32_t k) { return faces(normal, surface_.samples()[k].normal); }, mesh_hint_[i], limit);
      mesh_hint_[i] = c.triangle;
      Match& m = matches.emplace_back();
      m.weight = per_square_metre * probe.area / area;
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
  static Vec3d between(Vec3d body, Vec3d mesh) { return normalised(dot(body, mesh) < 0 ? body - mesh : body + mesh); }

  bool faces(Vec3d body, Vec3d mesh) const {
    return mesh == Vec3d{} || faces_alike(body, mesh, facing_, stage_->facing);
  }

  void from_mesh(std::vector<Match>& matches) {
    const std::span<const Triangle> triangles = level_.triangles();
    tree_.move(as_span(points_of_body_), triangles);
    normals_.resize(triangles.size());
    for (std::size_t t = 0; t < triangles.size(); ++t) normals_[t] = normal_of(triangles[t]);
    const std::size_t count = std::min(stage_->points, surface_.samples().size());
    const double limit = 9 * stage_->scale * stage_->scale;
    for (std::size_t k = 0; k < count; ++k) {
      const SampledSurface::Sample& s = surface_.samples()[k];
      const ClosestPoint c = tree_.closest(
          s.point, [&](std::uint32_t t) { return faces(normals_[t], s.normal); }, body_hint_[k], limit);
      body_hint_[k] = c.triangle;
      Match& m = matches.emplace_back();
      m.weight = per_square_metre / static_cast<double>(count);
      m.scale = stage_->scale;
      if (c.triangle == no_index) continue;
      m.at = {triangles[c.triangle], c.weights, {}};
      m.offset = c.point - s.point;
      m.squared = c.squared_distance;
    }
  }

  /// Matches of places in the place of older ones, and what they add to E.
  double from_places(std::vector<Match>& matches) const {
    std::erase_if(matches, [](const Match& m) { return m.is_place; });
    const double weight = place_share_ * stage_->place_weight * per_square_metre;
    if (!(weight > 0)) return 0;
    double total = 0, value = 0;
    for (std::size_t k = 0; k < places_.size(); ++k) total += motion_->certainty[k];
    for (std::size_t k = 0; k < places_.size(); ++k) {
      const BodyPoint& at = places_[k];
      const Vec3d offset = points_of_body_[at.corners[0]] * at.weights[0] +
                           points_of_body_[at.corners[1]] * at.weights[1] +
                           points_of_body_[at.corners[2]] * at.weights[2] - points_[k].point;
      matches.push_back(
          {offset, dot(offset, offset), at, weight * motion_->certainty[k] / total, 2 * stage_->scale, true});
      value += matches.back().weight * matches.back().robust();
    }
    return value;
  }

  const PosePrior& prior_;
  const SampledSurface& surface_;
  const BodyLevel& level_;
  const FitStage* stage_ = nullptr;
  std::span<const PointCorrespondence> points_;
  const PartMotion* motion_ = nullptr;
  std::vector<BodyPoint> places_;
  TriangleTree tree_;
  const PointTree& mesh_tree_;
  double facing_, prior_share_ = 1, place_share_ = 1, value_ = 0, trial_value_ = 0, data_value_ = 0;
  bool whole_step_ = true;
  std::vector<double> x_, trial_;
  std::vector<Vec3d> points_of_body_, normals_;
  std::vector<Match> matches_, trial_matches_;
  DifferentiableBody::State state_, trial_state_;
  NormalEquations equations_;
  std::vector<std::uint32_t> mesh_hint_, body_hint_;
};

}  // namespace fit::internal

}  // namespace npt::inline NPT_ABI
