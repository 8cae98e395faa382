/// A body model at one resolution: some of its vertices, spread evenly, with triangles between them.
///   coarse   vertices far from each other (farthest point sampling); each vertex of the body belongs to the chosen one
///            that is nearest along its edges, and where three such cells meet there is a triangle
///   full     all vertices and the body's own triangles
/// Numerics  the same model and count give the same level
#pragma once

#include <npt/base/as_span.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/differentiable_body.hpp>
#include <npt/config.hpp>
#include <npt/mesh/closest_point.hpp>
#include <npt/mesh/farthest_points.hpp>
#include <npt/mesh/geodesics.hpp>
#include <npt/mesh/points.hpp>
#include <npt/mesh/topology.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI {

/// A point of a body's surface: the sum of the vertices `corners` times `weights`.
struct BodyPoint {
  Triangle corners{};
  std::array<double, 3> weights{};
  Vec3d rest;  ///< where it is on the mean shape in the rest pose
};

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
  BasicBodyLevel(const BodyModel& model, std::size_t count) : BodyLevel(model, Cells(model, count)) {
    for (std::uint32_t i = 0; i < probes_.size(); ++i) probes_[i].vertex = i;
  }

  /// The level of all vertices and triangles, with at most `probe_count` probes.
  static BodyLevel full(const BodyModel& model, std::size_t probe_count) {
    BodyLevel level(model, model.vertex_count());
    level.place_probes(model, Cells(model, probe_count));
    return level;
  }

  const DifferentiableBody& body() const noexcept { return body_; }
  std::span<const Triangle> triangles() const noexcept { return as_span(triangles_); }
  /// Of the triangles at rest.
  const TriangleTree& tree() const noexcept { return tree_; }
  std::span<const Probe> probes() const noexcept { return probes_; }
  /// Of the model's surface at rest.
  double area() const noexcept { return area_; }

  /// The surface's point that is closest to a place on the resting body.
  BodyPoint locate(Vec3d place) const {
    const ClosestPoint c = tree_.closest(place);
    return {triangles_[c.triangle], c.weights, c.point};
  }

 private:
  /// Chosen vertices, and what belongs to each.
  struct Cells {
    std::vector<Vec3d> points;            ///< [V] of the body at rest
    std::vector<std::uint32_t> vertices;  ///< [n] of the body
    std::vector<std::uint32_t> cell;      ///< [V] which of them each vertex belongs to, or no_index

    Cells(const BodyModel& model, std::size_t count) : points(points_of(as_span(model.tables().v_template))) {
      if (count >= points.size()) {
        vertices.resize(points.size());
        std::iota(vertices.begin(), vertices.end(), 0U);
        cell = vertices;
        return;
      }
      vertices = farthest_points(as_span(points), count);
      cell = geodesics(as_span(points), neighbours(as_span(edges_of_triangles(model.triangles())), points.size()),
                       as_span(vertices))
                 .nearest;
    }
  };

  BasicBodyLevel(const BodyModel& model, const Cells& cells)
      : body_(model, cells.vertices),
        triangles_(triangles_between(model, cells)),
        rest_(rest_of(cells)),
        tree_(as_span(rest_), as_span(triangles_)) {
    place_probes(model, cells);
  }

  static std::vector<Vec3d> rest_of(const Cells& cells) {
    std::vector<Vec3d> rest;
    for (const std::uint32_t v : cells.vertices) rest.push_back(cells.points[v]);
    return rest;
  }

  /// Each once. Turning order is kept.
  static std::vector<Triangle> triangles_between(const BodyModel& model, const Cells& cells) {
    std::vector<Triangle> all;
    for (const auto& [p, q, r] : model.triangles()) {
      Triangle t{cells.cell[p], cells.cell[q], cells.cell[r]};
      if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;
      std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
      all.push_back(t);
    }
    std::sort(all.begin(), all.end());
    all.erase(std::unique(all.begin(), all.end()), all.end());
    return all;
  }

  /// At the chosen vertices, with the area of their cells.
  void place_probes(const BodyModel& model, const Cells& cells) {
    probes_.assign(cells.vertices.size(), {});
    for (std::size_t i = 0; i < probes_.size(); ++i) probes_[i].vertex = cells.vertices[i];
    double total = 0;
    area_ = 0;
    for (const Triangle& t : model.triangles()) {
      const Vec3d normal = cross(cells.points[t[1]] - cells.points[t[0]], cells.points[t[2]] - cells.points[t[0]]);
      area_ += 0.5 * length(normal);
      for (const std::uint32_t v : t) {
        const std::uint32_t cell = cells.cell[v];
        if (cell == no_index) continue;
        probes_[cell].area += length(normal);
        total += length(normal);
        if (cells.vertices[cell] == v) probes_[cell].normal += normal;
      }
    }
    for (Probe& probe : probes_) {
      probe.area /= total > 0 ? total : 1;
      probe.normal = normalised(probe.normal);
    }
  }

  DifferentiableBody body_;
  std::vector<Triangle> triangles_;
  std::vector<Vec3d> rest_;
  TriangleTree tree_;
  std::vector<Probe> probes_;
  double area_ = 0;
};

}  // namespace npt::inline NPT_ABI
