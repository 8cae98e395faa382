#include <doctest/doctest.h>

#include <npt/base/thread_executor.hpp>
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/body/proportions.hpp>
#include <npt/lab/body_pairs.hpp>
#include <npt/lab/evaluation.hpp>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "lab/figures.hpp"

namespace {

std::shared_ptr<const npt::BodyModel> figure() {
  static const auto body = std::make_shared<const npt::BodyModel>(stick_figure(2));
  return body;
}

/// A square in the plane that is its own truth.
npt::EvaluationPair square() {
  npt::EvaluationPair pair;
  pair.name = "square";
  pair.identity = pair.truth = pair.pose = {0, 0, 0, 2, 0, 0, 2, 2, 0, 0, 2, 0};
  pair.edges = {{0, 1}, {1, 2}, {2, 3}, {0, 3}};
  return pair;
}

std::vector<float> moved(std::vector<float> xyz, npt::Vec3f by) {
  for (std::size_t i = 0; i < xyz.size(); i += 3) xyz[i] += by.x, xyz[i + 1] += by.y, xyz[i + 2] += by.z;
  return xyz;
}

const auto give_truth = [](const npt::EvaluationPair& pair, std::span<float> result) {
  std::ranges::copy(pair.truth, result.begin());
};

}  // namespace

TEST_CASE("errors by hand") {
  const npt::EvaluationPair pair = square();
  // The truth somewhere else is no error.
  npt::EvaluationPair away = pair;
  away.truth = moved(away.truth, {5, 6, 7});
  CHECK(npt::pair_errors(away, pair.identity).pmd == 0);
  CHECK(npt::pair_errors(away, pair.identity).pmd_in_place == 0);
  CHECK(npt::pair_errors(away, pair.identity).edge_error == 0);
  // A result that is moved is one in place only.
  const npt::PairErrors shifted = npt::pair_errors(pair, moved(pair.truth, {0, 0, 3}));
  CHECK(shifted.pmd == 0);
  CHECK(shifted.pmd_in_place == doctest::Approx(9));
  // Twice as large: every vertex off by the root of 2, every edge by its own length.
  std::vector<float> large = pair.truth;
  for (float& x : large) x *= 2;
  const npt::PairErrors grown = npt::pair_errors(pair, large);
  CHECK(grown.pmd == doctest::Approx(2));
  CHECK(grown.per_coordinate() == doctest::Approx(2.0 / 3));
  CHECK(grown.root_mm() == doctest::Approx(1000 * std::sqrt(2.0)));
  CHECK(grown.edge_error == doctest::Approx(1));
  // An edge without length in the truth counts for nothing.
  npt::EvaluationPair folded = pair;
  folded.edges.push_back({2, 2});
  CHECK(npt::pair_errors(folded, large).edge_error == doctest::Approx(1));
  folded.edges.clear();
  CHECK(npt::pair_errors(folded, large).edge_error == 0);
}

TEST_CASE("pairs that a transfer doesn't recognise are counted, other refusals end the evaluation") {
  const npt::EvaluationSet set{.name = "three", .count = 3, .pair = [](std::size_t) { return square(); }};
  const auto refuse = [](npt::ErrorCode code) {
    return [code](std::size_t i, const npt::EvaluationPair& pair, std::span<float> result) {
      if (i == 1) throw npt::Error({.file = "mesh", .found = "a tree", .expected = "a person", .code = code});
      std::ranges::copy(pair.truth, result.begin());
    };
  };
  const npt::Evaluation evaluation = npt::evaluate(set, refuse(npt::ErrorCode::not_recognised));
  REQUIRE(evaluation.pairs.size() == 2);
  CHECK(evaluation.pairs[1].number == 2);
  CHECK(evaluation.pmd() == 0);
  REQUIRE(evaluation.refused.size() == 1);
  CHECK(evaluation.refused[0].find("mesh: found a tree, expected a person") != std::string::npos);
  CHECK_THROWS_AS(npt::evaluate(set, refuse(npt::ErrorCode::bad_input)), npt::Error);
  const npt::Evaluation none{.name = "none", .pairs = {}};
  CHECK(std::isnan(none.pmd()));
  CHECK(std::isnan(none.median_pmd()));
  CHECK(std::isnan(none.worst_pmd()));
}

TEST_CASE("a NaN in a result is an error that is NaN, and the worst of all") {
  const npt::EvaluationPair pair = square();
  std::vector<float> broken = pair.truth;
  broken[4] = std::numeric_limits<float>::quiet_NaN();
  const npt::PairErrors errors = npt::pair_errors(pair, broken);
  CHECK(std::isnan(errors.pmd));
  CHECK(std::isnan(errors.edge_error));
  npt::Evaluation evaluation{.name = "", .pairs = {{"a", 1, 0, 0}, errors, {"b", 3, 0, 0}, {"c", 2, 0, 0}}};
  CHECK(evaluation.worst(3) == std::vector<std::size_t>{1, 2, 3});
  CHECK(evaluation.worst(9).size() == 4);
  CHECK(std::isnan(evaluation.pmd()));
  CHECK(std::isnan(evaluation.worst_pmd()));
  CHECK(evaluation.median_pmd() == doctest::Approx(2.5));
  evaluation.pairs.erase(evaluation.pairs.begin() + 1);
  CHECK(evaluation.median_pmd() == doctest::Approx(2));
  CHECK(evaluation.worst_pmd() == doctest::Approx(3));
  CHECK(evaluation.pmd() == doctest::Approx(2));
  CHECK(evaluation.root_mm() == doctest::Approx(1000 * std::sqrt(2.0)));
  CHECK(evaluation.mean_mm() == doctest::Approx(1000 * (1 + std::sqrt(2.0) + std::sqrt(3.0)) / 3));
  CHECK(evaluation.median_mm() == doctest::Approx(1000 * std::sqrt(2.0)));
}

TEST_CASE("a set in metres: every mesh grows, and errors with it") {
  const npt::EvaluationSet set{.name = "squares", .count = 1, .pair = [](std::size_t) { return square(); }};
  const npt::EvaluationSet grown = npt::in_metres(set, 1.7);
  const npt::EvaluationPair pair = grown.pair(0);
  CHECK(pair.identity[3] == doctest::Approx(3.4));
  CHECK(pair.pose == pair.identity);
  CHECK(pair.truth == pair.identity);
  const auto crush = [](const npt::EvaluationPair&, std::span<float> result) { std::ranges::fill(result, 0.0F); };
  CHECK(npt::evaluate(grown, crush).mean_mm() == doctest::Approx(1.7 * npt::evaluate(set, crush).mean_mm()));
  for (const double metres : {0.0, -1.0, std::numeric_limits<double>::infinity()})
    CHECK_THROWS_AS(npt::in_metres(set, metres), npt::Error);
}

TEST_CASE("sizes that don't fit are refused") {
  npt::EvaluationPair pair = square();
  CHECK_THROWS_AS(npt::pair_errors(pair, std::vector<float>(9)), npt::Error);
  pair.truth.resize(9);
  CHECK_THROWS_AS(npt::pair_errors(pair, pair.identity), npt::Error);
  CHECK_THROWS_AS(npt::evaluate({.name = "none"}, give_truth), npt::Error);
  CHECK_THROWS_AS(npt::with_noise({}, -1, 0), npt::Error);
  CHECK_THROWS_AS(npt::body_pairs(nullptr, {}, ""), npt::Error);
  CHECK_THROWS_AS(npt::protocol_sets(nullptr), npt::Error);
  CHECK_THROWS_AS(npt::fresh_pairs(std::size_t{1} << 20, 0, 3), npt::Error);
}

TEST_CASE("pairs of a body are its posed meshes, shuffled independently, with edges and faces that moved along") {
  const auto body = figure();
  const auto parameters = npt::fresh_pairs(3, 4, body->shape_count());
  const npt::EvaluationSet set = npt::body_pairs(body, parameters, "some", 9);
  CHECK(set.count == 3);
  for (std::size_t i = 0; i < 3; ++i) {
    const npt::EvaluationPair pair = set.pair(i);
    const npt::BodyPair& p = parameters[i];
    std::vector<float> identity(3 * body->vertex_count()), truth(identity.size()), pose(identity.size());
    body->posed(p.identity_shape, p.identity_pose, identity);
    body->posed(p.identity_shape, p.pose, truth);
    body->posed(p.pose_shape, p.pose, pose);
    const auto places = [&](const std::vector<float>& from, const std::vector<float>& to) {
      std::vector<std::size_t> found;
      for (std::size_t v = 0; v < to.size() / 3; ++v) {
        std::size_t u = 0;
        while (u < from.size() / 3 && !(npt::point_at(from, u) == npt::point_at(to, v))) ++u;
        found.push_back(u);
      }
      return found;
    };
    const auto identity_places = places(identity, pair.identity), pose_places = places(pose, pair.pose);
    CHECK(places(truth, pair.truth) == identity_places);
    CHECK(pose_places != identity_places);
    for (const auto& list : {identity_places, pose_places}) {
      std::vector<std::size_t> sorted = list;
      std::ranges::sort(sorted);
      for (std::size_t v = 0; v < sorted.size(); ++v) REQUIRE(sorted[v] == v);
    }
    REQUIRE(pair.edges.size() == body->triangles().size() * 3);
    for (std::size_t t = 0; t < pair.pose_triangles.size(); ++t)
      for (std::size_t k = 0; k < 3; ++k) REQUIRE(pose_places[pair.pose_triangles[t][k]] == body->triangles()[t][k]);
    for (const auto& [a, b] : pair.edges) REQUIRE(identity_places[a] / 3 == identity_places[b] / 3);
    REQUIRE(pair.identity_triangles.size() == body->triangles().size());
    for (std::size_t t = 0; t < pair.identity_triangles.size(); ++t)
      for (std::size_t k = 0; k < 3; ++k)
        REQUIRE(identity_places[pair.identity_triangles[t][k]] == body->triangles()[t][k]);
  }
}

TEST_CASE("natural pairs: other shapes, other poses in any direction, the identity's shape in the pose as the truth") {
  const auto pairs = npt::fresh_pairs(40, 4, 10, npt::ShapeDistribution::normal, npt::PoseDistribution::natural);
  const auto paper = npt::fresh_pairs(40, 4, 10);
  int turned = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    CHECK(pairs[i].identity_shape == paper[i].identity_shape);
    CHECK(pairs[i].identity_shape != pairs[i].pose_shape);
    CHECK(pairs[i].identity_pose != pairs[i].pose);
    turned += std::abs(pairs[i].pose[1]) > 1 ? 1 : 0;
  }
  CHECK(turned > 10);
  CHECK(pairs[3].pose ==
        npt::fresh_pairs(4, 4, 10, npt::ShapeDistribution::normal, npt::PoseDistribution::natural)[3].pose);
}

TEST_CASE("character pairs have the same shapes and poses, and proportions behind them") {
  const npt::BodyModel body = npt::with_proportions(npt::mannequin());
  const std::size_t own = npt::mannequin().shape_count();
  const auto plain = npt::fresh_pairs(3, 4, own), characters = npt::fresh_character_pairs(3, 4, own);
  for (std::size_t i = 0; i < plain.size(); ++i) {
    CHECK(characters[i].pose == plain[i].pose);
    CHECK(characters[i].identity_pose == plain[i].identity_pose);
    for (const auto& [with, without] : {std::pair{characters[i].identity_shape, plain[i].identity_shape},
                                        std::pair{characters[i].pose_shape, plain[i].pose_shape}}) {
      REQUIRE(with.size() == body.shape_count());
      CHECK(std::equal(without.begin(), without.end(), with.begin()));
      CHECK(std::any_of(with.begin() + static_cast<std::ptrdiff_t>(own), with.end(), [](float p) { return p != 0; }));
    }
    CHECK(!std::equal(characters[i].identity_shape.begin() + static_cast<std::ptrdiff_t>(own),
                      characters[i].identity_shape.end(),
                      characters[i].pose_shape.begin() + static_cast<std::ptrdiff_t>(own)));
  }
}

TEST_CASE("the result is the same for any threads, and every pair is evaluated once") {
  const npt::EvaluationSet set = npt::body_pairs(figure(), npt::fresh_pairs(20, 1, 3), "some");
  const auto give_identity = [](const npt::EvaluationPair& pair, std::span<float> result) {
    std::ranges::copy(pair.identity, result.begin());
  };
  std::atomic<int> done{0};
  const npt::Evaluation serial = npt::evaluate(set, give_identity);
  const npt::Evaluation threaded = npt::evaluate(set, give_identity, npt::ThreadExecutor(3), [&done] { ++done; });
  CHECK(done == 20);
  for (std::size_t i = 0; i < 20; ++i) {
    CHECK(serial.pairs[i].pmd == threaded.pairs[i].pmd);
    CHECK(serial.pairs[i].edge_error == threaded.pairs[i].edge_error);
    CHECK(serial.pairs[i].pmd > 0);
    CHECK(serial.pairs[i].name == "pair " + std::to_string(i));
  }
  CHECK(npt::evaluate(set, give_truth).pmd() == 0);
  std::array<int, 20> asked{};
  const auto numbered = [&](std::size_t number, const npt::EvaluationPair& pair, std::span<float> result) {
    CHECK(pair.name == "pair " + std::to_string(number));
    ++asked[number];
    give_truth(pair, result);
  };
  CHECK(npt::evaluate(set, numbered).pmd() == 0);
  CHECK(std::ranges::all_of(asked, [](int times) { return times == 1; }));
  CHECK(serial.per_coordinate() == serial.pmd() / 3);
}

TEST_CASE("the frames of a network's evaluation are the sample's: the truth in them gives no error") {
  const npt::EvaluationSet set = npt::body_pairs(figure(), npt::fresh_pairs(4, 2, 3), "some");
  for (const auto normalisation : {npt::Normalisation::sphere, npt::Normalisation::centre}) {
    for (std::size_t i = 0; i < set.count; ++i) {
      const npt::EvaluationPair pair = set.pair(i);
      std::vector<float> result(pair.identity.size());
      npt::normalised_transfer(
          [&](std::span<const float> pose, std::span<const float> identity, std::span<float> out) {
            const npt::NormalisingTransform frame = npt::normalising_transform(pair.identity, normalisation);
            CHECK(npt::length(npt::normalising_transform(pose, npt::Normalisation::centre).centre) < 1e-6);
            CHECK(npt::length(npt::normalising_transform(identity, npt::Normalisation::centre).centre) < 1e-6);
            npt::NormalisingTransform{npt::normalising_transform(pair.truth, npt::Normalisation::centre).centre,
                                      frame.scale}
                .apply(pair.truth, out);
          },
          normalisation)(pair, result);
      CHECK(npt::pair_errors(pair, result).pmd < 1e-12);
      CHECK(npt::pair_errors(pair, result).pmd_in_place < 1e-12);
    }
  }
}

TEST_CASE("noise moves the pose mesh by the given deviation and nothing else") {
  const npt::EvaluationSet clean = npt::body_pairs(npt::borrowed(npt::mannequin()), npt::fresh_pairs(2, 1, 10), "some");
  const npt::EvaluationSet noisy = npt::with_noise(clean, 0.01, 3);
  for (std::size_t i = 0; i < 2; ++i) {
    const npt::EvaluationPair a = clean.pair(i), b = noisy.pair(i);
    CHECK(a.identity == b.identity);
    CHECK(a.truth == b.truth);
    CHECK(std::sqrt(npt::pmd_per_coordinate(a.pose, b.pose)) == doctest::Approx(0.01).epsilon(0.03));
    CHECK(noisy.pair(i).pose == b.pose);
  }
  CHECK(npt::with_noise(clean, 0, 3).pair(0).pose == clean.pair(0).pose);
}

TEST_CASE("the protocol's sets are its pairs, on any body") {
  const auto sets = npt::protocol_sets(figure());
  REQUIRE(sets.size() == 2);
  CHECK(sets[0].name == "seen poses");
  CHECK(sets[0].count == 72);
  CHECK(sets[1].count == 72);
  CHECK(sets[0].pair(0).truth != sets[1].pair(0).truth);
}

TEST_CASE("evaluation never draws what training draws") {
  // Same seed, same numbers of sample: other shapes and poses.
  const auto pairs = npt::fresh_pairs(3, 0, 10);
  npt::Random random = npt::data::random_for(npt::data::Purpose::training, 0, 0, 0, npt::data::Part::identity_shape);
  CHECK(npt::sample_shape(random, 10) != pairs[0].identity_shape);
}
