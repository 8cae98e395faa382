#include <doctest/doctest.h>

#include <npt/baseline/fit/fit_start.hpp>
#include <npt/baseline/skeleton/skeleton_transfer.hpp>
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/body/natural_poses.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/transfer/pose_transfer.hpp>

#include <vector>

TEST_CASE("a fit that begins where a mesh was read needs no search") {
  const auto transfer =
      npt::PoseTransfer::open(NPT_SOURCE_DIR "/examples/weights/human.safetensors", {.method = npt::Method::body}, 1);
  const npt::BodyFitter fitter(npt::borrowed(npt::mannequin()));
  for (const std::uint64_t seed : {2U, 3U}) {  // as 7 of the first 8 do
    npt::Random random(812, seed);
    const npt::NaturalPoses::Pose pose = npt::natural_poses().sample(random);
    npt::Mesh mesh = npt::to_mesh(npt::mannequin(), npt::sample_shape(random, npt::mannequin().shape_count()), pose);
    for (npt::Vec3f& p : mesh.positions) p += npt::Vec3f{3, -2, 1};
    const std::vector<npt::Triangle> triangles = npt::triangulate(mesh);
    const npt::Pose pose_of_mesh = transfer.pose({mesh.coordinates(), triangles, "person"});
    REQUIRE(*pose_of_mesh.confidence() > npt::sure_start);
    const npt::BodyFit start = npt::start_of(*pose_of_mesh.joints(), fitter.model());
    const npt::BodyFit fit = npt::fit_body(fitter, mesh, "person", &start);
    CHECK(fit.starts == 1);
    CHECK(fit.distance < 0.004);
  }
}

TEST_CASE("a start of another model is refused") {
  const npt::BodyFitter fitter(npt::borrowed(npt::mannequin()));
  npt::BodyFit start;
  start.axis_angles.resize(6);
  CHECK_THROWS_AS(npt::fit_body(fitter, npt::to_mesh(npt::mannequin()), "person", &start), npt::Error);
}
