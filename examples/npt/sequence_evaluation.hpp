/// Sequences run as `npt transfer` runs a folder of poses.
#pragma once

#include "networks.hpp"

#include <npt/lab/sequences.hpp>

#include <functional>
#include <vector>

namespace program {

/// The means over all sequences, each counting once.
struct SequenceMeans {
  double pmd = 0, edge_error = 0, jitter = 0, true_jitter = 0;
};

/// `fresh_choices`: every frame chooses points and pairings for itself.
std::vector<npt::SequenceErrors> evaluate_sequences(const npt::SequenceSet& set, const PoseTransfer& transfer,
                                                    bool fresh_choices, const std::function<void()>& after_frame);

SequenceMeans means_of(const std::vector<npt::SequenceErrors>& sequences);

}  // namespace program
