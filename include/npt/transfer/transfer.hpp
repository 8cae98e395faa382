/// From meshes to the network's coordinates and back: what stands between a file and an engine.
///
/// The identity mesh gives the frame of the result: its centre and scale are taken out before the network and put back
/// after it, so that the result is in the identity's units and place (training expresses the truth in the identity's
/// scale). The pose mesh is normalised by its own frame. Vertices come in any order; only positions change.
#pragma once

#include <npt/config.hpp>
#include <npt/core/error.hpp>
#include <npt/core/view.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/normalise.hpp>
#include <npt/mesh/normals.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/mesh/vertex_order.hpp>
#include <npt/transfer/options.hpp>
#include <npt/transfer/pose_points.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// An identity mesh as the network sees it, and the way back.
struct IdentityInput {
  std::vector<float> coordinates;  ///< [V, 3], normalised, in the network's order
  NormalisingTransform frame;
  std::vector<std::uint32_t> place;  ///< [V] position in the network's order of each vertex; empty: the same order
};

namespace internal {

/// x to -x.
inline void mirror(std::span<float> xyz) {
  for (std::size_t i = 0; i < xyz.size(); i += 3) xyz[i] = -xyz[i];
}

}  // namespace internal

/// Normalises an identity. `name` stands in messages of errors.
inline IdentityInput identity_input(std::span<const float> xyz, const TransferOptions& options,
                                    const std::string& name = "identity") {
  internal::expect_extent(xyz, name);
  IdentityInput input;
  input.frame = normalising_transform(xyz, options.normalisation, name);
  input.coordinates.resize(xyz.size());
  input.frame.apply(xyz, internal::view(input.coordinates));
  if (!options.invariant) return input;
  // Coincident vertices can't be told apart, so they all take the result of one of them.
  const std::vector<std::uint32_t> order = canonical_shuffle(xyz, options.seed);
  const std::vector<std::uint32_t> representative = coincident_representatives(xyz);
  const std::vector<std::uint32_t> place = inverse_order(internal::view(order));
  std::vector<float> ordered(xyz.size());
  for (std::size_t i = 0; i < order.size(); ++i)
    for (std::size_t axis = 0; axis < 3; ++axis) ordered[3 * i + axis] = input.coordinates[3 * order[i] + axis];
  input.coordinates = std::move(ordered);
  input.place.resize(order.size());
  for (std::size_t v = 0; v < order.size(); ++v) input.place[v] = place[representative[v]];
  return input;
}

/// A pose mesh as the network sees it: [count, 3], normalised. `count` 0: as many points as it has vertices. The first
/// pairing only.
inline std::vector<float> pose_input(std::span<const float> xyz, std::span<const Triangle> triangles, std::size_t count,
                                     const TransferOptions& options, const std::string& name = "pose") {
  return pose_input(xyz, choose_points(xyz, triangles, count, options, 0, name), options, name);
}

/// The network's result [V, 3] as positions in the identity's order, units and place. `out` may not be `result`.
inline void restore(const IdentityInput& identity, std::span<const float> result, std::span<float> out) {
  if (identity.place.empty()) {
    identity.frame.apply_inverse(result, out);
    return;
  }
  for (std::size_t v = 0; v < identity.place.size(); ++v)
    identity.frame.apply_inverse(result.subspan(3 * std::size_t{identity.place[v]}, 3), out.subspan(3 * v, 3));
}

/// The identity mesh with new positions; normals are recomputed if it has any.
inline Mesh with_positions(Mesh identity, const IdentityInput& input, std::span<const float> result) {
  restore(input, result, identity.coordinates());
  recompute_normals(identity);
  return identity;
}

/// Encodes what the runs of a transfer need of one pose mesh: a code for each pairing, and with options.mirror one for each
/// mirror image after them. `engine`: an Engine, or a Core of its kind.
template <class Engine, class Code>
void encode_runs(const Engine& engine, std::span<const float> xyz, std::span<const PosePoints> pairings,
                 const TransferOptions& options, std::vector<Code>& codes, const std::string& name = "pose") {
  codes.resize(pairings.size() * (options.mirror ? 2 : 1));
  for (std::size_t p = 0; p < pairings.size(); ++p) {
    std::vector<float> points = pose_input(xyz, pairings[p], options, name);
    engine.encode(points, codes[p]);
    if (!options.mirror) continue;
    internal::mirror(points);
    engine.encode(points, codes[pairings.size() + p]);
  }
}

/// Gives an identity the pose that encode_runs encoded: the mean of its runs, [V, 3], in the network's order and frame.
template <class Engine, class Code>
void decode_runs(const Engine& engine, const std::vector<Code>& codes, const IdentityInput& identity,
                 const TransferOptions& options, std::span<float> result) {
  if (codes.size() == 1) {
    engine.decode(codes[0], identity.coordinates, result);
    return;
  }
  std::vector<float> mirrored, run(result.size());
  if (options.mirror) {
    mirrored = identity.coordinates;
    internal::mirror(mirrored);
  }
  std::vector<double> sum(result.size(), 0.0);
  for (std::size_t r = 0; r < codes.size(); ++r) {
    const bool turned = options.mirror && r >= codes.size() / 2;
    engine.decode(codes[r], turned ? mirrored : identity.coordinates, run);
    if (turned) internal::mirror(run);
    for (std::size_t i = 0; i < run.size(); ++i) sum[i] += run[i];
  }
  for (std::size_t i = 0; i < sum.size(); ++i)
    result[i] = static_cast<float>(sum[i] / static_cast<double>(codes.size()));
}

/// Transfers of one sequence, or of many poses, to one identity: what depends on the identity is computed once, and all
/// frames share their random choices (see pose_points.hpp). Keeps a reference to the engine. One thread at a time.
template <class Engine>
class SequenceTransfer {
 public:
  /// Errors  npt::Error for an empty mesh and for one whose vertices are all in one point
  SequenceTransfer(const Engine& engine, Mesh identity, const TransferOptions& options = {})
      : engine_(&engine),
        options_(options),
        identity_(std::move(identity)),
        input_(identity_input(identity_.coordinates(), options)) {}

  /// The identity mesh in the frame's pose.
  /// Errors  as transfer()
  Mesh operator()(const Mesh& frame) {
    const std::size_t count = Engine::pairs_vertices() ? identity_.vertex_count() : 0;
    const auto& pairings = points_.of(frame.coordinates(), triangulate(frame), count, options_);
    encode_runs(*engine_, frame.coordinates(), pairings, options_, codes_);
    std::vector<float> result(input_.coordinates.size());
    decode_runs(*engine_, codes_, input_, options_, result);
    return with_positions(identity_, input_, result);
  }

 private:
  using Code = decltype(std::declval<const Engine&>().encode(std::span<const float>()));

  const Engine* engine_;
  TransferOptions options_;
  Mesh identity_;
  IdentityInput input_;
  SequencePoints points_;
  std::vector<Code> codes_;
};

/// The identity mesh in the pose mesh's pose.
/// Errors  npt::Error for empty meshes, for a mesh whose vertices are all in one point, for unequal vertex counts
///         where the network pairs vertices and resampling is off, and for fewer than one pairing
template <class Engine>
Mesh transfer(const Engine& engine, const Mesh& identity, const Mesh& pose, const TransferOptions& options = {}) {
  const bool paired = Engine::pairs_vertices();
  if (options.mirror || (paired && options.pairings != 1))
    return SequenceTransfer<Engine>(engine, identity, options)(pose);
  // One run needs no code that outlives it.
  const IdentityInput input = identity_input(identity.coordinates(), options);
  const std::vector<float> posed =
      pose_input(pose.coordinates(), triangulate(pose), paired ? identity.vertex_count() : 0, options);
  std::vector<float> result(input.coordinates.size());
  engine(posed, input.coordinates, result);
  return with_positions(identity, input, result);
}

}  // namespace npt::inline NPT_ABI
