#include <doctest/doctest.h>

#include <npt/mesh/triangles.hpp>
#include <npt/nets/pose_transfer_net.hpp>
#include <npt/transfer/network_state.hpp>
#include <npt/transfer/network_transfer.hpp>

#include <vector>

#include "support/bumpy_sphere.hpp"

TEST_CASE("nothing is prepared at first") {
  CHECK(npt::NetworkIdentity().vertices == 0);
  CHECK(npt::PoseChoice().vertex_count() == 0);
  CHECK(npt::NetworkPose().codes.empty());
}

TEST_CASE("a network's identity is the normalised mesh with its mirror image, its pose a code a run") {
  using Paired = npt::PoseTransferNet<16>;
  npt::Model<Paired> model;
  npt::randomise(model, 8);
  const npt::NetworkTransfer<npt::DefaultExecutor> network(
      npt::network_type<Paired, npt::DefaultExecutor>(), model.buffer(), {}, "the model",
      {.network = {.pairings = 2, .mirror = true}}, npt::DefaultExecutor(1));
  const npt::Mesh mesh = support::bumpy_sphere(9, 14, 0.2, true), pose = support::bumpy_sphere(6, 11, 0.4);
  npt::NetworkIdentity identity;
  network.prepare_identity({.xyz = mesh.coordinates()}, identity);
  CHECK(identity.vertices == 140);
  REQUIRE(identity.coordinates.size() == 420);
  for (std::size_t v = 0; v < 140; ++v) {
    const npt::Vec3f p{identity.coordinates[3 * v], identity.coordinates[3 * v + 1], identity.coordinates[3 * v + 2]};
    CHECK(npt::length(identity.transform.apply_inverse(p.as<double>()).as<float>() - mesh.positions[v]) < 1e-5F);
    CHECK(identity.mirrored[3 * v] == -p.x);
    CHECK(identity.mirrored[3 * v + 1] == p.y);
  }
  REQUIRE(identity.place.size() == 140);
  CHECK(identity.place[13] == identity.place[0]);  // along the seam
  const std::vector<npt::Triangle> triangles = npt::triangulate(pose);
  npt::PoseChoice choice;
  network.choose({.xyz = pose.coordinates(), .triangles = triangles}, 140, choice);
  CHECK(choice.vertex_count() == 77);
  CHECK(choice.pairings().size() == 2);
  npt::NetworkPose encoded;
  network.encode({.xyz = pose.coordinates(), .triangles = triangles}, choice, encoded);
  CHECK(encoded.count == 140);
  CHECK(encoded.codes.size() == 4);
}

TEST_CASE("a mirror image has x of the other sign") {
  const std::vector<float> xyz{1, 2, 3, -4, 5, 6};
  std::vector<float> mirrored;
  npt::internal::mirror(xyz, mirrored);
  CHECK(mirrored == std::vector<float>{-1, 2, 3, 4, 5, 6});
}
