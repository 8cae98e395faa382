/// How a transfer is done: what the weights' file doesn't say, in groups of one concern each.
#pragma once

#include <npt/config.hpp>
#include <npt/estimate/warning_code.hpp>
#include <npt/mesh/normalise.hpp>
#include <npt/nn/engine/precision.hpp>
#include <npt/nn/weights/weights.hpp>
#include <npt/transfer/refinement.hpp>

#include <cstddef>
#include <cstdint>
#include <optional>

namespace npt::inline NPT_ABI {

/// How a transfer is made.
enum class Method {
  automatic,  ///< by body estimation where the weights hold it: a mesh that isn't recognised is refused; else by the
              ///< pose transfer network
  body,       ///< by body estimation, whatever the meshes are
  network     ///< by the pose transfer network
};

/// How much time an estimate of a body may take.
enum class Quality {
  fast,      ///< half of the views, and fewer points of a mesh: about two thirds of the time
  balanced,  ///< what every number of the guides was measured with
  best       ///< all views of every mesh, for odd characters; people's natural poses come out the same (24 pairs)
};

/// Body estimation.
struct BodyOptions {
  Quality quality = Quality::balanced;
  /// Confidence from which on a mesh counts as recognised.
  double least_confidence = npt::least_confidence;
  /// Confidence from which on no warning is given.
  double high_confidence = npt::high_confidence;
  /// Of several figures in one mesh this one, from 1 on, the one with the most points first; a mesh of one figure is
  /// taken whole. 0: the one that is recognised.
  std::size_t figure = 0;
};

/// How a network with the per-vertex feature meets the vertices of pose and identity.
enum class Pairing {
  random,   ///< each identity vertex with a random point of the pose mesh, as in training
  as_given  ///< by number: for comparisons with other implementations; meshes in one order come out distorted
};

/// The pose transfer network.
struct NetworkOptions {
  Pairing pairing = Pairing::random;
  /// The result is the mean over so many random pairings. Costs as many runs of the network. Where the network pairs no
  /// vertices (the pooled feature) there is nothing to choose, and it runs once.
  int pairings = 1;
  /// The result is the mean with the transfer of the mirror images (x to -x, about the mesh's centre): the mirror image
  /// of a transfer is a transfer of the mirror images. For subjects about as symmetric as the training's. Twice the
  /// runs.
  bool mirror = false;
  /// Permuting a mesh's vertices permutes the result bit for bit: vertices are brought into an order derived from their
  /// coordinates first. Without it, other vertex numbers mean other random pairings, or sums in another order.
  bool invariant = false;
  /// Where the network pairs vertices and the counts differ: draw as many points from the pose mesh's surface as the
  /// identity has vertices. False: an Error instead.
  bool resample = true;
  /// None: the file's (metadata normalisation); a file that doesn't say is taken for one of the authors' code, which
  /// centres.
  std::optional<Normalisation> normalisation{};
  /// Values for metadata that the file lacks: order, feature, output_scale.
  Metadata assume{};
  Precision precision = Precision::automatic;
};

/// How meshes are understood.
struct ImportOptions {
  /// Metres in one unit of the meshes' coordinates. None: inferred from each mesh's extent (transfer/unit.hpp). Without
  /// effect on body estimation, and where the weights ask for no unit or meshes are scaled to a sphere.
  std::optional<double> unit{};
};

struct TransferOptions {
  Method method = Method::automatic;
  BodyOptions body{};
  NetworkOptions network{};
  ImportOptions import{};
  /// Gives results the identity's surface detail: npt::detail_refinement; nullptr: nothing is refined.
  MakeRefinement refinement = nullptr;
  /// Detail below this fraction of the root of the mesh's area comes from the identity; none: as the file says
  /// (metadata refine_radius), or default_refine_radius.
  std::optional<double> refine_radius{};
  /// Measure every result (TransferReport::measures): 14 ms for an identity of 6890 vertices and 12 ms for each result.
  bool measure = false;
  /// The seed of every random choice: pairings and drawn points.
  std::uint64_t seed = 0;
};

}  // namespace npt::inline NPT_ABI
