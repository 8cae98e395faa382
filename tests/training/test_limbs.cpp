#include <doctest/doctest.h>

#include <npt/body/skeleton.hpp>
#include <training/limbs.hpp>

TEST_CASE("every joint moves a limb, those of one side the side's") {
  using enum npt::SmplJoint;
  CHECK(npt::limb_of(npt::joint_index(left_hand)) == npt::Limb::left_arm);
  CHECK(npt::limb_of(npt::joint_index(right_collar)) == npt::Limb::trunk);
  CHECK(npt::limb_of(npt::joint_index(neck)) == npt::Limb::skull);
  for (std::size_t j = 0; j < npt::smpl_joint_count; ++j) {
    const npt::Limb own = npt::limb_of(j), other = npt::limb_of(npt::smpl_mirrored_joints[j]);
    const bool middle = own == npt::Limb::trunk || own == npt::Limb::skull;
    CHECK((own == other) == middle);
  }
}
