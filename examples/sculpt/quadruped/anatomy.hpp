/// The four-legged template's anatomy as tables: cross-sections of its parts, strokes that finish them, and joints.
/// A generic animal between dog, horse and cow, 0.75 m at the withers, stands square on four legs: y up, facing +z,
/// left at x > 0, soles at y = 0. Only the half x >= 0 is written; the other one is its mirror image. Metres.
/// Source    proportions by eye, after drawing books' rules: the point of the hock stands under the point of the
///           buttock, the elbow at the height of the brisket; no scanned or modelled body was measured
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/body/mannequin/loft.hpp>

#include <sculpt/figure.hpp>
#include <string_view>
#include <utility>
#include <vector>

namespace sculpt::quadruped {

using npt::Vec3d;
using npt::anatomy::LocalFrame;
using npt::anatomy::Loft;
using npt::anatomy::Section;

/// What the body's coordinates are relative to: the middle of its bounding box along z.
inline constexpr Vec3d origin{0, 0, 0.105};

// Trunk: t = z, u = x, v = y, so the columns are
//   z, centre x, centre y, half width (left, right), up, down, squareness.
inline constexpr Section trunk_sections[] = {
    {-0.420, 0, 0.610, 0.072, 0.072, 0.080, 0.080, 0.10}, {-0.360, 0, 0.605, 0.108, 0.108, 0.120, 0.115, 0.15},
    {-0.280, 0, 0.600, 0.126, 0.126, 0.140, 0.125, 0.20}, {-0.180, 0, 0.600, 0.128, 0.128, 0.134, 0.138, 0.20},
    {-0.050, 0, 0.590, 0.144, 0.144, 0.138, 0.164, 0.15}, {0.080, 0, 0.585, 0.153, 0.153, 0.144, 0.182, 0.10},
    {0.190, 0, 0.580, 0.142, 0.142, 0.168, 0.188, 0.10},  {0.270, 0, 0.578, 0.122, 0.122, 0.172, 0.176, 0.10},
    {0.340, 0, 0.575, 0.098, 0.098, 0.146, 0.142, 0.10},  {0.385, 0, 0.580, 0.074, 0.074, 0.105, 0.104, 0.05},
};

// Neck and head: t along the axis, u = x, v towards crest and forehead: t, centres, left, right, above, below.
inline constexpr LocalFrame neck_frame{{0, 0.600, 0.280}, {0, 0.6428, 0.7660}, {1, 0, 0}, {0, 0.7660, -0.6428}};
inline constexpr Section neck_sections[] = {
    {-0.040, 0, 0.000, 0.100, 0.100, 0.125, 0.140, 0.1}, {0.050, 0, 0.000, 0.088, 0.088, 0.112, 0.140, 0.1},
    {0.130, 0, 0.001, 0.076, 0.076, 0.096, 0.118, 0.1},  {0.210, 0, 0.002, 0.066, 0.066, 0.084, 0.096, 0.1},
    {0.300, 0, 0.004, 0.058, 0.058, 0.074, 0.080, 0.1},  {0.400, 0, 0.004, 0.052, 0.052, 0.064, 0.070, 0.05},
    {0.450, 0, 0.004, 0.048, 0.048, 0.056, 0.064, 0.0},
};
inline constexpr LocalFrame head_frame{{0, 0.905, 0.605}, {0, -0.4226, 0.9063}, {1, 0, 0}, {0, 0.9063, 0.4226}};
inline constexpr Section skull_sections[] = {
    {0.000, 0, 0.002, 0.052, 0.052, 0.052, 0.058, 0.0},  {0.045, 0, 0.002, 0.063, 0.063, 0.062, 0.070, 0.1},
    {0.090, 0, 0.000, 0.061, 0.061, 0.060, 0.066, 0.1},  {0.135, 0, -0.003, 0.050, 0.050, 0.053, 0.050, 0.2},
    {0.180, 0, -0.006, 0.041, 0.041, 0.046, 0.036, 0.2}, {0.225, 0, -0.009, 0.038, 0.038, 0.041, 0.029, 0.2},
    {0.262, 0, -0.012, 0.035, 0.035, 0.036, 0.025, 0.2},
};
inline constexpr Section jaw_sections[] = {
    {0.050, 0, -0.052, 0.050, 0.050, 0.030, 0.036, 0.1}, {0.090, 0, -0.054, 0.047, 0.047, 0.028, 0.036, 0.1},
    {0.130, 0, -0.052, 0.039, 0.039, 0.024, 0.031, 0.2}, {0.180, 0, -0.049, 0.032, 0.032, 0.020, 0.024, 0.2},
    {0.222, 0, -0.047, 0.029, 0.029, 0.017, 0.020, 0.2}, {0.246, 0, -0.046, 0.025, 0.025, 0.014, 0.016, 0.2},
};

// Ear: a leaf; t from its base, u across it, v through it.
inline constexpr Vec3d ear_base{0.040, 0.952, 0.612};
inline constexpr Vec3d ear_axis{0.42, 0.88, -0.20};
inline constexpr Section ear_sections[] = {
    {-0.025, 0, 0, 0.016, 0.016, 0.014, 0.014, 0.0},  {0.005, 0, 0, 0.021, 0.021, 0.012, 0.013, 0.0},
    {0.040, 0, 0, 0.027, 0.027, 0.0095, 0.0105, 0.0}, {0.070, 0, 0, 0.022, 0.022, 0.0085, 0.0090, 0.0},
    {0.095, 0, 0, 0.013, 0.013, 0.0075, 0.0075, 0.0},
};

// Tail: t along its axis, u = x, v forwards and down.
inline constexpr LocalFrame tail_frame{{0, 0.688, -0.425}, {0, -0.7880, -0.6157}, {1, 0, 0}, {0, -0.6157, 0.7880}};
inline constexpr Section tail_sections[] = {
    {-0.040, 0, 0.010, 0.034, 0.034, 0.034, 0.036, 0}, {0.020, 0, -0.010, 0.029, 0.029, 0.029, 0.030, 0},
    {0.100, 0, -0.024, 0.025, 0.025, 0.025, 0.025, 0}, {0.200, 0, -0.028, 0.0225, 0.0225, 0.0225, 0.0225, 0},
    {0.300, 0, -0.020, 0.020, 0.020, 0.020, 0.020, 0}, {0.400, 0, -0.002, 0.0165, 0.0165, 0.0165, 0.0165, 0},
    {0.440, 0, 0.007, 0.014, 0.014, 0.014, 0.014, 0},
};

// Legs: t = y, u = x, v = z: height, centre x, centre z, outer, inner, front, back, squareness.
inline constexpr Section foreleg_sections[] = {
    {0.035, 0.100, 0.220, 0.026, 0.026, 0.028, 0.027, 0},   {0.070, 0.100, 0.213, 0.024, 0.024, 0.026, 0.027, 0},
    {0.120, 0.100, 0.212, 0.0225, 0.0225, 0.025, 0.027, 0}, {0.170, 0.100, 0.215, 0.026, 0.026, 0.029, 0.030, 0.1},
    {0.205, 0.100, 0.218, 0.029, 0.028, 0.033, 0.031, 0.1}, {0.250, 0.100, 0.214, 0.029, 0.029, 0.033, 0.034, 0},
    {0.310, 0.101, 0.211, 0.036, 0.034, 0.041, 0.043, 0},   {0.370, 0.103, 0.210, 0.042, 0.039, 0.050, 0.052, 0},
    {0.420, 0.105, 0.215, 0.047, 0.044, 0.062, 0.063, 0},   {0.470, 0.107, 0.232, 0.049, 0.048, 0.082, 0.074, 0},
    {0.530, 0.104, 0.252, 0.050, 0.050, 0.085, 0.086, 0},   {0.600, 0.090, 0.252, 0.047, 0.050, 0.074, 0.086, 0},
    {0.670, 0.068, 0.235, 0.040, 0.045, 0.054, 0.066, 0},
};
inline constexpr Section hindleg_sections[] = {
    {0.035, 0.100, -0.370, 0.027, 0.027, 0.029, 0.027, 0},   {0.070, 0.100, -0.378, 0.024, 0.024, 0.026, 0.028, 0},
    {0.120, 0.100, -0.387, 0.023, 0.023, 0.027, 0.029, 0},   {0.170, 0.100, -0.395, 0.025, 0.025, 0.030, 0.033, 0},
    {0.215, 0.100, -0.399, 0.028, 0.027, 0.036, 0.038, 0.1}, {0.250, 0.100, -0.383, 0.029, 0.028, 0.040, 0.046, 0},
    {0.290, 0.100, -0.346, 0.033, 0.032, 0.050, 0.054, 0},   {0.330, 0.102, -0.308, 0.038, 0.037, 0.060, 0.062, 0},
    {0.370, 0.105, -0.275, 0.045, 0.043, 0.074, 0.076, 0},   {0.410, 0.107, -0.262, 0.051, 0.048, 0.088, 0.094, 0},
    {0.460, 0.106, -0.274, 0.056, 0.055, 0.098, 0.114, 0},   {0.520, 0.100, -0.295, 0.057, 0.057, 0.100, 0.120, 0},
    {0.580, 0.088, -0.308, 0.054, 0.054, 0.088, 0.112, 0},   {0.640, 0.073, -0.310, 0.043, 0.044, 0.066, 0.094, 0},
};

// Paw: t = z from the joint of the foot, u = x, v = y: flat below.
inline constexpr Section paw_sections[] = {
    {-0.018, 0, 0.026, 0.026, 0.026, 0.026, 0.024, 0.2},
    {0.015, 0, 0.026, 0.031, 0.031, 0.026, 0.026, 0.4},
    {0.045, 0, 0.022, 0.032, 0.032, 0.022, 0.022, 0.5},
    {0.062, 0, 0.018, 0.027, 0.027, 0.016, 0.018, 0.4},
};
inline constexpr double forepaw_z = 0.222, hindpaw_z = -0.370, paw_x = 0.100;

/// The masses of the figure: what its surface is modelled on.
inline npt::anatomy::BlendedLofts masses() {
  const LocalFrame lengthwise{{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {0, 1, 0}};
  const LocalFrame upright{{0, 0, 0}, {0, 1, 0}, {1, 0, 0}, {0, 0, 1}};
  std::vector<Loft> parts;
  parts.emplace_back(lengthwise, trunk_sections, 0.040, 0.040, 0.03, false);
  parts.emplace_back(neck_frame, neck_sections, 0.040, 0.030, 0.07, false);
  parts.emplace_back(head_frame, skull_sections, 0.035, 0.022, 0.03, false);
  parts.emplace_back(head_frame, jaw_sections, 0.025, 0.015, 0.012, false);
  parts.emplace_back(tail_frame, tail_sections, 0.020, 0.016, 0.04, false);
  parts.emplace_back(upright, foreleg_sections, 0.015, 0.040, 0.05, true);
  parts.emplace_back(upright, hindleg_sections, 0.015, 0.040, 0.05, true);
  for (const double z : {forepaw_z, hindpaw_z})
    parts.emplace_back(LocalFrame{{paw_x, 0, z}, {0, 0, 1}, {1, 0, 0}, {0, 1, 0}}, paw_sections, 0.012, 0.014, 0.02,
                       true);
  parts.emplace_back(npt::anatomy::make_frame(ear_base, ear_axis, {0.75, -0.2, 0.6}), ear_sections, 0.010, 0.012, 0.012,
                     true);
  return npt::anatomy::BlendedLofts(std::move(parts));
}

// Strokes, region by region: from, to, radius in x, y and z, amount.
inline constexpr Stroke strokes[] = {
    // Eyes: socket and eyeball; nostrils.
    {{0.054, 0.884, 0.696}, {0.052, 0.878, 0.716}, {0.026, 0.020, 0.026}, -0.0065},
    {{0.055, 0.883, 0.703}, {0.055, 0.881, 0.708}, {0.016, 0.014, 0.017}, 0.0070},
    {{0.020, 0.790, 0.856}, {0.022, 0.793, 0.850}, {0.014, 0.012, 0.014}, -0.0045},
    // Furrow of the back; muscle of the shoulder, of the thigh; points of knee, hock and elbow.
    {{0.000, 0.745, -0.050}, {0.000, 0.750, -0.300}, {0.040, 0.040, 0.080}, -0.0040},
    {{0.112, 0.520, 0.330}, {0.112, 0.495, 0.320}, {0.060, 0.075, 0.065}, 0.0090},
    {{0.120, 0.580, -0.240}, {0.125, 0.490, -0.260}, {0.055, 0.090, 0.090}, 0.0060},
    {{0.115, 0.410, -0.180}, {0.112, 0.395, -0.185}, {0.050, 0.050, 0.045}, 0.0080},
    {{0.100, 0.228, -0.440}, {0.100, 0.222, -0.436}, {0.024, 0.034, 0.034}, 0.0080},
    {{0.110, 0.425, 0.150}, {0.110, 0.418, 0.150}, {0.032, 0.034, 0.036}, 0.0070},
};

inline Figure figure() { return {masses(), strokes}; }

/// Joints of the rest pose at x >= 0, by the plan's names; reach: of the skin around each that its place is averaged
/// from.
struct JointPlace {
  std::string_view joint;
  Vec3d position;
  double reach;
};
inline constexpr JointPlace joint_places[] = {
    {"pelvis", {0, 0.650, -0.290}, 0.20},
    {"spine1", {0, 0.662, -0.165}, 0.20},
    {"spine2", {0, 0.660, -0.035}, 0.20},
    {"spine3", {0, 0.655, 0.090}, 0.20},
    {"chest", {0, 0.645, 0.205}, 0.20},
    {"neck1", {0, 0.680, 0.368}, 0.17},
    {"neck2", {0, 0.752, 0.458}, 0.14},
    {"neck3", {0, 0.826, 0.546}, 0.13},
    {"head", {0, 0.893, 0.630}, 0.12},
    {"jaw", {0, 0.836, 0.652}, 0.10},
    {"l_ear", {0.041, 0.955, 0.611}, 0.05},
    {"tail1", {0, 0.680, -0.430}, 0.08},
    {"tail2", {0, 0.634, -0.508}, 0.06},
    {"tail3", {0, 0.566, -0.569}, 0.06},
    {"tail4", {0, 0.488, -0.616}, 0.06},
    {"tail5", {0, 0.409, -0.654}, 0.06},
    {"l_scapula", {0.072, 0.665, 0.215}, 0.14},
    {"l_shoulder", {0.110, 0.500, 0.310}, 0.13},
    {"l_elbow", {0.107, 0.425, 0.198}, 0.10},
    {"l_wrist", {0.100, 0.205, 0.217}, 0.07},
    {"l_forefoot", {0.100, 0.045, 0.222}, 0.06},
    {"l_hip", {0.085, 0.605, -0.310}, 0.15},
    {"l_knee", {0.106, 0.408, -0.210}, 0.11},
    {"l_hock", {0.100, 0.222, -0.396}, 0.07},
    {"l_hindfoot", {0.100, 0.047, -0.372}, 0.06},
};

}  // namespace sculpt::quadruped
