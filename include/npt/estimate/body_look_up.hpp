/// Where the points of a mesh belong on a body that was fitted to it: each where the body's surface is closest and
/// faces the same way.
/// Shapes    V vertices of the body
/// Units     metres
/// Numerics  some 1 us a look-up; neighbouring points one after the other are faster, by the last one's answer
/// Threads   look-ups may run side by side, each caller with a hint of its own
#pragma once

#include <npt/base/executor.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/fitted_body.hpp>
#include <npt/body/sparse_matrix.hpp>
#include <npt/config.hpp>
#include <npt/estimate/robust_distance.hpp>
#include <npt/mesh/closest_point.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/sampled_surface.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI {

/// A place on a body.
struct BodyPlace {
  Vec3d rest;              ///< on the mean shape at rest
  std::uint32_t part = 0;  ///< the joint that moves it most
};

NPT_INLINE_CLASS(class, BodyLookUp);
template <class>
class BasicBodyLookUp {
 public:
  /// facing: 1: the mesh's triangles turn outwards; -1: inwards; 0: that is not known. joints: how many count as parts
  /// of their own; one behind them, a finger's, counts as what it hangs from
  BasicBodyLookUp(const BodyModel& model, const BodyFit& fit, double facing, std::size_t joints)
      : model_(model), facing_(facing), body_(fitted_points(model, fit)), tree_(body_, model.triangles()) {
    normals_.reserve(model.triangles().size());
    for (const Triangle& t : model.triangles())
      normals_.push_back(normalised(cross(body_[t[1]] - body_[t[0]], body_[t[2]] - body_[t[0]])));
    parts_ = model.tables().weights.heaviest_columns();
    for (std::uint32_t& part : parts_)
      while (part >= joints) part = static_cast<std::uint32_t>(model.tables().parents[part]);
  }

  /// [V] the body's vertices as fitted
  std::span<const Vec3d> body() const noexcept { return as_span(body_); }

  /// outward: the mesh's area vector at the point, 0 where it has none; hint: the last look-up's triangle, or no_index
  ClosestPoint operator()(Vec3d point, Vec3d outward, std::uint32_t& hint) const {
    const Vec3d normal = normalised(outward);
    ClosestPoint c = tree_.closest(
        point, [&](std::uint32_t t) { return normal == Vec3d{} || faces_alike(normals_[t], normal, facing_); }, hint);
    if (c.triangle == no_index) c = tree_.closest(point);
    hint = c.triangle;
    return c;
  }

  /// f(p, where) for each of a mesh's points, side by side. outward: [P] its area vectors
  template <Executor Exec, class F>
  void for_each(std::span<const Vec3d> points, std::span<const Vec3d> outward, const Exec& executor, const F& f) const {
    for_ranges(executor, points.size(), [&](std::size_t first, std::size_t last) {
      std::uint32_t hint = no_index;
      for (std::size_t p = first; p < last; ++p) f(p, (*this)(points[p], outward[p], hint));
    });
  }

  /// From the body's surface as such, whichever way it faces.
  double distance(Vec3d point) const { return std::sqrt(tree_.closest(point).squared_distance); }

  /// add(joint, weight) for the skin weights of the body there; a joint may come several times.
  template <class Add>
  void for_each_weight(const ClosestPoint& on, const Add& add) const {
    const SparseMatrix& skin = model_.tables().weights;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t v = model_.triangles()[on.triangle][k];
      for (std::size_t i = skin.start[v]; i < skin.start[v + 1]; ++i)
        add(skin.column[i], on.weights[k] * static_cast<double>(skin.value[i]));
    }
  }

  BodyPlace place(const ClosestPoint& on) const {
    const Triangle& t = model_.triangles()[on.triangle];
    BodyPlace place;
    for (std::size_t k = 0; k < 3; ++k) {
      const float* rest = &model_.tables().v_template[3 * std::size_t{t[k]}];
      place.rest += Vec3f{rest[0], rest[1], rest[2]}.as<double>() * on.weights[k];
    }
    place.part = parts_[t[static_cast<std::size_t>(std::max_element(on.weights.begin(), on.weights.end()) -
                                                   on.weights.begin())]];
    return place;
  }

 private:
  const BodyModel& model_;
  double facing_;
  std::vector<Vec3d> body_;
  TriangleTree tree_;
  std::vector<Vec3d> normals_;        ///< of the body's triangles, unit
  std::vector<std::uint32_t> parts_;  ///< [V]
};

}  // namespace npt::inline NPT_ABI
