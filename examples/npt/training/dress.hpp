/// Clothes, hair, shoes and what is missing of a body, as samples for a network that reads meshes have them.
/// Units     metres
#pragma once

#include <npt/base/random.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/skeleton.hpp>
#include <npt/config.hpp>
#include <training/surface_cloud.hpp>

#include <algorithm>
#include <array>
#include <cmath>

namespace npt::inline NPT_ABI {

namespace data {

/// What is attached to the body, as offsets along its normals, in metres; waves make them uneven.
struct Dress {
  bool any = false;
  float puff = 0;                       ///< everywhere
  float trunk = 0, legs = 0, arms = 0;  ///< loose clothes, where above 0
  float skirt = 0;                      ///< how far the legs' clothes are spread apart, at the knees
  float hair = 0, hair_back = 0;
  float shoes = 0, heel = 0;
  bool no_hands = false, no_feet = false, no_head = false;
  std::array<Vec3f, 2> hole{};  ///< centres in canonical coordinates
  float hole_radius = 0;
  Vec3f piece;  ///< where piece_radius is above 0, all that is farther from here in canonical coordinates is missing
  float piece_radius = 0;
  Vec3f wave;
  float phase = 0, wave_size = 0;
};

/// dressed: the share that wears clothes.
inline Dress draw_dress(Random& r, double dressed) {
  const auto uniform = [&r](double low, double high) { return static_cast<float>(r.uniform(low, high)); };
  Dress d;
  d.any = true;
  d.puff = uniform(0, 1) < 0.5F ? uniform(-0.005, 0.03) : 0;
  if (r.uniform() < dressed) {
    if (r.uniform() < 0.8) d.trunk = uniform(0.005, 0.07);
    if (r.uniform() < 0.6) d.legs = uniform(0.005, 0.06);
    if (r.uniform() < 0.5) d.arms = uniform(0.005, 0.05);
    if (r.uniform() < 0.2) d.skirt = uniform(0.1, 1);
  }
  if (r.uniform() < 0.4) d.hair = uniform(0.01, 0.12), d.hair_back = uniform(0, 0.15);
  if (r.uniform() < 0.4) d.shoes = uniform(0.005, 0.03), d.heel = uniform(0, 0.06);
  d.no_hands = r.uniform() < 0.06;
  d.no_feet = r.uniform() < 0.03;
  d.no_head = r.uniform() < 0.02;
  if (r.uniform() < 0.15) {
    for (Vec3f& h : d.hole) h = {uniform(-0.8, 0.8), uniform(-0.9, 0.7), uniform(-0.15, 0.15)};
    d.hole_radius = uniform(0.05, 0.2);
  }
  d.wave = {uniform(-25, 25), uniform(-25, 25), uniform(-25, 25)};
  d.phase = uniform(0, 6.3);
  d.wave_size = uniform(0, 0.5);
  return d;
}

/// Moves a resting point outwards to where its clothes, hair or shoes are; false: nothing is there.
/// swollen: by how much the surface is larger there.
inline bool clothe(const SurfaceCloud::Point& p, const auto& weight_of, const Dress& d, Vec3f& at, float& swollen) {
  using enum SmplJoint;
  if (d.hole_radius > 0)
    for (const Vec3f h : d.hole)
      if (length(p.canonical - h) < d.hole_radius) return false;
  if (d.piece_radius > 0 && length(p.canonical - d.piece) > d.piece_radius) return false;
  const float hands = weight_of(left_wrist, right_wrist, left_hand, right_hand),
              feet = weight_of(left_ankle, right_ankle, left_foot, right_foot), skull = weight_of(head);
  if (d.no_hands && hands > 0.5F) return false;
  if (d.no_feet && feet > 0.5F) return false;
  if (d.no_head && skull > 0.5F) return false;
  const Vec3f normal = normalised(cross(p.along, p.across));
  const float trunk = weight_of(pelvis, spine1, spine2, spine3, left_collar, right_collar),
              thighs = weight_of(left_hip, right_hip, left_knee, right_knee),
              arms = weight_of(left_shoulder, right_shoulder, left_elbow, right_elbow);
  const float wave = 1 + d.wave_size * std::sin(dot(d.wave, p.canonical) + d.phase);
  const float out = d.puff + (d.trunk * trunk + d.legs * thighs + d.arms * arms) * wave + d.shoes * feet;
  at += normal * out;
  if (d.skirt > 0 && thighs > 0) {
    // A skirt: round about both legs, wider the lower.
    const float depth = std::clamp(-(p.canonical.y + 0.05F) / 0.45F, 0.0F, 1.0F);
    const float wide = d.skirt * 0.12F * depth * thighs;
    const Vec3f away = normalised(Vec3f{p.canonical.x, 0, p.canonical.z});
    at += away * wide;
  }
  if (skull > 0.5F && d.hair > 0 && (normal.y > 0.1F || normal.z < -0.1F)) {
    const float amount = (skull - 0.5F) * 2;
    at += normal * (d.hair * amount * wave);
    swollen += 16 * d.hair * amount;  // a head's radius is about 0.12 m
    at.z -= d.hair_back * amount * std::max(0.0F, -normal.z);
  }
  if (feet > 0 && normal.y < -0.3F) at.y -= d.heel * feet;
  return true;
}

}  // namespace data

}  // namespace npt::inline NPT_ABI
