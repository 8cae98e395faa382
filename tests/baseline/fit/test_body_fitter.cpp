#include <doctest/doctest.h>

#include <npt/base/error.hpp>
#include <npt/base/random.hpp>
#include <npt/baseline/fit/body_fitter.hpp>
#include <npt/baseline/fit/start_poses.hpp>
#include <npt/body/body_file.hpp>
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/body/pose_sampler.hpp>
#include <npt/mesh/vertex_order.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "support/needs.hpp"

namespace {

using npt::Vec3d;

/// A body made by a model, with its vertices shuffled.
struct Sample {
  std::vector<Vec3d> truth;   ///< in the model's order
  std::vector<Vec3d> points;  ///< shuffled
  std::vector<npt::Triangle> triangles;
};

Sample sample(const npt::BodyModel& model, std::uint64_t seed) {
  npt::Random random(seed);
  const std::vector<float> betas = npt::sample_shape(random, model.shape_count());
  const npt::Mesh mesh = npt::to_mesh(model, betas, npt::sample_pose(random));
  Sample result;
  for (const npt::Vec3f p : mesh.positions) result.truth.push_back(p.as<double>());
  const auto count = static_cast<std::uint32_t>(mesh.vertex_count());
  const std::vector<std::uint32_t> order = npt::random_permutation(count, random);
  std::vector<std::uint32_t> place(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    result.points.push_back(result.truth[order[i]]);
    place[order[i]] = i;
  }
  for (const npt::Triangle& t : model.triangles()) result.triangles.push_back({place[t[0]], place[t[1]], place[t[2]]});
  return result;
}

/// RMS over the model's vertices, in metres.
double error(const npt::BodyModel& model, const npt::BodyFit& fit, const std::vector<Vec3d>& truth) {
  std::vector<float> vertices(3 * model.vertex_count());
  model.posed(fit.betas, fit.axis_angles, vertices);
  double sum = 0;
  for (std::size_t v = 0; v < truth.size(); ++v) {
    const Vec3d p =
        npt::Vec3f{vertices[3 * v], vertices[3 * v + 1], vertices[3 * v + 2]}.as<double>() + fit.translation;
    sum += dot(p - truth[v], p - truth[v]);
  }
  return std::sqrt(sum / static_cast<double>(truth.size()));
}

const npt::BodyFitter& mannequin_fitter() {
  static const npt::BodyFitter fitter(npt::borrowed(npt::mannequin()));
  return fitter;
}

}  // namespace

TEST_CASE("bodies made by the model come back from shuffled vertices to 5 mm RMS") {
  for (const std::uint64_t seed : {1U, 2U}) {
    const Sample s = sample(npt::mannequin(), seed);
    const npt::BodyFit fit = mannequin_fitter().fit(s.points, s.triangles);
    CAPTURE(seed);
    CHECK(error(npt::mannequin(), fit, s.truth) < 0.003);
    CHECK(fit.distance < 0.001);
    CHECK(fit.starts >= 1);
    CHECK(fit.evaluations > 10);
  }
}

TEST_CASE("so do bodies of a model made elsewhere" * support::needs_shared("data/human_6890.safetensors")) {
  const std::filesystem::path file = std::string(NPT_SHARED) + "/data/human_6890.safetensors";
  const auto model = std::make_shared<const npt::BodyModel>(npt::load_body(file));
  const npt::BodyFitter fitter(model);
  const Sample s = sample(*model, 11);
  CHECK(error(*model, fitter.fit(s.points, s.triangles), s.truth) < 0.003);
}

TEST_CASE("a body may stand elsewhere, face away, and come with another vertical axis") {
  Sample s = sample(npt::mannequin(), 4);
  for (auto* points : {&s.truth, &s.points})
    for (Vec3d& p : *points) p = Vec3d{-p.x, p.z, p.y} + Vec3d{7, -3, 11};
  const npt::BodyFit fit = mannequin_fitter().fit(s.points, s.triangles);
  CHECK(error(npt::mannequin(), fit, s.truth) < 0.003);
}

TEST_CASE("what is no surface, or of another size, is an error that names it") {
  const Sample s = sample(npt::mannequin(), 5);
  const auto expect_error = [](const std::vector<Vec3d>& points, const std::vector<npt::Triangle>& triangles) {
    try {
      mannequin_fitter().fit(points, triangles, "hat.ply");
      FAIL("no error");
    } catch (const npt::Error& error) {
      CHECK(error.parts().file == "hat.ply");
    }
  };
  expect_error(s.points, {});
  std::vector<Vec3d> centimetres = s.points;
  for (Vec3d& p : centimetres) p *= 100;
  expect_error(centimetres, s.triangles);
  CHECK_THROWS_AS(npt::BodyFitter(nullptr), npt::Error);
  CHECK_THROWS_AS(npt::BodyFitter(npt::borrowed(npt::mannequin()), {.yaws = 0}), npt::Error);
}

TEST_CASE("start directions are turns about the vertical axis, then laid down") {
  const std::vector<Vec3d> directions = npt::start_directions(4);
  REQUIRE(directions.size() == 24);
  const auto up = [](Vec3d axis_angle) { return npt::rotation_matrix(axis_angle) * Vec3d{0, 1, 0}; };
  const std::vector<Vec3d> ups{{0, 1, 0}, {0, 0, 1}, {0, 0, -1}, {1, 0, 0}, {-1, 0, 0}, {0, -1, 0}};
  for (std::size_t i = 0; i < 24; ++i) {
    CHECK(length(up(directions[i]) - ups[i / 4]) < 1e-9);
    CHECK(length(directions[i]) < 3.1416);
    for (std::size_t k = 0; k < i; ++k) CHECK(length(directions[i] - directions[k]) > 0.1);
  }
}
