/// A training sample as the network sees it, and what makes samples for a trainer.
/// Shapes    pose: [Vp, 3], identity and truth: [V, 3], row major, normalised; vertex v of the truth is vertex v of the
///           identity, and no vertex of the pose mesh belongs to one of theirs
/// Source    Wang et al., CVPR 2020, section 3.1: the truth is M(a1, b2, t1), the identity's shape and vertex order in
///           the pose mesh's pose
#pragma once

#include <npt/base/error.hpp>
#include <npt/config.hpp>
#include <npt/mesh/normalise.hpp>
#include <npt/mesh/topology.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <iterator>
#include <string>
#include <vector>

namespace npt::inline NPT_ABI {

struct Sample {
  std::vector<float> pose;      ///< [Vp, 3] normalised by itself
  std::vector<float> identity;  ///< [V, 3] normalised by itself
  /// [V, 3] centred by its own bounding box and scaled by the identity's factor, so that the network's result maps back
  /// to the identity's units.
  std::vector<float> truth;
  std::vector<Edge> edges;          ///< of the identity, each once; empty for a subset of its vertices
  std::vector<Triangle> triangles;  ///< of the identity; empty for a subset of its vertices
  double scale = 1;                 ///< network units in a unit of the identity mesh: 1 where meshes are only centred

  std::size_t vertex_count() const noexcept { return identity.size() / 3; }
  std::size_t pose_vertex_count() const noexcept { return pose.size() / 3; }
};

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

/// Gives a trainer its samples. A sample depends on (seed, step, index) only, so that neither threads nor a resumed
/// training change it.
/// Threads   all members may be called by any number of threads at a time
class SampleSource {
 public:
  virtual ~SampleSource() = default;

  /// Overwrites `sample` with sample `index` (below 2^20) of the batch of `step` (below 2^36). Memory is used again.
  virtual void fill(std::uint64_t step, std::uint64_t index, Sample& sample) const = 0;

  /// The most vertices that the identity of a sample, and its pose mesh, can have.
  virtual std::size_t max_vertices() const = 0;
  virtual std::size_t max_pose_vertices() const = 0;
  /// Whether every sample's meshes have equally many vertices, as networks that pair vertices need.
  virtual bool equal_counts() const = 0;

  Sample draw(std::uint64_t step, std::uint64_t index) const {
    Sample sample;
    fill(step, index, sample);
    return sample;
  }

 protected:
  SampleSource() = default;
  SampleSource(const SampleSource&) = default;
  SampleSource& operator=(const SampleSource&) = default;
};

}  // namespace npt::inline NPT_ABI
