/// The shipped weights and meshes for them, for the tests of the module.
#pragma once

#include <npt/base/error.hpp>
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/mesh_view.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/transfer/pose_transfer.hpp>

#include <cstddef>
#include <filesystem>
#include <span>
#include <vector>

#include "support/bumpy_sphere.hpp"

namespace shipped {

inline std::filesystem::path weights(const char* name = "human.safetensors") {
  return std::filesystem::path(NPT_SOURCE_DIR) / "examples/weights" / name;
}

/// One for all tests, since opening takes a tenth of a second.
inline const npt::PoseTransfer& human() {
  static const npt::PoseTransfer transfer = npt::PoseTransfer::open(weights(), {}, 1);
  return transfer;
}

/// A mannequin with a bent knee, forearm and shoulder; built: its first proportion.
inline npt::Mesh person(float bend, float built = 0.5F) {
  std::vector<float> pose(72, 0.0F);
  pose[3 * 4] = bend, pose[3 * 18 + 1] = -bend, pose[3 * 16 + 2] = -bend / 2;
  return npt::to_mesh(npt::mannequin(), std::vector<float>{built}, pose);
}

/// No person, and of another vertex count.
inline npt::Mesh ball() { return support::bumpy_sphere(20, 30, 0.2, true); }

/// Estimated once for all tests.
inline const npt::Character& character() {
  static const npt::Character prepared = human().character(person(0.1F), "hero");
  return prepared;
}
inline const npt::Pose& pose() {
  static const npt::Pose prepared = human().pose(person(1.0F, -1.0F));
  return prepared;
}

/// A mesh and its triangles as a view.
class Viewed {
 public:
  explicit Viewed(npt::Mesh mesh, const char* name = "")
      : mesh_(std::move(mesh)), triangles_(npt::triangulate(mesh_)), name_(name) {}
  operator npt::MeshView() const { return {mesh_.coordinates(), triangles_, name_}; }
  npt::MeshView view() const { return *this; }
  const npt::Mesh& mesh() const { return mesh_; }

 private:
  npt::Mesh mesh_;
  std::vector<npt::Triangle> triangles_;
  const char* name_;
};

inline std::vector<float> numbers(std::span<const float> values) { return {values.begin(), values.end()}; }

/// The parts of the npt::Error that f() throws; without an error, empty ones that say so.
template <class F>
npt::ErrorParts error_of(F f) {
  try {
    f();
  } catch (const npt::Error& error) {
    return error.parts();
  }
  return {.file = "no error"};
}

}  // namespace shipped
