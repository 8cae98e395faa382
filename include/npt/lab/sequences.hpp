/// Sequences of poses to evaluate on, and how much a result trembles from frame to frame.
///   jitter = mean over frames and vertices of |x(f + 1) - 2 x(f) + x(f - 1)|
/// A smooth movement has a small one, which the truth shows; what a result has beyond it is flicker.
/// Shapes    frames: [V, 3], row major, one vertex order
/// Units     those of the coordinates, a frame being the unit of time
#pragma once

#include <npt/base/error.hpp>
#include <npt/body/pose_sampler.hpp>
#include <npt/config.hpp>
#include <npt/lab/body_pairs.hpp>
#include <npt/lab/evaluation.hpp>
#include <npt/lab/prepared_body.hpp>
#include <npt/lab/protocol.hpp>
#include <npt/mesh/metrics.hpp>
#include <npt/mesh/normalise.hpp>
#include <npt/mesh/points.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// Takes the frames of a sequence one after another.
class JitterMeter {
 public:
  /// Errors  npt::Error for no vertices, and for another vertex count than that of the frames before
  void add(std::span<const float> frame) {
    expect_points(frame, "frame of a sequence");
    if (frames_ > 0) expect_comparable(frame, last_[0]);
    if (frames_ >= 2) {
      double sum = 0;
      const std::size_t vertices = frame.size() / 3;
      for (std::size_t v = 0; v < vertices; ++v)
        sum += length(point_at(frame, v) - point_at(last_[0], v) * 2.0 + point_at(last_[1], v));
      sum_ += sum / static_cast<double>(vertices);
    }
    std::swap(last_[0], last_[1]);
    last_[0].assign(frame.begin(), frame.end());
    ++frames_;
  }

  /// The mean over all frames with a neighbour on both sides; 0 for fewer than three frames.
  double jitter() const { return frames_ < 3 ? 0 : sum_ / static_cast<double>(frames_ - 2); }

 private:
  std::array<std::vector<float>, 2> last_;
  double sum_ = 0;
  std::size_t frames_ = 0;
};

/// The errors of a sequence: those of its frames, and the jitter of result and truth. The truth is centred by its
/// bounding box in every frame, as a network is trained to place it.
struct SequenceErrors {
  std::string name;
  std::vector<PairErrors> frames;
  double jitter = 0, true_jitter = 0;
};

/// Sequences, each frame a transfer with a known truth. All frames of a sequence have the same identity, faces and
/// vertex orders. `pair(s, f)` always gives the same.
struct SequenceSet {
  std::string name;
  std::size_t count = 0, frames = 0;
  std::function<EvaluationPair(std::size_t sequence, std::size_t frame)> pair{};
};

/// Movements from pair s's pose to that of the pair after it, by new identities; joint angles change linearly. `poses`
/// paper: between unseen poses of the protocol; others: between fresh ones of `seed`, and the root stays as it is,
/// since natural poses look in any direction. Vertices are shuffled as in body_pairs.
/// Errors  npt::Error for more sequences than the protocol has pairs, for fewer than 3 frames, and for a body without
///         SMPL's joints
inline SequenceSet body_sequences(std::shared_ptr<const BodyModel> body, std::size_t count, std::size_t frames,
                                  std::uint64_t seed = 0, ShapeDistribution distribution = ShapeDistribution::normal,
                                  PoseDistribution poses = PoseDistribution::paper) {
  if (count == 0 || count > protocol::pairs)
    throw Error(
        {.file = "sequences", .found = std::to_string(count), .expected = "1 to " + std::to_string(protocol::pairs)});
  if (frames < 3)
    throw Error({.file = "frames", .found = std::to_string(frames), .expected = "at least 3, to see a jitter"});
  auto prepared = std::make_shared<const data::PreparedBody>(std::move(body));
  const std::size_t shapes = prepared->model->shape_count();
  const bool protocol_poses = poses == PoseDistribution::paper;
  auto pairs = std::make_shared<const std::vector<BodyPair>>(
      protocol_poses ? unseen_pose_pairs(shapes, distribution)
                     : fresh_pairs(protocol::pairs, seed, shapes, distribution, poses));
  return {.name = "sequences",
          .count = count,
          .frames = frames,
          .pair = [prepared, pairs, frames, seed, first = protocol_poses ? std::size_t{0} : std::size_t{3}](
                      std::size_t s, std::size_t f) {
            BodyPair moment = (*pairs)[s];
            const PoseParameters& last = (*pairs)[(s + 1) % pairs->size()].pose;
            const float share = static_cast<float>(f) / static_cast<float>(frames - 1);
            for (std::size_t k = first; k < last.size(); ++k) moment.pose[k] += share * (last[k] - moment.pose[k]);
            EvaluationPair pair = data::body_evaluation_pair(*prepared, moment, seed, s);
            pair.name = std::string("sequence ").append(std::to_string(s)).append(", frame ").append(std::to_string(f));
            return pair;
          }};
}

/// Runs `transfer(pair, result)` on the frames of one sequence in their order. `after_frame` may be empty.
template <class Transfer>
SequenceErrors evaluate_sequence(const SequenceSet& set, std::size_t sequence, Transfer&& transfer,
                                 const std::function<void()>& after_frame = {}) {
  SequenceErrors errors{.name = "sequence " + std::to_string(sequence), .frames = {}};
  JitterMeter of_result, of_truth;
  for (std::size_t f = 0; f < set.frames; ++f) {
    EvaluationPair pair = set.pair(sequence, f);
    std::vector<float> result(pair.identity.size());
    transfer(pair, std::span<float>(result));
    errors.frames.push_back(pair_errors(pair, result));
    of_result.add(result);
    NormalisingTransform{bounding_box(pair.truth).centre(), 1}.apply(pair.truth, pair.truth);
    of_truth.add(pair.truth);
    if (after_frame) after_frame();
  }
  errors.jitter = of_result.jitter();
  errors.true_jitter = of_truth.jitter();
  return errors;
}

}  // namespace npt::inline NPT_ABI
