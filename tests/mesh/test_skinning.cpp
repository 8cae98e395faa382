#include <doctest/doctest.h>

#include <npt/base/rotation.hpp>
#include <npt/mesh/skinning.hpp>

#include <array>
#include <cstddef>
#include <limits>
#include <vector>

namespace {

const std::vector<npt::Rigid> bone_motions{{npt::rotation_matrix({0.3, -1.1, 0.7}), {4, -5, 6}},
                                           {npt::rotation_matrix({2, 0, 1}), {1, 0, 2}},
                                           {{}, {std::numeric_limits<double>::quiet_NaN(), 0, 0}}};

}  // namespace

TEST_CASE("a point goes to the weighted mean of where its joints bring it") {
  const npt::Vec3d p{1, 2, 3};
  const std::array<std::size_t, 3> joints{1, 0, 2};
  const std::array<float, 3> weights{0.25F, 0.75F, 0};  // the third takes no part
  const npt::Vec3d expected = bone_motions[1](p) * 0.25 + bone_motions[0](p) * 0.75;
  const auto moved = [&](std::size_t j) { return bone_motions[j](p); };
  CHECK(length(npt::skinned(joints, weights, moved) - expected) < 1e-14);
  CHECK(length(npt::skinned(joints, weights, moved, {1, 1, 1}) - (expected + npt::Vec3d{1, 1, 1})) < 1e-14);
  CHECK(length(npt::blended_motion(joints, weights, bone_motions)(p) - expected) < 1e-14);
  const std::array<double, 3> of_all{0.75, 0.25, 0};  // of the joints in their order
  CHECK(length(npt::skinned(of_all, moved) - expected) < 1e-14);
}

TEST_CASE("affine motions are blended in their own type") {
  const std::array<npt::BasicAffine<float>, 2> maps{
      {{npt::BasicMatrix3<float>::identity() * 2.0F, {1, 0, 0}}, {npt::BasicMatrix3<float>::identity(), {}}}};
  const std::array<std::size_t, 2> joints{0, 1};
  const std::array<float, 2> weights{0.5F, 0.5F};
  const npt::BasicAffine<float> blended = npt::blended_motion(joints, weights, maps);
  CHECK(blended({2, 4, 6}) == npt::Vec3f{3.5F, 6, 9});
}

TEST_CASE("motions add up to a sum that begins somewhere") {
  npt::Affine sum{{}, {1, 2, 3}};
  npt::add_motion(sum, bone_motions[0], 0.5);
  npt::add_motion(sum, affine_of(bone_motions[1]), 0.5);
  const npt::Vec3d p{1, -1, 2};
  CHECK(length(sum(p) - (bone_motions[0](p) + bone_motions[1](p)) * 0.5 - npt::Vec3d{1, 2, 3}) < 1e-14);
}
