/// What training varies of people: stylised proportions, natural, wide and folded poses and those in which characters
/// are made, clothes (dress.hpp).
/// Source    figures of games and films, by eye: heads of a third of the height, A and T poses
#pragma once

#include <npt/base/random.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/people_plan.hpp>
#include <npt/body/pose_sampler.hpp>
#include <npt/body/proportions.hpp>
#include <npt/body/skeleton.hpp>
#include <npt/config.hpp>
#include <training/body_variation.hpp>
#include <training/dress.hpp>
#include <training/props.hpp>
#include <training/surface_cloud.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <numbers>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

struct PeopleVariationOptions {
  double natural = 0.7;  ///< share of poses that `natural_pose` draws; the others are uniform in wide ranges
  double folded = 0;     ///< share of poses with legs and back bent as far as they go: crouching, kneeling, lotus
  double standing = 0;   ///< share in the poses in which characters are made: A, T and between
  double stylised = 0;   ///< share of bodies with proportions beyond the others' (big heads, short legs)
  double dressed = 0.45;
  bool props = false;  ///< weapons, shields, packs, hats, beards
};

class PeopleVariation final : public BodyVariation {
 public:
  using Angles = std::array<float, 3 * smpl_joint_count>;
  /// Draws the angles of a natural pose.
  using NaturalPose = std::function<Angles(Random&)>;

  explicit PeopleVariation(NaturalPose natural_pose, const PeopleVariationOptions& options = {})
      : BodyVariation(people_plan(), {0, 0, 1}), natural_pose_(std::move(natural_pose)), options_(options) {}

  std::vector<double> draw_proportions(Random& random) const override {
    const bool stylised = options_.stylised > 0 && random.uniform() < options_.stylised;
    const Proportions p = stylised ? stylised_proportions(random) : sample_proportions(random);
    return {p.begin(), p.end()};
  }

  Pose draw_pose(Random& random) const override {
    Angles pose = random.uniform() < options_.natural ? natural_pose_(random) : wide_pose(random);
    const double kind = options_.standing + options_.folded > 0 ? random.uniform() : 1;
    const bool folded = kind >= options_.standing && kind < options_.standing + options_.folded;
    if (kind < options_.standing) stand(random, pose);
    if (folded) fold(random, pose);
    return {{pose.begin(), pose.end()}, folded};
  }

  std::vector<data::Prop> draw_props(Random& random) const override {
    return options_.props ? data::draw_props(random) : std::vector<data::Prop>{};
  }
  data::Dress draw_dress(Random& random) const override { return data::draw_dress(random, options_.dressed); }
  bool clothe(const SurfaceCloud& cloud, const SurfaceCloud::Point& p, const data::Dress& dress, Vec3f& at,
              float& swollen) const override {
    return data::clothe(cloud, p, dress, at, swollen);
  }

 private:
  static float radians(double degrees) { return static_cast<float>(degrees * std::numbers::pi / 180); }
  static void set(Angles& pose, SmplJoint joint, double x, double y, double z) {
    const std::size_t at = 3 * joint_index(joint);
    pose[at] = radians(x), pose[at + 1] = radians(y), pose[at + 2] = radians(z);
  }
  /// Of the right side mirrored.
  static void set_both(Angles& pose, SmplJoint left, SmplJoint right, double x, double y, double z) {
    set(pose, left, x, y, z), set(pose, right, x, -y, -z);
  }

  static Angles wide_pose(Random& random) {
    Angles pose = sample_pose(random, random.uniform() < 0.75 ? PoseDistribution::wide : PoseDistribution::paper);
    const float amount = static_cast<float>(std::min(1.0, 1.3 * random.uniform()));
    for (std::size_t i = 3; i < pose.size(); ++i) pose[i] *= amount;
    return pose;
  }

  /// Arms anywhere between a T pose and hanging down, legs a little apart.
  static void stand(Random& random, Angles& pose) {
    pose.fill(0);
    using enum SmplJoint;
    const double down = random.uniform() < 0.3 ? 0 : random.uniform(0, 80);
    set_both(pose, left_shoulder, right_shoulder, 0, random.uniform(-12, 12), -down);
    set_both(pose, left_elbow, right_elbow, 0, random.uniform() < 0.5 ? 0 : random.uniform(-30, 0), 0);
    set_both(pose, left_hip, right_hip, 0, 0, random.uniform(-1, 15));
    const double noise = random.uniform() < 0.5 ? 0 : 0.08;
    for (float& angle : pose) angle += static_cast<float>(noise * random.normal());
  }

  /// Legs and back bent anew, in degrees: both legs alike in half of the poses, one by one in the others.
  static void fold(Random& random, Angles& pose) {
    using enum SmplJoint;
    const bool alike = random.uniform() < 0.5;
    std::array<double, 4> leg{};
    for (const double side : {1.0, -1.0}) {
      const std::array<double, 4> drawn{random.uniform(-150, 40), random.uniform(-25, 60), random.uniform(-10, 60),
                                        random.uniform(0, 155)};
      if (side > 0 || !alike) leg = drawn;
      set(pose, side > 0 ? left_hip : right_hip, leg[0], side * leg[1], side * leg[2]);
      set(pose, side > 0 ? left_knee : right_knee, leg[3], 0, 0);
    }
    const double bend = random.uniform(-25, 35);
    for (const SmplJoint joint : {spine1, spine2, spine3})
      set(pose, joint, bend + random.uniform(-8, 8), random.uniform(-8, 8), random.uniform(-8, 8));
  }

  /// A big head, short or thin limbs, large hands and feet; each log-uniform.
  static Proportions stylised_proportions(Random& random) {
    Proportions p = sample_proportions(random);
    const auto grow = [&p](BodyProportion which, double factor) { p[static_cast<std::size_t>(which)] = factor - 1; };
    const auto draw = [&](double low, double high) { return std::exp(random.uniform(std::log(low), std::log(high))); };
    using enum BodyProportion;
    grow(head_size, draw(1.3, 3));
    grow(neck_length, draw(0.3, 1.1));
    const double legs = draw(0.35, 1);
    grow(thigh_length, legs), grow(shin_length, legs);
    grow(arm_girth, draw(0.45, 2.2)), grow(leg_girth, draw(0.45, 2.2));
    grow(hand_size, draw(0.8, 2.6)), grow(foot_size, draw(0.8, 2.6));
    return p;
  }

  NaturalPose natural_pose_;
  PeopleVariationOptions options_;
};

}  // namespace npt::inline NPT_ABI
