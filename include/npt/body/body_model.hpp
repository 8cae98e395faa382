/// A skinned body: from shape and pose parameters to vertices (SMPL's forward function).
///   rest(betas)  = v_template + shapedirs * betas
///   joints       = J_regressor * rest(betas)
///   posed        = sum over joints of weight * G_j * (rest(betas) + posedirs * (R - I)),  R = Rodrigues(axis angles)
/// Shapes    betas: at most S numbers, missing ones count as 0;  axis angles: [J, 3], radians, relative to the parent;
///           out: [V, 3], or [n, 3] for a subset of n vertices
/// Numerics  tables and vertices are float; joints, rotations and skinning are computed in double. A vertex gets the
///           same bits in a subset as in the full mesh, and a subset of n vertices costs O(n), not O(V)
/// Errors    npt::Error for tables that don't make a body and for arguments of the wrong size or with NaN
/// Source    Loper et al., "SMPL: A Skinned Multi-Person Linear Model", SIGGRAPH Asia 2015
#pragma once

#include <npt/body/body_tables.hpp>
#include <npt/config.hpp>
#include <npt/core/error.hpp>
#include <npt/core/vec3.hpp>
#include <npt/mesh/mesh.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// A rigid motion x -> rotation * x + translation, as the rows of a 3x4 matrix.
using RigidMotion = std::array<double, 12>;

/// Rodrigues' formula. The result is exactly the identity for the zero vector.
inline std::array<double, 9> rotation_matrix(Vec3d axis_angle) {
  const double angle = length(axis_angle);
  if (angle == 0.0) return {1, 0, 0, 0, 1, 0, 0, 0, 1};
  const Vec3d a = axis_angle / angle;
  const double s = std::sin(angle), c = std::cos(angle), k = 1.0 - c;
  return {c + a.x * a.x * k,       a.x * a.y * k - a.z * s, a.x * a.z * k + a.y * s,
          a.y * a.x * k + a.z * s, c + a.y * a.y * k,       a.y * a.z * k - a.x * s,
          a.z * a.x * k - a.y * s, a.z * a.y * k + a.x * s, c + a.z * a.z * k};
}

class BodyModel {
 public:
  /// Checks the tables (`source` names them in errors) and prepares what makes subsets cheap.
  explicit BodyModel(BodyTables tables, const std::string& source = "body") : tables_(std::move(tables)) {
    check_tables(tables_, source);
    const std::size_t j = joint_count(), s = shape_count();
    joint_template_.assign(3 * j, 0.0);
    joint_shapedirs_.assign(3 * j * s, 0.0);
    const SparseMatrix& regressor = tables_.J_regressor;
    for (std::size_t r = 0; r < j; ++r) {
      for (std::size_t i = regressor.start[r]; i < regressor.start[r + 1]; ++i) {
        const double w = static_cast<double>(regressor.value[i]);
        const std::size_t v = regressor.column[i];
        for (std::size_t k = 0; k < 3; ++k) {
          joint_template_[3 * r + k] += w * static_cast<double>(tables_.v_template[3 * v + k]);
        }
        for (std::size_t k = 0; k < 3 * s; ++k) {
          joint_shapedirs_[3 * s * r + k] += w * static_cast<double>(tables_.shapedirs[3 * s * v + k]);
        }
      }
    }
  }

  std::size_t vertex_count() const noexcept { return tables_.vertex_count(); }
  std::size_t joint_count() const noexcept { return tables_.joint_count(); }
  std::size_t shape_count() const noexcept { return tables_.shape_count(); }
  std::span<const std::array<std::uint32_t, 3>> triangles() const noexcept { return tables_.triangles; }
  const BodyTables& tables() const noexcept { return tables_; }

  /// [J] joints of the rest pose for a shape.
  std::vector<Vec3d> joints(std::span<const float> betas) const {
    check_betas(betas);
    const std::size_t s = shape_count();
    std::vector<Vec3d> result(joint_count());
    for (std::size_t j = 0; j < result.size(); ++j) {
      double p[3];
      for (std::size_t k = 0; k < 3; ++k) {
        p[k] = joint_template_[3 * j + k];
        for (std::size_t b = 0; b < betas.size(); ++b) {
          p[k] += joint_shapedirs_[(3 * j + k) * s + b] * static_cast<double>(betas[b]);
        }
      }
      result[j] = {p[0], p[1], p[2]};
    }
    return result;
  }

  /// [J] motion of each bone from the rest pose of this shape to the pose.
  std::vector<RigidMotion> bone_motions(std::span<const float> betas, std::span<const float> axis_angles) const;

  /// All vertices: out is [V, 3].
  void posed(std::span<const float> betas, std::span<const float> axis_angles, std::span<float> out) const {
    check_output(out.size(), vertex_count());
    skin(
        betas, axis_angles, vertex_count(), [](std::size_t i) { return i; }, out);
  }

  /// The named vertices only, in their order: out is [vertices.size(), 3].
  void posed(std::span<const float> betas, std::span<const float> axis_angles, std::span<const std::uint32_t> vertices,
             std::span<float> out) const {
    check_output(out.size(), vertices.size());
    for (const std::uint32_t v : vertices) {
      if (v < vertex_count()) continue;
      throw Error({"vertices", "", std::to_string(v), "vertices below " + std::to_string(vertex_count())});
    }
    skin(
        betas, axis_angles, vertices.size(), [vertices](std::size_t i) { return std::size_t{vertices[i]}; }, out);
  }

 private:
  void check_betas(std::span<const float> betas) const {
    body::internal::require(betas.size() <= shape_count(), "betas", "", std::to_string(betas.size()) + " numbers",
                            "at most " + std::to_string(shape_count()));
    body::internal::check_finite(betas, "argument", "betas");
  }
  static void check_output(std::size_t size, std::size_t vertices) {
    body::internal::require(size == 3 * vertices, "out", "", std::to_string(size) + " numbers",
                            "three for each of " + std::to_string(vertices) + " vertices");
  }

  template <class VertexOf>
  void skin(std::span<const float> betas, std::span<const float> axis_angles, std::size_t count, VertexOf vertex_of,
            std::span<float> out) const {
    const std::vector<RigidMotion> motions = bone_motions(betas, axis_angles);
    const std::vector<double> bend = pose_feature(axis_angles);
    for (std::size_t i = 0; i < count; ++i) skin_vertex(vertex_of(i), betas, motions, bend, out.data() + 3 * i);
  }

  /// SMPL's input to posedirs, [9 (J - 1)]: R - I of each joint but the root. Empty for a body without posedirs.
  std::vector<double> pose_feature(std::span<const float> axis_angles) const;

  /// Never inlined: two copies could contract multiplications and additions differently, and a vertex must have the
  /// same bits in a subset as in the full mesh.
  NPT_NOINLINE void skin_vertex(std::size_t v, std::span<const float> betas, std::span<const RigidMotion> motions,
                                std::span<const double> bend, float* out) const {
    const std::size_t s = shape_count();
    double p[3];
    for (std::size_t k = 0; k < 3; ++k) {
      p[k] = static_cast<double>(tables_.v_template[3 * v + k]);
      const float* shape = tables_.shapedirs.data() + (3 * v + k) * s;
      for (std::size_t b = 0; b < betas.size(); ++b)
        p[k] += static_cast<double>(shape[b]) * static_cast<double>(betas[b]);
      const float* correction = tables_.posedirs.data() + (3 * v + k) * bend.size();
      for (std::size_t b = 0; b < bend.size(); ++b) p[k] += static_cast<double>(correction[b]) * bend[b];
    }
    RigidMotion m{};
    for (std::size_t i = tables_.weights.start[v]; i < tables_.weights.start[v + 1]; ++i) {
      const double w = static_cast<double>(tables_.weights.value[i]);
      const RigidMotion& g = motions[tables_.weights.column[i]];
      for (std::size_t k = 0; k < 12; ++k) m[k] += w * g[k];
    }
    for (std::size_t k = 0; k < 3; ++k) {
      out[k] = static_cast<float>(m[4 * k] * p[0] + m[4 * k + 1] * p[1] + m[4 * k + 2] * p[2] + m[4 * k + 3]);
    }
  }

  static Vec3d row(std::span<const float> axis_angles, std::size_t j) {
    return Vec3f{axis_angles[3 * j], axis_angles[3 * j + 1], axis_angles[3 * j + 2]}.as<double>();
  }

  BodyTables tables_;
  std::vector<double> joint_template_;   ///< [J, 3] J_regressor * v_template
  std::vector<double> joint_shapedirs_;  ///< [J, 3, S] J_regressor * shapedirs
};

inline std::vector<RigidMotion> BodyModel::bone_motions(std::span<const float> betas,
                                                        std::span<const float> axis_angles) const {
  body::internal::require(axis_angles.size() == 3 * joint_count(), "axis angles", "",
                          std::to_string(axis_angles.size()) + " numbers",
                          "three for each of " + std::to_string(joint_count()) + " joints");
  body::internal::check_finite(axis_angles, "argument", "axis angles");
  const std::vector<Vec3d> rest = joints(betas);
  std::vector<RigidMotion> motion(rest.size());
  for (std::size_t j = 0; j < rest.size(); ++j) {
    // With the parent's motion P: G_j(x) = P(R (x - rest_j) + rest_j). At R = I this is P without any rounding.
    const std::array<double, 9> r = rotation_matrix(row(axis_angles, j));
    const RigidMotion parent =
        j == 0 ? RigidMotion{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0} : motion[static_cast<std::size_t>(tables_.parents[j])];
    const Vec3d p = rest[j];
    const Vec3d shift{p.x - (r[0] * p.x + r[1] * p.y + r[2] * p.z), p.y - (r[3] * p.x + r[4] * p.y + r[5] * p.z),
                      p.z - (r[6] * p.x + r[7] * p.y + r[8] * p.z)};
    for (std::size_t i = 0; i < 3; ++i) {
      const double *a = &parent[4 * i], *b = r.data();
      double* c = &motion[j][4 * i];
      for (std::size_t k = 0; k < 3; ++k) c[k] = a[0] * b[k] + a[1] * b[3 + k] + a[2] * b[6 + k];
      c[3] = a[0] * shift.x + a[1] * shift.y + a[2] * shift.z + a[3];
    }
  }
  return motion;
}

inline std::vector<double> BodyModel::pose_feature(std::span<const float> axis_angles) const {
  std::vector<double> feature;
  if (tables_.posedirs.empty()) return feature;
  feature.reserve(9 * (joint_count() - 1));
  for (std::size_t j = 1; j < joint_count(); ++j) {
    const std::array<double, 9> r = rotation_matrix(row(axis_angles, j));
    for (std::size_t k = 0; k < 9; ++k) feature.push_back(r[k] - (k % 4 == 0 ? 1.0 : 0.0));
  }
  return feature;
}

/// The body as a triangle mesh. Without axis angles: the rest pose.
inline Mesh to_mesh(const BodyModel& body, std::span<const float> betas = {}, std::span<const float> axis_angles = {}) {
  Mesh mesh;
  mesh.positions.resize(body.vertex_count());
  const std::vector<float> rest(axis_angles.empty() ? 3 * body.joint_count() : 0, 0.0F);
  body.posed(betas, axis_angles.empty() ? std::span<const float>(rest) : axis_angles, mesh.coordinates());
  mesh.face_start.resize(body.triangles().size() + 1);
  for (std::size_t f = 0; f < mesh.face_start.size(); ++f) mesh.face_start[f] = 3 * f;
  mesh.corners.reserve(3 * body.triangles().size());
  for (const auto& triangle : body.triangles())
    mesh.corners.insert(mesh.corners.end(), triangle.begin(), triangle.end());
  return mesh;
}

}  // namespace npt::inline NPT_ABI
