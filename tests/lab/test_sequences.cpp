#include <doctest/doctest.h>

#include <npt/lab/sequences.hpp>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "lab/figures.hpp"

namespace {

std::shared_ptr<const npt::BodyModel> walker() {
  static const auto body = std::make_shared<const npt::BodyModel>(stick_figure(2));
  return body;
}

}  // namespace

TEST_CASE("jitter by hand: none in a straight movement, the flicker's second difference elsewhere") {
  npt::JitterMeter straight, flicker;
  for (int f = 0; f < 6; ++f) {
    const auto t = static_cast<float>(f);
    straight.add(std::vector<float>{t, 2 * t, 5, 1, 1, -t});
    // One vertex of two flickers by 3 up and down: second differences of 12 and 0.
    flicker.add(std::vector<float>{t, f % 2 == 0 ? 3.0F : -3.0F, 5, 1, 1, -t});
  }
  CHECK(straight.jitter() == 0);
  CHECK(flicker.jitter() == doctest::Approx(6));
}

TEST_CASE("fewer than three frames have no jitter; frames of other counts are refused") {
  npt::JitterMeter meter;
  CHECK(meter.jitter() == 0);
  meter.add(std::vector<float>{0, 0, 0});
  meter.add(std::vector<float>{9, 9, 9});
  CHECK(meter.jitter() == 0);
  CHECK_THROWS_AS(meter.add(std::vector<float>{0, 0, 0, 1, 1, 1}), npt::Error);
  CHECK_THROWS_AS(npt::JitterMeter().add({}), npt::Error);
}

TEST_CASE("a sequence keeps identity, faces and orders, and goes from one pose to the next") {
  const npt::SequenceSet set = npt::body_sequences(walker(), 2, 5, 3);
  const auto parameters = npt::unseen_pose_pairs(walker()->shape_count());
  const npt::EvaluationPair first = set.pair(1, 0), last = set.pair(1, 4);
  CHECK(first.identity == last.identity);
  CHECK(first.identity_triangles == last.identity_triangles);
  CHECK(first.pose_triangles == last.pose_triangles);
  CHECK(first.pose == npt::data::body_evaluation_pair(npt::data::PreparedBody(walker()), parameters[1], 3, 1).pose);
  npt::BodyPair end = parameters[1];
  end.pose = parameters[2].pose;
  const npt::EvaluationPair wanted = npt::data::body_evaluation_pair(npt::data::PreparedBody(walker()), end, 3, 1);
  for (std::size_t i = 0; i < wanted.truth.size(); ++i) {
    REQUIRE(last.truth[i] == doctest::Approx(wanted.truth[i]).epsilon(1e-5));
    REQUIRE(last.pose[i] == doctest::Approx(wanted.pose[i]).epsilon(1e-5));
  }
  CHECK(set.pair(0, 0).identity != first.identity);
}

TEST_CASE("the truth has the truth's jitter, and noise has more") {
  const npt::SequenceSet set = npt::body_sequences(walker(), 1, 8);
  const auto give_centred_truth = [](const npt::EvaluationPair& pair, std::span<float> result) {
    npt::NormalisingTransform{npt::bounding_box(pair.truth).centre(), 1}.apply(pair.truth, result);
  };
  std::size_t frames = 0;
  const npt::SequenceErrors exact = npt::evaluate_sequence(set, 0, give_centred_truth, [&frames] { ++frames; });
  CHECK(frames == 8);
  CHECK(exact.frames.size() == 8);
  CHECK(exact.frames[3].pmd < 1e-12);
  CHECK(exact.true_jitter > 0);
  CHECK(exact.jitter == exact.true_jitter);
  npt::Random random(1);
  const npt::SequenceErrors noisy =
      npt::evaluate_sequence(set, 0, [&](const npt::EvaluationPair& pair, std::span<float> result) {
        give_centred_truth(pair, result);
        for (float& x : result) x += static_cast<float>(0.01 * random.normal());
      });
  CHECK(noisy.true_jitter == exact.true_jitter);
  // The second difference of noise has sqrt(6) times its deviation along each axis: a length of 2.45 * 1.6 * 0.01.
  CHECK(noisy.jitter > 0.03);
}

TEST_CASE("sequences that can't be are refused") {
  CHECK_THROWS_AS(npt::body_sequences(walker(), 0, 5), npt::Error);
  CHECK_THROWS_AS(npt::body_sequences(walker(), 73, 5), npt::Error);
  CHECK_THROWS_AS(npt::body_sequences(walker(), 1, 2), npt::Error);
  CHECK_THROWS_AS(npt::body_sequences(nullptr, 1, 5), npt::Error);
}

TEST_CASE("sequences in natural poses are fresh, one mesh throughout, and the same for the same seed") {
  const auto made = [](std::uint64_t seed) {
    return npt::body_sequences(walker(), 2, 4, seed, npt::ShapeDistribution::normal, npt::PoseDistribution::natural);
  };
  const npt::SequenceSet set = made(5);
  CHECK(set.pair(1, 3).pose == made(5).pair(1, 3).pose);
  CHECK(set.pair(1, 3).pose != made(6).pair(1, 3).pose);
  CHECK(set.pair(0, 0).pose != npt::body_sequences(walker(), 2, 4, 5).pair(0, 0).pose);
  CHECK(set.pair(1, 0).pose != set.pair(1, 1).pose);
  CHECK(set.pair(1, 0).identity == set.pair(1, 1).identity);
  CHECK(set.pair(1, 0).pose_triangles == set.pair(1, 3).pose_triangles);
}
