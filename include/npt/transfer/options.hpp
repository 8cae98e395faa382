/// How a transfer is done: what the weights' file doesn't say, and what may be done beyond one run of the network.
#pragma once

#include <npt/config.hpp>
#include <npt/mesh/normalise.hpp>
#include <npt/nn/engine/packed_program.hpp>
#include <npt/nn/weights/weights_file.hpp>
#include <npt/transfer/body_interface.hpp>
#include <npt/transfer/refinement.hpp>

#include <cstdint>
#include <filesystem>
#include <optional>

namespace npt::inline NPT_ABI {

/// How a network with the per-vertex feature meets the vertices of pose and identity.
enum class Pairing {
  random,   ///< each identity vertex with a random point of the pose mesh, as in training
  as_given  ///< by number: for comparisons with other implementations. Meshes numbered alike come out torn
};

struct TransferOptions {
  /// The way through bodies, which does poses and characters that the network doesn't: npt::body_method; nullptr: all
  /// transfers are the network's. Opened where the weights' file names a reader beside it (metadata reader), or
  /// `reader` does.
  MakeBodyMethod body = nullptr;
  Method method = Method::automatic;
  /// Whether a pair that doesn't read as people keeps what the network makes of it where that is torn apart (for
  /// measuring). Else it is an Error.
  bool keep_distorted = false;
  /// Weights of the reader; empty: those that the weights' file names.
  std::filesystem::path reader{};
  Pairing pairing = Pairing::random;
  /// The result is the mean over so many random pairings. Costs as many runs of the network. Where the network pairs no
  /// vertices (the pooled feature) there is nothing to choose, and it runs once.
  int pairings = 1;
  /// The result is the mean with the transfer of the mirror images (x to -x, about the mesh's centre): the mirror image
  /// of a transfer is a transfer of the mirror images. For subjects about as symmetric as the training's. Twice the
  /// runs.
  bool mirror = false;
  /// Gives results the identity's surface detail: npt::detail_refinement; nullptr: nothing is refined.
  MakeRefinement refinement = nullptr;
  /// Detail below this share of the root of the mesh's area comes from the identity; none: as the file says (metadata
  /// refine_radius), or default_refine_radius.
  std::optional<double> refine_radius{};
  /// Permuting a mesh's vertices permutes the result bit for bit: vertices are brought into an order derived from their
  /// coordinates first. Without it, other vertex numbers mean other random pairings, or sums in another order.
  bool invariant = false;
  /// Where the network pairs vertices and the counts differ: draw as many points from the pose mesh's surface as the
  /// identity has vertices. False: an Error instead.
  bool resample = true;
  /// The seed of every random choice: pairings and drawn points.
  std::uint64_t seed = 0;
  /// Metres in one unit of the meshes' coordinates. None: told from each mesh's extent (transfer/unit.hpp). Without
  /// effect where the weights ask for no unit, or meshes are scaled to a sphere.
  std::optional<double> unit{};
  /// None: the file's (metadata normalisation); a file that doesn't say is taken for one of the authors' code, which
  /// centres.
  std::optional<Normalisation> normalisation{};
  /// Values for metadata that the file lacks: order, feature, output_scale.
  Metadata assume{};
  Precision precision = Precision::automatic;
};

}  // namespace npt::inline NPT_ABI
