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

#include <npt/base/affine.hpp>
#include <npt/base/error.hpp>
#include <npt/base/matrix3.hpp>
#include <npt/base/rigid.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_tables.hpp>
#include <npt/body/kinematics.hpp>
#include <npt/config.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/skinning.hpp>
#include <npt/mesh/triangles.hpp>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

NPT_INLINE_CLASS(class, RestJoints);
/// The joints of the rest pose as they depend on the shape: the regressor applied to the tables, once.
template <class>
class BasicRestJoints {
 public:
  explicit BasicRestJoints(const BodyTables& tables)
      : shapes_(tables.shape_count()),
        template_(3 * tables.joint_count(), 0.0),
        shapedirs_(3 * tables.joint_count() * shapes_, 0.0) {
    const SparseMatrix& regressor = tables.J_regressor;
    for (std::size_t j = 0; j < tables.joint_count(); ++j) {
      for (std::size_t i = regressor.start[j]; i < regressor.start[j + 1]; ++i) {
        const double w = static_cast<double>(regressor.value[i]);
        const std::size_t v = regressor.column[i];
        for (std::size_t k = 0; k < 3; ++k)
          template_[3 * j + k] += w * static_cast<double>(tables.v_template[3 * v + k]);
        for (std::size_t k = 0; k < 3 * shapes_; ++k)
          shapedirs_[3 * shapes_ * j + k] += w * static_cast<double>(tables.shapedirs[3 * shapes_ * v + k]);
      }
    }
  }

  /// joints: [J]. Missing betas count as 0.
  template <class T>
  void operator()(std::span<const T> betas, std::span<Vec3d> joints) const {
    for (std::size_t j = 0; j < joints.size(); ++j) {
      double p[3];
      for (std::size_t k = 0; k < 3; ++k) {
        p[k] = template_[3 * j + k];
        for (std::size_t b = 0; b < betas.size(); ++b) p[k] += direction(j, k)[b] * static_cast<double>(betas[b]);
      }
      joints[j] = {p[0], p[1], p[2]};
    }
  }

  /// [S] How coordinate k of joint j grows with the betas.
  const double* direction(std::size_t j, std::size_t k) const { return shapedirs_.data() + (3 * j + k) * shapes_; }

 private:
  std::size_t shapes_;
  std::vector<double> template_;   ///< [J, 3] J_regressor * v_template
  std::vector<double> shapedirs_;  ///< [J, 3, S] J_regressor * shapedirs
};

NPT_INLINE_CLASS(class, BodyModel);
template <class>
class BasicBodyModel {
 public:
  /// Checks the tables (`source` names them in errors) and prepares what makes subsets cheap.
  explicit BasicBodyModel(BodyTables tables, const std::string& source = "body")
      : tables_(checked(std::move(tables), source)), rest_joints_(tables_) {}

  std::size_t vertex_count() const noexcept { return tables_.vertex_count(); }
  std::size_t joint_count() const noexcept { return tables_.joint_count(); }
  std::size_t shape_count() const noexcept { return tables_.shape_count(); }
  std::span<const Triangle> triangles() const noexcept { return as_span(tables_.triangles); }
  const BodyTables& tables() const noexcept { return tables_; }
  const RestJoints& rest_joints() const noexcept { return rest_joints_; }

  /// [J] joints of the rest pose for a shape.
  std::vector<Vec3d> joints(std::span<const float> betas) const {
    check_betas(betas);
    std::vector<Vec3d> result(joint_count());
    rest_joints_(betas, std::span(result));
    return result;
  }

  /// [J] motion of each bone from the rest pose of this shape to the pose.
  std::vector<Rigid> bone_motions(std::span<const float> betas, std::span<const float> axis_angles) const {
    return bone_motions(betas, joint_rotations(axis_angles));
  }

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
  static BodyTables checked(BodyTables tables, const std::string& source) {
    check_tables(tables, source);
    return tables;
  }
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
    const std::vector<Matrix3> rotations = joint_rotations(axis_angles);
    const std::vector<Rigid> motions = bone_motions(betas, rotations);
    std::vector<double> bend(tables_.posedirs.empty() ? 0 : 9 * (joint_count() - 1));
    if (!bend.empty()) pose_feature(as_span(rotations), as_span(bend));
    for (std::size_t i = 0; i < count; ++i) skin_vertex(vertex_of(i), betas, motions, bend, out.data() + 3 * i);
  }

  std::vector<Matrix3> joint_rotations(std::span<const float> axis_angles) const {
    body::internal::require(axis_angles.size() == 3 * joint_count(), "axis angles", "",
                            std::to_string(axis_angles.size()) + " numbers",
                            "three for each of " + std::to_string(joint_count()) + " joints");
    body::internal::check_finite(axis_angles, "argument", "axis angles");
    std::vector<Matrix3> rotations(joint_count());
    for (std::size_t j = 0; j < rotations.size(); ++j) rotations[j] = joint_rotation(axis_angles, j);
    return rotations;
  }
  std::vector<Rigid> bone_motions(std::span<const float> betas, std::span<const Matrix3> rotations) const {
    std::vector<Rigid> motions;
    forward_kinematics(tables_.parents, joints(betas), rotations, motions);
    return motions;
  }

  /// Never inlined: two copies could contract multiplications and additions differently, and a vertex must have the
  /// same bits in a subset as in the full mesh.
  NPT_NOINLINE void skin_vertex(std::size_t v, std::span<const float> betas, std::span<const Rigid> motions,
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
    const Affine m = blended_motion(tables_.weights.columns_of(v), tables_.weights.values_of(v), motions);
    const Vec3f q = m({p[0], p[1], p[2]}).as<float>();
    out[0] = q.x, out[1] = q.y, out[2] = q.z;
  }

  BodyTables tables_;
  RestJoints rest_joints_;
};

/// A body that lives elsewhere, such as mannequin(), for what shares bodies. It must outlive whatever shares it.
NPT_INLINE std::shared_ptr<const BodyModel> borrowed(const BodyModel& body) {
  return {std::shared_ptr<const BodyModel>(), &body};
}

/// The body as a triangle mesh. Without axis angles: the rest pose.
NPT_INLINE Mesh to_mesh(const BodyModel& body, std::span<const float> betas = {},
                        std::span<const float> axis_angles = {}) {
  Mesh mesh;
  mesh.positions.resize(body.vertex_count());
  const std::vector<float> rest(axis_angles.empty() ? 3 * body.joint_count() : 0, 0.0F);
  body.posed(betas, axis_angles.empty() ? std::span<const float>(rest) : axis_angles, mesh.coordinates());
  set_faces(mesh, body.triangles());
  return mesh;
}

}  // namespace npt::inline NPT_ABI
