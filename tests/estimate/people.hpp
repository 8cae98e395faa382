/// People in natural poses, and the shipped way through bodies, for the tests of the room.
#pragma once

#include <npt/body/mannequin/mannequin.hpp>
#include <npt/body/natural_poses.hpp>
#include <npt/estimate/correspondence_estimator.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/mesh_view.hpp>

#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

namespace people {

inline npt::CorrespondenceEstimator shipped_reader(int threads = 1) {
  return npt::CorrespondenceEstimator::open(
      std::filesystem::path(NPT_SOURCE_DIR) / "examples/weights/readers/human.safetensors", threads);
}

struct Person {
  std::vector<float> betas;
  std::array<float, 72> pose{};
  npt::Mesh mesh;

  explicit Person(std::uint64_t seed) {
    npt::Random random(811, seed);
    pose = npt::natural_poses().sample(random);
    betas = npt::sample_shape(random, npt::mannequin().shape_count());
    mesh = npt::to_mesh(npt::mannequin(), betas, pose);
  }
  npt::MeshView view() const { return {mesh.coordinates(), npt::mannequin().triangles(), "person"}; }
};

}  // namespace people
