/// The linear least squares problem of a registration: sums of variables, each a point in space, are to be near to
/// given values. Some variables are fixed. It is solved several times, with other goals for single variables each time.
/// Errors    npt::Error as SparseCholesky throws it
#pragma once

#include <npt/base/matrix3.hpp>
#include <npt/base/vec3.hpp>
#include <npt/config.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/solve/sparse_cholesky.hpp>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI::deformation {

class RegistrationSystem {
 public:
  /// A variable times a vector; where a sum is of points and not of gradients, (a, 0, 0).
  struct Term {
    std::uint32_t variable = 0;
    Vec3d slope;
  };

  explicit RegistrationSystem(std::size_t variables) : unknown_(variables, no_index), value_(variables) {}

  void use(std::uint32_t variable) { unknown_[variable] = 0; }
  /// A fixed variable is used too.
  void fix(std::uint32_t variable, Vec3d value) {
    unknown_[variable] = fixed;
    value_[variable] = value;
  }
  /// After all variables are named, before anything is added.
  void number_unknowns() {
    count_ = 0;
    for (std::uint32_t& unknown : unknown_)
      if (unknown != no_index && unknown != fixed) unknown = count_++;
    sides_.assign(count_, Vec3d{});
    entries_.clear();
  }

  /// Adds weight * ||sum of variable slope^T - goal||_F^2.
  void add(std::span<const Term> terms, double weight, const Matrix3& goal = {}) {
    for (std::size_t i = 0; i < terms.size(); ++i) {
      const std::uint32_t row = unknown_[terms[i].variable];
      if (row == fixed) continue;
      sides_[row] += goal * terms[i].slope * weight;
      for (std::size_t k = 0; k < terms.size(); ++k) {
        const std::uint32_t column = unknown_[terms[k].variable];
        const double value = weight * dot(terms[i].slope, terms[k].slope);
        if (column == fixed) {
          sides_[row] += value_[terms[k].variable] * -value;
        } else if (column <= row) {  // the other half is its mirror image
          entries_.push_back({row, column, value});
        }
      }
    }
  }

  /// Solves with weight * |variable - goal|^2 for each of `goals` added for this time only.
  const std::vector<Vec3d>& solve(std::span<const std::pair<std::uint32_t, Vec3d>> goals, double weight) {
    const std::size_t own = entries_.size();
    std::vector<Vec3d> x = sides_;
    // Every diagonal entry is there in each solve, if only as 0: a pattern that stays keeps its ordering.
    for (std::uint32_t u = 0; u < count_; ++u) entries_.push_back({u, u, 0});
    for (const auto& [variable, goal] : goals) {
      const std::uint32_t u = unknown_[variable];
      if (u == fixed) continue;
      entries_[own + u].value += weight;
      x[u] += goal * weight;
    }
    if (cholesky_) {
      cholesky_->factor(entries_);
    } else {
      cholesky_.emplace(count_, entries_);
    }
    entries_.resize(own);
    cholesky_->solve(x);
    for (std::size_t v = 0; v < unknown_.size(); ++v)
      if (unknown_[v] != no_index && unknown_[v] != fixed) value_[v] = x[unknown_[v]];
    return value_;
  }

 private:
  static constexpr std::uint32_t fixed = no_index - 1;

  std::vector<std::uint32_t> unknown_;  ///< number of each variable's unknown; no_index: it isn't used
  std::vector<Vec3d> value_;            ///< of each variable
  std::uint32_t count_ = 0;
  std::vector<SymmetricEntry> entries_;
  std::vector<Vec3d> sides_;
  std::optional<SparseCholesky> cholesky_;
};

}  // namespace npt::inline NPT_ABI::deformation
