/// Non-rigid registration: the source deforms until it lies on the target, markers on markers. In two phases, each of
/// them linear least squares problems in the source's points and fourth vertices:
///   E = wS sum over ordered pairs of adjacent triangles ||T_i - T_j||_F^2 +
///       wI sum over triangles ||T_i - I||_F^2 +
///       wC sum over points |v_i - c_i|^2,   the markers as hard constraints
///   1. wC = 0
///   2. wC grows geometrically, with c_i the closest point of the target whose normal is less than 90 degrees away,
///      found anew before each step. A point whose closest one lies on an open border has no such term.
/// The third term has a unit, so its weight means something only with one: the diagonal of the target's bounding box
/// counts as `size`. Before all, the similarity that fits the markers best moves the source onto the target (markers in
/// one place: the diagonals give the scale).
/// Pieces of the source without a marker are tied to what they are nearest to; triangles without an area keep their
/// sides; points without a triangle don't take part.
/// Numerics  double; the same bits for any executor
/// Errors    npt::Error for no markers, markers out of range, in no face, or that pull one point to two places
/// Source    Sumner and Popovic, "Deformation Transfer for Triangle Meshes", SIGGRAPH 2004, section 5
#pragma once

#include <npt/base/error.hpp>
#include <npt/base/executor.hpp>
#include <npt/base/matrix3.hpp>
#include <npt/base/vec3.hpp>
#include <npt/baseline/deformation/deformation_gradient.hpp>
#include <npt/baseline/deformation/markers.hpp>
#include <npt/baseline/deformation/piece_tree.hpp>
#include <npt/baseline/deformation/registration_system.hpp>
#include <npt/baseline/deformation/registration_target.hpp>
#include <npt/baseline/deformation/surface.hpp>
#include <npt/config.hpp>
#include <npt/mesh/normals.hpp>
#include <npt/solve/best_similarity.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// The weights are the paper's.
struct RegistrationOptions {
  double smoothness = 1, identity = 0.001;
  double closest_first = 1, closest_last = 5000;
  int closest_steps = 10;  ///< of phase 2
  double size = 1;
};

/// How far a registration is, after each of its steps.
struct RegistrationStep {
  int step = 0, steps = 0;  ///< step 1 is phase 1
  double weight = 0;        ///< wC
  std::size_t matched = 0;  ///< points with a closest point, before the step
  double distance = 0;      ///< root mean square of their distances from it after the step, in the target's unit
};
using RegistrationProgress = std::function<void(const RegistrationStep&)>;

/// A source that lies on the target.
struct Registration {
  Similarity similarity;      ///< from the source to the target, by the markers
  std::vector<Vec3d> points;  ///< [P] of the source's surface, in the target's place and unit
};

namespace deformation {

/// Both meshes where the registration sees them: the source moved by the similarity, the target's diagonal
/// options.size.
class RegistrationRun {
 public:
  RegistrationRun(const Surface& source, const Surface& target, std::span<const Marker> markers,
                  const RegistrationOptions& options)
      : options_(options),
        source_(source),
        target_surface_(target),
        similarity_(similarity_of(markers)),
        unit_(diagonal_of(target) / options.size),
        system_(source.points.size() + source.triangles.size()) {
    check_markers(markers, source.point_of.size(), target.point_of.size());
    for (Vec3d& p : source_.points) p = similarity_(p) / unit_;
    for (Vec3d& p : target_surface_.points) p = p / unit_;
    target_.emplace(target_surface_);
    name_variables(markers);
    add_triangles();
    add_adjacent();
    add_ties(markers);
  }

  template <Executor Exec>
  Registration run(const RegistrationProgress& progress, const Exec& executor) {
    const std::size_t points = source_.points.size();
    std::vector<std::pair<std::uint32_t, Vec3d>> goals;
    std::vector<Vec3d> deformed(points);
    for (int step = 1; step <= 1 + options_.closest_steps; ++step) {
      const double weight = step == 1 ? 0 : weight_of(step - 2);
      if (step > 1) goals = closest(deformed, executor);
      const std::vector<Vec3d>& solution = system_.solve(goals, weight);
      for (std::size_t p = 0; p < points; ++p) deformed[p] = used_[p] != 0 ? solution[p] : source_.points[p];
      if (progress)
        progress({step, 1 + options_.closest_steps, weight, goals.size(), distance(goals, deformed) * unit_});
    }
    for (Vec3d& p : deformed) p = p * unit_;
    return {similarity_, std::move(deformed)};
  }

 private:
  using Term = RegistrationSystem::Term;

  Similarity similarity_of(std::span<const Marker> markers) const {
    if (markers.empty()) throw Error({.file = "markers", .found = "none", .expected = "at least one"});
    check_markers(markers, source_.point_of.size(), target_surface_.point_of.size());
    std::vector<Vec3d> from, to;
    for (const Marker& marker : markers) {
      from.push_back(source_.points[source_.point_of[marker.source]]);
      to.push_back(target_surface_.points[target_surface_.point_of[marker.target]]);
    }
    Similarity result = best_similarity(from, to);
    if (std::ranges::all_of(from, [&](Vec3d p) { return p == from[0]; }) ||
        std::ranges::all_of(to, [&](Vec3d p) { return p == to[0]; })) {
      // Markers in one place say nothing of sizes.
      result.scale = diagonal_of(target_surface_) / diagonal_of(source_);
      result.shift = to[0] - result.rotation * from[0] * result.scale;
    }
    return result;
  }

  static double diagonal_of(const Surface& surface) {
    Vec3d low = surface.points[0], high = low;
    for (const Vec3d p : surface.points) {
      low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    }
    return length(high - low);
  }

  double weight_of(int i) const {
    const double share = options_.closest_steps > 1 ? static_cast<double>(i) / (options_.closest_steps - 1) : 1;
    return options_.closest_first * std::pow(options_.closest_last / options_.closest_first, share);
  }

  std::uint32_t fourth(std::size_t t) const { return static_cast<std::uint32_t>(source_.points.size() + t); }

  void name_variables(std::span<const Marker> markers) {
    used_.assign(source_.points.size(), 0);
    for (std::size_t t = 0; t < source_.triangles.size(); ++t) {
      for (const std::uint32_t p : source_.triangles[t]) used_[p] = 1, system_.use(p);
      if (source_.flat[t] == 0) system_.use(fourth(t));
    }
    std::vector<std::uint32_t> goal(source_.points.size(), no_index);
    for (std::size_t i = 0; i < markers.size(); ++i) {
      const std::uint32_t p = source_.point_of[markers[i].source], q = target_surface_.point_of[markers[i].target];
      const std::string place = "marker " + std::to_string(i + 1);
      if (used_[p] == 0)
        throw Error({.file = "markers",
                     .place = place,
                     .found = "vertex " + std::to_string(markers[i].source) + " of the source, which is in no face",
                     .expected = "a vertex of the surface"});
      if (goal[p] != no_index && goal[p] != q)
        throw Error({.file = "markers",
                     .place = place,
                     .found = "vertex " + std::to_string(markers[i].source) + " of the source for the second time",
                     .expected = "one place for each vertex"});
      goal[p] = q;
      system_.fix(p, target_surface_.points[q]);
    }
    system_.number_unknowns();
  }

  void add_triangles() {
    rest_.resize(source_.triangles.size());
    weight_.resize(source_.triangles.size());
    const double side = source_.mean_side();
    for (std::size_t t = 0; t < source_.triangles.size(); ++t) {
      const auto [a, b, c] = source_.corners(t);
      if (source_.flat[t] == 0) {
        rest_[t] = RestTriangle(a, b, c);
        weight_[t] = source_.weight(t, side);
        system_.add(gradient_terms(t), options_.identity * weight_[t], Matrix3::identity());
        continue;
      }
      for (std::size_t i = 0; i < 3; ++i) {
        const std::uint32_t p = source_.triangles[t][i], q = source_.triangles[t][(i + 1) % 3];
        if (p == q) continue;
        const Vec3d along = (source_.points[q] - source_.points[p]) / side;
        system_.add(std::array<Term, 2>{{{q, {1 / side, 0, 0}}, {p, {-1 / side, 0, 0}}}}, options_.identity,
                    outer(along, {1, 0, 0}));
      }
    }
  }

  /// T of a triangle that isn't flat.
  std::array<Term, 4> gradient_terms(std::size_t t) const {
    const Triangle& triangle = source_.triangles[t];
    const auto& slopes = rest_[t].slopes;
    return {{{triangle[0], slopes[0]}, {triangle[1], slopes[1]}, {triangle[2], slopes[2]}, {fourth(t), slopes[3]}}};
  }

  /// T_i - T_j. Both orders of a pair are in the sum.
  void add_difference(std::size_t i, std::size_t j) {
    std::array<Term, 8> sum{};
    std::size_t count = 0;
    const auto merge = [&](const Term& term, double sign) {
      std::size_t k = 0;
      while (k < count && sum[k].variable != term.variable) ++k;
      if (k == count) sum[count++].variable = term.variable;
      sum[k].slope += term.slope * sign;
    };
    for (const Term& term : gradient_terms(i)) merge(term, 1);
    for (const Term& term : gradient_terms(j)) merge(term, -1);
    system_.add(std::span(sum).first(count), 2 * options_.smoothness * std::min(weight_[i], weight_[j]));
  }

  /// Where more than two triangles share an edge, each is adjacent to the next in their order.
  void add_adjacent() {
    const std::vector<TriangleSide> sides = sorted_sides(source_);
    for (std::size_t i = 1; i < sides.size(); ++i)
      if (sides[i - 1].edge == sides[i].edge) add_difference(sides[i - 1].triangle, sides[i].triangle);
  }

  /// A piece without a marker keeps the place of its hook relative to the triangle that it is attached to, and the gradients
  /// of a triangle at the hook and of that one are to be alike.
  void add_ties(std::span<const Marker> markers) {
    const Pieces pieces = pieces_of(source_);
    std::vector<char> marked(pieces.count);
    for (const Marker& marker : markers) marked[pieces.of_point[source_.point_of[marker.source]]] = 1;
    if (std::ranges::count(marked, 0) == 0) return;
    const double side = source_.mean_side();
    std::vector<std::uint32_t> some_triangle(source_.points.size(), no_index);
    bool held = false;
    for (std::uint32_t t = 0; t < source_.triangles.size(); ++t) {
      if (source_.flat[t] != 0) continue;
      for (const std::uint32_t p : source_.triangles[t]) some_triangle[p] = t;
      held = held || marked[pieces.of_point[source_.triangles[t][0]]] != 0;
    }
    if (!held)
      throw Error({.file = "markers",
                   .found = "none on a face with an area",
                   .expected = "at least one marker on a face with an area"});
    for (const auto& [piece, point, at] : PieceTree(source_, pieces.of_point, marked).hooks()) {
      if (used_[point] == 0) continue;  // a point without a triangle
      const std::size_t t = at.triangle;
      const std::array<Term, 4> gradient = gradient_terms(t);
      const Vec3d offset = source_.points[point] - source_.points[gradient[0].variable];
      std::array<Term, 5> sum{};
      for (std::size_t k = 0; k < 4; ++k) sum[k] = {gradient[k].variable, {-dot(gradient[k].slope, offset), 0, 0}};
      sum[0].slope.x -= 1;
      sum[4] = {point, {1, 0, 0}};
      system_.add(sum, tie / (side * side));
      if (some_triangle[point] != no_index) add_difference(some_triangle[point], t);
    }
  }

  template <Executor Exec>
  std::vector<std::pair<std::uint32_t, Vec3d>> closest(std::span<const Vec3d> deformed, const Exec& executor) const {
    const std::vector<Vec3d> normals = area_vectors(deformed, source_.triangles);
    std::vector<std::optional<Vec3d>> found(deformed.size());
    for_ranges(executor, deformed.size(), [&](std::size_t first, std::size_t last) {
      for (std::size_t p = first; p < last; ++p)
        if (used_[p] != 0) found[p] = target_->closest(deformed[p], normals[p]);
    });
    std::vector<std::pair<std::uint32_t, Vec3d>> goals;
    for (std::uint32_t p = 0; p < found.size(); ++p)
      if (found[p]) goals.emplace_back(p, *found[p]);
    return goals;
  }

  static double distance(std::span<const std::pair<std::uint32_t, Vec3d>> goals, std::span<const Vec3d> deformed) {
    if (goals.empty()) return 0;
    double sum = 0;
    for (const auto& [p, goal] : goals) sum += dot(deformed[p] - goal, deformed[p] - goal);
    return std::sqrt(sum / static_cast<double>(goals.size()));
  }

  static constexpr double tie = 10;  ///< in lengths of a side: stiff beside wS = 1

  RegistrationOptions options_;
  Surface source_, target_surface_;
  Similarity similarity_;
  double unit_;  ///< in the target's unit
  RegistrationSystem system_;
  std::optional<RegistrationTarget> target_;
  std::vector<char> used_;          ///< [P] whether a point is in a triangle
  std::vector<RestTriangle> rest_;  ///< [T]
  std::vector<double> weight_;      ///< [T] of triangles that aren't flat
};

}  // namespace deformation

/// Brings `source` onto `target`. `progress` is called after every step, in the calling thread; what it throws ends the
/// run.
template <Executor Exec = SerialExecutor>
Registration register_surfaces(const deformation::Surface& source, const deformation::Surface& target,
                               std::span<const Marker> markers, const RegistrationOptions& options = {},
                               const RegistrationProgress& progress = {}, const Exec& executor = Exec()) {
  return deformation::RegistrationRun(source, target, markers, options).run(progress, executor);
}

}  // namespace npt::inline NPT_ABI
