#include <doctest/doctest.h>

#include <io/scratch.hpp>
#include <mesh/shapes.hpp>
#include <npt/base/thread_executor.hpp>
#include <npt/baseline/deformation/deformation_gradient.hpp>
#include <npt/baseline/deformation/deformation_transfer.hpp>

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace {

using npt::Matrix3;
using npt::Mesh;
using npt::Vec3d;
using npt::Vec3f;

std::vector<npt::TrianglePair> all_pairs(const Mesh& mesh) {
  return npt::identical_pairs(npt::triangulate(mesh).size());
}

std::vector<float> transferred(const npt::DeformationTransfer& transfer, std::span<const float> pose) {
  std::vector<float> result(3 * transfer.target_vertex_count());
  transfer(pose, result);
  return result;
}

Matrix3 some_rotation() {
  const double c = std::cos(0.7), s = std::sin(0.7);
  const Matrix3 z{{{{c, -s, 0}, {s, c, 0}, {0, 0, 1}}}}, x{{{{1, 0, 0}, {0, c, -s}, {0, s, c}}}};
  return z * x;
}

std::vector<float> mapped(const Mesh& mesh, const Matrix3& map, Vec3d shift = {}) {
  std::vector<float> xyz;
  for (const Vec3f p : mesh.positions) {
    const Vec3d q = map * p.as<double>() + shift;
    for (const double x : {q.x, q.y, q.z}) xyz.push_back(static_cast<float>(x));
  }
  return xyz;
}

Vec3d centre(std::span<const float> xyz) {
  Vec3d sum;
  for (const Vec3d p : shapes::points_of(xyz)) sum += p;
  return sum / static_cast<double>(xyz.size() / 3);
}

/// v4 of a triangle by the definition.
Vec3d fourth_vertex(Vec3d a, Vec3d b, Vec3d c) {
  const Vec3d n = cross(b - a, c - a);
  return a + n / std::sqrt(length(n));
}

/// Equal but for the place.
double distance_in_shape(std::vector<float> a, std::span<const float> b) {
  const Vec3d shift = centre(b) - centre(a);
  for (std::size_t i = 0; i < a.size(); ++i)
    a[i] += static_cast<float>(i % 3 == 0 ? shift.x : i % 3 == 1 ? shift.y : shift.z);
  return shapes::distance(a, b);
}

}  // namespace

TEST_CASE("a triangle's gradient is the map that it was deformed by, and grows with the root of the area") {
  const Vec3d a{0.1, 0.2, 0.3}, b{1.3, 0.1, 0.2}, c{0.4, 0.9, -0.5};
  const npt::RestTriangle rest(a, b, c);
  CHECK((rest.gradient(a, b, c) - Matrix3::identity()).squared_norm() < 1e-28);
  const Matrix3 turn = some_rotation();
  CHECK((rest.gradient(turn * a, turn * b, turn * c) - turn).squared_norm() < 1e-28);
  CHECK((rest.gradient(a * 2.5, b * 2.5, c * 2.5) - Matrix3::identity() * 2.5).squared_norm() < 1e-26);
  // The fourth vertex of the definition gives the same.
  const Vec3d d{2, 1, 0}, e{3, 3, 1}, f{0, 2, 2};
  CHECK((rest.gradient(d, e, f) - rest.gradient(d, e, f, fourth_vertex(d, e, f))).squared_norm() < 1e-26);
  const Matrix3 q = rest.gradient(d, e, f);
  CHECK(length(q * (b - a) - (e - d)) < 1e-13);
  CHECK(length(q * (c - a) - (f - d)) < 1e-13);
  CHECK(length(q * (fourth_vertex(a, b, c) - a) - (fourth_vertex(d, e, f) - d)) < 1e-13);
  // Squeezed to a line it keeps its sides.
  const Matrix3 line = rest.gradient({0, 0, 0}, {1, 0, 0}, {2, 0, 0});
  CHECK(length(line * (c - a) - Vec3d{2, 0, 0}) < 1e-13);
  CHECK(npt::is_flat({0, 0, 0}, {1, 0, 0}, {2, 0, 0}));
  CHECK(npt::is_flat({1, 1, 1}, {1, 1, 1}, {1, 1, 1}));
  CHECK(npt::is_flat({0, 0, 0}, {1, 0, 0}, {0.5, 9e-5, 0}));
  CHECK(!npt::is_flat({0, 0, 0}, {1, 0, 0}, {0.5, 2e-4, 0}));
}

TEST_CASE("a target that is the source follows it exactly; the undeformed source gives the target back") {
  const Mesh source = shapes::starfish(20, 30), target = shapes::starfish(20, 30, 0.4);
  const npt::DeformationTransfer same(source, source, all_pairs(source)), other(source, target, all_pairs(source));
  const std::vector<float> pose = shapes::bent(source, 0.8);
  CHECK(shapes::distance(transferred(same, pose), pose) < 3e-6);  // its size is 3: 1e-6 of it
  CHECK(shapes::distance(transferred(other, source.coordinates()), target.coordinates()) < 3e-7);
  CHECK(shapes::distance(transferred(other, pose), target.coordinates()) > 0.1);
}

TEST_CASE("an affine source makes an affine target, in the place that the source's way says") {
  const Mesh source = shapes::starfish(10, 14), target = shapes::moved(shapes::starfish(10, 14, 0.3), {5, 0, 0}, 2);
  const Mesh twice = shapes::moved(source, {5, 0, 0}, 2);
  const npt::DeformationTransfer transfer(source, target, all_pairs(source));
  const Matrix3 turn = some_rotation();
  const std::vector<float> turned = transferred(transfer, mapped(source, turn, {1, 2, 3}));
  CHECK(distance_in_shape(turned, mapped(target, turn)) < 1e-5);
  // Within the source triangles' planes any affine map; perpendicular to them the fourth vertex decides.
  const Matrix3 skewed = turn * Matrix3{{{{1.5, 0.2, 0}, {0, 0.7, 0}, {0.1, 0, 1}}}};
  const npt::DeformationTransfer doubled(source, twice, all_pairs(source));
  CHECK(distance_in_shape(transferred(doubled, mapped(source, skewed)), mapped(twice, skewed)) < 1e-5);
  // A source that walks away takes the target along, by its own size.
  const std::vector<float> walked = transferred(transfer, mapped(source, Matrix3::identity(), {1, 0, 0}));
  const double way = centre(walked).x - centre(target.coordinates()).x;
  CHECK(way > 1.8);
  CHECK(way < 2.7);
  CHECK(distance_in_shape(walked, target.coordinates()) < 1e-5);
}

TEST_CASE("the system without fourth vertices has the solution of the system with them") {
  const Mesh source = shapes::starfish(9, 12), target = shapes::starfish(9, 12, 0.5);
  std::vector<npt::TrianglePair> pairs = all_pairs(source);
  npt::Random random(4);  // some triangles several times, with wrong partners
  for (int i = 0; i < 40; ++i) pairs.push_back({random.below(190), random.below(190)});
  const std::vector<float> pose = shapes::bent(source, 1.1);
  const std::vector<float> result = transferred(npt::DeformationTransfer(source, target, pairs), pose);

  const auto triangles = npt::triangulate(target);
  const std::vector<Vec3d> rest = shapes::points_of(source.coordinates()), posed = shapes::points_of(pose),
                           own = shapes::points_of(target.coordinates());
  const auto vertices = static_cast<std::uint32_t>(own.size());
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  std::vector<npt::SymmetricEntry> entries{{0, 0, 1}};  // vertex 0 at the origin
  std::vector<Vec3d> x(vertices + triangles.size());
  for (const auto& [s, t] : pairs) {
    const auto [a, b, c] = triangles[s];  // the same faces in both
    const Matrix3 gradient = npt::RestTriangle(rest[a], rest[b], rest[c]).gradient(posed[a], posed[b], posed[c]);
    const npt::RestTriangle shape(own[triangles[t][0]], own[triangles[t][1]], own[triangles[t][2]]);
    const std::array<std::uint32_t, 4> unknowns{triangles[t][0], triangles[t][1], triangles[t][2], vertices + t};
    for (std::size_t i = 0; i < 4; ++i) {
      x[unknowns[i]] += gradient * shape.slopes[i];
      for (std::size_t k = 0; k <= i; ++k)
        entries.push_back({unknowns[i], unknowns[k], dot(shape.slopes[i], shape.slopes[k])});
    }
  }
  npt::SparseCholesky(x.size(), entries).solve(x);
  std::vector<float> expected;
  for (std::size_t v = 0; v < vertices; ++v)
    for (const double k : {x[v].x, x[v].y, x[v].z}) expected.push_back(static_cast<float>(k));
  CHECK(distance_in_shape(result, expected) < 3e-6);
  CHECK(distance_in_shape(result, target.coordinates()) > 0.1);
}

TEST_CASE("the executor changes no bit") {
  const Mesh source = shapes::starfish(40, 60), target = shapes::starfish(40, 60, 0.2);
  const npt::DeformationTransfer transfer(source, target, all_pairs(source));
  const std::vector<float> pose = shapes::bent(source, 0.5), serial = transferred(transfer, pose);
  std::vector<float> result(serial.size());
  transfer(pose, result, npt::ThreadExecutor(2));
  CHECK(result == serial);
}

TEST_CASE("a target that faces another way deforms in its own directions") {
  const Mesh source = shapes::starfish(12, 16);
  const Matrix3 turn = some_rotation();
  Mesh target = source;
  const std::vector<float> turned = mapped(source, turn);
  std::copy(turned.begin(), turned.end(), target.coordinates().begin());
  npt::DeformationTransferOptions options;
  options.turn = turn;
  const npt::DeformationTransfer transfer(source, target, all_pairs(source), options);
  const std::vector<float> pose = shapes::bent(source, 0.8);
  Mesh posed = source;
  std::copy(pose.begin(), pose.end(), posed.coordinates().begin());
  CHECK(distance_in_shape(transferred(transfer, pose), mapped(posed, turn)) < 3e-6);
}

TEST_CASE("bad meshes: every vertex gets a place, pieces stay together") {
  const Mesh source = shapes::bad_mesh(), target = shapes::bad_mesh(0.3);
  const npt::DeformationTransfer transfer(source, target, all_pairs(source)), same(source, source, all_pairs(source));
  CHECK(shapes::distance(transferred(transfer, source.coordinates()), target.coordinates()) < 1e-6);
  const std::vector<float> pose = shapes::bent(source, 0.8);
  const std::vector<float> result = transferred(transfer, pose);
  for (const float x : result) REQUIRE(std::isfinite(x));
  // What hangs together follows exactly; the rest keeps to the triangle that it is next to.
  const std::vector<float> followed = transferred(same, pose);
  CHECK(shapes::distance(followed, pose) < 0.6);  // the vertex far outside
  for (std::size_t c = 0; c < 3 * 500; ++c) {
    const std::size_t v = 3 * std::size_t{source.corners[c]};
    REQUIRE(shapes::distance(std::span(followed).subspan(v, 3), std::span(pose).subspan(v, 3)) < 3e-6);
  }
}

TEST_CASE("vertices that coincide in rest stay together unless told otherwise") {
  // Two halves whose border vertices are there twice.
  const Mesh whole = shapes::starfish(12, 16);
  Mesh split;
  split.face_start.push_back(0);
  for (std::size_t c = 0; c < whole.corners.size(); ++c) {  // no vertex is shared at all
    split.positions.push_back(whole.positions[whole.corners[c]]);
    split.corners.push_back(static_cast<std::uint32_t>(c));
    if (c % 3 == 2) split.face_start.push_back(c + 1);
  }
  const Mesh source = shapes::starfish(12, 16, 0.4);
  const std::vector<float> pose = shapes::bent(source, 0.9);
  const std::vector<float> expected = transferred(npt::DeformationTransfer(source, whole, all_pairs(whole)), pose);
  const auto distance_of_split = [&](bool weld) {
    npt::DeformationTransferOptions options;
    options.weld = weld;
    const auto result = transferred(npt::DeformationTransfer(source, split, all_pairs(whole), options), pose);
    double worst = 0;
    for (std::size_t c = 0; c < split.corners.size(); ++c)
      worst = std::max(worst, shapes::distance(std::span(result).subspan(3 * c, 3),
                                               std::span(expected).subspan(3 * std::size_t{whole.corners[c]}, 3)));
    return worst;
  };
  CHECK(distance_of_split(true) < 1e-6);
  CHECK(distance_of_split(false) > 0.01);
}

TEST_CASE("triangles without a pair take their neighbour's") {
  const Mesh mesh = shapes::starfish(20, 30);
  std::vector<npt::TrianglePair> pairs = all_pairs(mesh);
  std::erase_if(pairs, [](const npt::TrianglePair& p) { return p.target % 3 != 0; });
  const std::vector<float> pose = shapes::bent(mesh, 0.8);
  CHECK(shapes::distance(transferred(npt::DeformationTransfer(mesh, mesh, pairs), pose), pose) < 0.2);
}

TEST_CASE("what can't be transferred is an error that says why; a NaN comes out") {
  const Mesh mesh = shapes::starfish(6, 8);
  const auto pairs = all_pairs(mesh);
  using Pairs = std::vector<npt::TrianglePair>;
  const auto error = [&](const Mesh& source, const Mesh& target, const Pairs& list) {
    return scratch::error_of([&] { npt::DeformationTransfer(source, target, list); });
  };
  CHECK(error(mesh, mesh, pairs) == "no error");
  CHECK(error(mesh, mesh, {}).find("triangle pairs") != std::string::npos);
  CHECK(error(mesh, mesh, {{999, 0}}).find("source triangle 999") != std::string::npos);
  CHECK(error(mesh, mesh, {{0, 999}}).find("target triangle 999") != std::string::npos);
  Mesh cloud;
  cloud.positions.resize(4);
  CHECK(error(cloud, mesh, pairs).find("source: found no faces") != std::string::npos);
  CHECK(error(mesh, cloud, pairs).find("target: found no faces") != std::string::npos);
  CHECK(error(mesh, shapes::moved(mesh, {}, 0), pairs).find("without an area") != std::string::npos);
  Mesh nan = mesh;
  nan.positions[3].x = std::numeric_limits<float>::quiet_NaN();
  CHECK(error(nan, mesh, pairs).find("finite") != std::string::npos);
  CHECK(error(mesh, Mesh{}, pairs).find("no vertices") != std::string::npos);

  const npt::DeformationTransfer transfer(mesh, mesh, pairs);
  CHECK(scratch::error_of([&] { npt::deform(transfer, mesh, shapes::starfish(6, 9)); }).find("deformed source") !=
        std::string::npos);
  CHECK(scratch::error_of([&] { npt::deform(transfer, shapes::starfish(6, 9), mesh); }).find("target") !=
        std::string::npos);
  for (const float x : transferred(transfer, nan.coordinates())) REQUIRE(std::isnan(x));
}
