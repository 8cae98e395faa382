/// What a transfer may do beyond the network.
#pragma once

#include <npt/config.hpp>
#include <npt/mesh/normalise.hpp>

#include <cstdint>

namespace npt::inline NPT_ABI {

struct TransferOptions {
  /// Must be what the weights were trained with (the metadata key `normalisation`).
  Normalisation normalisation = Normalisation::centre;
  /// Where the network pairs vertices and the counts differ: draw as many points from the pose mesh's surface as the
  /// identity has. False: an Error instead.
  bool resample = true;
  /// Of every random choice: resampled points, the pairing in the invariant mode.
  std::uint64_t seed = 0;
  /// Permuting either mesh's vertices permutes the result bit for bit: vertices are brought into an order derived from
  /// their coordinates first. False: the paper's plain mode, in which vertices are paired as they come.
  bool invariant = false;
  /// The result is the mean over so many random pairings of pose and identity vertices. The first is the one that is used
  /// alone; costs as many runs of the network. Where the network pairs no vertices (the pooled feature) there is nothing to
  /// choose, and it runs once.
  int pairings = 1;
  /// Also transfer the mirror images (x to -x, about the frame's centre), and average: the mirror image of a transfer is a
  /// transfer of the mirror images. For subjects that are about as symmetric as the training's. Twice the runs.
  bool mirror = false;
};

}  // namespace npt::inline NPT_ABI
