/// What training varies of animals: the proportions of the plan, poses, wool, manes, horns, and what is missing.
/// Units     metres of the template
#pragma once

#include <npt/base/random.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_plan.hpp>
#include <npt/body/plan_proportions.hpp>
#include <npt/config.hpp>
#include <training/body_variation.hpp>
#include <training/dress.hpp>
#include <training/surface_cloud.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// The box in which a resting template lies.
struct TemplateReach {
  Vec3f low, high;
};

class AnimalVariation final : public BodyVariation {
 public:
  /// Draws the angles [3 J] of a pose.
  using DrawPose = std::function<std::vector<float>(Random&)>;

  /// What is none of them belongs below their feet.
  AnimalVariation(const BodyPlan& plan, TemplateReach reach, DrawPose draw_pose)
      : BodyVariation(plan, {0, reach.low.y - 0.7F, 0}), reach_(reach), draw_pose_(std::move(draw_pose)) {}

  std::vector<double> draw_proportions(Random& random) const override { return sample_proportions(plan(), random); }
  Pose draw_pose(Random& random) const override { return {draw_pose_(random), false}; }

  data::Dress draw_dress(Random& r) const override {
    const auto uniform = [&r](double low, double high) { return static_cast<float>(r.uniform(low, high)); };
    const Vec3d low = reach_.low.as<double>(), high = reach_.high.as<double>();
    data::Dress d;
    d.any = true;
    if (r.uniform() < 0.5) d.puff = uniform(-0.01, 0.04);
    if (r.uniform() < 0.2) d.trunk = uniform(0.01, 0.12);
    if (r.uniform() < 0.3) d.hair = uniform(0.02, 0.15);
    if (r.uniform() < 0.3) data::draw_horns(r, d, 0.7);
    d.no_feet = r.uniform() < 0.03;
    d.no_head = r.uniform() < 0.02;
    if (r.uniform() < 0.12) {
      for (Vec3f& h : d.hole) h = {uniform(low.x, high.x), uniform(low.y, high.y), uniform(low.z, high.z)};
      d.hole_radius = uniform(0.05, 0.2);
    }
    d.wave = {uniform(-25, 25), uniform(-25, 25), uniform(-25, 25)};
    d.phase = uniform(0, 6.3);
    d.wave_size = uniform(0, 0.5);
    return d;
  }

  bool clothe(const SurfaceCloud& cloud, const SurfaceCloud::Point& p, const data::Dress& d, Vec3f& at,
              float& swollen) const override {
    if (data::is_missing(p, d)) return false;
    float trunk = 0, neck = 0, head = 0, feet = 0;
    for (std::size_t i = 0; i < SurfaceCloud::most_joints; ++i) {
      const std::size_t j = p.joint[i];
      const JointKind kind = plan().joints[j].kind;
      if (plan().in_trunk(j)) trunk += p.weight[i];
      if (kind == JointKind::neck) neck += p.weight[i];
      if (kind == JointKind::head) head += p.weight[i];
      if (kind == JointKind::tip) feet += p.weight[i];
    }
    if (d.no_feet && feet > 0.5F) return false;
    if (d.no_head && head > 0.5F) return false;
    const Vec3f normal = normalised(cross(p.along, p.across));
    const float wave = 1 + d.wave_size * std::sin(dot(d.wave, p.canonical) + d.phase);
    at += normal * (d.puff + d.trunk * (trunk + 0.5F * neck) * wave);
    if (d.hair > 0 && normal.y > 0.2F) at += normal * (d.hair * neck * wave), swollen += 6 * d.hair * neck;
    if (head > 0.5F) data::grow_horns(d, cloud.head(), p, at, swollen);
    return true;
  }

 private:
  TemplateReach reach_;
  DrawPose draw_pose_;
};

}  // namespace npt::inline NPT_ABI
