/// A bound character as tensors of a file, and back with the same bits.
///   estimate.numbers [n] F64, estimate.axis_angles, estimate.betas, estimate.part_distances [J] F64,
///   estimate.joint_confidence [J] F64, body.axis_angles, joints [J', 3] F64, hands F64, points [V, 3] F64,
///   weights.start [V + 1] U32, weights.column U32, weights.value
/// The surface of the estimate isn't kept: poses need it, identities don't.
#pragma once

#include <npt/base/as_span.hpp>
#include <npt/base/error.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_kind.hpp>
#include <npt/body/sparse_matrix.hpp>
#include <npt/config.hpp>
#include <npt/estimate/body_estimate.hpp>
#include <npt/io/safetensors.hpp>
#include <npt/io/tensor_list.hpp>
#include <npt/io/tensor_values.hpp>
#include <npt/skin/bound_character.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace npt::inline NPT_ABI {

namespace transfer::internal {

/// The numbers of an estimate, in the file's order.
template <class Estimate, class F>
void for_each_number(Estimate& e, const F& f) {
  double unused = 0;  // two numbers that versions before wrote
  f(e.centre.x), f(e.centre.y), f(e.centre.z), f(e.metres), f(e.confidence);
  f(e.fit.relative_distance), f(e.fit.mesh_explained), f(unused), f(unused);
  f(e.fit.facing), f(e.fit.body.translation.x), f(e.fit.body.translation.y), f(e.fit.body.translation.z);
  f(e.fit.body.distance);
}
template <class Hands, class F>
void for_each_bend(Hands& hands, const F& f) {
  for (auto& hand : hands) {
    f(hand.knuckles);
    for (auto& bend : hand.middle) f(bend);
    double unused = 0;  // four numbers that versions before wrote, and all of these a second time
    for (std::size_t finger = 0; finger < finger_count; ++finger) f(unused);
  }
}

NPT_INLINE std::vector<double> numbers_of(std::span<const Vec3d> points) {
  std::vector<double> numbers;
  for (const Vec3d& p : points) numbers.insert(numbers.end(), {p.x, p.y, p.z});
  return numbers;
}
NPT_INLINE std::vector<Vec3d> points_of(std::span<const double> numbers) {
  std::vector<Vec3d> points;
  for (std::size_t i = 0; i + 2 < numbers.size(); i += 3)
    points.push_back({numbers[i], numbers[i + 1], numbers[i + 2]});
  return points;
}

/// Errors    npt::Error where the tensor is missing or doesn't have `count` numbers
template <class T>
std::vector<T> expect_values(const SafetensorsFile& file, const char* name, std::size_t count) {
  std::vector<T> values = to_values<T>(file.at(name), NonFinite::refuse);
  if (values.size() != count)
    throw Error({.file = file.name(),
                 .place = std::string("tensor '") + name + "'",
                 .found = std::to_string(values.size()) + " numbers",
                 .expected = std::to_string(count)});
  return values;
}

/// Errors    npt::Error for weights that point outside of joints or out of their list
NPT_INLINE SparseMatrix load_weights(const SafetensorsFile& file, std::size_t vertices, std::size_t joints) {
  const auto start = expect_values<std::int64_t>(file, "weights.start", vertices + 1);
  const auto column = to_values<std::int64_t>(file.at("weights.column"), NonFinite::refuse);
  SparseMatrix weights;
  weights.rows = vertices;
  weights.columns = joints;
  weights.value = expect_values<float>(file, "weights.value", column.size());
  bool good = start.front() == 0 && start.back() == static_cast<std::int64_t>(column.size());
  good = good && std::is_sorted(start.begin(), start.end());
  for (const std::int64_t j : column) good = good && j >= 0 && j < static_cast<std::int64_t>(joints);
  if (!good)
    throw Error({.file = file.name(),
                 .place = "tensors 'weights.start' and 'weights.column'",
                 .found = "numbers outside of their lists",
                 .expected = "skin weights on " + std::to_string(joints) + " joints"});
  weights.start.assign(start.size(), 0);
  for (std::size_t i = 0; i < start.size(); ++i) weights.start[i] = static_cast<std::uint32_t>(start[i]);
  for (const std::int64_t j : column) weights.column.push_back(static_cast<std::uint32_t>(j));
  return weights;
}

}  // namespace transfer::internal

NPT_INLINE void save_bound(const BoundCharacter& character, TensorList& out) {
  using namespace transfer::internal;
  const BodyEstimate& e = character.estimate;
  std::vector<double> numbers, bends;
  for_each_number(e, [&numbers](double x) { numbers.push_back(x); });
  for_each_bend(e.hands, [&bends](double x) { bends.push_back(x); });
  for_each_bend(e.hands, [&bends](double x) { bends.push_back(x); });
  out.add("estimate.numbers", numbers);
  out.add("estimate.axis_angles", e.fit.body.axis_angles);
  out.add("estimate.betas", e.fit.body.betas);
  out.add("estimate.part_distances", std::span<const double>(e.fit.part_distances), {e.fit.part_distances.size()});
  out.add("estimate.joint_confidence", std::span<const double>(e.joint_confidence), {e.joint_confidence.size()});
  const std::array<std::uint32_t, 2> flags{character.fingers[0] ? 1U : 0U, character.fingers[1] ? 1U : 0U};
  out.add("flags", std::span<const std::uint32_t>(flags), {flags.size()});
  out.add("body.axis_angles", character.body.axis_angles);
  out.add("hands", bends);
  out.add("joints", as_span(numbers_of(as_span(character.joints))), {character.joints.size(), 3});
  out.add("points", as_span(numbers_of(as_span(character.points))), {character.points.size(), 3});
  out.add("weights.start", character.weights.start);
  out.add("weights.column", character.weights.column);
  out.add("weights.value", character.weights.value);
}

/// Errors    npt::Error that names the file and the tensor, for one that is missing or doesn't fit the others
NPT_INLINE BoundCharacter load_bound(const SafetensorsFile& file, const BodyKind& kind) {
  using namespace transfer::internal;
  const std::size_t joints = kind.bound_body().joint_count();
  BoundCharacter character;
  BodyEstimate& e = character.estimate;
  std::size_t count = 0, bends = 0;
  for_each_number(e, [&count](double&) { ++count; });
  for_each_bend(e.hands, [&bends](double&) { ++bends; });
  const auto numbers = expect_values<double>(file, "estimate.numbers", count);
  std::size_t i = 0;
  for_each_number(e, [&](double& x) { x = numbers[i++]; });
  e.fit.body.axis_angles = expect_values<float>(file, "estimate.axis_angles", 3 * kind.joint_count());
  e.fit.body.betas = expect_values<float>(file, "estimate.betas", kind.body->shape_count());
  e.fit.part_distances = expect_values<double>(file, "estimate.part_distances", kind.joint_count());
  e.joint_confidence.assign(kind.joint_count(), e.confidence);
  if (file.find("estimate.joint_confidence") != nullptr)  // files that were made before have none
    e.joint_confidence = expect_values<double>(file, "estimate.joint_confidence", kind.joint_count());
  const auto flags = expect_values<std::int64_t>(file, "flags", 2);
  character.fingers = {flags[0] != 0, flags[1] != 0};
  const auto hands = expect_values<double>(file, "hands", 2 * bends);
  i = 0;
  for_each_bend(e.hands, [&](double& x) { x = hands[i++]; });
  character.body = e.fit.body;
  character.body.axis_angles = expect_values<float>(file, "body.axis_angles", 3 * joints);
  character.joints = points_of(as_span(expect_values<double>(file, "joints", 3 * joints)));
  const std::size_t coordinates = to_values<float>(file.at("positions"), NonFinite::refuse).size();
  character.points = points_of(as_span(expect_values<double>(file, "points", coordinates)));
  character.weights = load_weights(file, character.points.size(), joints);
  return character;
}

}  // namespace npt::inline NPT_ABI
