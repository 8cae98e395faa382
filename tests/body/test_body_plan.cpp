#include <doctest/doctest.h>

#include <npt/base/error.hpp>
#include <npt/body/body_plan.hpp>
#include <npt/body/kind_words.hpp>
#include <npt/io/file.hpp>

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace {

std::string error_of(const std::string& text) {
  try {
    (void)npt::read_body_plan(text, "plan");
    return "";
  } catch (const npt::Error& error) {
    return error.what();
  }
}

}  // namespace

TEST_CASE("a four-legged kind's plan names its parts, and its legs are pairs of limbs") {
  const std::string path = NPT_SOURCE_DIR "/examples/sculpt/quadruped.plan";
  const npt::BodyPlan plan = npt::read_body_plan(npt::read_file(path), path);
  const auto names = [&plan](const std::vector<std::size_t>& joints) {
    std::string all;
    for (const std::size_t j : joints) all += (all.empty() ? "" : " ") + plan.joints[j].name;
    return all;
  };
  const std::vector<npt::LimbPair> pairs = plan.limb_pairs();
  REQUIRE(pairs.size() == 2);
  CHECK(names(pairs[0].joints[0]) == "l_scapula l_shoulder l_elbow l_wrist l_forefoot");
  CHECK(names(pairs[0].joints[1]) == "r_scapula r_shoulder r_elbow r_wrist r_forefoot");
  CHECK(names({pairs[0].joints[0][pairs[0].middle()]}) == "l_elbow");
  CHECK(names(pairs[1].joints[0]) == "l_hip l_knee l_hock l_hindfoot");
  CHECK(names({pairs[1].joints[1][pairs[1].middle()]}) == "r_knee");
  CHECK(plan.in_trunk(plan.joint("l_scapula")));
  CHECK_FALSE(plan.in_trunk(plan.joint("tail1")));
  CHECK(plan.side(plan.joint("l_ear")) == 1);
  CHECK(plan.side(plan.joint("r_ear")) == -1);
  CHECK(plan.joint("wing") == npt::BodyPlan::no_joint);
  REQUIRE(!plan.proportions.empty());
  CHECK(plan.proportions[1].name == "trunk_length");
  CHECK(plan.proportions[1].grows.front() == std::pair(plan.joint("pelvis"), npt::PartGrowth::z));
  CHECK(plan.parents()[1] == 0);
  const npt::KindWords& words = plan.words();
  CHECK(words == npt::KindWords{"four-legged animal", "four-legged animals", "foreleg", "hindleg"});
  CHECK(&plan.words() == &words);
}

TEST_CASE("errors of a plan name the line and what was expected") {
  const auto says = [](const std::string& text, const std::string& what) {
    CAPTURE(text);
    CHECK(error_of(text).find(what) != std::string::npos);
  };
  const std::string root = "joint hips - hips trunk root hips 1 1\n";
  CHECK(error_of(root).empty());
  says("", "no joints");
  says(root + "joint tail hip tail tail bone tail 1 1\n", "line 2: found joint 'hip'");
  says(root + "joint tail hips tail tail wing tail 1 1\n", "line 2: found 'wing', expected one of root, spine");
  says(root + "joint tail hips tail tail bone tail 1 much\n", "found 'much', expected a number");
  says(root + "joint tail - tail tail bone tail 1 1\n", "found parent '-'");
  says(root + "joint leg hips arm leg bone leg 1 1\n", "found joint 'arm'");
  says(root + "joint leg hips hips leg bone leg 1 1\n", "expected pairs");
  says(root + "grows size all hips\n", "found 'size'");
  says(root + "wings 2\n", "line 2");
}
