#include <doctest/doctest.h>

#include <mesh/zoo.hpp>
#include <npt/io/safetensors.hpp>
#include <npt/mesh/normalise.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <numbers>

#include "support/needs.hpp"

namespace {

using npt::Normalisation;
using npt::Vec3d;

double largest_distance(std::span<const float> xyz, Vec3d from) {
  double largest = 0;
  for (std::size_t v = 0; v < xyz.size() / 3; ++v)
    largest = std::max(largest, npt::length(npt::point_at(xyz, v) - from));
  return largest;
}

}  // namespace

TEST_CASE("names of normalisations are read as they are written") {
  for (const Normalisation n : {Normalisation::sphere, Normalisation::centre, Normalisation::none})
    CHECK(npt::parse_normalisation(npt::to_string(n)) == n);
  CHECK_THROWS_WITH(npt::parse_normalisation("Sphere", "--normalise"),
                    "--normalise: found 'Sphere', expected sphere, centre or none");
}

TEST_CASE("each normalisation does what its name says") {
  const npt::Mesh mesh = zoo::mixed();
  const npt::NormalisingTransform sphere = npt::normalising_transform(mesh.coordinates(), Normalisation::sphere);
  CHECK(sphere.centre == Vec3d{4.5, 4.5, 4.5});
  std::vector<float> out(mesh.coordinates().size());
  sphere.apply(mesh.coordinates(), out);
  CHECK(std::abs(largest_distance(out, {}) - npt::sphere_radius) < 1e-7);

  const npt::NormalisingTransform centre = npt::normalising_transform(mesh.coordinates(), Normalisation::centre);
  CHECK(centre.centre == Vec3d{4.5, 4.5, 4.5});
  CHECK(centre.scale == 1);
  npt::normalising_transform(mesh.coordinates(), Normalisation::none).apply(mesh.coordinates(), out);
  CHECK(std::equal(out.begin(), out.end(), mesh.coordinates().begin()));
}

TEST_CASE("inverse undoes apply, in place too, and for meshes in other units far away") {
  for (const float unit : {1e-3F, 1.0F, 1e3F}) {
    npt::Mesh mesh = zoo::cube();
    for (npt::Vec3f& p : mesh.positions) p = (p + npt::Vec3f{100, -50, 3}) * unit;
    const npt::Mesh before = mesh;
    const npt::NormalisingTransform frame = npt::normalising_transform(mesh.coordinates(), Normalisation::sphere);
    frame.apply(mesh.coordinates(), mesh.coordinates());
    frame.apply_inverse(mesh.coordinates(), mesh.coordinates());
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
      CHECK(npt::length(mesh.positions[v] - before.positions[v]) <= 1e-5F * unit);
      CHECK(frame.apply(before.positions[v]) == frame.apply(before.positions[v].as<double>()).as<float>());
    }
  }
}

TEST_CASE("the frame doesn't depend on the vertex order") {
  npt::Mesh mesh = zoo::mixed();
  const npt::NormalisingTransform before = npt::normalising_transform(mesh.coordinates(), Normalisation::sphere);
  std::reverse(mesh.positions.begin(), mesh.positions.end());
  const npt::NormalisingTransform after = npt::normalising_transform(mesh.coordinates(), Normalisation::sphere);
  CHECK(before.centre == after.centre);
  CHECK(before.scale == after.scale);
}

TEST_CASE("the largest and the smallest coordinates have a frame") {
  constexpr float large = std::numeric_limits<float>::max(), small = std::numeric_limits<float>::denorm_min();
  for (const float x : {large, small}) {
    const std::array<float, 6> xyz = {-x, x, 0, x, -x, x};
    const npt::NormalisingTransform frame = npt::normalising_transform(xyz, Normalisation::sphere);
    CHECK(std::isfinite(frame.scale));
    std::array<float, 6> out{};
    frame.apply(xyz, out);
    CHECK(std::abs(largest_distance(out, {}) - npt::sphere_radius) < 1e-6);
  }
}

TEST_CASE("no vertices, half vertices and a single point are errors that name the mesh") {
  const std::vector<float> none, half(4), point(9, 2.5F);
  CHECK_THROWS_WITH(npt::normalising_transform(none, Normalisation::centre, "a.ply"),
                    "a.ply: found no vertices, expected at least one vertex");
  CHECK_THROWS_WITH(npt::normalising_transform(half, Normalisation::none, "span"),
                    "span: found 4 coordinates, expected a multiple of 3");
  CHECK_THROWS_WITH(npt::normalising_transform(point, Normalisation::sphere, "a.ply"),
                    doctest::Contains("a.ply: found all vertices in one point"));
  CHECK(npt::normalising_transform(point, Normalisation::centre).centre == Vec3d{2.5, 2.5, 2.5});
}

TEST_CASE("a NaN stays one vertex' matter") {
  std::vector<float> xyz = {0, 0, 0, 2, 2, 2, std::numeric_limits<float>::quiet_NaN(), 1, 1};
  const npt::NormalisingTransform frame = npt::normalising_transform(xyz, Normalisation::sphere);
  CHECK(frame.centre == Vec3d{1, 1, 1});
  frame.apply(xyz, xyz);
  CHECK(std::isnan(xyz[6]));
  CHECK(std::isfinite(xyz[3]));
}

// The claim behind sphere_radius, on a real body: linear blend skinning of a few joints, written out.
namespace {

using Matrix = std::array<Vec3d, 3>;  // rows

Vec3d operator*(const Matrix& m, Vec3d v) { return {npt::dot(m[0], v), npt::dot(m[1], v), npt::dot(m[2], v)}; }
Matrix operator*(const Matrix& a, const Matrix& b) {
  const auto column = [&](std::size_t k) {
    const auto at = [k](Vec3d row) { return k == 0 ? row.x : k == 1 ? row.y : row.z; };
    return Vec3d{at(b[0]), at(b[1]), at(b[2])};
  };
  Matrix result;
  for (std::size_t i = 0; i < 3; ++i) result[i] = {dot(a[i], column(0)), dot(a[i], column(1)), dot(a[i], column(2))};
  return result;
}
Matrix rotation_x(double degrees) {
  const double c = std::cos(degrees * std::numbers::pi / 180), s = std::sin(degrees * std::numbers::pi / 180);
  return {{{1, 0, 0}, {0, c, -s}, {0, s, c}}};
}
Matrix rotation_y(double degrees) {
  const double c = std::cos(degrees * std::numbers::pi / 180), s = std::sin(degrees * std::numbers::pi / 180);
  return {{{c, 0, s}, {0, 1, 0}, {-s, 0, c}}};
}

Matrix rotation_z(double degrees) {
  const double c = std::cos(degrees * std::numbers::pi / 180), s = std::sin(degrees * std::numbers::pi / 180);
  return {{{c, -s, 0}, {s, c, 0}, {0, 0, 1}}};
}

std::vector<float> posed(const npt::SafetensorsFile& body, const std::array<Matrix, 24>& local) {
  const std::vector<double> v = npt::to_double(body.at("v_template")),
                            regressor = npt::to_double(body.at("J_regressor")),
                            weights = npt::to_double(body.at("weights"));
  const std::vector<std::int64_t> parents = npt::to_int64(body.at("parents"));
  const std::size_t count = v.size() / 3;
  const auto vertex = [&](std::size_t i) { return Vec3d{v[3 * i], v[3 * i + 1], v[3 * i + 2]}; };
  std::array<Vec3d, 24> joints{}, moved{};
  std::array<Matrix, 24> turned{};
  for (std::size_t j = 0; j < 24; ++j) {
    for (std::size_t i = 0; i < count; ++i) joints[j] += vertex(i) * regressor[j * count + i];
    const auto parent = static_cast<std::size_t>(parents[j]);
    turned[j] = j == 0 ? local[0] : turned[parent] * local[j];
    moved[j] = j == 0 ? joints[0] : turned[parent] * (joints[j] - joints[parent]) + moved[parent];
  }
  std::vector<float> result;
  for (std::size_t i = 0; i < count; ++i) {
    Vec3d p;
    for (std::size_t j = 0; j < 24; ++j)
      if (weights[24 * i + j] != 0) p += (turned[j] * (vertex(i) - joints[j]) + moved[j]) * weights[24 * i + j];
    for (const double x : {p.x, p.y, p.z}) result.push_back(static_cast<float>(x));
  }
  return result;
}

}  // namespace

TEST_CASE("a curled-up person who stands up stays inside the range of tanh" *
          support::needs_shared("data/human_6890.safetensors")) {
  const std::filesystem::path path = NPT_SHARED "/data/human_6890.safetensors";
  const npt::SafetensorsFile body = npt::SafetensorsFile::read(path);
  std::array<Matrix, 24> standing;
  standing.fill(rotation_x(0));
  std::array<Matrix, 24> curled = standing;
  curled[1] = curled[2] = rotation_x(-125);  // hips
  curled[4] = curled[5] = rotation_x(140);   // knees
  for (const std::size_t spine : {3U, 6U, 9U, 12U, 15U}) curled[spine] = rotation_x(24);
  curled[16] = rotation_x(-50) * rotation_y(-60);  // shoulders
  curled[17] = rotation_x(-50) * rotation_y(60);
  curled[18] = rotation_y(-110);  // elbows
  curled[19] = rotation_y(110);
  const npt::NormalisingTransform frame = npt::normalising_transform(posed(body, curled), Normalisation::sphere);
  std::array<Matrix, 24> reaching = standing;
  reaching[16] = rotation_z(90);
  reaching[17] = rotation_z(-90);
  float highest = 0;
  for (const auto& pose : {standing, reaching}) {
    const std::vector<float> truth = posed(body, pose);
    const npt::NormalisingTransform own = npt::normalising_transform(truth, Normalisation::centre);
    std::vector<float> network(truth.size());
    npt::NormalisingTransform{own.centre, frame.scale}.apply(truth, network);
    for (const float x : network) highest = std::max(highest, std::abs(x));
  }
  MESSAGE("largest coordinate " << highest);
  CHECK(highest < 0.97F);
  CHECK(highest > 0.8F);  // not wastefully small either
}
