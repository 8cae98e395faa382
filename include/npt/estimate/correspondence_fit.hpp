/// Fits a body to a surface of which it was read where each point belongs: Gauss-Newton steps from the motion in closed
/// form, in place of a search. Several candidate readings may be given, such as those of the mesh in turned directions.
///   E(x) = place weight * mean_k rho(|body(place_k) - point_k|^2) +
///          sum_i a_i rho(|v_i - surface|^2) + mean_k rho(|q_k - body|^2) + priors
///   1. motion    of every reading, from few points, and of the best ones with limbs swapped (part_motion.hpp)
///   2. coarse    a coarse body, first to the places of up to three of these, then, where it comes near, to the surface
///   3. finish    all vertices, both ways, with a kernel that narrows; where the body keeps a distance from it,
///                as under clothes, the places count too
/// Distances are taken along normals: the step is that of "point to plane"; where a point has left the other surface's
/// end, along the line to it.
/// Shapes    x as DifferentiableBody's: [translation, axis angles J x 3, betas S]
/// Units     those of the model, metres; E in square centimetres
/// Numerics  double; some 20 steps, 75 to 100 ms on one core of an EPYC with AVX-512, whatever the mesh's size. Of 50
///           mannequins in natural poses, read with errors of 5 cm, a tenth of the places wild and limbs swapped, 47
///           ended within 7 mm RMS over vertices and the others within 23; 50 people of another model's shapes at a
///           distance of 7 mm between surfaces, 3 of them with an arm twisted by more than 60 degrees.
/// Threads   a fitter may be used by several threads at a time; a fit runs its candidates side by side on the executor
///           that it is given, with the same bits for any, and in its caller's thread without one
/// Errors    npt::Error for no reading or too few points, and for a surface of quite another size than the body
/// Source    Chen and Medioni, "Object modelling by registration of multiple range images", 1992 (point to plane);
///           Nocedal and Wright, "Numerical Optimization", 2006, section 10.3 (Levenberg and Marquardt)
#pragma once

#include <npt/base/error.hpp>
#include <npt/base/executor.hpp>
#include <npt/base/sort.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_kind.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/body_plan.hpp>
#include <npt/config.hpp>
#include <npt/estimate/body_level.hpp>
#include <npt/estimate/correspondence_problem.hpp>
#include <npt/estimate/fit_stages.hpp>
#include <npt/estimate/fit_surface.hpp>
#include <npt/estimate/fitted_body.hpp>
#include <npt/estimate/part_motion.hpp>
#include <npt/estimate/pose_prior.hpp>
#include <npt/estimate/robust_distance.hpp>
#include <npt/estimate/surface_track.hpp>
#include <npt/mesh/closest_point.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// A mesh's points as they were read. Points should be drawn by area, in random order: the first n stand for all.
using Correspondences = std::vector<PointCorrespondence>;

struct CorrespondenceFitOptions {
  std::size_t coarse_vertices = 1200;      ///< of the body that is fitted first
  std::size_t probes = 1500;               ///< vertices that the finish measures at
  std::size_t samples = 2000;              ///< points of the surface that the finish measures at
  std::size_t ranked_points = 400;         ///< of each reading, from which the best ones are chosen
  std::size_t candidates = 3;              ///< readings that are fitted coarsely, at most
  std::vector<double> shape_deviations{};  ///< [S] standard deviations of the betas; missing ones are 1
};

/// A body that was fitted to a read surface, and what tells how reliable it is.
struct CorrespondenceFit {
  BodyFit body;
  /// Root of the mean squared distance between the surfaces, both ways, cut off at 5 cm, divided by the size of the
  /// surface (the root of its area over the body's).
  double relative_distance = 0;
  double mesh_explained = 0;           ///< share of the surface that has the body within 3 cm (times its size)
  double body_explained = 0;           ///< share of the body that has the surface within 3 cm
  double correspondence_residual = 0;  ///< PartMotion::residual of the reading that was taken
  std::size_t reading = 0;             ///< number of that
  double facing = 1;                   ///< 1: the mesh's triangles turn outwards, -1: inwards, 0: can't be said
  double pose_deviation = 0;           ///< how improbable the pose is: the mean of squared deviations of natural poses
  /// As relative_distance, of each part alone.
  std::vector<double> part_distances;

  /// The shape's sum of squared deviations: people up to 60, bodies with random proportions 270, a frog with a head of
  /// a third of his height 850; a tree 2800, a lamp 1900, a table, to which a body can be flattened, 700 to 1300.
  double shape_deviation() const {
    double sum = 0;
    for (const float beta : body.betas) sum += static_cast<double>(beta) * static_cast<double>(beta);
    return sum;
  }
};
NPT_INLINE_CLASS(class, CorrespondenceFitter);
template <class>
class BasicCorrespondenceFitter {
 public:
  explicit BasicCorrespondenceFitter(std::shared_ptr<const BodyKind> kind, CorrespondenceFitOptions options = {})
      : kind_(checked_kind(std::move(kind))),
        model_(kind_->body),
        options_(std::move(options)),
        coarse_(*model_, options_.coarse_vertices),
        full_(BodyLevel::full(*model_, options_.probes)),
        coarse_tree_(coarse_.rest_points(), coarse_.triangles()),
        full_tree_(full_.rest_points(), full_.triangles()),
        template_(*model_, coarse_, kind_->plan),
        prior_(PosePrior::natural(*kind_)),
        main_part_(model_->tables().weights.heaviest_columns()),
        turns_freely_(kind_->joint_count()) {
    for (std::size_t j = 0; j < turns_freely_.size(); ++j)
      turns_freely_[j] = kind_->plan.joints[j].kind == JointKind::tip;
    for (const LimbPair& limb : template_.limbs())
      for (const auto& joints : limb.joints)
        if (limb.first > 0) turns_freely_[joints[limb.middle() + 1]] = true;
    for (const Triangle& t : full_.triangles()) {
      const std::span<const Vec3d> rest = full_.rest_points();
      area_ += 0.5 * length(cross(rest[t[1]] - rest[t[0]], rest[t[2]] - rest[t[0]]));
    }
  }
  BasicCorrespondenceFitter(const BasicCorrespondenceFitter&) = delete;
  BasicCorrespondenceFitter& operator=(const BasicCorrespondenceFitter&) = delete;

  const BodyModel& model() const noexcept { return *model_; }
  const BodyKind& kind() const noexcept { return *kind_; }
  /// The resting body that places are read on.
  const CorrespondenceTemplate& correspondence_template() const noexcept { return template_; }
  const CorrespondenceFitOptions& options() const noexcept { return options_; }
  /// Of the resting body's surface, in square metres.
  double area() const noexcept { return area_; }

  CorrespondenceFit fit(const FitSurface& surface, const Correspondences& reading) const {
    return fit(surface, std::span(&reading, 1));
  }

  /// The best of several readings of one surface.
  template <class Exec = SerialExecutor>
  CorrespondenceFit fit(const FitSurface& surface, std::span<const Correspondences> readings,
                        const Exec& executor = Exec()) const {
    if (readings.empty()) throw Error({.file = "reading", .found = "none", .expected = "at least one"});
    std::vector<Candidate> candidates = ranked(readings);
    int evaluations = 0;
    for_each_of(candidates, executor, [&](Candidate& c) {
      const Correspondences& reading = readings[c.reading];
      if (options_.ranked_points < reading.size()) c.motion = part_motion(template_, reading, c.swapped);
      fit_places(surface, reading, c);
    });
    stable_sort_by(candidates, &Candidate::value);
    // Distances after the places alone tell candidates apart where they differ much.
    while (candidates.size() > 1 && candidates.back().value > 1.3 * candidates.front().value) candidates.pop_back();
    for_each_of(candidates, executor, [&](Candidate& c) { fit_coarsely(surface, readings[c.reading], c); });
    for (const Candidate& c : candidates) evaluations += c.evaluations;
    const auto best = std::min_element(candidates.begin(), candidates.end(),
                                       [](const Candidate& a, const Candidate& b) { return a.value < b.value; });
    CorrespondenceFit result = finished(surface, *best, readings[best->reading]);
    result.body.evaluations += evaluations;
    result.body.starts = static_cast<int>(candidates.size());
    return result;
  }

  /// The nearest of fits that begin elsewhere, as LimbSearch finds places; `fit` itself where none is nearer.
  template <class Exec = SerialExecutor>
  CorrespondenceFit nearest(const FitSurface& surface, const CorrespondenceFit& fit, std::span<const BodyFit> starts,
                            const Exec& executor = Exec()) const {
    std::vector<Candidate> candidates(starts.size());
    for (std::size_t i = 0; i < starts.size(); ++i) candidates[i].x = parameters(starts[i]);
    for_each_of(candidates, executor, [&](Candidate& c) {
      c.facing = fit.facing;
      c.motion.residual = fit.correspondence_residual;
      c.reading = fit.reading;
      fit::internal::CorrespondenceProblem problem(*model_, prior_, options_.shape_deviations, surface);
      problem.x() = c.x;
      problem.set_facing(fit.facing);
      problem.set_level(coarse_, coarse_tree_);
      problem.run(Stages::astray);
      c.value = problem.distance(Stages::judged);
      c.x = problem.x();
      c.evaluations = problem.evaluations();
    });
    int evaluations = 0;
    for (const Candidate& c : candidates) evaluations += c.evaluations;
    stable_sort_by(candidates, &Candidate::value);
    std::erase_if(candidates, [limit = candidates.empty() ? 0 : 1.3 * candidates.front().value](const Candidate& c) {
      return c.value > limit;
    });
    candidates.resize(std::min<std::size_t>(candidates.size(), 2));
    for_each_of(candidates, executor, [&](Candidate& c) { c.result = finished(surface, c); });
    CorrespondenceFit best = fit;
    for (Candidate& c : candidates)
      if (c.result.relative_distance < best.relative_distance) best = std::move(c.result);
    best.body.evaluations += evaluations;
    return best;
  }

  /// What follows the surface from here on, frame by frame.
  std::shared_ptr<const SurfaceTrack> track(const FitSurface& surface, const CorrespondenceFit& fit) const {
    return std::make_shared<const SurfaceTrack>(*model_, full_, full_tree_, surface, fit.body, fit.facing);
  }

 private:
  using Stages = fit::internal::FitStages;

  struct Candidate {
    std::size_t reading = 0;
    SwappedLimbs swapped = 0;
    PartMotion motion;
    std::vector<double> x;
    double value = std::numeric_limits<double>::infinity();
    double facing = 1;
    int evaluations = 0;
    CorrespondenceFit result;  ///< of those that were finished
  };

  template <class Exec, class F>
  static void for_each_of(std::vector<Candidate>& candidates, const Exec& executor, const F& f) {
    executor.for_each(static_cast<int>(candidates.size()),
                      [&](int i, int) { f(candidates[static_cast<std::size_t>(i)]); });
  }

  /// Half and one and a half times the body's size fit as well as its own.
  static bool has_body_size(const PartMotion& motion) { return motion.size > 0.25 && motion.size < 3; }

  std::vector<double> parameters(const BodyFit& body) const {
    std::vector<double> x{body.translation.x, body.translation.y, body.translation.z};
    x.insert(x.end(), body.axis_angles.begin(), body.axis_angles.end());
    x.insert(x.end(), body.betas.begin(), body.betas.end());
    x.resize(3 + 3 * model_->joint_count() + model_->shape_count());
    return x;
  }

  /// Readings, and the best ones with limbs swapped: the least residuals first; of equal ones, the earlier.
  std::vector<Candidate> ranked(std::span<const Correspondences> readings) const {
    std::vector<Candidate> all;
    const auto add = [&](std::size_t reading, SwappedLimbs swapped) {
      Candidate& c = all.emplace_back();
      c.reading = reading;
      c.swapped = swapped;
      const Correspondences& r = readings[reading];
      c.motion = part_motion(template_, std::span(r).first(std::min(options_.ranked_points, r.size())), swapped);
    };
    const auto sort = [&] { stable_sort_by(all, [](const Candidate& c) { return c.motion.residual; }); };
    for (std::size_t i = 0; i < readings.size(); ++i) add(i, 0);
    sort();
    const double size = all.front().motion.size;
    std::erase_if(all, [](const Candidate& c) { return !has_body_size(c.motion); });
    if (all.empty())
      throw Error({.file = "surface",
                   .found = "a body " + std::to_string(size) + " times as large as the model",
                   .expected = "about its size: the model's unit, metres"});
    const std::size_t whole = std::min<std::size_t>(all.size(), 2);
    for (std::size_t i = 0; i < whole; ++i)
      for (SwappedLimbs swapped = 1; swapped >> template_.limbs().size() == 0; ++swapped) add(all[i].reading, swapped);
    sort();
    std::vector<Candidate> kept;
    for (Candidate& c : all) {
      if (kept.size() == std::max<std::size_t>(1, options_.candidates)) break;
      if (!kept.empty() && c.motion.residual > 1.4 * kept.front().motion.residual) break;
      if (std::none_of(kept.begin(), kept.end(), [&](const Candidate& other) { return same(c.motion, other.motion); }))
        kept.push_back(std::move(c));
    }
    return kept;
  }

  /// Whether two motions are too much alike for two fits.
  bool same(const PartMotion& a, const PartMotion& b) const {
    for (std::size_t j = 0; j < a.parts.size(); ++j) {
      const Vec3d joint = template_.joints()[j];
      if (length(a.parts[j](joint) - b.parts[j](joint)) > 0.05 * a.size) return false;
      if (!turns_freely_[j] && (a.parts[j].rotation - b.parts[j].rotation).squared_norm() > 0.5) return false;
    }
    return true;
  }

  void fit_places(const FitSurface& surface, const Correspondences& reading, Candidate& c) const {
    fit::internal::CorrespondenceProblem problem(*model_, prior_, options_.shape_deviations, surface);
    problem.x() = {c.motion.translation.x, c.motion.translation.y, c.motion.translation.z};
    problem.x().insert(problem.x().end(), c.motion.axis_angles.begin(), c.motion.axis_angles.end());
    problem.x().resize(3 + 3 * model_->joint_count() + model_->shape_count());
    problem.set_places(reading, c.motion, c.motion.places);
    problem.set_level(coarse_, coarse_tree_);
    problem.run(Stages::places);
    problem.distance(Stages::places);
    c.facing = facing_of(problem, reading, c.motion);
    problem.set_facing(c.facing);
    c.value = problem.distance(Stages::judged);
    c.x = problem.x();
    c.evaluations = problem.evaluations();
  }

  void fit_coarsely(const FitSurface& surface, const Correspondences& reading, Candidate& c) const {
    fit::internal::CorrespondenceProblem problem(*model_, prior_, options_.shape_deviations, surface);
    problem.x() = c.x;
    problem.set_places(reading, c.motion, c.motion.places);
    problem.set_facing(c.facing);
    problem.set_level(coarse_, coarse_tree_);
    problem.run(Stages::wide);
    problem.run(Stages::middle);
    c.value = problem.distance(Stages::judged);
    c.x = problem.x();
    c.evaluations += problem.evaluations();
  }

  /// By a vote of the read points: whether the mesh's normals are those of the posed body.
  double facing_of(const fit::internal::CorrespondenceProblem& problem, const Correspondences& reading,
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
  CorrespondenceFit finished(const FitSurface& surface, const Candidate& c,
                             std::span<const PointCorrespondence> reading = {}) const {
    fit::internal::CorrespondenceProblem problem(*model_, prior_, options_.shape_deviations, surface);
    problem.x() = c.x;
    problem.set_facing(c.facing);
    std::vector<BodyPoint> read_places;
    for (std::size_t i = 0; i < std::min(reading.size(), fit::internal::stage_places); ++i) {
      const ClosestPoint at = full_tree_.closest(c.motion.places[i].rest);
      read_places.push_back({full_.triangles()[at.triangle], at.weights, at.point});
    }
    problem.set_places(reading.first(read_places.size()), c.motion, read_places);
    problem.set_level(full_, full_tree_);
    problem.run(Stages::fine);
    problem.run(Stages::finest);
    return result_of(surface, problem, c);
  }

  CorrespondenceFit result_of(const FitSurface& surface, fit::internal::CorrespondenceProblem& problem,
                              const Candidate& c) const {
    CorrespondenceFit result;
    const double sum = problem.distance(Stages::measured);
    result.body.distance = std::sqrt(sum / (2 * per_square_metre));
    const double size = std::sqrt(surface.area() / area_);
    result.relative_distance = result.body.distance / size;
    const std::size_t probes = problem.probe_matches();
    double body = 0, mesh = 0, body_all = 0, mesh_all = 0;
    const std::size_t joints = model_->joint_count();
    std::vector<double> part_sums(joints), part_weights(joints);
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
    result.part_distances.resize(joints);
    for (std::size_t j = 0; j < joints; ++j)
      if (part_weights[j] > 0) result.part_distances[j] = std::sqrt(part_sums[j] / part_weights[j]) / size;
    result.body_explained = body_all > 0 ? body / body_all : 0;
    result.mesh_explained = mesh_all > 0 ? mesh / mesh_all : 0;
    result.reading = c.reading;
    result.correspondence_residual = c.motion.residual;
    result.facing = c.facing;
    result.body.evaluations = problem.evaluations();
    const std::vector<double>& x = problem.x();
    result.body.translation = {x[0], x[1], x[2]};
    const std::size_t shape = 3 + 3 * model_->joint_count();
    for (std::size_t i = 3; i < x.size(); ++i)
      (i < shape ? result.body.axis_angles : result.body.betas).push_back(static_cast<float>(x[i]));
    const auto angles = std::span(x).subspan(3, shape - 3);
    std::vector<double> gradient(angles.size());
    result.pose_deviation = prior_(angles, 1, 0, gradient) / static_cast<double>(angles.size());
    return result;
  }

  std::shared_ptr<const BodyKind> kind_;
  std::shared_ptr<const BodyModel> model_;  ///< the kind's
  CorrespondenceFitOptions options_;
  BodyLevel coarse_, full_;
  TriangleTree coarse_tree_, full_tree_;  ///< at rest: fits move copies
  CorrespondenceTemplate template_;
  PosePrior prior_;
  std::vector<std::uint32_t> main_part_;  ///< [V] joint with the greatest weight
  std::vector<bool> turns_freely_;  ///< [J] what has hardly a direction of its own: tips, and hands about their arms
  double area_ = 0;
};

}  // namespace npt::inline NPT_ABI
