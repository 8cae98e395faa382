// Through body_weights(), which uses it for closed hands.
#include <doctest/doctest.h>

#include <estimate/people.hpp>

#include <npt/body/kinematics.hpp>
#include <npt/body/mannequin/finger_joints.hpp>
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/skin/body_weights.hpp>
#include <npt/skin/hand_skin.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

namespace {

using npt::Vec3d;

const npt::BodyModel& fingered_mannequin() { return people::mannequins()->bound_body(); }

constexpr npt::HandBend fist{.knuckles = 0.7, .middle = {1.5, 1.5, 1.5, 1.5}};
const std::vector<float> straight(3 * npt::smpl_joint_count, 0.0F);

std::vector<Vec3d> skin_points(const std::vector<float>& angles) {
  std::vector<float> xyz(3 * fingered_mannequin().vertex_count());
  fingered_mannequin().posed({}, angles, xyz);
  std::vector<Vec3d> points;
  for (std::size_t i = 0; i < xyz.size(); i += 3)
    points.push_back(npt::Vec3f{xyz[i], xyz[i + 1], xyz[i + 2]}.as<double>());
  return points;
}

/// Weights of a mesh of the mannequin's topology with fists, from a body with fists that are closed by `off` more.
npt::SparseMatrix fist_weights(double off, std::array<npt::skeleton::internal::HandMeasure, 2>* measured = nullptr,
                               bool closed = true) {
  npt::HandBend other = fist;
  for (double& m : other.middle) m += off;
  npt::BodyFit fit;
  fit.axis_angles = npt::with_fingers(straight, {other, other});
  return npt::body_weights(*people::mannequins(), fit, skin_points(npt::with_fingers(straight, {fist, fist})),
                           fingered_mannequin().triangles(), {.closed = {closed, closed}}, measured);
}

/// Mean of how much of a finger's weights is where it doesn't belong, over vertices that are moved by fingers alone.
double misplaced(const npt::SparseMatrix& weights) {
  const std::vector<float> own = fingered_mannequin().tables().weights.to_dense(), found = weights.to_dense();
  double sum = 0, count = 0;
  for (std::size_t v = 0; v < fingered_mannequin().vertex_count(); ++v) {
    float of_fingers = 0;
    for (std::size_t j = npt::smpl_joint_count; j < npt::fingered_joint_count; ++j)
      of_fingers += own[v * npt::fingered_joint_count + j];
    if (of_fingers < 0.99F) continue;
    for (std::size_t j = 0; j < npt::fingered_joint_count; ++j)
      sum += static_cast<double>(
                 std::abs(own[v * npt::fingered_joint_count + j] - found[v * npt::fingered_joint_count + j])) /
             2;
    ++count;
  }
  return sum / count;
}

}  // namespace

TEST_CASE("a fist's fingers get their own weights, though other skin lies nearer") {
  const double along_skin = misplaced(fist_weights(-0.4)), nearest = misplaced(fist_weights(-0.4, nullptr, false));
  CHECK(along_skin < 0.12);
  CHECK(along_skin < 0.5 * nearest);
}

TEST_CASE("rows still sum to 1, the thumb stays with the palm, the rest of the body as it was") {
  const npt::SparseMatrix weights = fist_weights(-0.4), without = fist_weights(-0.4, nullptr, false);
  const std::vector<float> own = weights.to_dense(), before = without.to_dense();
  for (std::size_t v = 0; v < weights.rows; ++v) {
    CHECK(weights.row_sum(v) == doctest::Approx(1).epsilon(1e-5));
    const float* at = &npt::mannequin().tables().v_template[3 * v];
    const float* row = &own[v * npt::fingered_joint_count];
    if (std::abs(at[0]) < 0.6F)
      for (std::size_t j = 0; j < npt::fingered_joint_count; ++j)
        CHECK(row[j] == before[v * npt::fingered_joint_count + j]);
    if (at[2] > 0.07F && std::abs(at[0]) > 0.75F && std::abs(at[0]) < 0.79F)  // the thumb's end
      CHECK(row[joint_index(npt::SmplJoint::left_wrist) + (at[0] < 0 ? 1 : 0)] > 0.9F);
  }
}

TEST_CASE("fingers are measured against the body's: their bend beyond it, and where their joints are") {
  constexpr double off = -0.4;
  std::array<npt::skeleton::internal::HandMeasure, 2> measured;
  fist_weights(off, &measured);
  const std::vector<float> angles = npt::with_fingers(straight, {fist, fist});
  const std::vector<Vec3d> joints = fingered_mannequin().joints({});
  const std::vector<npt::Rigid> motions = fingered_mannequin().bone_motions({}, angles);
  for (std::size_t side = 0; side < 2; ++side)
    for (std::size_t f = 0; f < npt::finger_count; ++f) {
      const auto& finger = measured[side].closed[f];
      // The body's middle joints lack 0.4, and the ends of its fingers two thirds of it more.
      CHECK(std::abs(finger.turns[0] + off) < 0.3);
      CHECK(std::abs(finger.turns[1] + off * 5 / 3) < 0.35);
      for (std::size_t k = 0; k < 2; ++k) {
        const std::size_t j = npt::middle_finger_joint(side, f) + k;
        REQUIRE(finger.joints[k].has_value());
        CHECK(length(*finger.joints[k] - motions[j](joints[j])) < 0.01);
      }
    }
}

TEST_CASE("hands without fingers, and what is no hand, bend with the hand's joint alone") {
  const std::vector<Vec3d> points = skin_points(npt::with_fingers(straight, {}));
  npt::BodyFit fit;
  fit.axis_angles = npt::with_fingers(straight, {});
  const auto fingers_of = [&](std::span<const Vec3d> mesh, std::span<const npt::Triangle> triangles) {
    std::array<npt::skeleton::internal::HandMeasure, 2> measured;
    const npt::SparseMatrix weights = npt::body_weights(*people::mannequins(), fit, mesh, triangles, {}, &measured);
    const bool bend = std::ranges::any_of(weights.column, [](std::uint32_t j) { return j >= npt::smpl_joint_count; });
    CHECK(bend == (measured[0].fingers || measured[1].fingers));
    return std::array{measured[0].fingers, measured[1].fingers};
  };
  CHECK(fingers_of(points, fingered_mannequin().triangles()) == std::array{true, true});
  // Cut off at the knuckles.
  std::vector<npt::Triangle> cut;
  for (const npt::Triangle& t : fingered_mannequin().triangles())
    if (std::ranges::all_of(t, [&](std::uint32_t v) { return std::abs(points[v].x) < 0.8; })) cut.push_back(t);
  CHECK(fingers_of(points, cut) == std::array{false, false});
  std::vector<Vec3d> stick = points;  // a gun in the left hand
  for (Vec3d& p : stick)
    if (p.x > 0.83) p.x += 8 * (p.x - 0.83);
  CHECK(fingers_of(stick, fingered_mannequin().triangles()) == std::array{false, true});
}
