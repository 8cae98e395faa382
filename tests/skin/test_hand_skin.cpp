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
npt::SparseMatrix fist_weights(double off, bool closed = true) {
  npt::HandBend other = fist;
  for (double& m : other.middle) m += off;
  npt::BodyFit fit;
  fit.axis_angles = npt::with_fingers(straight, {other, other});
  return npt::body_weights(*people::mannequins(), fit, skin_points(npt::with_fingers(straight, {fist, fist})),
                           fingered_mannequin().triangles(), {.closed = {closed, closed}})
      .weights;
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
  const double along_skin = misplaced(fist_weights(-0.4)), nearest = misplaced(fist_weights(-0.4, false));
  CHECK(along_skin < 0.12);
  CHECK(along_skin < 0.5 * nearest);
}

TEST_CASE("rows still sum to 1, the thumb stays with the palm, the rest of the body as it was") {
  const npt::SparseMatrix weights = fist_weights(-0.4), without = fist_weights(-0.4, false);
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

TEST_CASE("hands without fingers, and what is no hand, bend with the hand's joint alone") {
  const std::vector<Vec3d> points = skin_points(npt::with_fingers(straight, {}));
  npt::BodyFit fit;
  fit.axis_angles = npt::with_fingers(straight, {});
  const auto fingers_of = [&](std::span<const Vec3d> mesh, std::span<const npt::Triangle> triangles) {
    const auto [weights, fingers] = npt::body_weights(*people::mannequins(), fit, mesh, triangles);
    const bool bend = std::ranges::any_of(weights.column, [](std::uint32_t j) { return j >= npt::smpl_joint_count; });
    CHECK(bend == (fingers[0] || fingers[1]));
    return fingers;
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
