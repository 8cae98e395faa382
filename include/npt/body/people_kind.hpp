/// People as a kind of body: the mannequin with its proportions, natural poses, and hands with fingers.
/// Numerics  the mannequin's kind is made in 30 ms, at the first call
#pragma once

#include <npt/base/as_span.hpp>
#include <npt/base/random.hpp>
#include <npt/body/body_kind.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/joint_names.hpp>
#include <npt/body/mannequin/finger_joints.hpp>
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/body/natural_poses.hpp>
#include <npt/body/people_plan.hpp>
#include <npt/body/proportions.hpp>
#include <npt/config.hpp>

#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// body: the mannequin with whatever shape directions
NPT_INLINE std::shared_ptr<const BodyKind> people_kind(std::shared_ptr<const BodyModel> body) {
  constexpr std::size_t draws_of_moments = 2000, draws = 1500;
  auto kind = std::make_shared<BodyKind>();
  kind->plan = people_plan();
  const auto pose = [](Random& random) {
    const NaturalPoses::Pose drawn = natural_poses().sample(random);
    return std::vector<float>(drawn.begin(), drawn.end());
  };
  static const PoseMoments moments = [&pose] {
    std::vector<std::vector<float>> poses;
    for (Random random(1); poses.size() < draws_of_moments;) poses.push_back(pose(random));
    return moments_of(as_span(poses));
  }();
  kind->moments = moments;
  for (std::size_t i = 0; i < draws; ++i) {
    Random random(20260620, i);
    kind->poses.push_back(pose(random));
  }
  kind->hands = BodyKind::Hands{std::make_shared<const BodyModel>(with_finger_joints(*body)), people_hands()};
  kind->has_own_rest = true;
  for (std::size_t j = 0; j < fingered_joint_count; ++j)
    kind->skeleton_names.emplace_back(joint_name(j, JointNames::vrm));
  kind->body = std::move(body);
  return kind;
}

/// With the mannequin's own shapes and proportions, all in standard deviations; made at the first call and then shared.
NPT_INLINE const std::shared_ptr<const BodyKind>& people_kind() {
  static const std::shared_ptr<const BodyKind> kind =
      people_kind(std::make_shared<const BodyModel>(with_proportions(mannequin(), human_proportion_deviations)));
  return kind;
}

}  // namespace npt::inline NPT_ABI
