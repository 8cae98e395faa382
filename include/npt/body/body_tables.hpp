/// The numbers of a skinned body in SMPL's layout, and the check that they make one.
///   V vertices, J joints, F triangles, S shape directions
/// Source    Loper et al., "SMPL: A Skinned Multi-Person Linear Model", SIGGRAPH Asia 2015
#pragma once

#include <npt/base/as_span.hpp>
#include <npt/base/error.hpp>
#include <npt/body/sparse_matrix.hpp>
#include <npt/config.hpp>
#include <npt/mesh/triangles.hpp>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace npt::inline NPT_ABI {

NPT_INLINE_CLASS(struct, BodyTables);
/// A plain table: anybody fills it, check_tables() judges it, BodyModel computes with it.
template <class>
struct BasicBodyTables {
  std::vector<float> v_template;                ///< [V, 3] mean shape in the rest pose
  std::vector<float> shapedirs;                 ///< [V, 3, S] vertex = v_template + shapedirs * betas
  std::vector<float> posedirs;                  ///< [V, 3, 9 (J - 1)] corrections for bent joints, or empty
  SparseMatrix J_regressor;                     ///< [J, V] joints = J_regressor * vertices of the rest pose
  SparseMatrix weights;                         ///< [V, J] skin weights: not negative, each row sums to 1
  std::vector<Triangle> triangles;              ///< [F]
  std::vector<int> parents;                     ///< [J] an earlier joint; -1 for the root, joint 0
  std::vector<std::string> joint_names;         ///< [J] or empty
  std::map<std::string, std::string> metadata;  ///< unit, up, front, rest_pose, licence, source, ...

  std::size_t vertex_count() const noexcept { return v_template.size() / 3; }
  std::size_t joint_count() const noexcept { return parents.size(); }
  std::size_t shape_count() const noexcept { return v_template.empty() ? 0 : shapedirs.size() / v_template.size(); }
};

namespace body::internal {

NPT_INLINE void require(bool condition, const std::string& source, const std::string& place, const std::string& found,
                        const std::string& expected) {
  if (!condition) throw Error({source, place, found, expected});
}

NPT_INLINE void check_finite(std::span<const float> values, const std::string& source, const std::string& tensor) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (std::isfinite(values[i])) continue;
    throw Error({source, "tensor '" + tensor + "', element " + std::to_string(i), std::to_string(values[i]),
                 "a finite number"});
  }
}

NPT_INLINE void check_matrix(const SparseMatrix& m, std::size_t rows, std::size_t columns, const std::string& source,
                             const std::string& tensor) {
  const auto shape = [](std::size_t r, std::size_t c) {
    return "[" + std::to_string(r) + ", " + std::to_string(c) + "]";
  };
  require(m.rows == rows && m.columns == columns, source, "tensor '" + tensor + "'",
          "shape " + shape(m.rows, m.columns), "shape " + shape(rows, columns));
  bool consistent = m.start.size() == rows + 1 && m.column.size() == m.value.size() && m.start.front() == 0 &&
                    m.start.back() == m.value.size();
  for (std::size_t r = 0; consistent && r < rows; ++r) consistent = m.start[r] <= m.start[r + 1];
  require(consistent, source, "tensor '" + tensor + "'", "row starts that don't fit its entries",
          "a matrix in CSR form");
  check_finite(as_span(m.value), source, tensor);
  for (const std::uint32_t c : m.column) {
    if (c < columns) continue;
    throw Error(
        {source, "tensor '" + tensor + "'", "column " + std::to_string(c), "columns below " + std::to_string(columns)});
  }
}

NPT_INLINE void check_row_sums(const SparseMatrix& m, double tolerance, const std::string& source,
                               const std::string& tensor) {
  for (std::size_t r = 0; r < m.rows; ++r) {
    if (std::abs(m.row_sum(r) - 1.0) <= tolerance) continue;
    throw Error(
        {source, "tensor '" + tensor + "', row " + std::to_string(r), "sum " + std::to_string(m.row_sum(r)), "sum 1"});
  }
}

NPT_INLINE void check_parents(std::span<const int> parents, const std::string& source) {
  require(!parents.empty(), source, "tensor 'parents'", "no joint", "at least one joint");
  require(parents[0] == -1, source, "tensor 'parents', joint 0", std::to_string(parents[0]), "-1, the root");
  for (std::size_t j = 1; j < parents.size(); ++j) {
    require(parents[j] >= 0 && static_cast<std::size_t>(parents[j]) < j, source,
            "tensor 'parents', joint " + std::to_string(j), std::to_string(parents[j]),
            "an earlier joint, 0 .. " + std::to_string(j - 1));
  }
}

NPT_INLINE void check_triangles(const BodyTables& body, const std::string& source) {
  const std::size_t v = body.vertex_count();
  for (std::size_t f = 0; f < body.triangles.size(); ++f) {
    for (const std::uint32_t corner : body.triangles[f]) {
      if (corner < v) continue;
      throw Error({source, "tensor 'f', triangle " + std::to_string(f), "vertex " + std::to_string(corner),
                   "vertices below " + std::to_string(v)});
    }
  }
}

}  // namespace body::internal

/// Throws npt::Error unless the tables make a body. `source` is the file or variable that the message names.
/// Sums of weights and of the joint regressor's rows may be off by 1e-3: public models are rounded.
NPT_INLINE void check_tables(const BodyTables& body, const std::string& source = "body") {
  using namespace body::internal;
  const std::size_t v = body.vertex_count(), j = body.joint_count();
  require(v > 0 && body.v_template.size() == 3 * v, source, "tensor 'v_template'",
          std::to_string(body.v_template.size()) + " numbers", "three for each of at least one vertex");
  // NOLINTNEXTLINE(clang-analyzer-core.DivideZero): the line before has thrown then
  require(body.shapedirs.size() % (3 * v) == 0, source, "tensor 'shapedirs'",
          std::to_string(body.shapedirs.size()) + " numbers", "a multiple of 3 * " + std::to_string(v));
  check_parents(as_span(body.parents), source);
  const std::size_t corrections = 3 * v * 9 * (j - 1);
  require(body.posedirs.empty() || body.posedirs.size() == corrections, source, "tensor 'posedirs'",
          std::to_string(body.posedirs.size()) + " numbers", std::to_string(corrections) + " numbers or none");
  require(body.joint_names.empty() || body.joint_names.size() == j, source, "joint_names",
          std::to_string(body.joint_names.size()) + " names", std::to_string(j) + " names or none");
  check_finite(as_span(body.v_template), source, "v_template");
  check_finite(as_span(body.shapedirs), source, "shapedirs");
  check_finite(as_span(body.posedirs), source, "posedirs");
  check_matrix(body.J_regressor, j, v, source, "J_regressor");
  check_row_sums(body.J_regressor, 1e-3, source, "J_regressor");
  check_matrix(body.weights, v, j, source, "weights");
  for (const float w : body.weights.value) {
    if (w < 0.0F) throw Error({source, "tensor 'weights'", std::to_string(w), "weights that aren't negative"});
  }
  check_row_sums(body.weights, 1e-3, source, "weights");
  check_triangles(body, source);
}

}  // namespace npt::inline NPT_ABI
