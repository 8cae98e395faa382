/// Meshes at random, bad in every way that the reader lets through: deformation transfer gives a result or says why
/// not.
#include <doctest/doctest.h>

#include <mesh/shapes.hpp>
#include <npt/baseline/deformation/correspondence.hpp>
#include <npt/baseline/deformation/deformation_transfer.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

namespace {

using npt::Mesh;
using npt::Random;
using npt::Vec3f;

/// Triangles between any points, which lie on each other, on a plane or grid, or far apart.
Mesh soup(Random& random) {
  Mesh mesh;
  const bool grid = random.below(2) == 0;
  const std::uint32_t points = 3 + random.below(40);
  for (std::uint32_t i = 0; i < points; ++i) {
    const double size = random.below(3) == 0 ? 1e-3 : 1;
    Vec3f p = npt::Vec3d{random.normal() * size, random.normal() * size, random.normal() * size}.as<float>();
    if (i > 0 && random.below(6) == 0) p = mesh.positions[random.below(i)];
    if (grid) p = {std::round(2 * p.x) / 2, std::round(2 * p.y) / 2, std::round(p.z)};
    mesh.positions.push_back(p);
  }
  mesh.face_start.push_back(0);
  for (std::uint32_t f = random.below(60); f < 60; ++f)
    shapes::add_face(mesh, {random.below(points), random.below(points), random.below(points)});
  return mesh;
}

Mesh some_mesh(Random& random) {
  const std::uint32_t kind = random.below(4);
  Mesh mesh = kind == 0   ? shapes::starfish(4 + random.below(6), 4 + random.below(6), random.uniform())
              : kind == 1 ? shapes::bad_mesh(random.uniform())
                          : soup(random);
  const auto vertices = static_cast<std::uint32_t>(mesh.vertex_count());
  for (std::uint32_t i = random.below(5); i > 0; --i)
    mesh.corners[random.below(static_cast<std::uint32_t>(mesh.corners.size()))] = random.below(vertices);
  const auto scale = static_cast<float>(random.below(3) == 0 ? std::pow(10.0, random.uniform(-6, 6)) : 1);
  const Vec3f shift{random.below(4) == 0 ? 100.0F : 0.0F, 0, 0};
  const bool flat = random.below(6) == 0;
  for (Vec3f& p : mesh.positions) p = Vec3f{p.x, p.y, flat ? 0 : p.z} * scale + shift;
  return mesh;
}

double extent(const Mesh& mesh) {
  double most = 0;
  for (const Vec3f p : mesh.positions) most = std::max(most, length(p.as<double>()));
  return most;
}

}  // namespace

TEST_CASE("any mesh: finite results, the undeformed source gives the target back, or an error in the user's words") {
  int results = 0;
  for (std::uint64_t i = 0; i < 150; ++i) {
    Random random(77, i);
    const Mesh source = some_mesh(random), target = some_mesh(random);
    std::vector<npt::Marker> markers(1 + random.below(8));
    for (npt::Marker& marker : markers)
      marker = {random.below(static_cast<std::uint32_t>(source.vertex_count())),
                random.below(static_cast<std::uint32_t>(target.vertex_count()))};
    npt::CorrespondenceOptions options;
    options.weld = random.below(4) != 0;
    npt::DeformationTransferOptions transfer_options;
    transfer_options.weld = options.weld;
    CAPTURE(i);
    try {
      const npt::Correspondence found = npt::find_correspondence(source, target, markers, options);
      CHECK(std::ranges::all_of(found.registered, [](Vec3f p) { return npt::is_finite(p); }));
      const npt::DeformationTransfer transfer(source, target, found.pairs, transfer_options);
      std::vector<float> result(3 * target.vertex_count());
      transfer(source.coordinates(), result);
      CHECK(shapes::distance(result, target.coordinates()) < 1e-4 * extent(target));
      transfer(shapes::bent(source, 0.5), result);
      CHECK(std::ranges::all_of(result, [](float x) { return std::isfinite(x); }));
      ++results;
    } catch (const npt::Error& error) {
      const std::string what = error.what();
      const bool known = what.starts_with("markers") || what.starts_with("source") || what.starts_with("target");
      CHECK_MESSAGE(known, what);
    }
  }
  CHECK(results > 70);
}

TEST_CASE("one marker: the sizes come from the bounding boxes; a mesh inside out is named as that") {
  const Mesh source = shapes::starfish(12, 16), target = shapes::moved(shapes::starfish(12, 16, 0.1), {3, 0, 0}, 1000);
  const auto found = npt::find_correspondence(source, target, std::vector<npt::Marker>{{0, 0}});
  CHECK(found.similarity.scale > 900);
  CHECK(found.similarity.scale < 1300);
  double worst = 0;
  for (std::size_t v = 0; v < found.registered.size(); ++v)
    worst = std::max(worst, length(found.registered[v].as<double>() - target.positions[v].as<double>()));
  CHECK(worst < 300);

  Mesh inside_out = shapes::mesh_of({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 2, 1}});
  const Mesh triangle = shapes::mesh_of({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}});
  CHECK_THROWS_WITH(npt::find_correspondence(inside_out, triangle, std::vector<npt::Marker>{{0, 0}, {1, 1}, {2, 2}}),
                    doctest::Contains("face the same way"));
}

TEST_CASE("slivers and faces of all sizes: the undeformed source still gives the target back") {
  Mesh mesh = shapes::starfish(16, 24);
  Random random(5);
  for (int i = 0; i < 30; ++i) {  // a vertex on a side, off by anything from nothing to a little
    const std::size_t f = random.below(static_cast<std::uint32_t>(mesh.face_count()));
    const std::uint32_t a = mesh.corners[3 * f], b = mesh.corners[3 * f + 1], c = mesh.corners[3 * f + 2];
    const auto v = static_cast<std::uint32_t>(mesh.vertex_count());
    const Vec3f middle = (mesh.positions[a] + mesh.positions[b]) / 2;
    mesh.positions.push_back(middle +
                             (mesh.positions[c] - middle) * static_cast<float>(std::pow(10.0, random.uniform(-8, -1))));
    mesh.corners[3 * f + 1] = v;
    shapes::add_face(mesh, {v, b, c});
    shapes::add_face(mesh, {a, b, v});
  }
  const npt::DeformationTransfer transfer(mesh, mesh, npt::identical_pairs(mesh.face_count()));
  std::vector<float> result(3 * mesh.vertex_count());
  transfer(mesh.coordinates(), result);
  CHECK(shapes::distance(result, mesh.coordinates()) < 1e-6);
  const std::vector<float> pose = shapes::bent(mesh, 0.8);
  transfer(pose, result);
  CHECK(shapes::distance(result, pose) < 1e-3);
}
