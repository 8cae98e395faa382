#include <doctest/doctest.h>

#include <mesh/shapes.hpp>
#include <npt/base/error.hpp>
#include <npt/baseline/skeleton/body_bones.hpp>
#include <npt/baseline/skeleton/skeleton_transfer.hpp>
#include <npt/body/fitted_body.hpp>
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/lab/body_pairs.hpp>
#include <npt/mesh/metrics.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace {

using npt::Vec3d;
using npt::Vec3f;

std::shared_ptr<const npt::BodyFitter> fitter() {
  static const auto shared = std::make_shared<const npt::BodyFitter>(npt::borrowed(npt::mannequin()));
  return shared;
}

npt::Mesh mesh_of(const std::vector<float>& xyz, const std::vector<npt::Triangle>& triangles) {
  return shapes::mesh_of(shapes::points_of(xyz), triangles);
}

const npt::EvaluationPair& pair() {
  static const npt::EvaluationPair made = npt::protocol_sets(npt::borrowed(npt::mannequin()))[1].pair(0);
  return made;
}

/// A transfer of that pair, which tests share.
const npt::SkeletonTransfer& transfer() {
  static const npt::SkeletonTransfer made(fitter(), mesh_of(pair().identity, pair().identity_triangles));
  return made;
}

const npt::BodyFit& pose_fit() {
  static const npt::BodyFit made = npt::fit_body(*fitter(), pair().pose, pair().pose_triangles);
  return made;
}

double root_mm(const std::vector<float>& result) { return npt::pair_errors(pair(), result).root_mm(); }

}  // namespace

TEST_CASE("a protocol pair comes out within what bone heat allows") {
  std::vector<float> result(pair().identity.size());
  transfer().pose(pose_fit().axis_angles, result);
  CHECK(root_mm(result) < 25);
  CHECK(root_mm(pair().identity) > 100);
  CHECK(npt::pair_errors(pair(), result).edge_error < 0.1);
}

TEST_CASE("the identity's own angles give the identity back") {
  std::vector<float> result(pair().identity.size());
  transfer().pose(transfer().fit().axis_angles, result);
  for (std::size_t i = 0; i < result.size(); ++i) CHECK(std::abs(result[i] - pair().identity[i]) < 1e-5F);
}

TEST_CASE("weights cover every vertex, bones lie inside, and joints keep their distances") {
  const npt::SparseMatrix& weights = transfer().weights();
  REQUIRE(weights.rows == pair().identity.size() / 3);
  for (std::size_t v = 0; v < weights.rows; ++v) CHECK(std::abs(weights.row_sum(v) - 1) < 1e-5);
  CHECK(transfer().bones().size() == 23 + 5);  // a head, two hands and two pairs of toes end in nothing

  const npt::BodyModel& model = npt::mannequin();
  const auto motions = npt::skeleton_motions(model, transfer().fit(), pose_fit().axis_angles);
  for (const npt::Bone& bone : transfer().bones()) {
    const Vec3d from = motions[bone.joint](bone.from), to = motions[bone.joint](bone.to);
    CHECK(std::abs(length(to - from) - length(bone.to - bone.from)) < 1e-9);
    // Bones hang together: where the joint's parent takes the joint, it is itself.
    if (bone.joint > 0) {
      const auto parent = static_cast<std::size_t>(model.tables().parents[bone.joint]);
      CHECK(length(motions[parent](bone.from) - from) < 1e-6);
    } else {
      CHECK(length(from - bone.from) < 1e-6);
    }
  }
}

TEST_CASE("evaluate() runs it as a system") {
  npt::EvaluationSet set = npt::protocol_sets(npt::borrowed(npt::mannequin()))[1];
  set.count = 1;
  const npt::Evaluation evaluation = npt::evaluate(set, npt::skeleton_system(fitter()));
  std::vector<float> result(pair().identity.size());
  transfer().pose(pose_fit().axis_angles, result);
  CHECK(evaluation.pairs[0].pmd == npt::pair_errors(pair(), result).pmd);
}

TEST_CASE("a mesh with every defect gets a result") {
  npt::Mesh bad = mesh_of(pair().identity, pair().identity_triangles);
  const std::size_t vertices = bad.vertex_count(), faces = bad.face_count();
  // Holes: every 40th face. A face twice, faces without area, a fin, an unused vertex, and a hat of its own.
  std::vector<npt::Triangle> triangles;
  for (std::size_t t = 0; t < faces; ++t)
    if (t % 40 != 0) triangles.push_back(pair().identity_triangles[t]);
  triangles.push_back(triangles[100]);
  triangles.push_back({5, 5, 9});
  triangles.push_back({7, 7, 7});
  std::vector<float> xyz = pair().identity;
  const auto add = [&xyz](Vec3f p) {
    xyz.insert(xyz.end(), {p.x, p.y, p.z});
    return static_cast<std::uint32_t>(xyz.size() / 3 - 1);
  };
  triangles.push_back(
      {triangles[200][0], triangles[200][1], add(bad.positions[triangles[200][0]] + Vec3f{0, 0.05F, 0})});
  add({0, 3, 0});
  const auto top = std::ranges::max_element(bad.positions, {}, &Vec3f::y);
  const Vec3f hat = *top + Vec3f{0, 0.01F, 0};
  const std::uint32_t a = add(hat), b = add(hat + Vec3f{0.1F, 0, 0}), c = add(hat + Vec3f{0, 0, 0.1F});
  triangles.push_back({a, b, c});
  bad = mesh_of(xyz, triangles);

  const npt::SkeletonTransfer made(fitter(), bad);
  std::vector<float> result(xyz.size());
  made.pose(pose_fit().axis_angles, result);
  CHECK(std::ranges::all_of(result, [](float v) { return std::isfinite(v); }));
  result.resize(3 * vertices);
  CHECK(root_mm(result) < 25);
}

TEST_CASE("a pose mesh may have other faces and vertex counts; the result is a mesh like the identity") {
  // Every face cut in three at its centre.
  npt::Mesh pose = mesh_of(pair().pose, {});
  std::vector<float> xyz = pair().pose;
  std::vector<npt::Triangle> triangles;
  for (const npt::Triangle& t : pair().pose_triangles) {
    const Vec3f p = (pose.positions[t[0]] + pose.positions[t[1]] + pose.positions[t[2]]) / 3.0F;
    xyz.insert(xyz.end(), {p.x, p.y, p.z});
    const auto middle = static_cast<std::uint32_t>(xyz.size() / 3 - 1);
    for (std::size_t k = 0; k < 3; ++k) triangles.push_back({t[k], t[(k + 1) % 3], middle});
  }
  const npt::Mesh result = transfer()(mesh_of(xyz, triangles));
  CHECK(result.corners == mesh_of(pair().identity, pair().identity_triangles).corners);
  CHECK(root_mm({result.coordinates().begin(), result.coordinates().end()}) < 25);
}

TEST_CASE("what can't be used is an error") {
  npt::Mesh cloud = mesh_of(pair().pose, {});
  cloud.face_start.clear();
  CHECK_THROWS_AS(transfer()(cloud), npt::Error);
  CHECK_THROWS_AS(npt::SkeletonTransfer(fitter(), cloud), npt::Error);
  std::vector<float> result(pair().identity.size());
  CHECK_THROWS_AS(transfer().pose(std::vector<float>(9), result), npt::Error);
  result.pop_back();
  CHECK_THROWS_AS(transfer().pose(pose_fit().axis_angles, result), npt::Error);
}
