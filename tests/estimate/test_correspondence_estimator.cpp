#include <doctest/doctest.h>

#include <npt/base/random.hpp>
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/body/natural_poses.hpp>
#include <npt/body/pose_sampler.hpp>
#include <npt/estimate/canonical_frame.hpp>
#include <npt/estimate/correspondence_estimator.hpp>
#include <npt/io/safetensors.hpp>
#include <npt/mesh/normals.hpp>
#include <npt/mesh/sampled_surface.hpp>
#include <npt/nets/correspondence_net.hpp>
#include <npt/nn/engine/engine.hpp>
#include <npt/nn/engine/model.hpp>
#include <npt/nn/weights/weights.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace {

const std::filesystem::path weights = std::filesystem::path(NPT_SOURCE_DIR) / "examples/weights/human.safetensors";

npt::SampledSurface surface_of(const npt::Mesh& mesh) {
  return {npt::points_of(mesh.coordinates()), npt::triangulate(mesh), 1500, "mesh"};
}

}  // namespace

TEST_CASE("the shipped reader says where points of unseen people belong, to 5 cm in the middle") {
  const npt::CorrespondenceEstimator reader = npt::CorrespondenceEstimator::open(weights, 1);
  for (std::uint64_t i = 0; i < 4; ++i) {
    npt::Random random(9001, i);
    const auto pose = npt::natural_poses().sample(random);
    const auto betas = npt::sample_shape(random, npt::mannequin().shape_count());
    const npt::Mesh posed = npt::to_mesh(npt::mannequin(), betas, pose);
    const npt::Mesh rest = npt::to_mesh(npt::mannequin());
    std::vector<npt::SampledSurface::Sample> samples;
    std::vector<npt::Vec3d> places;
    std::vector<npt::Vec3d> points;
    for (const npt::Vec3f p : posed.positions) points.push_back(p.as<double>());
    const std::vector<npt::Vec3d> normals = npt::area_vectors(points, npt::mannequin().triangles());
    for (std::size_t v = 0; v < posed.positions.size(); v += 5) {
      samples.push_back({points[v], npt::normalised(normals[v])});
      places.push_back(rest.positions[v].as<double>());
    }
    const npt::Correspondences median = reader.read(samples).front();
    std::vector<double> errors;
    for (std::size_t k = 0; k < places.size(); ++k) errors.push_back(length(median[k].place - places[k]));
    std::ranges::sort(errors);
    CHECK(errors[errors.size() / 2] < 0.06);
  }
}

// Else the fit's decisions fall otherwise on another processor: with readings 3e-5 m apart a result moved by 2 mm.
TEST_CASE("the shipped networks read to 2 micrometres in float, in each precision of its error") {
  const npt::Mesh mesh = npt::to_mesh(npt::mannequin());
  const npt::SampledSurface surface = surface_of(mesh);
  const std::size_t n = 3 * surface.samples().size();
  std::vector<float> points, normals, places(n);
  const npt::NormalisingTransform frame =
      npt::canonical_frame(surface.samples().size(), [&surface](std::size_t i) { return surface.samples()[i].point; });
  for (const auto& s : surface.samples()) {
    const npt::Vec3f p = frame.apply(s.point).as<float>(), q = s.normal.as<float>();
    points.insert(points.end(), {p.x, p.y, p.z});
    normals.insert(normals.end(), {q.x, q.y, q.z});
  }
  const std::vector<double> exact_points(points.begin(), points.end()), exact_normals(normals.begin(), normals.end());
  for (const char* name : {"human.safetensors", "quadruped.safetensors"}) {
    const npt::SafetensorsFile file =
        npt::correspondence_part(npt::SafetensorsFile::read(weights.parent_path() / name));
    npt::Model<npt::CorrespondenceNet<>> model;
    npt::Model<npt::CorrespondenceNet<>, double> exact;
    npt::load(model, file);
    npt::load(exact, file);
    std::vector<double> expected(n);
    npt::Engine(exact, 1)({exact_points, exact_normals}, expected);
    for (const npt::Precision precision : {npt::Precision::native, npt::Precision::automatic}) {
      npt::Engine(model, 1, precision)({points, normals}, places);
      double off = 0;
      for (std::size_t i = 0; i < n; ++i)
        off = std::max(off, std::abs(2 * (static_cast<double>(places[i]) - expected[i])));
      CAPTURE(std::string(name));
      CAPTURE(std::string(npt::name_of(precision)));
      CHECK(off < 2e-6);
      CHECK(off > 0);
    }
  }
}

TEST_CASE("there is a reading for each turn and their median, the same with any number of threads, place and unit") {
  npt::Model<npt::CorrespondenceNet<>> model;
  npt::randomise(model, 2);
  const npt::CorrespondenceEstimator one(model, npt::DefaultExecutor(1));
  const npt::Mesh mesh = npt::to_mesh(npt::mannequin());
  const npt::SampledSurface surface = surface_of(mesh);
  const auto samples = surface.samples().first(200);
  const std::vector<npt::Correspondences> readings = one.read(samples, {.turns = 3});
  REQUIRE(readings.size() == 4);
  REQUIRE(one.read(samples, {.turns = 1}).size() == 1);
  std::vector<npt::SampledSurface::Sample> moved(samples.begin(), samples.end());
  for (auto& s : moved) s.point = s.point * 4.0 + npt::Vec3d{16, -8, 32};
  const std::vector<npt::Correspondences> others = one.read(moved, {.turns = 3});
  for (std::size_t i = 0; i < 200; ++i) {
    CHECK(readings[1][i].point == samples[i].point);
    CHECK(length(readings[1][i].place - others[1][i].place) < 1e-4);
    const bool own = readings[0][i].place == readings[1][i].place || readings[0][i].place == readings[2][i].place ||
                     readings[0][i].place == readings[3][i].place;
    CHECK(own);
    CHECK(readings[0][i].spread >= 0.01);
  }
}

TEST_CASE("no points, points in one place and no turn are errors") {
  npt::Model<npt::CorrespondenceNet<>> model;
  npt::randomise(model, 2);
  const npt::CorrespondenceEstimator reader(model, npt::DefaultExecutor(1));
  CHECK_THROWS_AS(reader.read({}), npt::Error);
  const std::vector<npt::SampledSurface::Sample> same(30, {{1, 1, 1}, {0, 1, 0}});
  CHECK_THROWS_AS(reader.read(same), npt::Error);
  const npt::SampledSurface surface = surface_of(npt::to_mesh(npt::mannequin()));
  CHECK_THROWS_AS(reader.read(surface.samples(), {.turns = 0}), npt::Error);
}
