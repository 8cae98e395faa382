/// Skeleton-driven pose transfer: a body model is fitted to both meshes, its joints are their skeletons, the identity
/// mesh is bound to its skeleton by bone heat, and linear blend skinning gives it the pose mesh's joint angles.
///   SkeletonTransfer transfer(fitter, identity);   fits and binds once
///   Mesh result = transfer(pose);                  fits the pose mesh and skins
/// The identity's bone lengths are kept, and its root joint stays in place. Neither mesh needs to be the body's own:
/// vertex counts, orders and faces are free, but both should be bodies that the model can take the shape of.
/// Shapes    meshes: [V, 3] floats, row major; result: as the identity
/// Meshes    several pieces, open borders, edges of many faces, faces without area and unused vertices are fine
/// Threads   one transfer may be used by several threads at a time
/// Errors    npt::Error for a mesh without a face that has an area, or of quite another size than the body, and for
///           angles of another number of joints
/// Source    Wang et al., CVPR 2020, supplement C.1
#pragma once

#include <npt/base/error.hpp>
#include <npt/base/vec3.hpp>
#include <npt/baseline/fit/body_fitter.hpp>
#include <npt/baseline/skeleton/body_bones.hpp>
#include <npt/baseline/skeleton/bone_heat.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/fitted_body.hpp>
#include <npt/body/sparse_matrix.hpp>
#include <npt/config.hpp>
#include <npt/lab/evaluation.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/normals.hpp>
#include <npt/mesh/points.hpp>
#include <npt/mesh/skinning.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/mesh/validate.hpp>

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// Fits a body to a mesh in the library's own types. `name` stands in errors; start: as BodyFitter::fit's.
inline BodyFit fit_body(const BodyFitter& fitter, std::span<const float> xyz, std::span<const Triangle> triangles,
                        const std::string& name = "mesh", const BodyFit* start = nullptr) {
  return fitter.fit(points_of(xyz), triangles, name, start);
}

inline BodyFit fit_body(const BodyFitter& fitter, const Mesh& mesh, const std::string& name = "mesh",
                        const BodyFit* start = nullptr) {
  validate(mesh, name);
  return fit_body(fitter, mesh.coordinates(), triangulate(mesh), name, start);
}

class SkeletonTransfer {
 public:
  /// `name` stands in errors; start: as BodyFitter::fit's.
  SkeletonTransfer(std::shared_ptr<const BodyFitter> fitter, const Mesh& identity, const std::string& name = "identity",
                   const BodyFit* start = nullptr)
      : SkeletonTransfer(std::move(fitter), validated(identity, name).coordinates(), triangulate(identity), name, {},
                         start) {
    mesh_ = identity;
  }

  /// Requires  finite coordinates, triangles of vertices below V
  SkeletonTransfer(std::shared_ptr<const BodyFitter> fitter, std::span<const float> identity,
                   std::span<const Triangle> triangles, const std::string& name = "identity",
                   const BoneHeatOptions& options = {}, const BodyFit* start = nullptr)
      : fitter_(std::move(fitter)), fit_(fit_body(*fitter_, identity, triangles, name, start)) {
    for (std::size_t v = 0; v < identity.size() / 3; ++v) points_.push_back(point_at(identity, v));
    bones_ = bones_of(fitter_->model(), fit_);
    weights_ = bone_heat_weights(points_, triangles, bones_, fitter_->model().joint_count(), options);
  }

  /// How the body lies in the identity mesh, the bones in it, and the mesh's skin weights [V, J].
  const BodyFit& fit() const noexcept { return fit_; }
  std::span<const Bone> bones() const noexcept { return bones_; }
  const SparseMatrix& weights() const noexcept { return weights_; }
  const BodyFitter& fitter() const noexcept { return *fitter_; }

  /// The identity with joint angles [J, 3]. out: [V, 3]
  void pose(std::span<const float> axis_angles, std::span<float> out) const {
    if (out.size() != 3 * points_.size())
      throw Error({.file = "result",
                   .found = std::to_string(out.size()) + " numbers",
                   .expected = "three for each of " + std::to_string(points_.size()) + " vertices"});
    const std::vector<Rigid> motions = skeleton_motions(fitter_->model(), fit_, axis_angles);
    for (std::size_t v = 0; v < points_.size(); ++v) {
      const auto moved = [&](std::size_t j) { return motions[j](points_[v]); };
      const Vec3f p = skinned(weights_.columns_of(v), weights_.values_of(v), moved).as<float>();
      out[3 * v] = p.x, out[3 * v + 1] = p.y, out[3 * v + 2] = p.z;
    }
  }

  /// The identity in the pose of another mesh. Only for a transfer that was made from a Mesh.
  Mesh operator()(const Mesh& pose_mesh, const std::string& name = "pose") const {
    NPT_ASSERT(mesh_.vertex_count() == points_.size());
    const BodyFit fit = fit_body(*fitter_, pose_mesh, name);
    Mesh result = mesh_;
    pose(fit.axis_angles, result.coordinates());
    recompute_normals(result);
    return result;
  }

 private:
  static const Mesh& validated(const Mesh& mesh, const std::string& name) {
    validate(mesh, name);
    return mesh;
  }

  std::shared_ptr<const BodyFitter> fitter_;
  BodyFit fit_;
  std::vector<Vec3d> points_;
  std::vector<Bone> bones_;
  SparseMatrix weights_;
  Mesh mesh_;
};

/// A transfer for evaluate(): each pair by itself, as `npt skeleton` does it.
inline auto skeleton_system(std::shared_ptr<const BodyFitter> fitter) {
  return [fitter = std::move(fitter)](const EvaluationPair& pair, std::span<float> result) {
    const SkeletonTransfer transfer(fitter, pair.identity, pair.identity_triangles, pair.name + ", identity");
    transfer.pose(fit_body(*fitter, pair.pose, pair.pose_triangles, pair.name + ", pose").axis_angles, result);
  };
}

}  // namespace npt::inline NPT_ABI
