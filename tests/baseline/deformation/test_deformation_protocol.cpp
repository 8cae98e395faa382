#include <doctest/doctest.h>

#include <npt/baseline/deformation/control_points.hpp>
#include <npt/baseline/deformation/deformation_evaluation.hpp>
#include <npt/body/body_file.hpp>
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/lab/body_pairs.hpp>

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "support/needs.hpp"

namespace {

using npt::Mesh;
using npt::Vec3d;

Vec3d position(const Mesh& mesh, std::uint32_t v) { return mesh.positions[v].as<double>(); }

/// The error of one of the protocol's pairs, PMD per coordinate in square metres.
double figure(const npt::BodyModel& body, std::size_t control_points, npt::ThirdMesh third) {
  const auto pairs = npt::unseen_pose_pairs(body.shape_count());
  const npt::Evaluation evaluation = npt::evaluate_deformation(body, std::span(pairs).first(1), "one",
                                                               npt::protocol::unseen_pair_seed, control_points, third);
  CHECK(evaluation.pairs.size() == 1);
  CHECK(evaluation.edge_error() < 0.05);
  return evaluation.per_coordinate();
}

}  // namespace

TEST_CASE("control points lie where their names say, apart from each other and symmetric") {
  const npt::BodyModel& body = npt::mannequin();
  const Mesh rest = npt::to_mesh(body);
  const auto vertices = npt::control_vertices(body, 13);
  CHECK(std::set<std::uint32_t>(vertices.begin(), vertices.end()).size() == 13);
  const auto five = npt::control_vertices(body, 5);
  CHECK(std::equal(five.begin(), five.end(), vertices.begin()));
  float top = -9, left = -9;
  for (const npt::Vec3f p : rest.positions) top = std::max(top, p.y), left = std::max(left, p.x);
  CHECK(rest.positions[vertices[0]].y > top - 0.02F);
  CHECK(rest.positions[vertices[1]].x > left - 0.03F);
  for (std::size_t i = 1; i < 13; i += 2) {
    const Vec3d a = position(rest, vertices[i]), b = position(rest, vertices[i + 1]);
    CHECK(a.x > 0.05);
    CHECK(length(Vec3d{-a.x, a.y, a.z} - b) < 0.02);
    CHECK(npt::body_control_points[i].name.substr(0, 4) == "left");
  }
  const auto joints = body.joints({});
  for (std::size_t i = 0; i < 13; ++i)
    CHECK(length(position(rest, vertices[i]) - joints[npt::joint_index(npt::body_control_points[i].joint)]) < 0.25);
  CHECK_THROWS_AS(npt::control_vertices(body, 7), npt::Error);
}

TEST_CASE("a case has the protocol's meshes in the protocol's orders") {
  const auto body = npt::borrowed(npt::mannequin());
  const auto pairs = npt::seen_pose_pairs(body->shape_count());
  const auto sets = npt::protocol_sets(body);
  for (const npt::ThirdMesh third : {npt::ThirdMesh::rest, npt::ThirdMesh::identity_pose}) {
    const auto given = npt::deformation_case(*body, pairs[3], 3, npt::protocol::seen_pair_seed, 13, third);
    const npt::EvaluationPair pair = sets[0].pair(3);
    CHECK(given.pose == pair.pose);
    CHECK(given.truth == pair.truth);
    CHECK(npt::unique_edges(given.target).size() == pair.edges.size());
    CHECK((std::vector<float>(given.target.coordinates().begin(), given.target.coordinates().end()) == pair.identity) ==
          (third == npt::ThirdMesh::identity_pose));
    CHECK(given.markers.size() == 13);
    CHECK(!npt::same_topology(given.source, given.target));
  }
}

TEST_CASE("a body that gets its own pose follows exactly, whatever the vertex orders") {
  const npt::BodyModel& body = npt::mannequin();
  npt::BodyPair pair = npt::unseen_pose_pairs(body.shape_count())[1];
  pair.identity_shape = pair.pose_shape;
  for (const npt::ThirdMesh third : {npt::ThirdMesh::rest, npt::ThirdMesh::identity_pose}) {
    const auto given = npt::deformation_case(body, pair, 0, 5, 5, third);
    const std::vector<float> result = npt::run_deformation_case(given);
    double worst = 0;
    for (std::size_t i = 0; i < result.size(); ++i)
      worst = std::max(worst, std::abs(static_cast<double>(result[i]) - static_cast<double>(given.truth[i])));
    CHECK(worst < 1.75e-6);  // 1e-6 of the height
  }
}

TEST_CASE("the protocol's error is far below the paper's 6.7e-4") {
  CHECK(figure(npt::mannequin(), 13, npt::ThirdMesh::rest) < 0.2e-4);
  CHECK(figure(npt::mannequin(), 5, npt::ThirdMesh::identity_pose) < 3e-4);
}

TEST_CASE("and so it is on a body made elsewhere" * support::needs_shared("data/human_6890.safetensors")) {
  const std::filesystem::path human = std::string(NPT_SHARED) + "/data/human_6890.safetensors";
  CHECK(figure(npt::load_body(human), 13, npt::ThirdMesh::rest) < 1e-4);
}
