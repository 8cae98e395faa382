#include <doctest/doctest.h>

#include <npt/base/random.hpp>
#include <npt/base/thread_executor.hpp>
#include <npt/body/mannequin/finger_joints.hpp>
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/body/pose_sampler.hpp>
#include <npt/estimate/body_look_up.hpp>
#include <npt/mesh/normals.hpp>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace {

npt::BodyFit posed(std::uint64_t seed) {
  npt::Random random(seed);
  npt::BodyFit fit;
  fit.translation = {1, 0, -1};
  fit.betas = npt::sample_shape(random, npt::mannequin().shape_count());
  const auto pose = npt::sample_pose(random);
  fit.axis_angles.assign(pose.begin(), pose.end());
  return fit;
}

}  // namespace

TEST_CASE("a body's own points belong where they are at rest") {
  const npt::BodyModel& body = npt::mannequin();
  const npt::BodyLookUp look_up(body, posed(1), 1, body.joint_count());
  REQUIRE(look_up.body().size() == body.vertex_count());
  const std::vector<npt::Vec3d> outward = npt::area_vectors(look_up.body(), body.triangles());
  const std::vector<std::uint32_t> parts = body.tables().weights.heaviest_columns();
  std::uint32_t hint = npt::no_index;
  for (std::size_t v = 0; v < body.vertex_count(); v += 29) {
    const npt::ClosestPoint on = look_up(look_up.body()[v], outward[v], hint);
    const npt::BodyPlace place = look_up.place(on);
    const float* rest = &body.tables().v_template[3 * v];
    CHECK(length(place.rest - npt::Vec3f{rest[0], rest[1], rest[2]}.as<double>()) < 1e-5);
    CHECK(place.part == parts[v]);
    CHECK(look_up.distance(look_up.body()[v]) < 1e-6);
  }
}

TEST_CASE("a point belongs to the side that faces as it does, if that is known") {
  const npt::BodyModel& body = npt::mannequin();
  const npt::BodyFit fit = posed(2);
  const npt::BodyLookUp outwards(body, fit, 1, 24), inwards(body, fit, -1, 24), either(body, fit, 0, 24);
  const std::vector<npt::Vec3d> outward = npt::area_vectors(outwards.body(), body.triangles());
  std::size_t other_side = 0, looked = 0;
  for (std::size_t v = 0; v < body.vertex_count(); v += 29, ++looked) {
    std::uint32_t none = npt::no_index, hint = npt::no_index, third = npt::no_index;
    const npt::Vec3d p = outwards.body()[v];
    CHECK(outwards(p, outward[v], none).squared_distance < 1e-10);
    CHECK(either(p, -outward[v], third).squared_distance < 1e-10);
    if (inwards(p, outward[v], hint).squared_distance > 1e-6) ++other_side;
  }
  CHECK(other_side > looked / 2);
}

TEST_CASE("fingers count as their hands") {
  const npt::BodyModel fingered = npt::with_finger_joints(npt::mannequin());
  npt::BodyFit fit;
  fit.axis_angles.assign(3 * fingered.joint_count(), 0.0F);
  const npt::BodyLookUp look_up(fingered, fit, 1, npt::smpl_joint_count);
  std::uint32_t hint = npt::no_index;
  for (const npt::Vec3d p : look_up.body()) REQUIRE(look_up.place(look_up(p, {}, hint)).part < npt::smpl_joint_count);
}

TEST_CASE("all points of a mesh are looked up side by side, each as by itself") {
  const npt::BodyModel& body = npt::mannequin();
  const npt::BodyLookUp look_up(body, posed(3), 1, 24);
  std::vector<npt::Vec3d> points(look_up.body().begin(), look_up.body().end());
  for (npt::Vec3d& p : points) p.x += 0.01;
  const std::vector<npt::Vec3d> outward = npt::area_vectors(points, body.triangles());
  std::vector<npt::ClosestPoint> found(points.size());
  const npt::ThreadExecutor executor(3);
  look_up.for_each(points, outward, executor, [&](std::size_t p, const npt::ClosestPoint& c) { found[p] = c; });
  for (std::size_t p = 0; p < points.size(); ++p) {
    std::uint32_t hint = npt::no_index;
    const npt::ClosestPoint alone = look_up(points[p], outward[p], hint);
    CHECK(found[p].triangle == alone.triangle);
    CHECK(found[p].weights == alone.weights);
  }
}
