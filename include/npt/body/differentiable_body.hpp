/// A body's vertices as a function of its parameters, and its derivatives: what pulls at vertices does to the
/// parameters. A pull is a force: joints feel its sum and moment, from the tips towards the root. Those of a
/// function's slopes by the vertices give its gradient; of the Jacobian's rows see point_equations.hpp.
///   parameters   x = [translation 3, axis angles 3 J, betas S], in one row: BodyModel's, and a translation of all
///                vertices
/// Shapes    vertices, gradients: [n] for the n vertices that were named at construction
/// Numerics  double; the forward pass agrees with BodyModel::posed() to float's rounding, gradients with finite
///           differences
/// Source    Loper et al., "SMPL", 2015; Sola et al., "A micro Lie theory for state estimation in robotics", 2018,
///           section IV (rotations)
#pragma once

#include <npt/base/as_span.hpp>
#include <npt/base/matrix3.hpp>
#include <npt/base/rigid.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/kinematics.hpp>
#include <npt/body/sparse_matrix.hpp>
#include <npt/config.hpp>
#include <npt/mesh/skinning.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

namespace fit::internal {

/// m^T v
constexpr Vec3d transposed_times(const Matrix3& m, Vec3d v) {
  return m.rows[0] * v.x + m.rows[1] * v.y + m.rows[2] * v.z;
}

/// How exp(axis_angle) turns in its own frame where the axis angle grows: exp(a + d) = exp(a) exp(J d), to first order.
NPT_INLINE Matrix3 right_jacobian(Vec3d a) {
  const double square = dot(a, a), angle = std::sqrt(square);
  // The series' next terms are below 1e-10 there.
  const bool small = angle < 1e-3;
  const double first = small ? 0.5 - square / 24 : (1 - std::cos(angle)) / square;
  const double second = small ? 1.0 / 6 - square / 120 : (angle - std::sin(angle)) / (square * angle);
  const Matrix3 skew{{{{0, -a.z, a.y}, {a.z, 0, -a.x}, {-a.y, a.x, 0}}}};
  return Matrix3::identity() - skew * first + skew * skew * second;
}

}  // namespace fit::internal
NPT_INLINE_CLASS(class, DifferentiableBody);
template <class>
class BasicDifferentiableBody {
 public:
  /// The pose of every bone for one set of parameters, as forward() leaves it for backward() and for normals.
  struct State {
    std::vector<Vec3d> joints;   ///< [J] of the rest pose
    std::vector<Matrix3> local;  ///< [J] rotation relative to the parent
    std::vector<Rigid> motions;  ///< [J] of the bones, without the translation
    std::vector<double> bend;    ///< [9 (J - 1)] R - I, or empty without posedirs
    std::vector<Vec3d> shaped;   ///< [n] vertices of the rest pose
  };

  /// What all derivatives at one x have in common.
  struct Derivatives {
    std::vector<Matrix3> turns;  ///< [J] from a moment about a posed joint to the derivative by its axis angle
    std::vector<Vec3d> places;   ///< [J] posed joints, without the translation
    std::vector<double> slides;  ///< [J, 3, S] how a bone shifts with the betas
    std::vector<Vec3d> forces;   ///< [J] at each bone; of backward()
    std::vector<Vec3d> moments;  ///< [J] of these, about the origin
  };

  /// The body with all its vertices.
  explicit BasicDifferentiableBody(const BodyModel& model) : BasicDifferentiableBody(model, all_of(model)) {}

  /// The body with some vertices only.
  /// Requires  vertices below the model's count
  BasicDifferentiableBody(const BodyModel& model, std::vector<std::uint32_t> vertices)
      : vertices_(std::move(vertices)), rest_joints_(model.rest_joints()) {
    const BodyTables& tables = model.tables();
    shapes_ = model.shape_count();
    parents_ = tables.parents;
    corrections_ = tables.posedirs.empty() ? 0 : 9 * (parents_.size() - 1);
    gather(tables.v_template, 1, template_);
    gather(tables.shapedirs, shapes_, shapedirs_);
    gather(tables.posedirs, corrections_, posedirs_);
    weights_ = tables.weights.gathered(as_span(vertices_));
    for (std::size_t i = 0; i < vertices_.size(); ++i) {
      std::uint64_t& movers = movers_.emplace_back();
      for (const std::uint32_t column : weights_.columns_of(i))
        for (int j = static_cast<int>(column); j >= 0; j = parents_[static_cast<std::size_t>(j)])
          movers |= j < last_bit ? std::uint64_t{1} << j : ~std::uint64_t{0};
    }
  }

  std::size_t vertex_count() const noexcept { return vertices_.size(); }
  std::size_t joint_count() const noexcept { return parents_.size(); }
  std::size_t shape_count() const noexcept { return shapes_; }
  std::size_t parameter_count() const noexcept { return 3 + 3 * joint_count() + shapes_; }
  std::span<const std::uint32_t> vertices() const noexcept { return as_span(vertices_); }
  std::span<const int> parents() const noexcept { return as_span(parents_); }

  /// out: [n]
  void forward(std::span<const double> x, State& state, std::span<Vec3d> out) const {
    NPT_ASSERT(x.size() == parameter_count() && out.size() == vertex_count());
    pose_bones(x, state);
    shape_vertices(betas(x), state);
    const Vec3d translation{x[0], x[1], x[2]};
    for (std::size_t i = 0; i < out.size(); ++i)
      out[i] = skinned(
          weights_.columns_of(i), weights_.values_of(i),
          [&](std::size_t j) { return state.motions[j](state.shaped[i]); }, translation);
  }

  /// Writes the gradient with respect to the parameters of a function that has `out_gradient` [n] with respect to the
  /// vertices. `state` is forward's for this x.
  void backward(std::span<const double> x, const State& state, std::span<const Vec3d> out_gradient,
                std::span<double> gradient) const {
    NPT_ASSERT(out_gradient.size() == vertex_count() && gradient.size() == parameter_count());
    Derivatives d;
    derivatives(x, state, d);
    begin_pull(d, gradient);
    std::vector<double> by_entry(corrections_);  // of the joints' rotations
    for (std::size_t i = 0; i < out_gradient.size(); ++i) {
      const Vec3d at_rest = pull(state, i, out_gradient[i], d, gradient);
      const float* correction = posedirs_.data() + 3 * i * corrections_;
      for (std::size_t b = 0; b < corrections_; ++b)
        by_entry[b] += at_rest.x * static_cast<double>(correction[b]) +
                       at_rest.y * static_cast<double>(correction[corrections_ + b]) +
                       at_rest.z * static_cast<double>(correction[2 * corrections_ + b]);
    }
    end_pull(d, gradient);
    for (std::size_t j = 1; 9 * j <= corrections_; ++j) {
      const double* e = &by_entry[9 * (j - 1)];
      const Matrix3 m =
          state.local[j].transposed() * Matrix3{{{{e[0], e[1], e[2]}, {e[3], e[4], e[5]}, {e[6], e[7], e[8]}}}};
      const Vec3d own{m.rows[2].y - m.rows[1].z, m.rows[0].z - m.rows[2].x, m.rows[1].x - m.rows[0].y};
      const Vec3d turn = d.turns[j] * (state.motions[j].rotation * own);
      gradient[3 + 3 * j] += turn.x, gradient[4 + 3 * j] += turn.y, gradient[5 + 3 * j] += turn.z;
    }
  }

  /// As much of a step as turns no joint too far for one.
  double allowed_share(std::span<const double> step) const {
    constexpr double most = 0.7;  // radians about an axis
    double largest = most;
    for (std::size_t i = 3; i < 3 + 3 * joint_count(); ++i) largest = std::max(largest, std::abs(step[i]));
    return most / largest;
  }
  /// x and the allowed share of a step; angles beyond half a turn are written the other way round.
  std::vector<double> stepped(std::span<const double> x, std::span<const double> step) const {
    const double share = allowed_share(step);
    std::vector<double> result(x.begin(), x.end());
    for (std::size_t i = 0; i < result.size(); ++i) result[i] += share * step[i];
    for (std::size_t j = 0; j < joint_count(); ++j) {
      const double angle = length(axis_angle(as_span(result), j));
      if (angle <= std::numbers::pi) continue;
      for (std::size_t k = 0; k < 3; ++k) result[3 + 3 * j + k] *= (angle - 2 * std::numbers::pi) / angle;
    }
    return result;
  }

  /// The direction `rest` of vertex i in the rest pose, carried along by the skin; not normalised.
  Vec3d carried(std::size_t i, Vec3d rest, const State& state) const {
    return skinned(weights_.columns_of(i), weights_.values_of(i),
                   [&](std::size_t j) { return state.motions[j].rotation * rest; });
  }

  /// Prepares derivatives at x. `state` is forward's for this x.
  void derivatives(std::span<const double> x, const State& state, Derivatives& d) const {
    const std::size_t joints = joint_count();
    d.turns.resize(joints), d.places.resize(joints), d.slides.resize(joints * 3 * shapes_);
    std::vector<Vec3d> moved(joints * shapes_);  // how posed joints move with the betas
    for (std::size_t j = 0; j < joints; ++j) {
      const Matrix3& rotation = state.motions[j].rotation;
      d.turns[j] = (rotation * fit::internal::right_jacobian(axis_angle(x, j))).transposed();
      d.places[j] = state.motions[j](state.joints[j]);
      for (std::size_t b = 0; b < shapes_; ++b) {
        const Vec3d own = joint_direction(j, b);
        Vec3d& move = moved[j * shapes_ + b];
        move = own;
        if (j > 0) {
          const auto parent = static_cast<std::size_t>(parents_[j]);
          move = moved[parent * shapes_ + b] + state.motions[parent].rotation * (own - joint_direction(parent, b));
        }
        const Vec3d slide = move - rotation * own;
        double* to = &d.slides[j * 3 * shapes_ + b];
        to[0] = slide.x, to[shapes_] = slide.y, to[2 * shapes_] = slide.z;
      }
    }
  }

  /// The joints that move vertex i: those it is attached to and all above them, as a set for moves().
  std::uint64_t movers(std::size_t i) const { return movers_[i]; }
  static bool moves(std::uint64_t movers, std::size_t joint) {
    return (movers >> std::min<std::size_t>(joint, last_bit) & 1) != 0;
  }

  /// f(joint, weight) for each joint that vertex i is attached to.
  template <class F>
  void for_each_bone(std::size_t i, F&& f) const {
    for (std::size_t s = weights_.start[i]; s < weights_.start[i + 1]; ++s)
      f(std::size_t{weights_.column[s]}, static_cast<double>(weights_.value[s]));
  }

  /// Adds to [S] how much each beta moves vertex i along a direction of the rest pose, and a bone along one.
  void add_shape_slopes(std::size_t i, Vec3d at_rest, std::span<double> by_beta) const {
    add_product(at_rest, shapedirs_.data() + 3 * i * shapes_, by_beta);
  }
  void add_slide_slopes(const Derivatives& d, std::size_t joint, Vec3d force, std::span<double> by_beta) const {
    add_product(force, d.slides.data() + 3 * joint * shapes_, by_beta);
  }

 private:
  static std::vector<std::uint32_t> all_of(const BodyModel& model) {
    std::vector<std::uint32_t> all(model.vertex_count());
    for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<std::uint32_t>(i);
    return all;
  }
  /// The rows [3 * width] of this body's vertices.
  void gather(std::span<const float> table, std::size_t width, std::vector<float>& rows) const {
    if (table.empty()) return;
    rows.reserve(vertices_.size() * 3 * width);
    for (const std::uint32_t v : vertices_) {
      const auto row = table.subspan(std::size_t{v} * 3 * width, 3 * width);
      rows.insert(rows.end(), row.begin(), row.end());
    }
  }
  std::span<const double> betas(std::span<const double> x) const { return x.subspan(3 + 3 * joint_count()); }
  static Vec3d axis_angle(std::span<const double> x, std::size_t j) {
    return {x[3 + 3 * j], x[4 + 3 * j], x[5 + 3 * j]};
  }

  /// Adds v^T m, m [3, S].
  template <class T>
  static void add_product(Vec3d v, const T* m, std::span<double> to) {
    const std::size_t n = to.size();
    for (std::size_t b = 0; b < n; ++b)
      to[b] += v.x * static_cast<double>(m[b]) + v.y * static_cast<double>(m[n + b]) +
               v.z * static_cast<double>(m[2 * n + b]);
  }

  /// Of movers(). What is attached to a joint from here on counts as moved by all joints.
  static constexpr int last_bit = 63;

  /// How joint j of the rest pose moves with beta number b.
  Vec3d joint_direction(std::size_t j, std::size_t b) const {
    return {rest_joints_.direction(j, 0)[b], rest_joints_.direction(j, 1)[b], rest_joints_.direction(j, 2)[b]};
  }

  void pose_bones(std::span<const double> x, State& state) const {
    state.joints.resize(joint_count());
    state.local.resize(joint_count());
    state.bend.resize(corrections_);
    rest_joints_(betas(x), std::span(state.joints));
    for (std::size_t j = 0; j < joint_count(); ++j) state.local[j] = rotation_matrix(axis_angle(x, j));
    forward_kinematics(parents_, state.joints, state.local, state.motions);
    if (corrections_ > 0) pose_feature(state.local, state.bend);
  }

  void shape_vertices(std::span<const double> shape, State& state) const {
    state.shaped.resize(vertex_count());
    for (std::size_t i = 0; i < state.shaped.size(); ++i) {
      double p[3];
      for (std::size_t k = 0; k < 3; ++k) {
        p[k] = static_cast<double>(template_[3 * i + k]);
        const float* direction = shapedirs_.data() + (3 * i + k) * shapes_;
        for (std::size_t b = 0; b < shapes_; ++b) p[k] += static_cast<double>(direction[b]) * shape[b];
        const float* correction = posedirs_.data() + (3 * i + k) * corrections_;
        for (std::size_t b = 0; b < corrections_; ++b) p[k] += static_cast<double>(correction[b]) * state.bend[b];
      }
      state.shaped[i] = {p[0], p[1], p[2]};
    }
  }

  void begin_pull(Derivatives& d, std::span<double> gradient) const {
    d.forces.assign(joint_count(), {});
    d.moments.assign(joint_count(), {});
    std::ranges::fill(gradient, 0.0);
  }

  /// Pulls at vertex i: adds to its bones' forces and moments, and what that says of the betas to `gradient`. The force
  /// as the vertex feels it in the rest pose.
  Vec3d pull(const State& state, std::size_t i, Vec3d force, Derivatives& d, std::span<double> gradient) const {
    Vec3d at_rest;
    for_each_bone(i, [&](std::size_t j, double weight) {
      const Vec3d share = force * weight;
      d.forces[j] += share;
      d.moments[j] += cross(state.motions[j](state.shaped[i]), share);
      at_rest += fit::internal::transposed_times(state.motions[j].rotation, share);
    });
    add_shape_slopes(i, at_rest, gradient.subspan(3 + 3 * joint_count()));
    return at_rest;
  }

  /// What all pulls together do to the parameters. A joint moves what is attached to it: sums over its branch.
  void end_pull(Derivatives& d, std::span<double> gradient) const {
    const std::span<double> by_beta = gradient.subspan(3 + 3 * joint_count());
    for (std::size_t j = 0; j < joint_count(); ++j)
      if (d.forces[j] != Vec3d{}) add_slide_slopes(d, j, d.forces[j], by_beta);
    for (std::size_t j = joint_count(); j-- > 0;) {
      const Vec3d turn = d.turns[j] * (d.moments[j] - cross(d.places[j], d.forces[j]));
      gradient[3 + 3 * j] = turn.x, gradient[4 + 3 * j] = turn.y, gradient[5 + 3 * j] = turn.z;
      if (j == 0) break;
      const auto parent = static_cast<std::size_t>(parents_[j]);
      d.moments[parent] += d.moments[j];
      d.forces[parent] += d.forces[j];
    }
    gradient[0] = d.forces[0].x, gradient[1] = d.forces[0].y, gradient[2] = d.forces[0].z;
  }

  std::vector<std::uint32_t> vertices_;
  std::size_t shapes_ = 0, corrections_ = 0;
  std::vector<int> parents_;
  std::vector<float> template_;        ///< [n, 3]
  std::vector<float> shapedirs_;       ///< [n, 3, S]
  std::vector<float> posedirs_;        ///< [n, 3, 9 (J - 1)] or empty
  SparseMatrix weights_;               ///< [n, J]
  std::vector<std::uint64_t> movers_;  ///< [n]
  RestJoints rest_joints_;
};

}  // namespace npt::inline NPT_ABI
