/// A body model at one resolution: some of its vertices, spread evenly, with triangles between them.
///   coarse   vertices far from each other (farthest point sampling); each vertex of the body belongs to the chosen one
///            that is nearest along its edges, and where three such cells meet there is a triangle
///   full     all vertices and the body's own triangles
/// Numerics  the same model and count give the same level
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/body/body_model.hpp>
#include <npt/config.hpp>
#include <npt/estimate/differentiable_body.hpp>
#include <npt/mesh/farthest_points.hpp>
#include <npt/mesh/geodesics.hpp>
#include <npt/mesh/topology.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI {

NPT_INLINE_CLASS(class, BodyLevel);
template <class>
class BasicBodyLevel {
 public:
  /// A vertex that distances are measured at.
  struct Probe {
    std::uint32_t vertex = 0;  ///< of this level
    double area = 0;           ///< share of the body's area; all of them sum to 1
    Vec3d normal;              ///< unit, in the mean shape's rest pose
  };

  /// A level of at most `count` vertices, each a probe.
  BasicBodyLevel(const BodyModel& model, std::size_t count) : BodyLevel(of_probes(model, choose(model, count))) {}

  /// The level of all vertices and triangles, with at most `probe_count` probes.
  static BodyLevel full(const BodyModel& model, std::size_t probe_count) {
    BodyLevel level(model, choose(model, model.vertex_count()));
    level.probes_ = probes_of(model, choose(model, probe_count));
    return level;
  }

  const DifferentiableBody& body() const noexcept { return body_; }
  std::span<const Triangle> triangles() const noexcept { return as_span(triangles_); }
  std::span<const Vec3d> rest_points() const noexcept { return as_span(rest_); }
  std::span<const Probe> probes() const noexcept { return probes_; }

 private:
  struct Choice {
    std::vector<std::uint32_t> vertices;  ///< [n] of the body
    std::vector<std::uint32_t> cell;      ///< [V] which of them each vertex belongs to, or no_index
  };

  BasicBodyLevel(const BodyModel& model, const Choice& choice) : body_(model, choice.vertices) {
    const std::vector<Vec3d> all = rest_of(model);
    for (const std::uint32_t v : choice.vertices) rest_.push_back(all[v]);
    for (const Triangle& t : model.triangles()) {
      const Triangle cells{choice.cell[t[0]], choice.cell[t[1]], choice.cell[t[2]]};
      if (cells[0] != cells[1] && cells[1] != cells[2] && cells[2] != cells[0]) triangles_.push_back(cells);
    }
    once();
  }

  /// A level whose vertices are all probes.
  static BodyLevel of_probes(const BodyModel& model, const Choice& choice) {
    BodyLevel level(model, choice);
    level.probes_ = probes_of(model, choice);
    for (std::uint32_t i = 0; i < level.probes_.size(); ++i) level.probes_[i].vertex = i;
    return level;
  }

  /// The chosen vertices with the area of their cells.
  static std::vector<Probe> probes_of(const BodyModel& model, const Choice& choice) {
    const std::vector<Vec3d> points = rest_of(model);
    std::vector<Probe> probes(choice.vertices.size());
    for (std::size_t i = 0; i < probes.size(); ++i) probes[i].vertex = choice.vertices[i];
    double total = 0;
    for (const Triangle& t : model.triangles()) {
      const Vec3d normal = cross(points[t[1]] - points[t[0]], points[t[2]] - points[t[0]]);
      for (const std::uint32_t v : t) {
        const std::uint32_t cell = choice.cell[v];
        if (cell == no_index) continue;
        probes[cell].area += length(normal);
        total += length(normal);
        if (choice.vertices[cell] == v) probes[cell].normal += normal;
      }
    }
    for (Probe& probe : probes) {
      probe.area /= total > 0 ? total : 1;
      probe.normal = normalised(probe.normal);
    }
    return probes;
  }

  static std::vector<Vec3d> rest_of(const BodyModel& model) {
    const std::span<const float> xyz = model.tables().v_template;
    std::vector<Vec3d> points(xyz.size() / 3);
    for (std::size_t v = 0; v < points.size(); ++v)
      points[v] = Vec3f{xyz[3 * v], xyz[3 * v + 1], xyz[3 * v + 2]}.as<double>();
    return points;
  }

  /// Takes out triangles that stand for the same three cells. Turning order is kept.
  void once() {
    for (Triangle& t : triangles_) std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    std::sort(triangles_.begin(), triangles_.end());
    triangles_.erase(std::unique(triangles_.begin(), triangles_.end()), triangles_.end());
  }

  static Choice choose(const BodyModel& model, std::size_t count) {
    const std::vector<Vec3d> points = rest_of(model);
    Choice choice;
    if (count >= points.size()) {
      for (std::uint32_t v = 0; v < points.size(); ++v) choice.vertices.push_back(v);
      choice.cell = choice.vertices;
      return choice;
    }
    choice.vertices = farthest_points(as_span(points), count);
    choice.cell =
        geodesics(points, neighbours(as_span(edges_of_triangles(model.triangles())), points.size()), choice.vertices)
            .nearest;
    return choice;
  }

  DifferentiableBody body_;
  std::vector<Triangle> triangles_;
  std::vector<Vec3d> rest_;
  std::vector<Probe> probes_;
};

}  // namespace npt::inline NPT_ABI
