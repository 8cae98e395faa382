/// Samples for pose transfer networks: their inputs by name, and what all sources of them let one choose.
/// Shapes    pose: [Vp, 3], identity and truth: [V, 3], row major, normalised; vertex v of the truth is vertex v of the
///           identity, and no vertex of the pose mesh belongs to one of theirs
/// Source    Wang et al., CVPR 2020, section 3.1: the truth is M(a1, b2, t1), the identity's shape and vertex order in
///           the pose mesh's pose
#pragma once

#include <npt/base/error.hpp>
#include <npt/config.hpp>
#include <npt/mesh/normalise.hpp>
#include <npt/nn/train/sample.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <iterator>
#include <string>
#include <vector>

namespace npt::inline NPT_ABI {

/// [Vp, 3] normalised by itself.
inline std::vector<float>& pose_of(Sample& sample) { return sample.inputs.at(0); }
inline const std::vector<float>& pose_of(const Sample& sample) { return sample.inputs.at(0); }
/// [V, 3] normalised by itself. The truth is centred by its own bounding box and scaled by the identity's factor, so
/// that the network's result maps back to the identity's units.
inline std::vector<float>& identity_of(Sample& sample) { return sample.inputs.at(1); }
inline const std::vector<float>& identity_of(const Sample& sample) { return sample.inputs.at(1); }

/// What all sources of samples let one choose. Lengths are in the meshes' unit, metres for bodies.
struct SampleOptions {
  std::uint64_t seed = 0;
  std::size_t vertices = 0;       ///< of each mesh, drawn anew for every use; 0: all
  std::size_t pose_vertices = 0;  ///< of the pose mesh, where they are to differ; 0: as `vertices` says
  bool shuffle = true;            ///< whole meshes: vertices in a new random order, pose and identity each in its own
  bool topology = true;           ///< whole meshes: fill edges and triangles, for losses on edges
  Normalisation normalisation = Normalisation::centre;
  /// Degrees. Identity and pose mesh turn about the vertical axis (y), each by its own angle in -yaw .. yaw; the truth
  /// turns as the pose mesh does.
  double yaw = 0;
  /// Identity and pose mesh grow by a factor each, log-uniform in scale_low .. scale_high; the truth grows as the
  /// identity does.
  double scale_low = 1, scale_high = 1;
  /// The standard deviation of the noise on each coordinate of the pose mesh is uniform in 0 .. noise, a draw a mesh,
  /// so that clean meshes stay among the samples.
  double noise = 0;
};

namespace data {

/// Vertices of the samples' pose meshes; 0: all that a mesh has.
inline std::size_t pose_vertices_of(const SampleOptions& options) {
  return options.pose_vertices != 0 ? options.pose_vertices : options.vertices;
}

/// The most vertices of a sample's mesh: `asked`, or where that is 0, of the largest that samples are made of.
/// `count_of(member)`: its vertices.
template <class Members, class CountOf>
std::size_t most_vertices(std::size_t asked, const Members& members, CountOf&& count_of) {
  if (asked != 0) return asked;
  std::size_t result = 0;
  for (const auto& member : members) result = std::max(result, std::invoke(count_of, member));
  return result;
}

/// Whether all samples' identity and pose meshes have one count of vertices, where either comes from any of `members`.
template <class Members, class CountOf>
bool have_equal_counts(const SampleOptions& options, const Members& members, CountOf&& count_of) {
  if (options.vertices != pose_vertices_of(options)) return false;
  return options.vertices != 0 || std::ranges::all_of(members, [&](const auto& member) {
           return std::invoke(count_of, member) == std::invoke(count_of, *std::begin(members));
         });
}

/// Throws npt::Error for options that no sample can be made with.
inline void check_options(const SampleOptions& options) {
  const auto require = [](bool good, const char* what, double found, const char* expected) {
    if (!good) throw Error({.file = what, .found = std::to_string(found), .expected = expected});
  };
  require(options.yaw >= 0 && options.yaw <= 180, "yaw", options.yaw, "0 to 180 degrees");
  require(options.scale_low > 0 && std::isfinite(options.scale_low), "least scale", options.scale_low,
          "a number above 0");
  require(options.scale_high >= options.scale_low && std::isfinite(options.scale_high), "largest scale",
          options.scale_high, "at least the least scale");
  require(options.noise >= 0 && std::isfinite(options.noise), "noise", options.noise, "a number from 0");
}

}  // namespace data

}  // namespace npt::inline NPT_ABI
