/// Fits a body to a surface by correspondences, where each point belongs on it: Gauss-Newton steps from the motion in
/// closed form, in place of a search. Several views' correspondences may be given.
///   E(x) = place weight * mean_k rho(|body(place_k) - point_k|^2) +
///          sum_i a_i rho(|v_i - surface|^2) + mean_k rho(|q_k - body|^2) + priors
///   1. motion    of every view, and of the best ones with limbs swapped (part_motion.hpp)
///   2. coarse    a coarse body, first to the places of some of these, then, where near, one a pose to the surface
///   3. finish    of the poses that these end in those of the least energy (residuals.hpp): all vertices, both ways,
///                with a kernel that narrows; where the body keeps a distance, as under clothes, places count too
///   4. polish    of the one that is chosen, by all samples
/// Distances are taken along normals ("point to plane"); beyond the other surface's end, along the line to it.
/// Shapes    x as DifferentiableBody's: [translation, axis angles J x 3, betas S]
/// Units     those of the model, metres; E in square centimetres
/// Numerics  double; the same bits for any executor; how far results are off: docs/results.md
/// Threads   a fitter may be used by several threads at a time; a fit runs its candidates side by side on its executor
/// Errors    npt::Error for too few points
/// Source    Chen and Medioni, "Object modelling by registration of multiple range images", 1992 (point to plane);
///           Nocedal and Wright, "Numerical Optimization", 2006, section 10.3 (Levenberg and Marquardt)
#pragma once

#include <npt/base/as_span.hpp>
#include <npt/base/executor.hpp>
#include <npt/base/sort.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_kind.hpp>
#include <npt/body/body_level.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/fitted_body.hpp>
#include <npt/body/pose_prior.hpp>
#include <npt/config.hpp>
#include <npt/estimate/correspondence_problem.hpp>
#include <npt/estimate/fit_stages.hpp>
#include <npt/estimate/part_motion.hpp>
#include <npt/estimate/residuals.hpp>
#include <npt/estimate/robust_distance.hpp>
#include <npt/estimate/surface_track.hpp>
#include <npt/mesh/sampled_surface.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// A mesh's points and where they were seen to belong. Points should be drawn by area, in random order: the first n of
/// them stand for all.
using Correspondences = std::vector<PointCorrespondence>;

/// Correspondences of one direction, and how the parts of a body move by the first of them.
struct BodyView {
  /// Points that tell whether a view shows a body. With 500 1 of 60 people in natural poses has its legs exchanged (the
  /// mean rises from 4.7 to 12.0e-4), and 1 of 60 in clothes ends at 55e-4 instead of 16.
  static constexpr std::size_t few = 400;

  BodyView(const CorrespondenceTemplate& rest, Correspondences seen)
      : points(std::move(seen)), motion(motion_of(rest, 0)) {}

  /// With limbs swapped.
  PartMotion motion_of(const CorrespondenceTemplate& rest, SwappedLimbs swapped) const {
    return part_motion(rest, as_span(points).first(std::min(few, points.size())), swapped);
  }

  Correspondences points;
  PartMotion motion;
};

/// A body that was fitted to a surface, and what tells how reliable it is.
struct CorrespondenceFit {
  BodyFit body;
  /// Root of the mean squared distance between the surfaces, both ways, cut off at 6 cm, divided by the size of the
  /// surface (the root of its area over the body's).
  double relative_distance = 0;
  double mesh_explained = 0;           ///< share of the surface that has the body within 3 cm (times its size)
  double facing = 1;                   ///< 1: the mesh's triangles turn outwards, -1: inwards, 0: can't be said
  double pose_deviation = 0;           ///< how improbable the pose is: the mean of squared deviations of natural poses
  std::vector<double> part_distances;  ///< as relative_distance, of each part alone

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
  /// candidates: views that are fitted coarsely, at most
  explicit BasicCorrespondenceFitter(std::shared_ptr<const BodyKind> kind, std::size_t candidates = 3)
      : kind_(checked_kind(std::move(kind))),
        model_(kind_->body),
        candidates_(std::max<std::size_t>(1, candidates)),
        coarse_(*model_, coarse_vertices),
        full_(BodyLevel::full(*model_, Stages::fine.points)),
        template_(*model_, coarse_, kind_->plan),
        prior_(PosePrior::natural(*kind_)),
        main_part_(model_->tables().weights.heaviest_columns()) {}
  BasicCorrespondenceFitter(const BasicCorrespondenceFitter&) = delete;
  BasicCorrespondenceFitter& operator=(const BasicCorrespondenceFitter&) = delete;

  const BodyModel& model() const noexcept { return *model_; }
  const BodyKind& kind() const noexcept { return *kind_; }
  /// The resting body that places are seen on.
  const CorrespondenceTemplate& correspondence_template() const noexcept { return template_; }
  /// Of the resting body's surface, in square metres.
  double area() const noexcept { return full_.area(); }

  /// By several views of one surface: the best that end in different poses. None where a body is a third as large as
  /// what the views show, or three times. compared: whether views are, before each was fitted coarsely
  template <class Exec = SerialExecutor>
  std::vector<CorrespondenceFit> fits(const SampledSurface& surface, std::span<const BodyView> views,
                                      const Exec& executor = Exec(), bool compared = true) const {
    const std::size_t together = compared ? views.size() : 1;
    std::vector<Candidate> all;
    for (std::size_t i = 0; i < views.size(); i += together)
      for (Candidate& c : coarse(surface, views.subspan(i, together), executor)) all.push_back(std::move(c));
    return finished(surface, std::move(all), executor);
  }

  /// The same from other poses of a fit, as LimbSearch finds them.
  template <class Exec = SerialExecutor>
  std::vector<CorrespondenceFit> fits(const SampledSurface& surface, const CorrespondenceFit& fit,
                                      std::span<const BodyFit> starts, const Exec& executor = Exec()) const {
    std::vector<Candidate> candidates(starts.size());
    for (std::size_t i = 0; i < starts.size(); ++i)
      candidates[i].x = parameters_of(starts[i], coarse_.body().parameter_count());
    for_each_of(candidates, executor, [&](Candidate& c) {
      c.facing = fit.facing;
      Problem problem = problem_of(surface, coarse_, c);
      problem.run(Stages::astray);
      judge(problem, c);
    });
    return finished(surface, std::move(candidates), executor);
  }

  /// The fit once more from where it is, by all samples and a view's places.
  CorrespondenceFit polished(const SampledSurface& surface, const BodyView& view, const CorrespondenceFit& fit) const {
    Candidate c{.view = &view, .motion = view.motion, .x = parameters_of(fit.body, full_.body().parameter_count())};
    c.facing = fit.facing;
    Problem problem = problem_of(surface, full_, c);
    problem.run(Stages::polish);
    return measured(surface, problem, c);
  }

  /// What follows the surface from here on, frame by frame.
  std::shared_ptr<const SurfaceTrack> track(const SampledSurface& surface, const CorrespondenceFit& fit) const {
    return std::make_shared<const SurfaceTrack>(*model_, surface, fit.body, fit.facing);
  }

 private:
  using Stages = fit::internal::FitStages;
  using Problem = fit::internal::CorrespondenceProblem;

  /// Vertices of the body that is fitted first.
  static constexpr std::size_t coarse_vertices = 1200;
  /// Poses that are finished, at most, by their energies so far. Of 335 calls for 100 characters and 120 people one
  /// ends with more energy (by 0.08) than where all are finished; with two 7 do (by 0.02 to 0.5).
  static constexpr std::size_t most_finished = 3;

  struct Candidate {
    const BodyView* view = nullptr;  ///< none: its places don't count
    SwappedLimbs swapped = 0;
    PartMotion motion{};
    std::vector<double> x{};
    double value = std::numeric_limits<double>::infinity();  ///< by which it is ranked: a residual, distance or energy
    double facing = 1;
  };

  template <class Exec, class F>
  static void for_each_of(std::vector<Candidate>& candidates, const Exec& executor, const F& f) {
    executor.for_each(static_cast<int>(candidates.size()),
                      [&](int i, int) { f(candidates[static_cast<std::size_t>(i)]); });
  }

  /// Views, and the best ones with limbs swapped, fitted by the coarse body.
  template <class Exec>
  std::vector<Candidate> coarse(const SampledSurface& surface, std::span<const BodyView> views,
                                const Exec& executor) const {
    std::vector<Candidate> candidates = ranked(views);
    for_each_of(candidates, executor, [&](Candidate& c) {
      if (BodyView::few < c.view->points.size()) c.motion = part_motion(template_, c.view->points, c.swapped);
      c.x = {c.motion.translation.x, c.motion.translation.y, c.motion.translation.z};
      c.x.insert(c.x.end(), c.motion.axis_angles.begin(), c.motion.axis_angles.end());
      c.x.resize(coarse_.body().parameter_count());
      Problem problem = problem_of(surface, coarse_, c);
      problem.run(Stages::places);
      problem.distance(Stages::places);
      c.facing = problem.vote_on_facing(c.view->points, c.motion);
      judge(problem, c);
    });
    keep_near(candidates);
    candidates = one_a_pose(std::move(candidates));  // of people's views five end in one
    for_each_of(candidates, executor, [&](Candidate& c) {
      Problem problem = problem_of(surface, coarse_, c);
      problem.run(Stages::wide);
      problem.run(Stages::middle);
      judge(problem, c);
    });
    return candidates;
  }

  static bool has_body_size(const PartMotion& motion) { return motion.size > 1.0 / 3 && motion.size < 3; }

  /// Views, and the best ones with limbs swapped: the least residuals first; of equal ones, the earlier. The best of
  /// each choice of limbs is always among them: else 3 of 540 people with random proportions end with legs exchanged.
  std::vector<Candidate> ranked(std::span<const BodyView> views) const {
    const auto residual = [](const Candidate& c) { return c.motion.residual; };
    std::vector<Candidate> all;
    for (const BodyView& view : views) all.push_back({.view = &view, .motion = view.motion});
    std::erase_if(all, [](const Candidate& c) { return !has_body_size(c.motion); });
    stable_sort_by(all, residual);
    const std::size_t whole = std::min<std::size_t>(all.size(), 2);
    for (std::size_t i = 0; i < whole; ++i)
      for (SwappedLimbs swapped = 1; swapped >> template_.limbs().size() == 0; ++swapped)
        all.push_back({.view = all[i].view, .swapped = swapped, .motion = all[i].view->motion_of(template_, swapped)});
    stable_sort_by(all, residual);
    std::vector<double> had(std::size_t{1} << template_.limbs().size());
    for (Candidate& c : all) c.value = std::exchange(had[c.swapped], 1);
    stable_sort_by(all, &Candidate::value);
    return one_a_pose(std::move(all), candidates_ + had.size() - 1, [this](const Candidate& c) {
      std::vector<Vec3d> joints(template_.joints().begin(), template_.joints().end());
      for (std::size_t k = 0; k < joints.size(); ++k) joints[k] = c.motion.parts[k](joints[k]);
      return joints;
    });
  }

  /// The first candidate of each pose, at most so many. In another pose a joint lies elsewhere.
  template <class JointsOf>
  static std::vector<Candidate> one_a_pose(std::vector<Candidate> candidates, std::size_t most, JointsOf&& joints_of) {
    std::vector<Candidate> kept;
    std::vector<std::vector<Vec3d>> poses;
    for (Candidate& c : candidates) {
      if (kept.size() == most) break;
      std::vector<Vec3d> joints = joints_of(c);
      const auto same = [&joints](const std::vector<Vec3d>& other) {
        return std::ranges::equal(joints, other, [](Vec3d a, Vec3d b) { return length(a - b) <= usual_error; });
      };
      if (std::ranges::any_of(poses, same)) continue;
      poses.push_back(std::move(joints));
      kept.push_back(std::move(c));
    }
    return kept;
  }

  /// By their fitted bodies.
  std::vector<Candidate> one_a_pose(std::vector<Candidate> all) const {
    const std::size_t count = all.size();
    return one_a_pose(std::move(all), count, [this](const Candidate& c) { return fitted_joints(*model_, body_of(c)); });
  }
  BodyFit body_of(const Candidate& c) const { return fit_of(as_span(c.x), model_->joint_count()); }
  Problem problem_of(const SampledSurface& surface, const BodyLevel& level, const Candidate& c) const {
    Problem problem(prior_, surface, level, c.x, c.facing);
    if (c.view != nullptr) problem.set_places(c.view->points, c.motion);
    return problem;
  }

  static void judge(Problem& problem, Candidate& c) {
    c.value = problem.distance(Stages::judged);
    c.x = problem.x();
  }

  /// The best one first, without those that are clearly farther.
  static void keep_near(std::vector<Candidate>& candidates) {
    stable_sort_by(candidates, &Candidate::value);
    while (candidates.size() > 1 && candidates.back().value > 1.3 * candidates.front().value) candidates.pop_back();
  }

  /// Of each pose the nearest candidate: by their energies a skeleton ends at 36 mm instead of 14. Of the poses those
  /// of the least energy: coarse distances don't tell them apart (1.45 to 1.49 for 7.0 to 7.4 mm).
  template <class Exec>
  std::vector<CorrespondenceFit> finished(const SampledSurface& surface, std::vector<Candidate> candidates,
                                          const Exec& executor) const {
    keep_near(candidates);
    std::vector<Candidate> kept = one_a_pose(std::move(candidates));
    for (Candidate& c : kept)
      c.value = EstimateResiduals::energy_of_fit(metres_of(c.value) / size_of(surface), pose_deviation(body_of(c)));
    stable_sort_by(kept, &Candidate::value);
    kept.resize(std::min(kept.size(), most_finished));
    std::vector<CorrespondenceFit> fits(kept.size());
    for_each_of(kept, executor,
                [&](Candidate& c) { fits[static_cast<std::size_t>(&c - kept.data())] = finished(surface, c); });
    return fits;
  }

  CorrespondenceFit finished(const SampledSurface& surface, const Candidate& c) const {
    Problem problem = problem_of(surface, full_, c);
    problem.run(Stages::fine);
    problem.run(Stages::finest);
    return measured(surface, problem, c);
  }

  CorrespondenceFit measured(const SampledSurface& surface, Problem& problem, const Candidate& c) const {
    CorrespondenceFit result;
    result.body = fit_of(as_span(problem.x()), model_->joint_count());
    result.body.distance = metres_of(problem.distance(Stages::measured));
    result.facing = c.facing;
    result.pose_deviation = pose_deviation(result.body);
    measure(problem, size_of(surface), result);
    return result;
  }

  /// Of Problem::distance, which is the sum of two means in square centimetres.
  static double metres_of(double distance) { return std::sqrt(distance / (2 * per_square_metre)); }
  double size_of(const SampledSurface& surface) const { return std::sqrt(surface.area() / area()); }
  double pose_deviation(const BodyFit& body) const {
    const std::vector<double> theta(body.axis_angles.begin(), body.axis_angles.end());
    return prior_(as_span(theta), 1, 0) / static_cast<double>(theta.size());
  }

  /// What the distances say, of a surface of that size.
  void measure(const Problem& problem, double size, CorrespondenceFit& result) const {
    result.relative_distance = result.body.distance / size;
    const std::size_t probes = problem.probe_matches();
    constexpr double nearest = Stages::finest.scale;
    double near = 0, all = 0;
    std::vector<double> sums(model_->joint_count()), weights(sums.size());
    for (std::size_t i = 0; i < problem.matches().size(); ++i) {
      const auto& m = problem.matches()[i];
      if (i < probes || m.squared >= 0) {
        const std::size_t part = main_part_[i < probes ? full_.probes()[i].vertex : m.at.corners[0]];
        sums[part] += m.weight * m.robust();
        weights[part] += m.weight;
      }
      if (i < probes) continue;
      all += m.weight;
      if (m.squared >= 0 && m.squared < nearest * nearest * size * size) near += m.weight;
    }
    result.mesh_explained = all > 0 ? near / all : 0;
    result.part_distances.resize(sums.size());
    for (std::size_t j = 0; j < sums.size(); ++j)
      if (weights[j] > 0) result.part_distances[j] = std::sqrt(sums[j] / weights[j]) / size;
  }

  std::shared_ptr<const BodyKind> kind_;
  std::shared_ptr<const BodyModel> model_;  ///< the kind's
  std::size_t candidates_;
  BodyLevel coarse_, full_;
  CorrespondenceTemplate template_;
  PosePrior prior_;
  std::vector<std::uint32_t> main_part_;  ///< [V] joint with the greatest weight
};

}  // namespace npt::inline NPT_ABI
