/// The border between the program's `transfer` and `explain` (arguments, files, jobs) and the network behind them.
/// transfer_backend.cpp implements what is declared here.
#pragma once

#include <npt/mesh/mesh.hpp>
#include <npt/mesh/normalise.hpp>
#include <npt/mesh/triangles.hpp>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>

namespace program {

/// Which network. What is not given comes from the weights' metadata, or without weights is the default.
struct NetworkOptions {
  std::optional<std::filesystem::path> weights;  ///< none: those shipped with the project
  std::optional<std::string> order;              ///< "conv_relu" or "relu_conv"
  std::optional<std::string> feature;            ///< "per-vertex" or "pooled"
  std::optional<double> output_scale;            ///< of the final tanh: 1 in the paper, 2 in its code
};

struct TransferOptions {
  NetworkOptions network;
  int threads = 0;                                  ///< 0: all that the process may use
  std::optional<npt::Normalisation> normalisation;  ///< none: the weights' own
  bool resample = true;    ///< bring the pose mesh to the identity's vertex count; false: a different count is an error
  std::uint64_t seed = 0;  ///< of resampling, of the invariant mode's order, of random weights
  bool invariant = false;  ///< the result does not depend on the vertex orders of the inputs
  int pairings = 1;        ///< the mean over so many random pairings of vertices
  bool mirror = false;     ///< also transfer the mirror images, and average
  bool refine = false;     ///< give the result the identity's surface detail
  std::optional<double> refine_radius;  ///< none: the weights' own, or the library's
  bool sequence =
      false;  ///< successive poses with the same faces are frames: one set of random choices for all of them
};

/// A mesh with its name for messages. The program keeps one object for as long as successive jobs use the same file,
/// and gives every newly read mesh another number, so that a backend can keep what depends on one mesh only.
struct LoadedMesh {
  npt::Mesh mesh;
  std::string name;
  std::uint64_t number = 0;
};

class TransferBackend {
 public:
  virtual ~TransferBackend() = default;

  /// The identity in the pose of `pose`: the identity's mesh with other positions, and renewed normals where it had
  /// some. Errors    npt::Error for meshes that the network can't take; names them
  virtual npt::Mesh transfer(const LoadedMesh& identity, const LoadedMesh& pose) = 0;

  /// The same on coordinates: writes the identity's new positions [V, 3]. No two calls share anything. May be called by any
  /// number of threads at a time. `identity_triangles` are for the refinement only.
  virtual void transfer(std::span<const float> identity, std::span<const npt::Triangle> identity_triangles,
                        std::span<const float> pose, std::span<const npt::Triangle> pose_triangles,
                        std::span<float> result) const = 0;

  /// One line about the network: "bottleneck 1024, conv_relu, per-vertex".
  virtual std::string description() const = 0;

  /// What the user must know before trusting the result, such as that the weights are random; empty: nothing.
  virtual std::string notice() const = 0;
};

/// Errors    npt::Error for weights that are missing, broken, or of another network than asked for
std::unique_ptr<TransferBackend> make_transfer_backend(const TransferOptions& options);

/// The text of `npt explain`: layers, stages, parameters and work of the network at this vertex count.
std::string explain_network(const NetworkOptions& options, std::optional<int> bottleneck, std::size_t vertices);

}  // namespace program
