/// The mannequin's anatomy as tables: cross-sections of trunk, head and limbs, and joints.
/// An adult of average build, 1.75 m and seven and a half heads tall, in T pose: y up, facing +z, soles at y = 0, palms
/// down. Only the left half (x >= 0) is written; the right one is its mirror image. Metres.
/// Source    proportions of figure drawing, by eye; no scanned or modelled body was measured, but for the joints
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/body/mannequin/loft.hpp>
#include <npt/body/skeleton.hpp>
#include <npt/config.hpp>

#include <utility>
#include <vector>

namespace npt::inline NPT_ABI::anatomy {

// Upright parts: t = y, u = x, v = z, so the columns are
//   height, centre x, centre z, half width (left, right), depth to the front and to the back, squareness.

inline constexpr Section torso_sections[] = {
    {0.820, 0, -0.006, 0.100, 0.100, 0.060, 0.070, 0.10}, {0.860, 0, -0.006, 0.138, 0.138, 0.080, 0.092, 0.15},
    {0.905, 0, -0.006, 0.158, 0.158, 0.094, 0.098, 0.20}, {0.950, 0, -0.006, 0.163, 0.163, 0.102, 0.098, 0.25},
    {1.000, 0, -0.004, 0.156, 0.156, 0.106, 0.090, 0.25}, {1.050, 0, 0.000, 0.143, 0.143, 0.104, 0.083, 0.25},
    {1.100, 0, 0.003, 0.134, 0.134, 0.098, 0.080, 0.25},  {1.150, 0, 0.003, 0.135, 0.135, 0.100, 0.086, 0.25},
    {1.200, 0, 0.000, 0.144, 0.144, 0.110, 0.096, 0.25},  {1.250, 0, -0.003, 0.153, 0.153, 0.116, 0.105, 0.25},
    {1.300, 0, -0.006, 0.159, 0.159, 0.114, 0.111, 0.25}, {1.350, 0, -0.012, 0.159, 0.159, 0.100, 0.110, 0.25},
    {1.390, 0, -0.018, 0.148, 0.148, 0.084, 0.102, 0.20}, {1.425, 0, -0.024, 0.116, 0.116, 0.066, 0.088, 0.10},
    {1.455, 0, -0.028, 0.076, 0.076, 0.054, 0.068, 0.00},
};

inline constexpr Section neck_sections[] = {
    {1.400, 0, -0.022, 0.070, 0.070, 0.062, 0.070, 0}, {1.440, 0, -0.018, 0.062, 0.062, 0.058, 0.062, 0},
    {1.480, 0, -0.012, 0.056, 0.056, 0.055, 0.058, 0}, {1.520, 0, -0.004, 0.054, 0.054, 0.056, 0.058, 0},
    {1.560, 0, 0.000, 0.055, 0.055, 0.056, 0.062, 0},  {1.600, 0, 0.000, 0.056, 0.056, 0.056, 0.064, 0},
};

inline constexpr Section cranium_sections[] = {
    {1.570, 0, 0.006, 0.056, 0.056, 0.066, 0.080, 0.0},   {1.600, 0, 0.005, 0.065, 0.065, 0.079, 0.094, 0.0},
    {1.635, 0, 0.003, 0.073, 0.073, 0.090, 0.104, 0.0},   {1.665, 0, 0.002, 0.0760, 0.0760, 0.092, 0.106, 0.0},
    {1.685, 0, 0.001, 0.0755, 0.0755, 0.091, 0.103, 0.0},
};

inline constexpr Section jaw_sections[] = {
    {1.523, 0, 0.066, 0.020, 0.020, 0.032, 0.025, 0.2}, {1.535, 0, 0.050, 0.034, 0.034, 0.050, 0.040, 0.2},
    {1.555, 0, 0.036, 0.046, 0.046, 0.064, 0.045, 0.2}, {1.580, 0, 0.030, 0.054, 0.054, 0.070, 0.050, 0.2},
    {1.610, 0, 0.025, 0.060, 0.060, 0.073, 0.050, 0.2}, {1.640, 0, 0.020, 0.060, 0.060, 0.074, 0.050, 0.2},
};

inline constexpr Section leg_sections[] = {
    {0.055, 0.113, -0.024, 0.031, 0.031, 0.042, 0.036, 0.1}, {0.090, 0.112, -0.025, 0.029, 0.029, 0.037, 0.035, 0.1},
    {0.140, 0.111, -0.025, 0.027, 0.028, 0.033, 0.034, 0.0}, {0.200, 0.110, -0.023, 0.032, 0.032, 0.034, 0.039, 0.0},
    {0.270, 0.108, -0.019, 0.041, 0.040, 0.038, 0.050, 0.0}, {0.330, 0.107, -0.015, 0.048, 0.048, 0.042, 0.060, 0.1},
    {0.380, 0.107, -0.011, 0.051, 0.051, 0.044, 0.062, 0.1}, {0.430, 0.107, -0.006, 0.047, 0.049, 0.046, 0.056, 0.1},
    {0.470, 0.107, -0.002, 0.045, 0.047, 0.049, 0.052, 0.2}, {0.510, 0.106, 0.001, 0.047, 0.049, 0.052, 0.052, 0.2},
    {0.555, 0.104, 0.004, 0.052, 0.052, 0.059, 0.056, 0.1},  {0.620, 0.101, 0.006, 0.061, 0.060, 0.071, 0.064, 0.1},
    {0.690, 0.098, 0.006, 0.070, 0.069, 0.081, 0.073, 0.1},  {0.760, 0.096, 0.004, 0.077, 0.077, 0.087, 0.082, 0.1},
    {0.820, 0.094, 0.002, 0.081, 0.083, 0.089, 0.090, 0.1},  {0.870, 0.092, 0.000, 0.081, 0.084, 0.088, 0.090, 0.1},
    {0.915, 0.090, 0.000, 0.073, 0.072, 0.080, 0.080, 0.0},  {0.960, 0.088, 0.000, 0.050, 0.050, 0.058, 0.060, 0.0},
};

// Foot: t from the ankle forwards, u = x, v = y: columns t, centre x, centre y, outer, inner, up, down, squareness.
inline constexpr Section foot_sections[] = {
    {-0.048, 0.000, 0.034, 0.028, 0.028, 0.030, 0.034, 0.2}, {-0.025, 0.000, 0.036, 0.034, 0.034, 0.040, 0.037, 0.3},
    {0.010, 0.001, 0.036, 0.036, 0.035, 0.050, 0.037, 0.3},  {0.045, 0.004, 0.034, 0.038, 0.036, 0.044, 0.035, 0.3},
    {0.080, 0.006, 0.028, 0.042, 0.040, 0.034, 0.029, 0.4},  {0.115, 0.006, 0.021, 0.046, 0.045, 0.027, 0.022, 0.4},
    {0.145, 0.004, 0.016, 0.047, 0.046, 0.022, 0.017, 0.5},  {0.170, 0.000, 0.014, 0.042, 0.042, 0.016, 0.015, 0.5},
    {0.188, -0.007, 0.013, 0.030, 0.032, 0.013, 0.013, 0.4},
};

// Arm: t = x, u = y, v = z: columns x, centre y, centre z, up, down, front, back, squareness.
inline constexpr Section arm_sections[] = {
    {0.110, 1.392, -0.014, 0.046, 0.070, 0.060, 0.062, 0.1}, {0.150, 1.398, -0.012, 0.050, 0.070, 0.060, 0.062, 0.1},
    {0.190, 1.403, -0.010, 0.053, 0.063, 0.057, 0.058, 0.1}, {0.235, 1.405, -0.008, 0.048, 0.054, 0.050, 0.051, 0.1},
    {0.290, 1.405, -0.006, 0.040, 0.046, 0.044, 0.046, 0.1}, {0.345, 1.405, -0.005, 0.036, 0.041, 0.042, 0.044, 0.1},
    {0.400, 1.405, -0.005, 0.033, 0.036, 0.038, 0.040, 0.1}, {0.445, 1.405, -0.005, 0.032, 0.034, 0.035, 0.038, 0.1},
    {0.480, 1.405, -0.003, 0.034, 0.036, 0.040, 0.038, 0.1}, {0.525, 1.405, 0.000, 0.035, 0.036, 0.043, 0.038, 0.1},
    {0.580, 1.405, 0.001, 0.030, 0.031, 0.037, 0.034, 0.1},  {0.640, 1.405, 0.002, 0.023, 0.024, 0.030, 0.029, 0.1},
    {0.690, 1.405, 0.002, 0.019, 0.020, 0.027, 0.026, 0.1},  {0.720, 1.405, 0.002, 0.018, 0.019, 0.028, 0.027, 0.2},
};

inline constexpr Section palm_sections[] = {
    {0.705, 1.405, 0.002, 0.017, 0.018, 0.028, 0.027, 0.2}, {0.730, 1.405, 0.003, 0.017, 0.019, 0.036, 0.032, 0.3},
    {0.760, 1.405, 0.002, 0.015, 0.018, 0.041, 0.038, 0.4}, {0.783, 1.405, 0.001, 0.013, 0.015, 0.042, 0.040, 0.4},
    {0.795, 1.405, 0.000, 0.011, 0.012, 0.037, 0.036, 0.4},
};

/// A finger or thumb: where it leaves the hand, where it points, how long and thick it is.
struct Digit {
  Vec3d root, direction;
  double length, radius;
};

inline constexpr Digit digits[] = {
    {{0.783, 1.405, 0.0330}, {1, -0.06, 0.12}, 0.092, 0.0087},
    {{0.790, 1.406, 0.0113}, {1, -0.06, 0.03}, 0.101, 0.0090},
    {{0.787, 1.405, -0.0105}, {1, -0.06, -0.065}, 0.095, 0.0087},
    {{0.778, 1.403, -0.0312}, {1, -0.06, -0.17}, 0.077, 0.0078},
    {{0.736, 1.397, 0.0260}, {0.80, -0.26, 0.60}, 0.082, 0.0110},
};

/// Where a body's coordinates have their origin: between the hips.
inline constexpr Vec3d origin{0, 0.940, -0.005};

/// Joints of the rest pose at x >= 0, in SMPL's order, without the right side's. Set by eye first, then moved to where
/// the skeletons of human_6890 and human_13380 (MakeHuman's default, CC0) have theirs: the median difference over 660
/// meshes of random shapes and poses to which the mannequin was fitted, twice, both bodies within 2 mm. Joints by eye
/// were off by 31 mm at the hips, 73 mm at the uppermost spine joint. With these, transfers between people of other
/// models through fitted bodies are better by a fifth (human_6890, 40 pairs in natural poses: PMD 4.8e-4 instead of
/// 5.9e-4; a dressed man 6.6e-4 instead of 9.3e-4).
struct JointPlace {
  SmplJoint joint;
  Vec3d position;
};
inline constexpr JointPlace joint_places[] = {
    {SmplJoint::pelvis, {0, 0.913, -0.015}},         {SmplJoint::left_hip, {0.104, 0.898, -0.025}},
    {SmplJoint::spine1, {0, 1.063, -0.041}},         {SmplJoint::left_knee, {0.108, 0.490, 0.006}},
    {SmplJoint::spine2, {0, 1.148, -0.042}},         {SmplJoint::left_ankle, {0.104, 0.071, -0.018}},
    {SmplJoint::spine3, {0, 1.314, -0.033}},         {SmplJoint::left_foot, {0.135, 0.027, 0.122}},
    {SmplJoint::neck, {0, 1.486, -0.027}},           {SmplJoint::left_collar, {0.022, 1.410, -0.010}},
    {SmplJoint::head, {0, 1.592, -0.002}},           {SmplJoint::left_shoulder, {0.178, 1.410, -0.001}},
    {SmplJoint::left_elbow, {0.444, 1.405, -0.003}}, {SmplJoint::left_wrist, {0.701, 1.404, 0.006}},
    {SmplJoint::left_hand, {0.804, 1.413, 0.008}},
};

/// The masses of the figure: what its surface is modelled on.
NPT_INLINE BlendedLofts masses() {
  const LocalFrame upright{{0, 0, 0}, {0, 1, 0}, {1, 0, 0}, {0, 0, 1}};
  const LocalFrame sideways{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  std::vector<Loft> parts;
  parts.emplace_back(upright, torso_sections, 0.03, 0.05, 0.03, false);
  parts.emplace_back(upright, neck_sections, 0.03, 0.03, 0.05, false);
  parts.emplace_back(upright, cranium_sections, 0.03, 0.065, 0.03, false);
  parts.emplace_back(upright, jaw_sections, 0.008, 0.03, 0.025, false);
  parts.emplace_back(upright, leg_sections, 0.02, 0.05, 0.035, true);
  parts.emplace_back(sideways, arm_sections, 0.06, 0.02, 0.06, true);
  LocalFrame foot = make_frame({0.113, 0.0, -0.022}, {0.12, 0, 1}, {1, 0, 0});
  foot.v = {0, 1, 0};
  parts.emplace_back(foot, foot_sections, 0.018, 0.014, 0.03, true);
  parts.emplace_back(sideways, palm_sections, 0.01, 0.008, 0.014, true);
  for (const Digit& d : digits) {
    const double r = d.radius, n = d.length;
    const Section sections[] = {{-0.010, 0, 0, 1.05 * r, 1.05 * r, 1.05 * r, 1.05 * r, 0.1},
                                {0.35 * n, 0, 0, 1.00 * r, 0.98 * r, 0.98 * r, 0.98 * r, 0.1},
                                {0.65 * n, 0, 0, 0.95 * r, 0.93 * r, 0.93 * r, 0.93 * r, 0.1},
                                {n - r, 0, 0, 0.80 * r, 0.84 * r, 0.84 * r, 0.84 * r, 0.1}};
    parts.emplace_back(make_frame(d.root, d.direction, {0, 1, 0}), sections, r, r, 0.006, true);
  }
  // A plate whose rear edge stands off the skull.
  const Section ear[] = {{-0.020, 0, 0.005, 0.0065, 0.0065, 0.008, 0.008, 0},
                         {0.000, 0, 0.000, 0.0080, 0.0080, 0.015, 0.015, 0},
                         {0.016, 0, -0.002, 0.0080, 0.0080, 0.019, 0.019, 0}};
  const LocalFrame beside{{0.0735, 1.624, -0.008}, {0, 1, 0}, {0.9285, 0, 0.3714}, {-0.3714, 0, 0.9285}};
  parts.emplace_back(beside, ear, 0.008, 0.013, 0.009, true);
  return BlendedLofts(std::move(parts));
}

}  // namespace npt::inline NPT_ABI::anatomy
