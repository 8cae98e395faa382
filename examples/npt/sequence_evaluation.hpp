/// Sequences run through a backend as `npt transfer` runs a folder of poses.
#pragma once

#include "transfer_backend.hpp"

#include <npt/data/sequences.hpp>

#include <functional>
#include <vector>

namespace program {

/// The means over all sequences, each counting once.
struct SequenceMeans {
  double pmd = 0, edge_error = 0, jitter = 0, true_jitter = 0;
};

/// One after another: a backend holds one sequence at a time.
std::vector<npt::SequenceErrors> evaluate_sequences(const npt::SequenceSet& set, TransferBackend& backend,
                                                    const std::function<void()>& after_frame);

SequenceMeans means_of(const std::vector<npt::SequenceErrors>& sequences);

}  // namespace program
