/// Sums of squared distances that a step of a fit makes less, of points of a body:
///   sum of weight (direction . dp + residual)^2,   dp how a point moves by the step
/// A point moves with the joints that its vertices are attached to and those above them: a third of a body's
/// parameters. So points that move with the same joints are summed together, in a matrix of these parameters alone.
/// With rows of all parameters, one after the other, the sets of tests/accuracy take 143 instead of 104 s.
/// Units     those of the body
/// Numerics  double; the same bits for the same calls. Corrections for bent joints, which move less than 1 cm, are left
///           out
/// Threads   one object belongs to one thread
#pragma once

#include <npt/base/matrix3.hpp>
#include <npt/base/rigid.hpp>
#include <npt/base/sort.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/differentiable_body.hpp>
#include <npt/config.hpp>
#include <npt/solve/normal_equations.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI {

NPT_INLINE_CLASS(class, PointEquations);
/// Of one body at one x.
template <class>
class BasicPointEquations {
 public:
  /// x, and state as forward() left it for x. Both must outlive the object, as the body must. count: points, about
  BasicPointEquations(const DifferentiableBody& body, std::span<const double> x, const DifferentiableBody::State& state,
                      std::size_t count)
      : body_(body), state_(state), local_(body.joint_count()) {
    terms_.reserve(count);
    body.derivatives(x, state, derivatives_);
  }

  /// The point that is the sum of the vertices `corners` times `weights`, which sum to 1, along one unit direction.
  void add(const std::array<std::uint32_t, 3>& corners, const std::array<double, 3>& weights, Vec3d direction,
           double weight, double residual) {
    terms_.push_back({movers_of(corners, weights), corners, weights, weight, direction, residual, false});
  }
  /// The same along all three axes.
  void add(const std::array<std::uint32_t, 3>& corners, const std::array<double, 3>& weights, Vec3d offset,
           double weight) {
    terms_.push_back({movers_of(corners, weights), corners, weights, weight, offset, 0, true});
  }

  /// Adds all terms so far to `equations`, of the body's parameters.
  void sum_into(NormalEquations& equations) {
    stable_sort_by(terms_, &Term::movers);
    for (auto first = terms_.begin(); first != terms_.end();) {
      const auto last = std::find_if(first, terms_.end(), [&](const Term& t) { return t.movers != first->movers; });
      sum_group({&*first, static_cast<std::size_t>(last - first)}, equations);
      first = last;
    }
    terms_.clear();
  }

 private:
  struct Term {
    std::uint64_t movers = 0;
    std::array<std::uint32_t, 3> corners{};
    std::array<double, 3> weights{};
    double weight = 0;
    Vec3d direction;  ///< or, along all axes, the offset
    double residual = 0;
    bool all_axes = false;
  };

  std::uint64_t movers_of(const std::array<std::uint32_t, 3>& corners, const std::array<double, 3>& weights) const {
    std::uint64_t movers = 0;
    for (std::size_t c = 0; c < 3; ++c)
      if (weights[c] != 0) movers |= body_.movers(corners[c]);
    return movers;
  }

  void sum_group(std::span<const Term> terms, NormalEquations& equations) {
    joints_.clear();
    for (std::uint32_t j = 0; j < body_.joint_count(); ++j) {
      if (!DifferentiableBody::moves(terms.front().movers, j)) continue;
      local_[j] = joints_.size();
      joints_.push_back(j);
    }
    unknowns_ = {0, 1, 2};
    for (const std::uint32_t j : joints_) unknowns_.insert(unknowns_.end(), {3 + 3 * j, 4 + 3 * j, 5 + 3 * j});
    const auto first_beta = static_cast<std::uint32_t>(3 + 3 * body_.joint_count());
    for (std::uint32_t b = 0; b < body_.shape_count(); ++b) unknowns_.push_back(first_beta + b);
    NormalEquations::Group group = NormalEquations::group(unknowns_, 3 * terms.size());
    for (const Term& term : terms) {
      attach(term);
      const auto add_row = [&](Vec3d direction, double residual) {
        fill(term, direction, group.row(term.weight, residual));
      };
      const Vec3d d = term.direction;
      if (term.all_axes)
        add_row({1, 0, 0}, d.x), add_row({0, 1, 0}, d.y), add_row({0, 0, 1}, d.z);
      else
        add_row(d, term.residual);
    }
    equations.add(group);
  }

  /// What of a point is attached to each joint, and to all below it.
  void attach(const Term& term) {
    own_.assign(joints_.size(), 0);
    below_.assign(joints_.size(), {});
    for (std::size_t c = 0; c < 3; ++c) {
      rotation_[c] = {};
      if (term.weights[c] == 0) continue;
      body_.for_each_bone(term.corners[c], [&](std::size_t j, double share) {
        share *= term.weights[c];
        const Rigid& motion = state_.motions[j];
        rotation_[c] = rotation_[c] + motion.rotation * share;
        own_[local_[j]] += share;
        below_[local_[j]] += (motion(state_.shaped[term.corners[c]]) - derivatives_.places[j]) * share;
      });
    }
    share_ = own_;
    for (std::size_t k = joints_.size(); k-- > 1;) {
      const auto above = static_cast<std::size_t>(body_.parents()[joints_[k]]);
      const std::size_t parent = local_[above];
      share_[parent] += share_[k];
      below_[parent] += below_[k] + (derivatives_.places[joints_[k]] - derivatives_.places[above]) * share_[k];
    }
  }

  void fill(const Term& term, Vec3d direction, std::span<double> row) const {
    row[0] = direction.x, row[1] = direction.y, row[2] = direction.z;
    const std::span<double> by_beta = row.last(body_.shape_count());
    for (std::size_t k = 0; k < joints_.size(); ++k) {
      const Vec3d turn = derivatives_.turns[joints_[k]] * cross(below_[k], direction);
      row[3 + 3 * k] = turn.x, row[4 + 3 * k] = turn.y, row[5 + 3 * k] = turn.z;
      if (own_[k] != 0) body_.add_slide_slopes(derivatives_, joints_[k], direction * own_[k], by_beta);
    }
    for (std::size_t c = 0; c < 3; ++c) {
      if (term.weights[c] == 0) continue;
      body_.add_shape_slopes(term.corners[c], fit::internal::transposed_times(rotation_[c], direction), by_beta);
    }
  }

  const DifferentiableBody& body_;
  const DifferentiableBody::State& state_;
  DifferentiableBody::Derivatives derivatives_;
  std::vector<Term> terms_;
  std::vector<std::uint32_t> joints_, unknowns_;  ///< of a group
  std::vector<std::size_t> local_;                ///< [J] number among a group's joints
  std::vector<double> own_, share_;               ///< of a term, by a group's joints
  std::vector<Vec3d> below_;                      ///< the arm of a joint's turn times what is attached below it
  std::array<Matrix3, 3> rotation_{};             ///< of each corner
};

}  // namespace npt::inline NPT_ABI
