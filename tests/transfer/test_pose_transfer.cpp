#include <doctest/doctest.h>

#include <npt/base/control.hpp>
#include <npt/base/error.hpp>
#include <npt/mesh/permute.hpp>
#include <npt/transfer/pose_transfer.hpp>
#include <npt/transfer/pose_transfer_class.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <initializer_list>
#include <limits>
#include <memory>
#include <span>
#include <thread>
#include <vector>

#include "support/bumpy_sphere.hpp"
#include "support/nets.hpp"

namespace {

using support::bumpy_sphere;

using Paired = npt::PoseTransferNet<16>;
using Pooled = npt::PoseTransferNet<16, npt::ConvRelu, npt::Pooled>;

template <class Net>
npt::PoseTransfer random_transfer(const npt::TransferOptions& options = {}) {
  npt::Model<Net> model;
  npt::randomise(model, 8);
  return npt::PoseTransfer(model, options, 1);
}

bool same_bits(std::span<const float> a, std::span<const float> b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}
bool same_bits(const npt::Mesh& a, const npt::Mesh& b) { return same_bits(a.coordinates(), b.coordinates()); }

std::vector<std::uint32_t> random_order(const npt::Mesh& mesh, std::uint64_t seed) {
  npt::Random random(seed);
  return npt::random_permutation(static_cast<std::uint32_t>(mesh.vertex_count()), random);
}

float largest_distance(const npt::Mesh& a, const npt::Mesh& b) {
  float worst = 0;
  for (std::size_t v = 0; v < a.vertex_count(); ++v)
    worst = std::max(worst, npt::length(a.positions[v] - b.positions[v]));
  return worst;
}

/// A refinement that shows: it raises the mesh by ten times the radius.
std::unique_ptr<const npt::Refinement> raised(const npt::MeshView& identity, double radius) {
  struct Raise : npt::Refinement {
    void refine(std::span<float> positions) const override {
      for (std::size_t i = 1; i < positions.size(); i += 3) positions[i] += height;
    }
    float height = 0;
  };
  CHECK_FALSE(identity.triangles.empty());
  auto refinement = std::make_unique<Raise>();
  refinement->height = static_cast<float>(10 * radius);
  return refinement;
}

/// The invariant mode's promise, for meshes given in any order.
template <class Net>
void check_invariance(const npt::Mesh& identity, const npt::Mesh& pose) {
  for (const auto normalisation : {npt::Normalisation::sphere, npt::Normalisation::centre, npt::Normalisation::none}) {
    const auto transfer =
        random_transfer<Net>({.network = {.invariant = true, .normalisation = normalisation}, .seed = 5});
    const npt::Mesh expected = transfer(identity, pose);
    for (const std::uint64_t seed : std::initializer_list<std::uint64_t>{1, 2, 3}) {
      const auto order = random_order(identity, seed);
      const npt::Mesh found =
          transfer(npt::permute_vertices(identity, order), npt::permute_vertices(pose, random_order(pose, seed + 10)));
      CHECK(same_bits(npt::permute_vertices(expected, order), found));
    }
  }
}

}  // namespace

TEST_CASE("the result has the identity's faces, order, attributes and count") {
  npt::Mesh identity = bumpy_sphere(9, 14, 0.2);
  identity.tags.push_back({.face = 3, .keyword = "usemtl", .value = "skin"});
  const npt::Mesh result = random_transfer<Paired>()(identity, bumpy_sphere(9, 14, 0.4));
  CHECK(result.vertex_count() == identity.vertex_count());
  CHECK(result.corners == identity.corners);
  CHECK(result.face_start == identity.face_start);
  CHECK(result.tags.size() == 1);
  CHECK(result.normals.empty());
  CHECK_FALSE(same_bits(result, identity));
}

TEST_CASE("normals are recomputed if the identity had them") {
  npt::Mesh identity = bumpy_sphere(9, 14, 0.2);
  identity.normals.assign(identity.vertex_count(), {0, 0, 1});
  const npt::Mesh result = random_transfer<Paired>()(identity, bumpy_sphere(9, 14, 0.4));
  REQUIRE(result.normals.size() == identity.vertex_count());
  const auto expected = npt::vertex_normals(result);
  for (std::size_t v = 0; v < expected.size(); ++v) CHECK(npt::length(result.normals[v] - expected[v]) < 1e-5F);
}

TEST_CASE("paired as given, a transfer is the network on vertices as they come, mapped back to the identity's place") {
  const npt::Mesh identity = bumpy_sphere(9, 14, 0.2), pose = bumpy_sphere(9, 14, 0.4);
  for (const auto normalisation : {npt::Normalisation::sphere, npt::Normalisation::centre, npt::Normalisation::none}) {
    const auto transfer =
        random_transfer<Paired>({.network = {.pairing = npt::Pairing::as_given, .normalisation = normalisation}});
    const auto of_identity = npt::normalising_transform(identity.coordinates(), normalisation);
    const auto of_pose = npt::normalising_transform(pose.coordinates(), normalisation);
    std::vector<float> a(3 * pose.vertex_count()), b(a.size()), c(a.size());
    of_pose.apply(pose.coordinates(), a);
    of_identity.apply(identity.coordinates(), b);
    transfer.engine()({a, b}, c);
    of_identity.apply_inverse(c, c);
    CHECK(same_bits(c, transfer(identity, pose).coordinates()));
    CHECK_FALSE(same_bits(
        c, random_transfer<Paired>({.network = {.normalisation = normalisation}})(identity, pose).coordinates()));
  }
}

TEST_CASE("moving and scaling the meshes moves and scales the result as the identity") {
  const npt::Mesh identity = bumpy_sphere(9, 14, 0.2), pose = bumpy_sphere(9, 14, 0.4);
  const auto transfer = random_transfer<Paired>({.network = {.normalisation = npt::Normalisation::sphere}});
  const npt::Mesh expected = transfer(identity, pose);
  npt::Mesh far_identity = identity, far_pose = pose;
  for (auto& p : far_identity.positions) p = p * 100.0F + npt::Vec3f{10, 20, 30};
  for (auto& p : far_pose.positions) p = p * 0.5F - npt::Vec3f{1, 2, 3};
  const npt::Mesh found = transfer(far_identity, far_pose);
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

TEST_CASE("coincident vertices stay together unless paired as given") {
  const npt::Mesh identity = bumpy_sphere(9, 14, 0.2, true), pose = bumpy_sphere(9, 14, 0.4);
  for (const bool invariant : {false, true}) {
    const npt::Mesh result = random_transfer<Paired>({.network = {.invariant = invariant}})(identity, pose);
    for (std::size_t r = 0; r <= 9; ++r) CHECK(result.positions[14 * r] == result.positions[14 * r + 13]);
  }
  const npt::Mesh torn = random_transfer<Paired>({.network = {.pairing = npt::Pairing::as_given}})(identity, pose);
  CHECK(torn.positions[0] != torn.positions[13]);
}

TEST_CASE("paired vertices depend on the order of the pose mesh, the pooled feature hardly") {
  const npt::Mesh identity = bumpy_sphere(9, 14, 0.2), pose = bumpy_sphere(9, 14, 0.4);
  const npt::Mesh shuffled = npt::permute_vertices(pose, random_order(pose, 4));
  const auto largest = [&](const npt::PoseTransfer& transfer) {
    return largest_distance(transfer(identity, pose), transfer(identity, shuffled));
  };
  CHECK(largest(random_transfer<Paired>({.network = {.pairing = npt::Pairing::as_given}})) > 1e-3F);
  CHECK(largest(random_transfer<Pooled>()) < 1e-4F);  // moments are summed in another order
}

TEST_CASE("random choices are seeded; resampling may be forbidden") {
  const npt::Mesh identity = bumpy_sphere(9, 14, 0.2);
  for (const npt::Mesh& pose : {bumpy_sphere(6, 11, 0.4), bumpy_sphere(9, 14, 0.4)}) {
    CHECK(same_bits(random_transfer<Paired>({.seed = 3})(identity, pose),
                    random_transfer<Paired>({.seed = 3})(identity, pose)));
    CHECK_FALSE(same_bits(random_transfer<Paired>({.seed = 3})(identity, pose),
                          random_transfer<Paired>({.seed = 4})(identity, pose)));
  }
  const npt::Mesh pose = bumpy_sphere(6, 11, 0.4);
  CHECK_THROWS_WITH_AS(random_transfer<Paired>({.network = {.resample = false}})(identity, pose),
                       "pose: found 77 vertices, expected 140, as many as the identity has (or resampling, or weights "
                       "with the pooled feature)",
                       npt::Error);
  CHECK_NOTHROW(random_transfer<Pooled>({.network = {.resample = false}})(identity, pose));
}

TEST_CASE("meshes that can't be transferred are errors that name them") {
  const npt::Mesh good = bumpy_sphere(9, 14, 0.2);
  npt::Mesh point = good;
  for (auto& p : point.positions) p = {1, 2, 3};
  for (const auto normalisation : {npt::Normalisation::sphere, npt::Normalisation::centre, npt::Normalisation::none}) {
    const auto transfer = random_transfer<Paired>({.network = {.normalisation = normalisation}});
    CHECK_THROWS_WITH_AS(transfer(npt::Mesh{}, good), "identity: found no vertices, expected at least one vertex",
                         npt::Error);
    CHECK_THROWS_WITH_AS(transfer(good, npt::Mesh{}), "pose: found no vertices, expected at least one vertex",
                         npt::Error);
    CHECK_THROWS_WITH_AS(transfer(point, good),
                         "identity: found all vertices in one point, expected a mesh with an extent", npt::Error);
    CHECK_THROWS_WITH_AS(transfer(good, point), "pose: found all vertices in one point, expected a mesh with an extent",
                         npt::Error);
  }
  const auto transfer = random_transfer<Paired>();
  const std::vector<npt::Triangle> beyond{{0, 1, 2}, {0, 1, 140}};
  std::vector<float> result(good.coordinates().size());
  CHECK_THROWS_WITH_AS(transfer({good.coordinates()}, {good.coordinates(), beyond, "b.obj"}, result),
                       "b.obj: triangle 1: found vertex 140, expected a number below 140", npt::Error);
  CHECK_THROWS_WITH_AS(transfer({good.coordinates()}, {good.coordinates()}, std::span(result).first(9)),
                       "result: found 9 numbers, expected 420, three for each of the identity's vertices", npt::Error);
  CHECK_THROWS_WITH_AS(transfer({good.coordinates().first(8)}, {good.coordinates()}, std::span(result).first(8)),
                       "identity: found 8 coordinates, expected a multiple of 3", npt::Error);
}

TEST_CASE("a NaN that goes in comes out") {
  npt::Mesh identity = bumpy_sphere(9, 14, 0.2);
  identity.positions[7].y = std::numeric_limits<float>::quiet_NaN();
  const auto comes_out = [&identity](const npt::PoseTransfer& transfer) {
    const npt::Mesh result = transfer(identity, bumpy_sphere(9, 14, 0.4));
    return std::ranges::any_of(result.coordinates(), [](float x) { return std::isnan(x); });
  };
  CHECK(comes_out(random_transfer<Paired>()));
  CHECK(comes_out(random_transfer<Pooled>()));
}

TEST_CASE("an average over pairings is the mean of its runs, each a pairing of its own") {
  const npt::Mesh identity = bumpy_sphere(9, 14, 0.2);
  for (const npt::Mesh& pose : {bumpy_sphere(9, 14, 0.4), bumpy_sphere(6, 11, 0.4)}) {
    const npt::TransferOptions options{.network = {.pairings = 3}, .seed = 3};
    const auto transfer = random_transfer<Paired>(options);
    const auto triangles = npt::triangulate(pose);
    const npt::MeshView view{pose.coordinates(), triangles};
    const npt::PoseChoice choice = transfer.choose_points(view, 140);
    REQUIRE(choice.pairings().size() == 3);
    const auto of_identity = npt::normalising_transform(identity.coordinates(), npt::Normalisation::centre);
    const auto of_pose = npt::normalising_transform(pose.coordinates(), npt::Normalisation::centre);
    std::vector<float> own(identity.coordinates().size());
    of_identity.apply(identity.coordinates(), own);
    std::vector<std::vector<float>> runs;
    for (const npt::PosePoints& pairing : choice.pairings()) {
      std::vector<float> points;
      npt::place_points(view, pairing, points);
      of_pose.apply(points, points);
      runs.emplace_back(own.size());
      transfer.engine()({points, own}, runs.back());
    }
    CHECK(runs[1] != runs[0]);
    CHECK(runs[2] != runs[1]);
    std::vector<float> mean(own.size());
    for (std::size_t i = 0; i < mean.size(); i += 3) {
      npt::Vec3d sum;
      for (const std::vector<float>& run : runs) sum += npt::point_at(run, i / 3);
      const npt::Vec3f position = of_identity.apply_inverse(sum / 3.0).as<float>();
      mean[i] = position.x;
      mean[i + 1] = position.y;
      mean[i + 2] = position.z;
    }
    CHECK(same_bits(mean, transfer(identity, pose).coordinates()));
    // The first pairing is the one that is used alone.
    of_identity.apply_inverse(runs[0], runs[0]);
    CHECK(same_bits(runs[0], random_transfer<Paired>({.seed = 3})(identity, pose).coordinates()));
  }
}

TEST_CASE("averaging keeps the invariant mode's promise, and steadies random pairings") {
  const npt::Mesh identity = bumpy_sphere(9, 14, 0.2), pose = bumpy_sphere(6, 11, 0.4);
  const auto transfer =
      random_transfer<Paired>({.network = {.pairings = 2, .mirror = true, .invariant = true}, .seed = 5});
  const npt::Mesh expected = transfer(identity, pose);
  const auto order = random_order(identity, 1);
  const npt::Mesh found =
      transfer(npt::permute_vertices(identity, order), npt::permute_vertices(pose, random_order(pose, 2)));
  CHECK(same_bits(npt::permute_vertices(expected, order), found));

  const auto spread = [&](int pairings) {
    const auto run = [&](std::uint64_t seed) {
      return random_transfer<Paired>({.network = {.pairings = pairings}, .seed = seed})(identity, pose);
    };
    const npt::Mesh a = run(1), b = run(2);
    double sum = 0;
    for (std::size_t v = 0; v < a.vertex_count(); ++v) sum += double{npt::length(a.positions[v] - b.positions[v])};
    return sum;
  };
  CHECK(spread(16) < 0.5 * spread(1));
}

TEST_CASE("pairings don't matter to the pooled feature") {
  const npt::Mesh identity = bumpy_sphere(9, 14, 0.2), pose = bumpy_sphere(6, 11, 0.4);
  CHECK(same_bits(random_transfer<Pooled>({.network = {.pairings = 5}})(identity, pose),
                  random_transfer<Pooled>()(identity, pose)));
}

TEST_CASE("with mirror, mirrored meshes give the mirrored result") {
  const auto mirrored = [](npt::Mesh mesh) {
    for (npt::Vec3f& p : mesh.positions) p.x = -p.x;
    return mesh;
  };
  const npt::Mesh identity = bumpy_sphere(9, 14, 0.2), pose = bumpy_sphere(9, 14, 0.4);
  for (const bool mirror : {false, true}) {
    const auto transfer = random_transfer<Paired>({.network = {.mirror = mirror}});
    const float worst =
        largest_distance(transfer(identity, pose), mirrored(transfer(mirrored(identity), mirrored(pose))));
    CHECK((worst < 1e-6F) == mirror);
  }
}

TEST_CASE("prepared meshes, batches and borrowed memory give the bits of meshes as they come") {
  const npt::Mesh identity = bumpy_sphere(9, 14, 0.2, true), other = bumpy_sphere(5, 8, 0.1);
  const npt::Mesh pose = bumpy_sphere(9, 14, 0.4), far = bumpy_sphere(6, 11, 0.3);
  const auto view = [](const npt::Mesh& mesh, const std::vector<npt::Triangle>& triangles) {
    return npt::MeshView{mesh.coordinates(), triangles};
  };
  const auto ti = npt::triangulate(identity), to = npt::triangulate(other), tp = npt::triangulate(pose),
             tf = npt::triangulate(far);
  const auto check = [&](const npt::PoseTransfer& transfer) {
    std::vector<float> a(identity.coordinates().size()), b(a.size()), c(a.size()), d(other.coordinates().size());
    // A crowd and a sequence at once: the first two share the identity, the last two the pose.
    const npt::TransferJob jobs[] = {{view(identity, ti), view(pose, tp), a},
                                     {view(identity, ti), view(far, tf), b},
                                     {view(other, to), view(far, tf), d}};
    transfer.run(jobs);
    CHECK(same_bits(a, transfer(identity, pose).coordinates()));
    CHECK(same_bits(b, transfer(identity, far).coordinates()));
    CHECK(same_bits(d, transfer(other, far).coordinates()));
    const npt::Character prepared = transfer.character(identity);
    CHECK(prepared.vertex_count() == identity.vertex_count());
    transfer.apply(prepared, transfer.pose(pose, identity.vertex_count()), c);
    CHECK(same_bits(a, c));
    transfer.apply(prepared, view(far, tf), c);
    CHECK(same_bits(b, c));
    // The result may be the identity's own memory.
    npt::Mesh moved = identity;
    transfer(view(moved, ti), view(pose, tp), moved.coordinates());
    CHECK(same_bits(a, moved.coordinates()));
  };
  check(random_transfer<Paired>());
  check(random_transfer<Pooled>({.network = {.mirror = true}}));
  check(random_transfer<Paired>({.network = {.pairings = 3, .mirror = true}}));
  check(random_transfer<Paired>({.network = {.invariant = true}, .refinement = raised}));
}

TEST_CASE("a batch of more vertices than the network carries at once gives the same bits") {
  const npt::Mesh pose = bumpy_sphere(30, 40, 0.4);
  std::vector<npt::Mesh> identities;
  for (int i = 0; i < 6; ++i)
    identities.push_back(bumpy_sphere(29 + static_cast<std::size_t>(i % 2), 40, 0.1 + 0.05 * i));
  const auto transfer = random_transfer<Paired>({.network = {.pairings = 8, .mirror = true}});
  const auto triangles = npt::triangulate(pose);
  std::vector<std::vector<float>> results;
  std::vector<npt::TransferJob> jobs;
  for (const npt::Mesh& identity : identities) results.emplace_back(identity.coordinates().size());
  for (std::size_t i = 0; i < identities.size(); ++i)
    jobs.push_back({{identities[i].coordinates()}, {pose.coordinates(), triangles}, results[i]});
  transfer.run(jobs);
  for (std::size_t i = 0; i < identities.size(); ++i)
    CHECK(same_bits(results[i], transfer(identities[i], pose).coordinates()));
}

TEST_CASE("what another transfer prepared is refused") {
  const npt::Mesh identity = bumpy_sphere(9, 14, 0.2), pose = bumpy_sphere(9, 14, 0.4);
  const auto plain = random_transfer<Paired>(), mirrored = random_transfer<Paired>({.network = {.mirror = true}}),
             pooled = random_transfer<Pooled>();
  const npt::Character prepared = plain.character(identity);
  const npt::Pose posed = plain.pose(pose, 140);
  std::vector<float> result(identity.coordinates().size());
  CHECK_NOTHROW(plain.apply(prepared, posed, result));
  CHECK_THROWS_AS(mirrored.apply(prepared, posed, result), npt::Error);
  CHECK_THROWS_AS(mirrored.apply(prepared, mirrored.pose(pose, 140), result), npt::Error);
  CHECK_THROWS_AS(pooled.apply(prepared, posed, result), npt::Error);
  CHECK_THROWS_AS(plain.apply(prepared, npt::Pose{}, result), npt::Error);
  CHECK_THROWS_AS(plain.apply(npt::Character{}, posed, std::span<float>()), npt::Error);
  CHECK_THROWS_AS(plain.apply(prepared, plain.pose(pose, 100), result), npt::Error);  // for 100 vertices
}

TEST_CASE("the network says how far it is, and stops between its sweeps") {
  const auto transfer = random_transfer<Paired>({.network = {.pairings = 2, .mirror = true}});
  const npt::Mesh identity = bumpy_sphere(8, 12, 1), mesh = bumpy_sphere(9, 10, 2);
  const npt::Character hero = transfer.character(identity);
  const auto made = [&](const npt::Control& control) {
    const npt::Pose pose = transfer.pose(mesh, hero.vertex_count(), "pose", control);
    return transfer.apply(hero, pose, control).mesh;
  };
  const npt::Mesh plain = made({});
  std::vector<double> done;
  CHECK(same_bits(made({.progress = [&](double x) { done.push_back(x); }}), plain));
  // Twice through four runs: the pose's sweeps, then the others.
  const auto turn = std::is_sorted_until(done.begin(), done.end());
  CHECK(std::is_sorted(turn, done.end()));
  CHECK(done.front() == 0);
  CHECK(*turn == 0);
  CHECK(done.back() > 0.9);
  CHECK(done.size() == 4 * 10);
  for (const std::size_t last : {std::size_t{3}, done.size() - 1}) {
    std::size_t asked = 0;
    try {
      (void)made({.stop = [&] { return asked++ == last; }});
      FAIL("not stopped");
    } catch (const npt::Error& error) {
      CHECK(error.code() == npt::ErrorCode::stopped);
    }
    CHECK(asked == last + 1);
  }
  CHECK(same_bits(made({}), plain));
}

TEST_CASE("threads share a transfer and get the same bits") {
  const npt::Mesh identity = bumpy_sphere(9, 14, 0.2), pose = bumpy_sphere(9, 14, 0.4);
  const auto transfer = random_transfer<Paired>({.network = {.pairings = 2}, .refinement = raised});
  const npt::Mesh expected = transfer(identity, pose);
  const npt::Character prepared = transfer.character(identity);
  std::vector<std::vector<float>> results(4, std::vector<float>(identity.coordinates().size()));
  {
    std::vector<std::jthread> threads;
    for (std::vector<float>& result : results)
      threads.emplace_back([&] {
        for (int i = 0; i < 3; ++i) transfer.apply(prepared, npt::MeshView{pose.coordinates()}, result);
      });
  }
  for (const std::vector<float>& result : results) CHECK(same_bits(result, expected.coordinates()));
}

TEST_CASE("a result is refined in the identity's place and order") {
  const npt::Mesh identity = bumpy_sphere(9, 14, 0.2), pose = bumpy_sphere(9, 14, 0.4);
  const npt::Mesh plain = random_transfer<Paired>()(identity, pose);
  const npt::Mesh refined = random_transfer<Paired>({.refinement = raised, .refine_radius = 0.3})(identity, pose);
  for (std::size_t v = 0; v < plain.vertex_count(); ++v) {
    CHECK(refined.positions[v].y == plain.positions[v].y + 3);
    CHECK(refined.positions[v].x == plain.positions[v].x);
  }
}

TEST_CASE("a transfer is opened with options that can be, and says what it does") {
  CHECK_THROWS_AS(random_transfer<Paired>({.network = {.pairings = 0}}), npt::Error);
  CHECK_THROWS_AS(random_transfer<Paired>({.import = {.unit = -1.0}}), npt::Error);
  npt::Model<Paired> model;
  const npt::PoseTransfer transfer(model, {.network = {.pairings = 2, .mirror = true}, .refinement = raised}, 1,
                                   {{"refine_radius", "0.1"}});
  CHECK(transfer.options().refine_radius == 0.1);
  CHECK(transfer.description() == "bottleneck 16, conv_relu, per-vertex, 2 pairings, mirrored, refined within 0.1");
}

TEST_CASE("weights in metres take meshes in centimetres and millimetres, and give results in their units") {
  npt::Model<Paired> model;
  npt::randomise(model, 8);
  const npt::Metadata metres{{"unit", "metre"}, {"normalisation", "centre"}};
  const npt::PoseTransfer transfer(model, {}, 1, metres);
  npt::Mesh identity = bumpy_sphere(9, 14, 0.2), pose = bumpy_sphere(9, 14, 0.4);
  for (npt::Mesh* mesh : {&identity, &pose})
    for (npt::Vec3f& p : mesh->positions) p = p * 0.5F;  // 1.7 m across
  const npt::Mesh expected = transfer(identity, pose);
  const auto scaled = [](npt::Mesh mesh, float factor) {
    for (npt::Vec3f& p : mesh.positions) p = p * factor;
    return mesh;
  };
  CHECK(largest_distance(scaled(transfer(scaled(identity, 100), pose), 0.01F), expected) < 1e-4F);
  CHECK(largest_distance(transfer(identity, scaled(pose, 1000)), expected) < 1e-4F);
  CHECK(transfer.character(scaled(identity, 100)).unit() == 0.01);
  CHECK_THROWS_WITH_AS(
      transfer(scaled(identity, 10), pose),
      "identity: found a mesh 17.8 units across, expected a person, 0.4 to 4 metres across, in metres, "
      "centimetres or millimetres",
      npt::Error);
  const npt::PoseTransfer told(model, {.import = {.unit = 0.1}}, 1, metres);
  CHECK(largest_distance(scaled(told(scaled(identity, 10), scaled(pose, 10)), 0.1F), expected) < 1e-4F);
  // Weights that name no unit, or scale every mesh, take any.
  CHECK_NOTHROW(npt::PoseTransfer(model, {}, 1)(scaled(identity, 10), pose));
  CHECK_NOTHROW(
      npt::PoseTransfer(model, {}, 1, {{"unit", "metre"}, {"normalisation", "sphere"}})(scaled(identity, 10), pose));
}
