#include <doctest/doctest.h>

#include <npt/base/random.hpp>
#include <npt/mesh/vertex_order.hpp>
#include <npt/transfer/detail_refiner.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "mesh/zoo.hpp"

namespace {

using npt::DetailRefiner;
using npt::Triangle;
using npt::Vec3d;
using npt::Vec3f;
using Floats = std::vector<float>;

/// A tube along x with bumps on it, open at both ends. 3 long, radius 0.25.
struct Tube {
  Floats xyz;
  std::vector<Triangle> triangles;

  explicit Tube(std::uint32_t rings = 49, std::uint32_t around = 20) {
    for (std::uint32_t i = 0; i < rings; ++i)
      for (std::uint32_t k = 0; k < around; ++k) {
        const double along = 3.0 * i / (rings - 1), angle = 2 * 3.14159265358979 * k / around;
        const double radius = 0.25 + 0.02 * std::sin(9 * along) * std::cos(3 * angle);
        for (const double c : {along, radius * std::cos(angle), radius * std::sin(angle)})
          xyz.push_back(static_cast<float>(c));
      }
    for (std::uint32_t i = 0; i + 1 < rings; ++i)
      for (std::uint32_t k = 0; k < around; ++k) {
        const std::uint32_t a = i * around + k, b = i * around + (k + 1) % around;
        triangles.push_back({a, b, b + around});
        triangles.push_back({a, b + around, a + around});
      }
  }
  DetailRefiner refiner(npt::DetailOptions options = {}) const { return {xyz, triangles, options}; }
};

template <class Map>
Floats mapped(Floats xyz, Map&& map) {
  for (std::size_t i = 0; i < xyz.size(); i += 3) {
    const Vec3f p = map(Vec3f{xyz[i], xyz[i + 1], xyz[i + 2]}.as<double>()).template as<float>();
    xyz[i] = p.x, xyz[i + 1] = p.y, xyz[i + 2] = p.z;
  }
  return xyz;
}

/// Bends the tube by a quarter of a turn, without stretching its axis.
Vec3d bent(Vec3d p) {
  const double curvature = 1.5707963267948966 / 3, angle = p.x * curvature, radius = 1 / curvature - p.y;
  return {radius * std::sin(angle), 1 / curvature - radius * std::cos(angle), p.z};
}

Floats with_noise(Floats xyz, double sigma, std::uint64_t seed) {
  npt::Random random(seed);
  for (float& x : xyz) x += static_cast<float>(sigma * random.normal());
  return xyz;
}

double rms(const Floats& a, const Floats& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += std::pow(double{a[i]} - double{b[i]}, 2);
  return std::sqrt(3 * sum / static_cast<double>(a.size()));
}

double edge_rms(const Floats& a, const Floats& b, const std::vector<Triangle>& triangles) {
  const auto at = [](const Floats& xyz, std::uint32_t v) {
    return Vec3f{xyz[3 * v], xyz[3 * v + 1], xyz[3 * v + 2]}.as<double>();
  };
  double sum = 0;
  const std::vector<npt::Edge> edges = npt::edges_of_triangles(triangles);
  for (const auto& [u, v] : edges) {
    const double d = npt::length(at(a, u) - at(a, v)) / npt::length(at(b, u) - at(b, v)) - 1;
    sum += d * d;
  }
  return std::sqrt(sum / static_cast<double>(edges.size()));
}

Floats refined(const DetailRefiner& refiner, const Floats& positions) {
  Floats result(positions.size());
  refiner(positions, result);
  return result;
}

bool same_bits(const Floats& a, const Floats& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

}  // namespace

TEST_CASE("the mesh itself, moved and turned, stays as it is") {
  const Tube tube;
  const npt::Quaternion turn = npt::Quaternion{}.turned({0.7, -2.1, 1.3});
  for (const auto& map : {+[](const npt::Quaternion&, Vec3d p) { return p; },
                          +[](const npt::Quaternion&r, Vec3d p) {
                            return r(p) + Vec3d{1, 2, 3};
                          }}) {
    const Floats wanted = mapped(tube.xyz, [&](Vec3d p) { return map(turn, p); });
    CHECK(rms(refined(tube.refiner(), wanted), wanted) < 1e-6);
  }
}

TEST_CASE("rough positions of a bent mesh become the bent mesh: detail from the mesh, the bend from the positions") {
  const Tube tube;
  const Floats truth = mapped(tube.xyz, bent), rough = with_noise(truth, 0.02, 1);
  const double before = rms(rough, truth), edges_before = edge_rms(rough, truth, tube.triangles);
  double last = before;
  for (const double radius : {0.01, 0.04, 0.1}) {
    const Floats result = refined(tube.refiner({.radius = radius}), rough);
    CHECK(rms(result, truth) < last);
    last = rms(result, truth);
  }
  CHECK(last < 0.3 * before);
  const Floats result = refined(tube.refiner({.radius = 0.1}), rough);
  CHECK(edge_rms(result, truth, tube.triangles) < 0.15 * edges_before);
  // More iterations, no worse.
  CHECK(rms(refined(tube.refiner({.radius = 0.1, .iterations = 20}), rough), truth) < 1.2 * last);
}

TEST_CASE("a small radius follows the positions, a large one keeps the mesh stiff") {
  const Tube tube;
  const Floats stretched = mapped(tube.xyz, [](Vec3d p) { return Vec3d{1.3 * p.x, p.y, p.z}; });
  CHECK(rms(refined(tube.refiner({.radius = 1e-4}), stretched), stretched) < 1e-4);
  const Floats stiff = refined(tube.refiner({.radius = 10, .iterations = 30}), stretched);
  CHECK(edge_rms(stiff, tube.xyz, tube.triangles) < 0.02);
}

TEST_CASE("the radius means the same on a finer mesh") {
  const auto ripple = [](Vec3d p) { return Vec3d{p.x, p.y + 0.03 * std::sin(2 * 3.14159265358979 * p.x / 0.5), p.z}; };
  const auto left_over = [&](const Tube& tube) {
    const Floats rough = mapped(tube.xyz, ripple);
    return rms(refined(tube.refiner({.radius = 0.1}), rough), tube.xyz) / rms(rough, tube.xyz);
  };
  CHECK(left_over(Tube(97, 40)) == doctest::Approx(left_over(Tube())).epsilon(0.1));
}

TEST_CASE("turned positions give the turned result, permuted vertices the permuted one") {
  const Tube tube;
  const Floats rough = with_noise(mapped(tube.xyz, bent), 0.02, 2), result = refined(tube.refiner(), rough);
  const npt::Quaternion turn = npt::Quaternion{}.turned({2, 1, -1});
  const auto move = [&](Vec3d p) { return turn(p) + Vec3d{-3, 0, 5}; };
  CHECK(rms(refined(tube.refiner(), mapped(rough, move)), mapped(result, move)) < 1e-5);

  npt::Random random(3);
  const std::vector<std::uint32_t> order =
      npt::random_permutation(static_cast<std::uint32_t>(tube.xyz.size() / 3), random);
  const std::vector<std::uint32_t> place = npt::inverse_order(order);
  const auto permuted = [&](const Floats& xyz) {
    Floats out;
    for (const std::uint32_t v : order) out.insert(out.end(), {xyz[3 * v], xyz[3 * v + 1], xyz[3 * v + 2]});
    return out;
  };
  std::vector<Triangle> triangles = tube.triangles;
  for (Triangle& t : triangles) t = {place[t[0]], place[t[1]], place[t[2]]};
  CHECK(rms(refined(DetailRefiner(permuted(tube.xyz), triangles), permuted(rough)), permuted(result)) < 1e-6);
}

TEST_CASE("the same bits at every call, in place, and from several threads") {
  const Tube tube;
  const DetailRefiner refiner = tube.refiner();
  const Floats rough = with_noise(mapped(tube.xyz, bent), 0.02, 4), expected = refined(refiner, rough);
  Floats own = rough;
  refiner(own, own);
  CHECK(same_bits(own, expected));
  std::vector<Floats> found(4);
  std::vector<std::thread> threads;
  for (Floats& f : found) threads.emplace_back([&] { f = refined(refiner, rough); });
  for (std::thread& t : threads) t.join();
  for (const Floats& f : found) CHECK(same_bits(f, expected));
}

TEST_CASE("vertices at one point stay together, as along a seam") {
  Tube tube;
  // Every triangle gets vertices of its own.
  Floats soup, target;
  std::vector<Triangle> faces;
  const Floats rough = with_noise(tube.xyz, 0.02, 5);
  for (const Triangle& t : tube.triangles) {
    const auto first = static_cast<std::uint32_t>(soup.size() / 3);
    faces.push_back({first, first + 1, first + 2});
    for (const std::uint32_t v : t)
      for (std::size_t k = 0; k < 3; ++k) {
        soup.push_back(tube.xyz[3 * v + k]);
        target.push_back(rough[3 * v + k]);
      }
  }
  const Floats result = refined(DetailRefiner(soup, faces), target), expected = refined(tube.refiner(), rough);
  for (std::size_t t = 0; t < faces.size(); ++t)
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t k = 0; k < 3; ++k)
        REQUIRE(result[9 * t + 3 * c + k] == doctest::Approx(expected[3 * tube.triangles[t][c] + k]).epsilon(1e-4));
}

TEST_CASE("pieces far apart go their own ways; pieces that lie on each other stay there") {
  Tube tube;
  const std::size_t half = tube.xyz.size();
  const auto count = static_cast<std::uint32_t>(half / 3);
  Floats both = tube.xyz;
  // A sleeve, 0.01 wider.
  for (std::size_t v = 0; v < count; ++v) {
    const double y = tube.xyz[3 * v + 1], z = tube.xyz[3 * v + 2], grown = 1 + 0.01 / std::hypot(y, z);
    both.insert(both.end(), {tube.xyz[3 * v], static_cast<float>(y * grown), static_cast<float>(z * grown)});
  }
  std::vector<Triangle> faces = tube.triangles;
  for (const Triangle& t : tube.triangles) faces.push_back({t[0] + count, t[1] + count, t[2] + count});
  // The sleeve alone is pushed aside.
  Floats target = both;
  for (std::size_t i = half + 1; i < target.size(); i += 3) target[i] += 0.1F;
  const auto gap = [&](const Floats& xyz) {
    double sum = 0;
    for (std::size_t v = 0; v < count; ++v) sum += double{xyz[half + 3 * v + 1]} - double{xyz[3 * v + 1]};
    return sum / count;
  };
  CHECK(gap(refined(DetailRefiner(both, faces, {.link_pieces = false}), target)) == doctest::Approx(0.1).epsilon(0.01));
  CHECK(gap(refined(DetailRefiner(both, faces, {.radius = 0.1}), target)) < 0.01);
}

TEST_CASE("faces without area, edges of three faces, repeated faces, and vertices in no face") {
  Tube tube;
  const auto count = static_cast<std::uint32_t>(tube.xyz.size() / 3);
  tube.triangles.push_back({0, 0, 1});
  tube.triangles.push_back({3, 3, 3});
  tube.triangles.push_back(tube.triangles[5]);
  tube.xyz.insert(tube.xyz.end(), {tube.xyz[0], tube.xyz[1] + 0.3F, tube.xyz[2], 9, 9, 9});
  tube.triangles.push_back({0, 1, count});
  tube.triangles.push_back({0, 1, 2});
  // Three in a line.
  for (const float x : {4.0F, 5.0F, 6.0F}) tube.xyz.insert(tube.xyz.end(), {x, 0, 0});
  tube.triangles.push_back({count + 2, count + 3, count + 4});
  const Floats truth = mapped(tube.xyz, bent);
  Floats rough = with_noise(truth, 0.02, 6);
  const Floats result = refined(tube.refiner({.radius = 0.1}), rough);
  CHECK(std::ranges::all_of(result, [](float x) { return std::isfinite(x); }));
  CHECK(rms(result, truth) < rms(rough, truth));
  for (std::size_t k = 0; k < 3; ++k)  // in no face: as it is put
    CHECK(result[3 * (count + 1) + k] == doctest::Approx(rough[3 * (count + 1) + k]));
}

TEST_CASE("quads, normals and the other meshes of the zoo") {
  npt::Mesh cube = zoo::hard_cube();
  const DetailRefiner refiner(cube);
  npt::Mesh turned = cube;
  for (Vec3f& p : turned.positions) p = {-p.y, p.x, p.z};
  npt::Mesh result = turned;
  refiner(result);
  for (std::size_t v = 0; v < 8; ++v) CHECK(npt::length(result.positions[v] - turned.positions[v]) < 1e-6F);
  CHECK(npt::length(result.normals[4] - Vec3f{0, -1, 0}) < 1e-5F);  // the face that looked along -x
  const npt::Mesh mixed = zoo::mixed();
  CHECK_NOTHROW(DetailRefiner{mixed});
}

TEST_CASE("what can't be refined is an error that says so") {
  const Tube tube;
  CHECK_THROWS_WITH_AS(DetailRefiner(tube.xyz, {}),
                       "mesh to refine: found no faces, expected a mesh with a surface, to keep its detail",
                       npt::Error);
  CHECK_THROWS_WITH_AS(DetailRefiner(zoo::cloud(), {}, "cloud.ply"),
                       "cloud.ply: found no faces, expected a mesh with a surface, to keep its detail", npt::Error);
  const Floats line{0, 0, 0, 1, 0, 0, 2, 0, 0};
  CHECK_THROWS_WITH_AS(DetailRefiner(line, std::vector<Triangle>{{0, 1, 2}}),
                       "mesh to refine: found no face with an area, expected a mesh with a surface, to keep its detail",
                       npt::Error);
  CHECK_THROWS_AS(DetailRefiner(line, std::vector<Triangle>{{0, 1, 3}}), npt::Error);
  CHECK_THROWS_AS(DetailRefiner(Floats{}, {}), npt::Error);
  Floats broken = tube.xyz;
  broken[7] = std::numeric_limits<float>::quiet_NaN();
  CHECK_THROWS_AS(DetailRefiner(broken, tube.triangles), npt::Error);
  for (const double radius : {0.0, -1.0, 11.0, std::numeric_limits<double>::quiet_NaN()})
    CHECK_THROWS_AS(tube.refiner({.radius = radius}), npt::Error);
  CHECK_THROWS_AS(tube.refiner({.iterations = 0}), npt::Error);
  const DetailRefiner refiner = tube.refiner();
  Floats result(9);
  CHECK_THROWS_WITH_AS(refiner(line, result),
                       "positions to refine: found 3 vertices, expected 980, as many as the mesh has", npt::Error);
}

TEST_CASE("NaN in a position comes out, and nothing hangs") {
  const Tube tube;
  Floats rough = tube.xyz;
  rough[100] = std::numeric_limits<float>::quiet_NaN();
  CHECK(std::isnan(refined(tube.refiner(), rough)[100]));
  rough[100] = std::numeric_limits<float>::infinity();
  CHECK_FALSE(std::isfinite(refined(tube.refiner(), rough)[100]));
}

TEST_CASE("all in one point, and meshes very small, very large and far away") {
  const Tube tube;
  const Floats point(tube.xyz.size(), 2.0F), collapsed = refined(tube.refiner(), point);
  CHECK(std::ranges::all_of(collapsed, [](float x) { return std::isfinite(x); }));
  const Floats rough = with_noise(mapped(tube.xyz, bent), 0.02, 7), expected = refined(tube.refiner(), rough);
  for (const float scale : {1e-15F, 1e15F}) {
    const auto scaled = [scale](Floats xyz) {
      for (float& x : xyz) x *= scale;
      return xyz;
    };
    const Floats result = refined(DetailRefiner(scaled(tube.xyz), tube.triangles), scaled(rough));
    CHECK(rms(result, scaled(expected)) < 1e-5 * double{scale});
  }
}
