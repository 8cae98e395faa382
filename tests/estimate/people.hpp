/// People in natural poses, and the shipped correspondence network, for the tests of estimates and of what uses them.
#pragma once

#include <npt/body/mannequin/mannequin.hpp>
#include <npt/body/natural_poses.hpp>
#include <npt/body/people_kind.hpp>
#include <npt/estimate/body_estimate.hpp>
#include <npt/estimate/body_estimator.hpp>
#include <npt/estimate/correspondence_estimator.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/mesh_view.hpp>
#include <npt/skin/bound_character.hpp>

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

namespace people {

inline npt::CorrespondenceEstimator shipped_correspondences(int threads = 1) {
  return npt::CorrespondenceEstimator::open(
      std::filesystem::path(NPT_SOURCE_DIR) / "examples/weights/human.safetensors", threads);
}

/// The mannequin as people's kind, without proportions.
inline const std::shared_ptr<const npt::BodyKind>& mannequins() {
  static const auto kind = npt::people_kind(npt::borrowed(npt::mannequin()));
  return kind;
}

/// The shipped body estimation and skinning, without the corrections of transfer/open_domain.hpp.
class Bodies {
 public:
  explicit Bodies(int threads = 1) : estimator_(shipped_correspondences(threads), npt::people_kind()) {}

  const npt::BodyKind& kind() const { return estimator_.kind(); }
  npt::BodyEstimate read(const npt::MeshView& mesh) const { return estimator_.read(mesh); }
  npt::BoundCharacter bind(const npt::MeshView& identity) const {
    return npt::bind_character(kind(), identity, read(identity));
  }
  void pose(const npt::BoundCharacter& identity, std::span<const float> angles, std::span<float> result) const {
    identity.pose(kind(), angles, result);
  }
  void pose(const npt::BoundCharacter& identity, const npt::BodyEstimate& pose, std::span<float> result) const {
    npt::expect_body(pose, "pose");
    this->pose(identity, identity.angles(kind(), pose.fit.body.axis_angles, pose), result);
  }

 private:
  npt::BodyEstimator estimator_;
};

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
