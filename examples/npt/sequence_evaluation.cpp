#include "sequence_evaluation.hpp"

#include <npt/transfer/pose_tracker.hpp>

#include <cstddef>
#include <span>
#include <vector>

namespace program {

std::vector<npt::SequenceErrors> evaluate_sequences(const npt::SequenceSet& set, const PoseTransfer& transfer,
                                                    bool fresh_choices, const std::function<void()>& after_frame) {
  std::vector<npt::SequenceErrors> sequences;
  npt::Character identity;
  for (std::size_t s = 0; s < set.count; ++s) {
    npt::PoseTracker frames(transfer);
    bool first = true;
    sequences.push_back(npt::evaluate_sequence(
        set, s,
        [&](const npt::EvaluationPair& frame, std::span<float> result) {
          if (first) transfer.prepare({frame.identity, frame.identity_triangles, "identity"}, identity);
          first = false;
          if (fresh_choices) frames.restart();
          const npt::Pose& pose = frames.next({frame.pose, frame.pose_triangles, "pose"}, identity.vertex_count());
          transfer.apply(identity, pose, result);
        },
        after_frame));
  }
  return sequences;
}

SequenceMeans means_of(const std::vector<npt::SequenceErrors>& sequences) {
  SequenceMeans means;
  const auto share = 1 / static_cast<double>(sequences.size());
  for (const npt::SequenceErrors& sequence : sequences) {
    means.jitter += share * sequence.jitter;
    means.true_jitter += share * sequence.true_jitter;
    for (const npt::PairErrors& frame : sequence.frames) {
      means.pmd += share * frame.pmd / static_cast<double>(sequence.frames.size());
      means.edge_error += share * frame.edge_error / static_cast<double>(sequence.frames.size());
    }
  }
  return means;
}

}  // namespace program
