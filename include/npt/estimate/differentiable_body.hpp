/// A body's vertices as a function of its parameters, and the gradient of a function of the vertices with respect to
/// the parameters: reverse mode through linear blend skinning, the kinematic tree and Rodrigues' formula. For methods
/// that want a point's derivatives one by one there are rows of the Jacobian, for any point of the surface.
///   parameters   x = [translation 3, axis angles 3 J, betas S], in one row: BodyModel's, and a translation of all
///                vertices
/// Shapes    vertices, gradients: [n] for the n vertices that were named at construction
/// Numerics  double; the forward pass agrees with BodyModel::posed() to float's rounding, gradients with finite
///           differences. Rows of the Jacobian leave out the corrections for bent joints, which move less than 1 cm
/// Source    Loper et al., "SMPL", 2015; the derivative of a rotation: Gallego and Yezzi, "A compact formula for the
///           derivative of a 3-D rotation in exponential coordinates", 2015
#pragma once

#include <npt/base/matrix3.hpp>
#include <npt/base/rigid.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/kinematics.hpp>
#include <npt/config.hpp>
#include <npt/mesh/skinning.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

namespace fit::internal {

/// m^T v
constexpr Vec3d transposed_times(const Matrix3& m, Vec3d v) {
  return m.rows[0] * v.x + m.rows[1] * v.y + m.rows[2] * v.z;
}

/// The sum of the products of entries.
constexpr double inner(const Matrix3& a, const Matrix3& b) {
  return dot(a.rows[0], b.rows[0]) + dot(a.rows[1], b.rows[1]) + dot(a.rows[2], b.rows[2]);
}

/// The gradient with respect to an axis angle, from that with respect to R = rotation_matrix(axis_angle).
NPT_INLINE Vec3d axis_angle_gradient(Vec3d axis_angle, const Matrix3& r, const Matrix3& gradient) {
  // With a generator w, dR = [w]x R: the sum of entries of `gradient` times [w]x R is w . turn.
  const Matrix3 m = gradient * r.transposed();
  const Vec3d turn{m.rows[2].y - m.rows[1].z, m.rows[0].z - m.rows[2].x, m.rows[1].x - m.rows[0].y};
  const double square = dot(axis_angle, axis_angle);
  // Below 1e-7 rad the formula's quotient is rounding noise, and its limit, w = e, good to 1e-7.
  if (square < 1e-14) return turn;
  const auto along = [&](Vec3d e, double component) {
    return dot(turn, (axis_angle * component + cross(axis_angle, e - r * e)) / square);
  };
  return {along({1, 0, 0}, axis_angle.x), along({0, 1, 0}, axis_angle.y), along({0, 0, 1}, axis_angle.z)};
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

  /// What the rows of the Jacobian at one x have in common.
  struct Derivatives {
    std::vector<Matrix3> turns;   ///< [J] from a moment about a posed joint to the derivative by its axis angle
    std::vector<Vec3d> places;    ///< [J] posed joints, without the translation
    std::vector<Vec3d> slides;    ///< [J, S] how a bone shifts with the betas
    std::vector<Vec3d> moments;   ///< [J] of row()
    std::vector<double> weights;  ///< [J] of row()
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
    skin_start_.push_back(0);
    for (const std::uint32_t v : vertices_) {
      NPT_ASSERT(v < model.vertex_count());
      for (std::size_t i = tables.weights.start[v]; i < tables.weights.start[v + 1]; ++i) {
        skin_joint_.push_back(tables.weights.column[i]);
        skin_weight_.push_back(static_cast<double>(tables.weights.value[i]));
      }
      skin_start_.push_back(skin_joint_.size());
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
          joints_of(i), weights_of(i), [&](std::size_t j) { return state.motions[j](state.shaped[i]); }, translation);
  }

  /// Adds the gradient with respect to the parameters to `gradient`, [3 + 3 J + S]. `state` is forward's for this x.
  void backward(std::span<const double> x, const State& state, std::span<const Vec3d> out_gradient,
                std::span<double> gradient) const {
    NPT_ASSERT(out_gradient.size() == vertex_count() && gradient.size() == parameter_count());
    Bones bones(joint_count());
    std::vector<double> bend_gradient(corrections_, 0.0);
    const std::span<double> beta_gradient = gradient.subspan(3 + 3 * joint_count());
    for (std::size_t i = 0; i < out_gradient.size(); ++i) {
      const Vec3d g = out_gradient[i];
      if (g == Vec3d{}) continue;
      const Vec3d at_rest = skin_backward(i, g, state, bones);
      gradient[0] += g.x, gradient[1] += g.y, gradient[2] += g.z;
      const double d[3] = {at_rest.x, at_rest.y, at_rest.z};
      for (std::size_t k = 0; k < 3; ++k) {
        const float* shape = shapedirs_.data() + (3 * i + k) * shapes_;
        for (std::size_t b = 0; b < shapes_; ++b) beta_gradient[b] += d[k] * static_cast<double>(shape[b]);
        const float* correction = posedirs_.data() + (3 * i + k) * corrections_;
        for (std::size_t b = 0; b < corrections_; ++b) bend_gradient[b] += d[k] * static_cast<double>(correction[b]);
      }
    }
    bones_backward(x, state, bend_gradient, bones, gradient);
  }

  /// The direction `rest` of vertex i in the rest pose, carried along by the skin; not normalised.
  Vec3d carried(std::size_t i, Vec3d rest, const State& state) const {
    return skinned(joints_of(i), weights_of(i), [&](std::size_t j) { return state.motions[j].rotation * rest; });
  }

  /// Prepares rows at x. `state` is forward's for this x.
  void derivatives(std::span<const double> x, const State& state, Derivatives& d) const {
    const std::size_t joints = joint_count();
    d.turns.resize(joints), d.places.resize(joints), d.slides.resize(joints * shapes_);
    d.moments.resize(joints), d.weights.resize(joints);
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
        d.slides[j * shapes_ + b] = move - rotation * own;
      }
    }
  }

  /// One row of the Jacobian: the derivatives of direction . p by all parameters, p the sum of the vertices `corners`
  /// times `weights`, which sum to 1. row: [3 + 3 J + S], or [3 + 3 J] without those by the betas
  /// Source    Sola et al., "A micro Lie theory for state estimation in robotics", 2018, section IV (rotations)
  void row(const State& state, Derivatives& d, const std::array<std::uint32_t, 3>& corners,
           const std::array<double, 3>& weights, Vec3d direction, std::span<double> row) const {
    const std::size_t joints = joint_count();
    std::fill(d.moments.begin(), d.moments.end(), Vec3d{});
    std::fill(d.weights.begin(), d.weights.end(), 0.0);
    const std::span<double> by_beta = row.subspan(3 + 3 * joints);
    std::fill(by_beta.begin(), by_beta.end(), 0.0);
    for (std::size_t c = 0; c < 3; ++c) {
      if (weights[c] == 0) continue;
      const std::size_t i = corners[c];
      Vec3d at_rest;
      for (std::size_t s = skin_start_[i]; s < skin_start_[i + 1]; ++s) {
        const std::size_t j = skin_joint_[s];
        const double w = weights[c] * skin_weight_[s];
        d.moments[j] += state.motions[j](state.shaped[i]) * w;
        d.weights[j] += w;
        at_rest += fit::internal::transposed_times(state.motions[j].rotation, direction) * w;
      }
      const float* shape = shapedirs_.data() + 3 * i * shapes_;
      for (std::size_t b = 0; b < by_beta.size(); ++b)
        by_beta[b] += at_rest.x * static_cast<double>(shape[b]) + at_rest.y * static_cast<double>(shape[shapes_ + b]) +
                      at_rest.z * static_cast<double>(shape[2 * shapes_ + b]);
    }
    for (std::size_t j = 0; j < joints; ++j)
      if (d.weights[j] != 0)
        for (std::size_t b = 0; b < by_beta.size(); ++b)
          by_beta[b] += d.weights[j] * dot(direction, d.slides[j * shapes_ + b]);
    row[0] = direction.x, row[1] = direction.y, row[2] = direction.z;
    // A joint moves what is attached to it: sums over its branch, children before parents.
    for (std::size_t j = joints; j-- > 0;) {
      Vec3d turn;
      if (d.weights[j] != 0) {
        turn = d.turns[j] * cross(d.moments[j] - d.places[j] * d.weights[j], direction);
        if (j > 0) {
          const auto parent = static_cast<std::size_t>(parents_[j]);
          d.moments[parent] += d.moments[j];
          d.weights[parent] += d.weights[j];
        }
      }
      row[3 + 3 * j] = turn.x, row[4 + 3 * j] = turn.y, row[5 + 3 * j] = turn.z;
    }
  }

  /// Rest joints and bones for x; forward() calls it.
  void pose_bones(std::span<const double> x, State& state) const {
    state.joints.resize(joint_count());
    state.local.resize(joint_count());
    state.bend.resize(corrections_);
    rest_joints_(betas(x), std::span(state.joints));
    for (std::size_t j = 0; j < joint_count(); ++j) state.local[j] = rotation_matrix(axis_angle(x, j));
    forward_kinematics(parents_, state.joints, state.local, state.motions);
    if (corrections_ > 0) pose_feature(state.local, state.bend);
  }

 private:
  /// Gradients with respect to what State holds for each bone.
  struct Bones {
    explicit Bones(std::size_t n) : rotation(n), shift(n), joints(n) {}
    std::vector<Matrix3> rotation;
    std::vector<Vec3d> shift, joints;
  };

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
  std::span<const std::uint32_t> joints_of(std::size_t i) const {
    return std::span(skin_joint_).subspan(skin_start_[i], skin_start_[i + 1] - skin_start_[i]);
  }
  std::span<const double> weights_of(std::size_t i) const {
    return std::span(skin_weight_).subspan(skin_start_[i], skin_start_[i + 1] - skin_start_[i]);
  }
  std::span<const double> betas(std::span<const double> x) const { return x.subspan(3 + 3 * joint_count()); }
  static Vec3d axis_angle(std::span<const double> x, std::size_t j) {
    return {x[3 + 3 * j], x[4 + 3 * j], x[5 + 3 * j]};
  }

  /// How joint j of the rest pose moves with beta number b.
  Vec3d joint_direction(std::size_t j, std::size_t b) const {
    return {rest_joints_.direction(j, 0)[b], rest_joints_.direction(j, 1)[b], rest_joints_.direction(j, 2)[b]};
  }

  static Matrix3 loaded(const double* m) { return {{{{m[0], m[1], m[2]}, {m[3], m[4], m[5]}, {m[6], m[7], m[8]}}}}; }

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

  /// Adds vertex i to its bones' gradients; returns the gradient with respect to the vertex in the rest pose.
  Vec3d skin_backward(std::size_t i, Vec3d g, const State& state, Bones& bones) const {
    Vec3d at_rest;
    for (std::size_t s = skin_start_[i]; s < skin_start_[i + 1]; ++s) {
      const std::size_t j = skin_joint_[s];
      const Vec3d share = g * skin_weight_[s];
      bones.rotation[j] += outer(share, state.shaped[i]);
      bones.shift[j] += share;
      at_rest += fit::internal::transposed_times(state.motions[j].rotation, share);
    }
    return at_rest;
  }

  /// Carries the bones' gradients on to the parameters, children before parents.
  void bones_backward(std::span<const double> x, const State& state, std::span<const double> bend_gradient,
                      Bones& bones, std::span<double> gradient) const {
    using fit::internal::transposed_times;
    for (std::size_t j = joint_count(); j-- > 0;) {
      // motion = parent's motion * (local, joint - local * joint)
      Matrix3 turn = bones.rotation[j];
      Vec3d shift = bones.shift[j];
      if (j > 0) {
        const auto parent = static_cast<std::size_t>(parents_[j]);
        const Matrix3 back = state.motions[parent].rotation.transposed();
        bones.rotation[parent] += bones.rotation[j] * state.local[j].transposed() +
                                  outer(bones.shift[j], state.joints[j] - state.local[j] * state.joints[j]);
        bones.shift[parent] += bones.shift[j];
        turn = back * turn;
        shift = back * shift;
      }
      bones.joints[j] += shift - transposed_times(state.local[j], shift);
      Matrix3 local = turn - outer(shift, state.joints[j]);
      if (j > 0 && corrections_ > 0) local += loaded(&bend_gradient[9 * (j - 1)]);
      const Vec3d g = fit::internal::axis_angle_gradient(axis_angle(x, j), state.local[j], local);
      gradient[3 + 3 * j] += g.x, gradient[4 + 3 * j] += g.y, gradient[5 + 3 * j] += g.z;
    }
    for (std::size_t j = 0; j < joint_count(); ++j) {
      const double d[3] = {bones.joints[j].x, bones.joints[j].y, bones.joints[j].z};
      for (std::size_t k = 0; k < 3; ++k)
        for (std::size_t b = 0; b < shapes_; ++b)
          gradient[3 + 3 * joint_count() + b] += d[k] * rest_joints_.direction(j, k)[b];
    }
  }

  std::vector<std::uint32_t> vertices_;
  std::size_t shapes_ = 0, corrections_ = 0;
  std::vector<int> parents_;
  std::vector<float> template_;   ///< [n, 3]
  std::vector<float> shapedirs_;  ///< [n, 3, S]
  std::vector<float> posedirs_;   ///< [n, 3, 9 (J - 1)] or empty
  std::vector<std::size_t> skin_start_;
  std::vector<std::uint32_t> skin_joint_;
  std::vector<double> skin_weight_;
  RestJoints rest_joints_;
};

}  // namespace npt::inline NPT_ABI
