/// What characters carry and wear that no body has the shape of: weapons and staffs, shields, packs, brims of hats,
/// beards. Each is some boxes and ellipsoids that one joint moves, and belongs where it is fastened to the body.
/// Units     metres, in the axes of the body at rest
/// Source    figures of games, by eye
#pragma once

#include <npt/base/random.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/skeleton.hpp>
#include <npt/config.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

namespace npt::inline NPT_ABI {

namespace data {

struct PropPart {
  Vec3f middle;               ///< from where the prop is fastened
  std::array<Vec3f, 3> axes;  ///< unit, at right angles
  Vec3f half;                 ///< along its axes
  bool box = false;           ///< else an ellipsoid

  float area() const {
    if (box) return 8 * (half.x * half.y + half.y * half.z + half.z * half.x);
    // Knud Thomsen's approximation, 1.1 % off at most.
    constexpr float p = 1.6075F;
    const float a = std::pow(half.x, p), b = std::pow(half.y, p), c = std::pow(half.z, p);
    return 4 * std::numbers::pi_v<float> * std::pow((a * b + b * c + c * a) / 3, 1 / p);
  }
  Vec3f across(Vec3f own) const { return axes[0] * own.x + axes[1] * own.y + axes[2] * own.z; }

  /// A point of its surface, by area, and the unit normal there.
  void draw(Random& random, Vec3f& point, Vec3f& normal) const {
    const auto uniform = [&random] { return static_cast<float>(random.uniform(-1, 1)); };
    if (box) {
      const std::array<float, 3> faces{half.y * half.z, half.z * half.x, half.x * half.y};
      float pick = static_cast<float>(random.uniform()) * (faces[0] + faces[1] + faces[2]);
      std::size_t face = 0;
      while (face < 2 && pick > faces[face]) pick -= faces[face++];
      std::array<float, 3> at{uniform(), uniform(), uniform()}, out{};
      at[face] = out[face] = at[face] < 0 ? -1.0F : 1.0F;
      point = middle + across({at[0] * half.x, at[1] * half.y, at[2] * half.z});
      normal = across({out[0], out[1], out[2]});
      return;
    }
    const float least = std::min({half.x, half.y, half.z});
    for (;;) {
      const Vec3f d{static_cast<float>(random.normal()), static_cast<float>(random.normal()),
                    static_cast<float>(random.normal())};
      const Vec3f unit = normalised(d), slope{unit.x / half.x, unit.y / half.y, unit.z / half.z};
      if (static_cast<float>(random.uniform()) > least * length(slope)) continue;
      point = middle + across({unit.x * half.x, unit.y * half.y, unit.z * half.z});
      normal = normalised(across(slope));
      return;
    }
  }
};

struct Prop {
  std::size_t joint = 0;  ///< that moves it
  Vec3f side;             ///< it is fastened where the joint's surface is farthest in this direction
  std::vector<PropPart> parts{};
};

namespace prop::internal {

/// Two unit vectors at right angles to a unit vector and to each other.
inline std::array<Vec3f, 3> axes_about(Vec3f up) {
  const Vec3f other = std::abs(up.x) < 0.7F ? Vec3f{1, 0, 0} : Vec3f{0, 0, 1};
  const Vec3f across = normalised(cross(up, other));
  return {across, up, cross(across, up)};
}

inline Vec3f any_direction(Random& r) {
  return normalised(
      Vec3f{static_cast<float>(r.normal()), static_cast<float>(r.normal()), static_cast<float>(r.normal())});
}

/// A staff, a spear, a sword, an axe, a club: a shaft through the hand, and often something at its end.
inline Prop draw_held(Random& r, bool left) {
  const auto uniform = [&r](double low, double high) { return static_cast<float>(r.uniform(low, high)); };
  Prop prop{.joint = joint_index(left ? SmplJoint::left_hand : SmplJoint::right_hand), .side = {0, -1, 0}};
  // Across the palm, more or less.
  const Vec3f up = normalised(Vec3f{0.3F * uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)} + any_direction(r) * 0.2F);
  const auto axes = axes_about(up);
  const float size = uniform(0.15, 1), thick = uniform(0.01, 0.035), held = uniform(-0.9, 0.6);
  const Vec3f middle = up * (size * -held);
  const bool blade = r.uniform() < 0.3;
  prop.parts.push_back({middle, axes, {blade ? uniform(0.03, 0.1) : thick, size, thick}, r.uniform() < 0.5});
  if (r.uniform() < 0.6) {
    const Vec3f head = middle + up * (size * uniform(0.8, 1)) + axes[0] * uniform(-0.1, 0.1);
    prop.parts.push_back(
        {head, axes, {uniform(0.04, 0.25), uniform(0.04, 0.25), uniform(0.01, 0.15)}, r.uniform() < 0.5});
  }
  return prop;
}

inline Prop draw_shield(Random& r, bool left) {
  const auto uniform = [&r](double low, double high) { return static_cast<float>(r.uniform(low, high)); };
  const bool on_arm = r.uniform() < 0.5;
  const Vec3f out = normalised(Vec3f{0, uniform(-0.5, 1), uniform(-1, 1)} + any_direction(r) * 0.2F);
  const auto axes = axes_about(out);
  const float width = uniform(0.15, 0.45);
  using enum SmplJoint;
  const SmplJoint joint = on_arm ? (left ? left_elbow : right_elbow) : (left ? left_hand : right_hand);
  return {.joint = joint_index(joint),
          .side = out,
          .parts = {{out * 0.05F, axes, {width, uniform(0.01, 0.05), width * uniform(0.8, 1.8)}, r.uniform() < 0.3}}};
}

inline Prop draw_pack(Random& r) {
  const auto uniform = [&r](double low, double high) { return static_cast<float>(r.uniform(low, high)); };
  const float deep = uniform(0.04, 0.2);
  const Vec3f up = normalised(Vec3f{uniform(-0.8, 0.8), 1, uniform(-0.2, 0.2)});
  return {.joint = joint_index(SmplJoint::spine3),
          .side = {0, 0, -1},
          .parts = {{{uniform(-0.08, 0.08), uniform(-0.2, 0.15), -0.8F * deep},
                     axes_about(up),
                     {uniform(0.04, 0.25), uniform(0.1, 0.45), deep},
                     r.uniform() < 0.5}}};
}

/// A brim, and mostly a crown or a tip.
inline Prop draw_hat(Random& r) {
  const auto uniform = [&r](double low, double high) { return static_cast<float>(r.uniform(low, high)); };
  const Vec3f up = normalised(Vec3f{uniform(-0.15, 0.15), 1, uniform(-0.3, 0.15)});
  const auto axes = axes_about(up);
  const float wide = uniform(0.12, 0.45), high = uniform(0.05, 0.4);
  Prop hat{.joint = joint_index(SmplJoint::head), .side = {0, 1, 0}};
  if (r.uniform() < 0.7) hat.parts.push_back({up * uniform(-0.08, 0), axes, {wide, uniform(0.008, 0.04), wide}, false});
  hat.parts.push_back({up * (0.6F * high - 0.05F), axes, {uniform(0.06, 0.16), high, uniform(0.06, 0.16)}, false});
  return hat;
}

inline Prop draw_beard(Random& r) {
  const auto uniform = [&r](double low, double high) { return static_cast<float>(r.uniform(low, high)); };
  const float high = uniform(0.06, 0.3);
  return {.joint = joint_index(SmplJoint::head),
          .side = {0, -0.5F, 1},
          .parts = {{{0, -0.7F * high, 0.01F},
                     axes_about(normalised(Vec3f{0, 1, uniform(-0.3, 0)})),
                     {uniform(0.05, 0.14), high, uniform(0.03, 0.09)},
                     false}}};
}

}  // namespace prop::internal

/// Mostly none: each kind with a chance of its own.
inline std::vector<Prop> draw_props(Random& r) {
  using namespace prop::internal;
  std::vector<Prop> props;
  for (const bool left : {true, false}) {
    const double kind = r.uniform();
    if (kind < 0.14)
      props.push_back(draw_held(r, left));
    else if (kind < 0.19)
      props.push_back(draw_shield(r, left));
  }
  if (r.uniform() < 0.06) props.push_back(draw_pack(r));
  if (r.uniform() < 0.08) props.push_back(draw_hat(r));
  if (r.uniform() < 0.08) props.push_back(draw_beard(r));
  return props;
}

}  // namespace data

}  // namespace npt::inline NPT_ABI
