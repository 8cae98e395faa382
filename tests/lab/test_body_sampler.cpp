#include <doctest/doctest.h>

#include <npt/base/thread_executor.hpp>
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/lab/body_sampler.hpp>
#include <npt/mesh/metrics.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <vector>

#include "body/small_body.hpp"
#include "lab/figures.hpp"

namespace {

bool same(const npt::Sample& a, const npt::Sample& b) {
  return npt::pose_of(a) == npt::pose_of(b) && npt::identity_of(a) == npt::identity_of(b) && a.truth == b.truth &&
         a.edges == b.edges && a.triangles == b.triangles && a.scale == b.scale;
}

std::vector<float> posed(const npt::BodyModel& body, const std::vector<float>& shape, const npt::PoseParameters& pose) {
  std::vector<float> xyz(3 * body.vertex_count());
  body.posed(shape, pose, xyz);
  return xyz;
}

std::vector<npt::Vec3f> points(const std::vector<float>& xyz) {
  std::vector<npt::Vec3f> result;
  for (std::size_t i = 0; i < xyz.size(); i += 3) result.push_back({xyz[i], xyz[i + 1], xyz[i + 2]});
  return result;
}

std::vector<npt::Vec3f> sorted_points(const std::vector<float>& xyz) {
  std::vector<npt::Vec3f> result = points(xyz);
  std::ranges::sort(result, [](npt::Vec3f a, npt::Vec3f b) {
    return a.x != b.x ? a.x < b.x : a.y != b.y ? a.y < b.y : a.z < b.z;
  });
  return result;
}

/// The frame of a mesh as the truth has it: its own centre, the identity's scale.
npt::NormalisingTransform truth_frame(const std::vector<float>& truth, const npt::NormalisingTransform& identity,
                                      npt::Normalisation normalisation) {
  if (normalisation == npt::Normalisation::none) return identity;
  return {npt::normalising_transform(truth, npt::Normalisation::centre).centre, identity.scale};
}

std::vector<float> in_frame(const npt::NormalisingTransform& frame, std::vector<float> xyz) {
  frame.apply(xyz, xyz);
  return xyz;
}

}  // namespace

TEST_CASE(
    "without shuffling a sample is the posed bodies in their frames, and the truth the identity's shape in the pose") {
  const npt::BodyModel& body = npt::mannequin();
  for (const auto normalisation : {npt::Normalisation::sphere, npt::Normalisation::centre, npt::Normalisation::none}) {
    npt::BodySamplerOptions options;
    options.shuffle = false;
    options.normalisation = normalisation;
    const npt::BodySampler sampler(npt::borrowed(body), options);
    const npt::BodyPair pair = sampler.choose(7, 3).pair;
    const npt::Sample sample = sampler.draw(7, 3);
    const std::vector<float> identity = posed(body, pair.identity_shape, pair.identity_pose);
    const std::vector<float> pose = posed(body, pair.pose_shape, pair.pose);
    const std::vector<float> truth = posed(body, pair.identity_shape, pair.pose);
    const npt::NormalisingTransform frame = npt::normalising_transform(identity, normalisation);
    CHECK(sample.scale == frame.scale);
    CHECK(npt::identity_of(sample) == in_frame(frame, identity));
    CHECK(npt::pose_of(sample) == in_frame(npt::normalising_transform(pose, normalisation), pose));
    CHECK(sample.truth == in_frame(truth_frame(truth, frame, normalisation), truth));
    CHECK(npt::pmd(identity, truth) > 1e-3);  // otherwise the above says little
    CHECK(npt::pmd(pose, truth) > 1e-6);
    CHECK(std::ranges::equal(sample.triangles, body.triangles()));
  }
}

TEST_CASE("shuffling reorders pose and identity independently, and truth, edges and triangles with the identity") {
  const npt::BodyModel& body = npt::mannequin();
  npt::BodySamplerOptions options;
  const npt::BodySampler shuffled(npt::borrowed(body), options);
  options.shuffle = false;
  const npt::BodySampler plain(npt::borrowed(body), options);
  const npt::Sample a = plain.draw(2, 5), b = shuffled.draw(2, 5);
  CHECK(npt::identity_of(a) != npt::identity_of(b));
  CHECK(sorted_points(npt::pose_of(a)) == sorted_points(npt::pose_of(b)));
  CHECK(sorted_points(npt::identity_of(a)) == sorted_points(npt::identity_of(b)));
  CHECK(sorted_points(a.truth) == sorted_points(b.truth));
  REQUIRE(a.triangles.size() == b.triangles.size());
  const auto ap = points(npt::identity_of(a)), bp = points(npt::identity_of(b)), at = points(a.truth),
             bt = points(b.truth);
  for (std::size_t t = 0; t < a.triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k) {
      REQUIRE(ap[a.triangles[t][k]] == bp[b.triangles[t][k]]);
      REQUIRE(at[a.triangles[t][k]] == bt[b.triangles[t][k]]);
    }
  // A closed surface: V - E + F = 2.
  CHECK(a.edges.size() + 2 == a.vertex_count() + a.triangles.size());
  REQUIRE(a.edges.size() == b.edges.size());
  std::size_t same_places = 0;
  for (std::size_t e = 0; e < a.edges.size(); ++e) {
    REQUIRE(b.edges[e][0] < b.edges[e][1]);
    const bool kept = ap[a.edges[e][0]] == bp[b.edges[e][0]] && ap[a.edges[e][1]] == bp[b.edges[e][1]];
    const bool turned = ap[a.edges[e][0]] == bp[b.edges[e][1]] && ap[a.edges[e][1]] == bp[b.edges[e][0]];
    REQUIRE((kept || turned));
  }
  const auto order_a = points(npt::pose_of(b));
  const auto pose_plain = points(npt::pose_of(a));
  for (std::size_t v = 0; v < 500; ++v) {
    const auto where_pose = std::ranges::find(pose_plain, order_a[v]) - pose_plain.begin();
    const auto where_identity = std::ranges::find(ap, bp[v]) - ap.begin();
    same_places += where_pose == where_identity ? 1 : 0;
  }
  CHECK(same_places < 5);
}

TEST_CASE("a subset's vertices are the full mesh's, in nearly its frame") {
  const npt::BodyModel& body = npt::mannequin();
  npt::BodySamplerOptions options;
  options.vertices = 120;
  options.normalisation = npt::Normalisation::sphere;
  const npt::BodySampler sampler(npt::borrowed(body), options);
  double mean_offset = 0;
  for (std::uint64_t i = 0; i < 20; ++i) {
    const npt::Sample sample = sampler.draw(0, i);
    const npt::BodyPair pair = sampler.choose(0, i).pair;
    REQUIRE(sample.vertex_count() == 120);
    REQUIRE(npt::pose_of(sample).size() / 3 == 120);
    REQUIRE(sample.truth.size() == 360);
    CHECK(sample.edges.empty());
    CHECK(sample.triangles.empty());
    // Row r is vertex v of the full mesh for one v, the same in identity and truth, and no vertex comes twice.
    const std::vector<float> identity = posed(body, pair.identity_shape, pair.identity_pose);
    const std::vector<float> truth = posed(body, pair.identity_shape, pair.pose);
    npt::Random random = npt::data::random_for(npt::data::Purpose::training, 0, 0, i, npt::data::Part::identity_order);
    npt::data::VertexChoice choice;
    std::vector<std::uint32_t> rows;
    choice.draw(120, static_cast<std::uint32_t>(body.vertex_count()), random, rows);
    CHECK(std::set<std::uint32_t>(rows.begin(), rows.end()).size() == 120);
    const npt::NormalisingTransform frame = npt::normalising_transform(identity, npt::Normalisation::sphere);
    const npt::NormalisingTransform own = truth_frame(truth, frame, npt::Normalisation::sphere);
    double offset = 0;
    for (std::size_t r = 0; r < rows.size(); ++r) {
      const npt::Vec3d a = npt::point_at(npt::identity_of(sample), r), b = npt::point_at(sample.truth, r);
      offset = std::max({offset, npt::length(a - frame.apply(npt::point_at(identity, rows[r]))) / frame.scale,
                         npt::length(b - own.apply(npt::point_at(truth, rows[r]))) / frame.scale});
    }
    CHECK(offset < 0.05);
    mean_offset += offset / 20;
  }
  CHECK(mean_offset < 0.002);
}

TEST_CASE("in its own frame a subset is centred by itself") {
  npt::BodySamplerOptions options;
  options.vertices = 50;
  options.own_frame = true;
  const npt::BodySampler sampler(npt::borrowed(npt::mannequin()), options);
  const npt::Sample sample = sampler.draw(1, 1);
  for (const std::vector<float>* xyz : {&npt::pose_of(sample), &npt::identity_of(sample), &sample.truth})
    CHECK(npt::length(npt::normalising_transform(*xyz, npt::Normalisation::centre).centre) < 1e-6);
  CHECK(sample.scale == 1);
}

TEST_CASE("a sample depends on seed, step and index only: not on order, memory or threads") {
  npt::BodySamplerOptions options;
  options.vertices = 64;
  options.pose_vertices = 90;
  options.yaw = 40;
  options.scale_low = 0.9;
  options.scale_high = 1.2;
  options.noise = 0.01;
  const npt::BodySampler sampler(npt::borrowed(npt::mannequin()), options);
  std::vector<npt::Sample> forward(24), threaded(24);
  for (std::size_t i = 0; i < 24; ++i) forward[i] = sampler.draw(i / 6, i % 6);
  const npt::ThreadExecutor executor(3);
  executor.for_each(24, [&](int i, int) {
    const auto k = static_cast<std::size_t>(23 - i);
    sampler.fill(k / 6, k % 6, threaded[k]);
  });
  for (std::size_t i = 0; i < 24; ++i) REQUIRE(same(forward[i], threaded[i]));
  npt::Sample reused = forward[5];
  sampler.fill(0, 2, reused);
  CHECK(same(reused, forward[2]));
  CHECK(!same(forward[0], forward[1]));
  CHECK(!same(forward[0], forward[6]));
  options.seed = 1;
  CHECK(!same(npt::BodySampler(npt::borrowed(npt::mannequin()), options).draw(0, 0), forward[0]));
}

TEST_CASE(
    "yaw turns the truth with the pose mesh, scale grows it with the identity, noise touches the pose mesh only") {
  const npt::BodyModel& body = npt::mannequin();
  npt::BodySamplerOptions options;
  options.shuffle = false;
  options.normalisation = npt::Normalisation::none;
  const npt::BodySampler plain(npt::borrowed(body), options);
  const npt::Sample before = plain.draw(0, 0);

  const auto angle = [](const std::vector<float>& from, const std::vector<float>& to, std::size_t v) {
    return std::atan2(double{to[3 * v]}, double{to[3 * v + 2]}) -
           std::atan2(double{from[3 * v]}, double{from[3 * v + 2]});
  };
  const auto off_axis = [](const std::vector<float>& xyz) {
    std::size_t v = 0;
    for (std::size_t i = 0; i < xyz.size() / 3; ++i)
      if (std::abs(xyz[3 * i]) > std::abs(xyz[3 * v])) v = i;
    return v;
  };
  const std::size_t v = off_axis(before.truth);
  options.yaw = 30;
  const npt::Sample turned = npt::BodySampler(npt::borrowed(body), options).draw(0, 0);
  CHECK(angle(before.truth, turned.truth, v) ==
        doctest::Approx(angle(npt::pose_of(before), npt::pose_of(turned), v)).epsilon(1e-4));
  CHECK(angle(before.truth, turned.truth, v) !=
        doctest::Approx(angle(npt::identity_of(before), npt::identity_of(turned), v)).epsilon(1e-3));
  CHECK(before.truth[3 * v + 1] == turned.truth[3 * v + 1]);

  options.yaw = 0;
  options.scale_low = 0.5;
  options.scale_high = 2;
  const npt::Sample grown = npt::BodySampler(npt::borrowed(body), options).draw(0, 0);
  const double own = double{npt::identity_of(grown)[3 * v]} / double{npt::identity_of(before)[3 * v]};
  CHECK(own != doctest::Approx(1));
  CHECK(own >= 0.5);
  CHECK(own <= 2);
  CHECK(double{grown.truth[3 * v]} / double{before.truth[3 * v]} == doctest::Approx(own).epsilon(1e-5));
  CHECK(double{npt::pose_of(grown)[3 * v]} / double{npt::pose_of(before)[3 * v]} != doctest::Approx(own).epsilon(1e-3));

  options.scale_low = options.scale_high = 1;
  options.noise = 0.02;
  const npt::BodySampler rough(npt::borrowed(body), options);
  double most = 0, sum = 0;
  for (std::uint64_t i = 0; i < 40; ++i) {
    const npt::Sample clean = plain.draw(1, i), noisy = rough.draw(1, i);
    REQUIRE(npt::identity_of(clean) == npt::identity_of(noisy));
    REQUIRE(clean.truth == noisy.truth);
    const double sigma = std::sqrt(npt::pmd(npt::pose_of(clean), npt::pose_of(noisy)) / 3);
    most = std::max(most, sigma);
    sum += sigma;
  }
  CHECK(most < 0.0205);
  CHECK(most > 0.015);
  CHECK(sum / 40 == doctest::Approx(0.01).epsilon(0.25));
}

TEST_CASE("the paper's training set: 16 shapes, 400 poses, any two") {
  const npt::BodyModel& body = npt::mannequin();
  npt::BodySamplerOptions options;
  options.protocol = true;
  options.vertices = 8;
  const npt::BodySampler sampler(npt::borrowed(body), options);
  const npt::TrainingSet set(body.shape_count());
  std::set<std::size_t> shapes, poses;
  for (std::uint64_t i = 0; i < 600; ++i) {
    const npt::BodyPair pair = sampler.choose(i / 8, i % 8).pair;
    for (const std::vector<float>* shape : {&pair.identity_shape, &pair.pose_shape}) {
      const auto found = std::ranges::find(set.shapes, *shape);
      REQUIRE(found != set.shapes.end());
      shapes.insert(static_cast<std::size_t>(found - set.shapes.begin()));
    }
    for (const npt::PoseParameters* pose : {&pair.identity_pose, &pair.pose}) {
      const auto found = std::ranges::find(set.poses, *pose);
      REQUIRE(found != set.poses.end());
      poses.insert(static_cast<std::size_t>(found - set.poses.begin()));
    }
  }
  CHECK(shapes.size() == 16);
  CHECK(poses.size() > 350);
}

TEST_CASE("a part of the meshes is in wide poses, and none unless asked for") {
  const auto body = npt::borrowed(npt::mannequin());
  const auto is_wide = [](const npt::PoseParameters& pose) {
    // The paper's thighs don't twist.
    return pose[3 * 1 + 1] != 0 || pose[3 * 2 + 1] != 0;
  };
  npt::BodySamplerOptions options;
  options.wide_poses = 0.25;
  const npt::BodySampler mixed(body, options), plain(body);
  int wide_identities = 0, wide_poses = 0, wide_in_plain = 0;
  for (std::uint64_t i = 0; i < 400; ++i) {
    const auto choice = mixed.choose(3, i), before = plain.choose(3, i);
    wide_identities += is_wide(choice.pair.identity_pose) ? 1 : 0;
    wide_poses += is_wide(choice.pair.pose) ? 1 : 0;
    wide_in_plain += is_wide(before.pair.identity_pose) || is_wide(before.pair.pose) ? 1 : 0;
    CHECK(choice.pair.identity_shape == before.pair.identity_shape);
  }
  CHECK(wide_in_plain == 0);
  for (const int count : {wide_identities, wide_poses}) {
    CHECK(count > 70);
    CHECK(count < 130);
  }
}

TEST_CASE("parts of the meshes are in wide and in natural poses") {
  const auto body = npt::borrowed(npt::mannequin());
  npt::BodySamplerOptions options;
  options.wide_poses = 0.25;
  const npt::BodySampler wide(body, options);
  options.natural_poses = 0.5;
  const npt::BodySampler mixed(body, options);
  int natural = 0, same = 0;
  for (std::uint64_t i = 0; i < 400; ++i) {
    const npt::PoseParameters pose = mixed.choose(3, i).pair.identity_pose;
    // Only natural poses turn about the vertical.
    natural += std::abs(pose[1]) > 0.4F ? 1 : 0;
    same += pose == wide.choose(3, i).pair.identity_pose ? 1 : 0;
  }
  CHECK(natural > 140);
  CHECK(natural < 200);
  CHECK(same > 160);  // wide ones stay wide, and half of the others the paper's
  CHECK(same < 240);
}

TEST_CASE("a part of the meshes is in poses of clips") {
  npt::PoseParameters fixed{};
  fixed[4] = 0.25F;
  npt::BodySamplerOptions options;
  options.clip_poses = 1;
  options.clip_pose = [&fixed](npt::Random&) { return fixed; };
  const npt::BodySampler all(npt::borrowed(npt::mannequin()), options);
  CHECK(all.choose(0, 0).pair.pose == fixed);
  CHECK(all.choose(3, 1).pair.identity_pose == fixed);
  options.natural_poses = 0.6;
  CHECK_THROWS_AS(npt::BodySampler(npt::borrowed(npt::mannequin()), options), npt::Error);
}

TEST_CASE("a mixture draws bodies by weight, and pairs them across only when told") {
  const auto two = std::make_shared<const npt::BodyModel>(stick_figure(1));
  const auto three = std::make_shared<const npt::BodyModel>(stick_figure(2));
  npt::BodySamplerOptions options;
  const std::vector<npt::WeightedBody> mixture{{two, 1}, {three, 3}};
  const npt::BodySampler apart(mixture, options);
  std::size_t second = 0;
  for (std::uint64_t i = 0; i < 400; ++i) {
    const auto choice = apart.choose(0, i);
    REQUIRE(choice.identity_body == choice.pose_body);
    const npt::Sample sample = apart.draw(0, i);
    REQUIRE(sample.vertex_count() == (choice.identity_body == 0 ? two : three)->vertex_count());
    REQUIRE(npt::pose_of(sample).size() / 3 == sample.vertex_count());
    second += choice.identity_body;
  }
  CHECK(second > 260);
  CHECK(second < 340);
  CHECK(apart.equal_counts());
  CHECK(apart.max_vertices() == three->vertex_count());

  options.mix_bodies = true;
  const npt::BodySampler mixed(mixture, options);
  CHECK(!mixed.equal_counts());
  std::size_t across = 0;
  for (std::uint64_t i = 0; i < 400; ++i) {
    const auto choice = mixed.choose(0, i);
    across += choice.identity_body != choice.pose_body ? 1 : 0;
    const npt::Sample sample = mixed.draw(0, i);
    REQUIRE(npt::pose_of(sample).size() / 3 == (choice.pose_body == 0 ? two : three)->vertex_count());
    REQUIRE(sample.truth.size() == npt::identity_of(sample).size());
  }
  CHECK(across > 100);
  options.vertices = 10;
  CHECK(npt::BodySampler(mixture, options).equal_counts());
  options.pose_vertices = 12;
  CHECK(!npt::BodySampler(mixture, options).equal_counts());
}

TEST_CASE("a choice of vertices is a uniform subset without repeats and leaves no trace") {
  npt::data::VertexChoice choice;
  npt::Random random(1);
  std::vector<std::uint32_t> chosen;
  std::vector<int> hits(10);
  for (int i = 0; i < 3000; ++i) {
    choice.draw(3, 10, random, chosen);
    REQUIRE(std::set<std::uint32_t>(chosen.begin(), chosen.end()).size() == 3);
    for (const std::uint32_t v : chosen) ++hits[v];
  }
  for (const int h : hits) {
    CHECK(h > 780);
    CHECK(h < 1020);
  }
  npt::Random a(5), b(5);
  npt::data::VertexChoice fresh;
  std::vector<std::uint32_t> other;
  choice.draw(7, 7, a, chosen);
  fresh.draw(7, 7, b, other);
  CHECK(chosen == other);
  choice.draw(0, 7, a, chosen);
  CHECK(chosen.empty());
}

TEST_CASE("samplers refuse what can't be sampled") {
  const auto body = npt::borrowed(npt::mannequin());
  const auto refused = [&](auto&& change, const char* says) {
    npt::BodySamplerOptions options;
    change(options);
    std::string message;
    try {
      const npt::BodySampler sampler(body, options);
    } catch (const npt::Error& error) {
      message = error.what();
    }
    INFO("wanted: ", says, ", found: ", message);
    CHECK(message.find(says) != std::string::npos);
  };
  using Options = npt::BodySamplerOptions;
  refused([](Options& o) { o.vertices = 7000; }, "found 7000, expected at most 6890");
  refused([](Options& o) { o.pose_vertices = 7000; }, "vertices of a sample");
  refused([](Options& o) { o.yaw = -1; }, "yaw");
  refused([](Options& o) { o.yaw = std::nan(""); }, "yaw");
  refused([](Options& o) { o.scale_low = 0; }, "least scale");
  refused([](Options& o) { o.scale_high = 0.5; }, "largest scale");
  refused([](Options& o) { o.noise = -1; }, "noise");
  refused([](Options& o) { o.wide_poses = 1.5; }, "wide_poses");
  refused([](Options& o) { o.natural_poses = -0.5; }, "natural_poses");
  refused([](Options& o) { o.wide_poses = o.natural_poses = 0.6; }, "wide_poses and natural_poses: found 1.2");
  CHECK_THROWS_AS(npt::BodySampler(std::vector<npt::WeightedBody>{}), npt::Error);
  CHECK_THROWS_AS(npt::BodySampler(std::vector<npt::WeightedBody>{{body, 0}}), npt::Error);
  CHECK_THROWS_AS(npt::BodySampler(std::shared_ptr<const npt::BodyModel>()), npt::Error);
  CHECK_THROWS_AS(npt::BodySampler(std::make_shared<const npt::BodyModel>(small_body())), npt::Error);
}
