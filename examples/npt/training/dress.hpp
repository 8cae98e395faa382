/// Clothes, hair, ears, capes, shoes and what is missing of a body, as samples for a network that reads meshes have
/// them.
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
  float sleeves = 0;                    ///< how far they hang down at the wrists
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
  bool closed = false;  ///< a skirt without an inside
  float cape = 0;       ///< how far it hangs behind the heels
  float tail = 0, tail_drop = 0;
  /// Ears, horns, a hat's tip: how far the skull is drawn out towards a direction, and how wide about it. Of two the
  /// second is the first one's mirror image.
  struct Horn {
    float length = 0, narrow = 0.9F;  ///< the cosine at which it begins
    Vec3f towards;
  };
  std::array<Horn, 2> horns{};
};

/// Where a tail grows, in canonical coordinates.
inline constexpr Vec3f seat{0, -0.03F, -0.11F};

/// Ears or horns, two alike with a chance of `pairs`, else a single one: a hat's tip, a beak.
inline void draw_horns(Random& r, Dress& d, double pairs) {
  const auto uniform = [&r](double low, double high) { return static_cast<float>(r.uniform(low, high)); };
  const bool pair = r.uniform() < pairs;
  Dress::Horn& first = d.horns[0];
  first.length = uniform(0.05, 0.45);
  first.narrow = uniform(0.75, 0.97);
  const Vec3f towards = pair ? Vec3f{uniform(0.3, 1), uniform(-0.2, 1), uniform(-0.4, 0.2)}
                             : Vec3f{uniform(-0.1, 0.1), uniform(-0.2, 1), uniform(-0.5, 1)};
  first.towards = normalised(towards);
  if (!pair) return;
  d.horns[1] = first;
  d.horns[1].towards.x = -first.towards.x;
}

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
    d.closed = d.skirt > 0 && r.uniform() < 0.5;
    if (r.uniform() < 0.06) d.sleeves = uniform(0.05, 0.3);
    if (r.uniform() < 0.15) d.cape = uniform(0.05, 0.35);
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
  if (r.uniform() < 0.17) draw_horns(r, d, 0.75);
  if (r.uniform() < 0.05) d.tail = uniform(0.2, 0.8), d.tail_drop = uniform(-0.5, 1);
  d.wave = {uniform(-25, 25), uniform(-25, 25), uniform(-25, 25)};
  d.phase = uniform(0, 6.3);
  d.wave_size = uniform(0, 0.5);
  return d;
}

/// Whether a point lies in a hole, or beyond the piece that is left.
inline bool is_missing(const SurfaceCloud::Point& p, const Dress& d) {
  const auto near = [&p](Vec3f place, float radius) { return length(p.canonical - place) < radius; };
  if (d.hole_radius > 0 && std::ranges::any_of(d.hole, [&](Vec3f h) { return near(h, d.hole_radius); })) return true;
  return d.piece_radius > 0 && !near(d.piece, d.piece_radius);
}

/// Draws a point of the skull out to where its ears or horns are.
inline void grow_horns(const Dress& d, Vec3f head, const SurfaceCloud::Point& p, Vec3f& at, float& swollen) {
  for (const Dress::Horn& horn : d.horns) {
    if (!(horn.length > 0)) continue;
    const float near = (dot(normalised(p.canonical - head), horn.towards) - horn.narrow) / (1 - horn.narrow);
    if (near > 0) at += horn.towards * (horn.length * near), swollen += 10 * horn.length;
  }
}

/// Moves a resting point outwards to where its clothes, hair or shoes are; false: nothing is there.
/// swollen: by how much the surface is larger there.
inline bool clothe(const SurfaceCloud& cloud, const SurfaceCloud::Point& p, const Dress& d, Vec3f& at, float& swollen) {
  using enum SmplJoint;
  const auto weight_of = [&p](auto... joints) {
    float sum = 0;
    for (std::size_t i = 0; i < SurfaceCloud::most_joints; ++i)
      if (((p.joint[i] == joint_index(joints)) || ...)) sum += p.weight[i];
    return sum;
  };
  if (is_missing(p, d)) return false;
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
    if (d.closed && thighs > 0.5F && dot(away, normal) < 0.1F) return false;
    at += away * wide;
  }
  if (d.sleeves > 0 && normal.y < 0.2F) {
    const float forearm = weight_of(left_elbow, right_elbow);
    at.y -= d.sleeves * forearm * std::clamp((std::abs(p.canonical.x) - 0.35F) / 0.3F, 0.0F, 1.0F);
  }
  if (d.cape > 0 && normal.z < -0.2F && trunk + thighs + arms > 0.5F && std::abs(p.canonical.x) < 0.35F) {
    const float depth = std::clamp((0.5F - p.canonical.y) / 1.2F, 0.0F, 1.0F);
    at.z -= 0.03F + d.cape * depth * wave;
    at.x *= 1 + depth;
  }
  if (d.tail > 0) {
    const float near = 1 - length(p.canonical - seat) / 0.09F;
    if (near > 0) at += Vec3f{0, -d.tail_drop, -1} * (d.tail * near), swollen += 8 * d.tail;
  }
  if (skull > 0.5F) grow_horns(d, cloud.head(), p, at, swollen);
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
