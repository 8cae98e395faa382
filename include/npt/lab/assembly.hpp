/// The last step of making a sample: from meshes in their own unit to what the network sees, normalised and shuffled.
#pragma once

#include <npt/base/random.hpp>
#include <npt/base/vec3.hpp>
#include <npt/config.hpp>
#include <npt/lab/draws.hpp>
#include <npt/lab/transfer_sample.hpp>
#include <npt/mesh/normalise.hpp>
#include <npt/mesh/points.hpp>
#include <npt/mesh/topology.hpp>
#include <npt/nn/train/sample.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI::data {

/// What a thread keeps between two samples, so that a warm one allocates little.
struct Scratch {
  VertexChoice choice;
  std::vector<std::uint32_t> identity_rows, pose_rows;  ///< which vertices of the meshes, in which order
  std::vector<std::uint32_t> vertices, places;
  std::vector<float> identity, pose, truth;  ///< meshes in their own unit

  static Scratch& of_thread() {
    thread_local Scratch scratch;
    return scratch;
  }
};

/// A mesh's vertices in a sample: `vertices` of its `count`, or all (0), in drawn order; all, without shuffle, as they
/// came.
inline void choose_rows(std::size_t count, std::size_t vertices, bool shuffle, Random& random, VertexChoice& choice,
                        std::vector<std::uint32_t>& rows) {
  if (vertices != 0 || shuffle) {
    choice.draw(static_cast<std::uint32_t>(vertices == 0 ? count : vertices), static_cast<std::uint32_t>(count), random,
                rows);
    return;
  }
  rows.resize(count);
  std::iota(rows.begin(), rows.end(), std::uint32_t{0});
}

/// out[i] = vertex rows[i] of `xyz`, transformed.
inline void gather(const NormalisingTransform& transform, std::span<const float> xyz,
                   std::span<const std::uint32_t> rows, std::vector<float>& out) {
  out.resize(3 * rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Vec3f p = transform.apply(point_at(xyz, rows[i])).as<float>();
    out[3 * i] = p.x, out[3 * i + 1] = p.y, out[3 * i + 2] = p.z;
  }
}

/// places[rows[i]] = i: where an order of all vertices puts each of them.
inline void places_of(std::span<const std::uint32_t> rows, std::vector<std::uint32_t>& places) {
  places.resize(rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) places[rows[i]] = static_cast<std::uint32_t>(i);
}

/// Edges between the new places of their vertices, a < b; in the old order of the edges.
inline void renumber_edges(std::span<const std::uint32_t> places, std::span<const Edge> edges, std::vector<Edge>& out) {
  out.resize(edges.size());
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const std::uint32_t a = places[edges[e][0]], b = places[edges[e][1]];
    out[e] = {std::min(a, b), std::max(a, b)};
  }
}

inline void renumber_triangles(std::span<const std::uint32_t> places, std::span<const Triangle> triangles,
                               std::vector<Triangle>& out) {
  out.resize(triangles.size());
  for (std::size_t t = 0; t < triangles.size(); ++t)
    out[t] = {places[triangles[t][0]], places[triangles[t][1]], places[triangles[t][2]]};
}

/// Fills the coordinates from the scratch's meshes and rows. Those meshes are what is normalised, whichever of their
/// vertices the sample takes.
inline void normalise_into(const Scratch& scratch, Normalisation normalisation, Sample& sample) {
  const NormalisingTransform identity = normalising_transform(scratch.identity, normalisation, "identity of a sample");
  NormalisingTransform truth = normalising_transform(
      scratch.truth, normalisation == Normalisation::none ? Normalisation::none : Normalisation::centre,
      "truth of a sample");
  truth.scale = identity.scale;
  sample.inputs.resize(2);
  gather(normalising_transform(scratch.pose, normalisation, "pose mesh of a sample"), scratch.pose, scratch.pose_rows,
         pose_of(sample));
  gather(identity, scratch.identity, scratch.identity_rows, identity_of(sample));
  gather(truth, scratch.truth, scratch.identity_rows, sample.truth);
  sample.reference = 1;
  sample.scale = identity.scale;
}

}  // namespace npt::inline NPT_ABI::data
