#include <doctest/doctest.h>

#include <npt/core/error.hpp>
#include <npt/mesh/permute.hpp>
#include <npt/transfer/transfer.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <initializer_list>
#include <tuple>
#include <vector>

#include "support/nets.hpp"

namespace {

/// A bumpy sphere: rings of quads closed by two triangle fans. Coincident vertices on request, as along a seam.
npt::Mesh bumpy_sphere(std::size_t rings, std::size_t sectors, double bump, bool seam = false) {
  npt::Mesh mesh;
  const auto add_face = [&mesh](std::initializer_list<std::uint32_t> corners) {
    if (mesh.face_start.empty()) mesh.face_start.push_back(0);
    mesh.corners.insert(mesh.corners.end(), corners);
    mesh.face_start.push_back(mesh.corners.size());
  };
  for (std::size_t r = 0; r <= rings; ++r)
    for (std::size_t s = 0; s < sectors; ++s) {
      const double theta = 3.14159265358979 * (static_cast<double>(r) + 0.5) / (static_cast<double>(rings) + 1);
      const std::size_t turn = seam && s + 1 == sectors ? 0 : s;  // the last sector lies on the first
      const double phi = 6.28318530717959 * static_cast<double>(turn) / static_cast<double>(sectors);
      const double radius = 1 + bump * std::sin(3 * phi) * std::sin(2 * theta + 0.3);
      mesh.positions.push_back({static_cast<float>(radius * std::sin(theta) * std::cos(phi) + 3),
                                static_cast<float>(1.7 * radius * std::cos(theta) - 1),
                                static_cast<float>(radius * std::sin(theta) * std::sin(phi) + 0.5)});
    }
  for (std::size_t r = 0; r < rings; ++r)
    for (std::size_t s = 0; s < sectors; ++s) {
      const auto at = [&](std::size_t ring, std::size_t sector) {
        return static_cast<std::uint32_t>(ring * sectors + sector % sectors);
      };
      add_face({at(r, s), at(r, s + 1), at(r + 1, s + 1), at(r + 1, s)});
    }
  return mesh;
}

template <class Net>
npt::Engine<Net> random_engine() {
  npt::Model<Net> model;
  npt::randomise(model, 8);
  return npt::Engine<Net>(model, 1);
}

using Paired = npt::PoseTransferNet<16>;
using Pooled = npt::PoseTransferNet<16, npt::ConvRelu, npt::Pooled>;

bool same_bits(const std::vector<npt::Vec3f>& a, const std::vector<npt::Vec3f>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(npt::Vec3f)) == 0;
}

std::vector<std::uint32_t> random_order(const npt::Mesh& mesh, std::uint64_t seed) {
  npt::Random random(seed);
  return npt::random_permutation(static_cast<std::uint32_t>(mesh.vertex_count()), random);
}

/// The invariant mode's promise, for meshes given in any order.
template <class Net>
void check_invariance(const npt::Mesh& identity, const npt::Mesh& pose) {
  const auto engine = random_engine<Net>();
  for (const auto normalisation : {npt::Normalisation::sphere, npt::Normalisation::centre, npt::Normalisation::none}) {
    const npt::TransferOptions options{.normalisation = normalisation, .seed = 5, .invariant = true};
    const npt::Mesh expected = npt::transfer(engine, identity, pose, options);
    for (const std::uint64_t seed : std::initializer_list<std::uint64_t>{1, 2, 3}) {
      const auto order = random_order(identity, seed);
      const npt::Mesh found = npt::transfer(engine, npt::permute_vertices(identity, order),
                                            npt::permute_vertices(pose, random_order(pose, seed + 10)), options);
      CHECK(same_bits(npt::permute_vertices(expected, order).positions, found.positions));
    }
  }
}

}  // namespace

TEST_CASE("the result has the identity's faces, order, attributes and count") {
  npt::Mesh identity = bumpy_sphere(9, 14, 0.2);
  identity.tags.push_back({.face = 3, .keyword = "usemtl", .value = "skin"});
  const npt::Mesh pose = bumpy_sphere(9, 14, 0.4);
  const npt::Mesh result = npt::transfer(random_engine<Paired>(), identity, pose);
  CHECK(result.vertex_count() == identity.vertex_count());
  CHECK(result.corners == identity.corners);
  CHECK(result.face_start == identity.face_start);
  CHECK(result.tags.size() == 1);
  CHECK(result.normals.empty());
  CHECK_FALSE(same_bits(result.positions, identity.positions));
}

TEST_CASE("normals are recomputed if the identity had them") {
  npt::Mesh identity = bumpy_sphere(9, 14, 0.2);
  identity.normals.assign(identity.vertex_count(), {0, 0, 1});
  const npt::Mesh result = npt::transfer(random_engine<Paired>(), identity, bumpy_sphere(9, 14, 0.4));
  REQUIRE(result.normals.size() == identity.vertex_count());
  const auto expected = npt::vertex_normals(result);
  for (std::size_t v = 0; v < expected.size(); ++v) CHECK(npt::length(result.normals[v] - expected[v]) < 1e-5F);
}

TEST_CASE("the plain mode is the network on vertices as they come, mapped back to the identity's frame") {
  const npt::Mesh identity = bumpy_sphere(9, 14, 0.2), pose = bumpy_sphere(9, 14, 0.4);
  const auto engine = random_engine<Paired>();
  for (const auto normalisation : {npt::Normalisation::sphere, npt::Normalisation::centre, npt::Normalisation::none}) {
    const npt::Mesh result = npt::transfer(engine, identity, pose, {.normalisation = normalisation});
    const npt::NormalisingTransform of_identity = npt::normalising_transform(identity.coordinates(), normalisation);
    const npt::NormalisingTransform of_pose = npt::normalising_transform(pose.coordinates(), normalisation);
    std::vector<float> a(3 * pose.vertex_count()), b(a.size()), c(a.size());
    of_pose.apply(pose.coordinates(), a);
    of_identity.apply(identity.coordinates(), b);
    engine(a, b, c);
    of_identity.apply_inverse(c, c);
    CHECK(std::memcmp(c.data(), result.positions.data(), c.size() * sizeof(float)) == 0);
  }
}

TEST_CASE("moving and scaling the meshes moves and scales the result as the identity") {
  const npt::Mesh identity = bumpy_sphere(9, 14, 0.2), pose = bumpy_sphere(9, 14, 0.4);
  const auto engine = random_engine<Paired>();
  const npt::TransferOptions options{.normalisation = npt::Normalisation::sphere};
  const npt::Mesh expected = npt::transfer(engine, identity, pose, options);
  npt::Mesh far_identity = identity, far_pose = pose;
  for (auto& p : far_identity.positions) p = p * 100.0F + npt::Vec3f{10, 20, 30};
  for (auto& p : far_pose.positions) p = p * 0.5F - npt::Vec3f{1, 2, 3};
  const npt::Mesh found = npt::transfer(engine, far_identity, far_pose, options);
  for (std::size_t v = 0; v < expected.vertex_count(); ++v)
    CHECK(npt::length(found.positions[v] - (expected.positions[v] * 100.0F + npt::Vec3f{10, 20, 30})) < 0.05F);
}

TEST_CASE("in the invariant mode permuting either mesh permutes the result bit for bit") {
  SUBCASE("equal counts") { check_invariance<Paired>(bumpy_sphere(9, 14, 0.2), bumpy_sphere(9, 14, 0.4)); }
  SUBCASE("coincident vertices") {
    check_invariance<Paired>(bumpy_sphere(9, 14, 0.2, true), bumpy_sphere(9, 14, 0.4, true));
  }
  SUBCASE("another count: the pose is resampled") {
    check_invariance<Paired>(bumpy_sphere(9, 14, 0.2), bumpy_sphere(6, 11, 0.4));
  }
  SUBCASE("a pose without faces") {
    npt::Mesh cloud = bumpy_sphere(6, 11, 0.4);
    cloud.face_start.clear();
    cloud.corners.clear();
    check_invariance<Paired>(bumpy_sphere(9, 14, 0.2), cloud);
  }
  SUBCASE("the pooled feature") { check_invariance<Pooled>(bumpy_sphere(9, 14, 0.2), bumpy_sphere(6, 11, 0.4)); }
}

TEST_CASE("coincident vertices stay together in the invariant mode") {
  const npt::Mesh identity = bumpy_sphere(9, 14, 0.2, true);
  const npt::Mesh result =
      npt::transfer(random_engine<Paired>(), identity, bumpy_sphere(9, 14, 0.4), {.invariant = true});
  for (std::size_t r = 0; r <= 9; ++r) CHECK(result.positions[14 * r] == result.positions[14 * r + 13]);
}

TEST_CASE("the plain mode depends on the order of paired vertices, the pooled feature hardly") {
  const npt::Mesh identity = bumpy_sphere(9, 14, 0.2), pose = bumpy_sphere(9, 14, 0.4);
  const npt::Mesh shuffled = npt::permute_vertices(pose, random_order(pose, 4));
  const auto largest = [&](const auto& engine) {
    const npt::Mesh a = npt::transfer(engine, identity, pose), b = npt::transfer(engine, identity, shuffled);
    float worst = 0;
    for (std::size_t v = 0; v < a.vertex_count(); ++v)
      worst = std::max(worst, npt::length(a.positions[v] - b.positions[v]));
    return worst;
  };
  CHECK(largest(random_engine<Paired>()) > 1e-3F);
  CHECK(largest(random_engine<Pooled>()) < 1e-4F);  // moments are summed in another order
}

TEST_CASE("resampling is seeded, and may be forbidden") {
  const npt::Mesh identity = bumpy_sphere(9, 14, 0.2), pose = bumpy_sphere(6, 11, 0.4);
  const auto engine = random_engine<Paired>();
  CHECK(same_bits(npt::transfer(engine, identity, pose, {.seed = 3}).positions,
                  npt::transfer(engine, identity, pose, {.seed = 3}).positions));
  CHECK_FALSE(same_bits(npt::transfer(engine, identity, pose, {.seed = 3}).positions,
                        npt::transfer(engine, identity, pose, {.seed = 4}).positions));
  CHECK_THROWS_WITH_AS(npt::transfer(engine, identity, pose, {.resample = false}),
                       "pose: found 77 vertices, expected 140, as many as the identity has (or resampling, or weights "
                       "with the pooled feature)",
                       npt::Error);
  CHECK_NOTHROW(npt::transfer(random_engine<Pooled>(), identity, pose, {.resample = false}));
}

TEST_CASE("empty meshes and meshes in one point are errors") {
  const npt::Mesh good = bumpy_sphere(9, 14, 0.2);
  npt::Mesh point = good;
  for (auto& p : point.positions) p = {1, 2, 3};
  const auto engine = random_engine<Paired>();
  CHECK_THROWS_AS(npt::transfer(engine, npt::Mesh{}, good), npt::Error);
  CHECK_THROWS_AS(npt::transfer(engine, good, npt::Mesh{}), npt::Error);
  for (const auto normalisation : {npt::Normalisation::sphere, npt::Normalisation::centre, npt::Normalisation::none}) {
    CHECK_THROWS_WITH_AS(npt::transfer(engine, point, good, {.normalisation = normalisation}),
                         "identity: found all vertices in one point, expected a mesh with an extent", npt::Error);
    CHECK_THROWS_WITH_AS(npt::transfer(engine, good, point, {.normalisation = normalisation}),
                         "pose: found all vertices in one point, expected a mesh with an extent", npt::Error);
  }
}

TEST_CASE("an average over pairings is the mean of its runs, each a pairing of its own") {
  const npt::Mesh identity = bumpy_sphere(9, 14, 0.2);
  const auto engine = random_engine<Paired>();
  for (const npt::Mesh& pose : {bumpy_sphere(9, 14, 0.4), bumpy_sphere(6, 11, 0.4)})
    for (const bool invariant : {false, true}) {
      npt::TransferOptions options{.seed = 3, .invariant = invariant};
      const npt::Mesh one = npt::transfer(engine, identity, pose, options);
      options.pairings = 3;
      const auto pairings = npt::choose_pairings(pose.coordinates(), npt::triangulate(pose), 140, options);
      REQUIRE(pairings.size() == 3);
      const npt::IdentityInput input = npt::identity_input(identity.coordinates(), options);
      std::vector<std::vector<float>> runs;
      for (const npt::PosePoints& pairing : pairings) {
        runs.emplace_back(input.coordinates.size());
        engine(npt::pose_input(pose.coordinates(), pairing, options), input.coordinates, runs.back());
        if (pose.vertex_count() != 140) continue;
        std::vector<npt::Vec3f> points = npt::positions_of(pairing.points, pose.coordinates()), all = pose.positions;
        if (pairing.points.empty()) points = all;
        const auto less = [](npt::Vec3f a, npt::Vec3f b) { return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z); };
        std::ranges::sort(points, less);
        std::ranges::sort(all, less);
        CHECK(same_bits(points, all));  // each vertex once
      }
      CHECK(runs[1] != runs[0]);
      CHECK(runs[2] != runs[1]);
      std::vector<float> mean(runs[0].size()), restored(mean.size());
      for (std::size_t i = 0; i < mean.size(); ++i)
        mean[i] = static_cast<float>((double{runs[0][i]} + runs[1][i] + runs[2][i]) / 3);
      npt::restore(input, mean, restored);
      const npt::Mesh found = npt::transfer(engine, identity, pose, options);
      CHECK(std::memcmp(restored.data(), found.positions.data(), restored.size() * sizeof(float)) == 0);
      npt::restore(input, runs[0], restored);
      CHECK(std::memcmp(restored.data(), one.positions.data(), restored.size() * sizeof(float)) == 0);
    }
}

TEST_CASE("averaging keeps the invariant mode's promise, and steadies the plain mode") {
  const npt::Mesh identity = bumpy_sphere(9, 14, 0.2), pose = bumpy_sphere(6, 11, 0.4);
  const auto engine = random_engine<Paired>();
  const npt::TransferOptions options{.seed = 5, .invariant = true, .pairings = 2, .mirror = true};
  const npt::Mesh expected = npt::transfer(engine, identity, pose, options);
  const auto order = random_order(identity, 1);
  const npt::Mesh found = npt::transfer(engine, npt::permute_vertices(identity, order),
                                        npt::permute_vertices(pose, random_order(pose, 2)), options);
  CHECK(same_bits(npt::permute_vertices(expected, order).positions, found.positions));

  const auto spread = [&](int pairings) {
    const auto run = [&](std::uint64_t seed) {
      return npt::transfer(engine, identity, pose, {.seed = seed, .pairings = pairings});
    };
    const npt::Mesh a = run(1), b = run(2);
    double sum = 0;
    for (std::size_t v = 0; v < a.vertex_count(); ++v) sum += npt::length(a.positions[v] - b.positions[v]);
    return sum;
  };
  CHECK(spread(16) < 0.5 * spread(1));
}

TEST_CASE("pairings don't matter to the pooled feature; fewer than one are an error") {
  const npt::Mesh identity = bumpy_sphere(9, 14, 0.2), pose = bumpy_sphere(6, 11, 0.4);
  const auto engine = random_engine<Pooled>();
  CHECK(same_bits(npt::transfer(engine, identity, pose, {.pairings = 5}).positions,
                  npt::transfer(engine, identity, pose).positions));
  CHECK_THROWS_WITH_AS(npt::transfer(random_engine<Paired>(), identity, pose, {.pairings = 0}),
                       "pairings: found 0, expected at least 1", npt::Error);
}

TEST_CASE("with mirror, mirrored meshes give the mirrored result") {
  const auto mirrored = [](npt::Mesh mesh) {
    for (npt::Vec3f& p : mesh.positions) p.x = -p.x;
    return mesh;
  };
  const npt::Mesh identity = bumpy_sphere(9, 14, 0.2), pose = bumpy_sphere(9, 14, 0.4);
  const auto engine = random_engine<Paired>();
  for (const bool mirror : {false, true}) {
    const npt::TransferOptions options{.mirror = mirror};
    const npt::Mesh a = npt::transfer(engine, identity, pose, options);
    const npt::Mesh b = mirrored(npt::transfer(engine, mirrored(identity), mirrored(pose), options));
    float worst = 0;
    for (std::size_t v = 0; v < a.vertex_count(); ++v)
      worst = std::max(worst, npt::length(a.positions[v] - b.positions[v]));
    CHECK((worst < 1e-6F) == mirror);
  }
}

TEST_CASE("frames of a sequence share their random choices; other faces begin another sequence") {
  const npt::Mesh identity = bumpy_sphere(9, 14, 0.2), first = bumpy_sphere(6, 11, 0.4),
                  other = bumpy_sphere(5, 8, 0.4);
  // Areas and the order of coordinates change.
  npt::Mesh second = first;
  for (npt::Vec3f& p : second.positions) p = {p.x + 0.3F * p.y, p.y + std::max(0.0F, p.x - 3), p.z - 0.2F * p.x};
  const auto engine = random_engine<Paired>();
  for (const bool invariant : {false, true}) {
    const npt::TransferOptions options{.seed = 2, .invariant = invariant, .pairings = 2};
    const auto triangles = npt::triangulate(first);
    npt::SequencePoints points;
    const auto of_first = points.of(first.coordinates(), triangles, 140, options);
    const auto of_second = points.of(second.coordinates(), triangles, 140, options);
    const auto anew = npt::choose_pairings(second.coordinates(), triangles, 140, options);
    for (std::size_t p = 0; p < 2; ++p) {
      CHECK(of_first[p].points == of_second[p].points);
      CHECK(of_first[p].points != anew[p].points);
    }

    npt::SequenceTransfer sequence(engine, identity, options);
    const npt::Mesh a = sequence(first), b = sequence(second);
    CHECK(same_bits(a.positions, npt::transfer(engine, identity, first, options).positions));
    const npt::Mesh alone = npt::transfer(engine, identity, second, options);
    CHECK_FALSE(same_bits(b.positions, alone.positions));
    CHECK(same_bits(sequence(first).positions, a.positions));
    CHECK(same_bits(sequence(second).positions, b.positions));
    // Other faces: chosen anew.
    CHECK(same_bits(sequence(other).positions, npt::transfer(engine, identity, other, options).positions));
    CHECK(same_bits(sequence(second).positions, alone.positions));
  }
}

TEST_CASE("chosen points follow their mesh and are refused by another") {
  const npt::Mesh mesh = bumpy_sphere(6, 11, 0.4);
  const npt::TransferOptions options{.normalisation = npt::Normalisation::none, .seed = 4};
  const npt::PosePoints chosen = npt::choose_points(mesh.coordinates(), npt::triangulate(mesh), 200, options);
  CHECK(chosen.count() == 200);
  npt::Mesh moved = mesh;
  for (npt::Vec3f& p : moved.positions) p = p * 2.0F + npt::Vec3f{1, 2, 3};
  const std::vector<float> a = npt::pose_input(mesh.coordinates(), chosen, options),
                           b = npt::pose_input(moved.coordinates(), chosen, options);
  REQUIRE(a.size() == 600);
  for (std::size_t i = 0; i < a.size(); ++i)
    REQUIRE(b[i] == doctest::Approx(2 * a[i] + static_cast<float>(i % 3 + 1)).epsilon(1e-5));
  CHECK_THROWS_WITH_AS(npt::pose_input(bumpy_sphere(5, 8, 0.4).coordinates(), chosen, options),
                       "pose: found 48 vertices, expected 77, as the mesh that the points were chosen on", npt::Error);
}
