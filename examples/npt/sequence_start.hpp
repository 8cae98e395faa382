/// Where a sequence is followed from: its first frame, or, where that hardly reads as a person, another mesh with the
/// same triangles that reads better, such as a rig at rest. An astronaut's walk came out at 29e-4 from its rest pose,
/// and from its first frame, which reads the wrong way round, at 2800e-4.
#pragma once

#include <npt/base/error.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/mesh_view.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/transfer/body_interface.hpp>
#include <npt/transfer/pose_sequence.hpp>
#include <npt/transfer/prepared.hpp>

#include <algorithm>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "networks.hpp"

namespace program {

/// How many frames of a sequence beside the first are tried.
inline std::size_t frames_to_try(std::size_t frames) { return std::min<std::size_t>(frames - 1, 3); }
/// Which frame that is, 0 < i <= frames_to_try(frames): spread over the sequence.
inline std::size_t frame_to_try(std::size_t i, std::size_t frames) { return frames * i / (frames_to_try(frames) + 1); }

/// pose: of the first frame, which `frames` has prepared; anew where it begins elsewhere. load(k), k < count: another
/// mesh, or npt::Error, which is for whoever comes to that frame to tell. `vertices`: of the identity
template <class Load>
void start_where_it_reads(const PoseTransfer& transfer, npt::PoseSequence<npt::DefaultExecutor>& frames,
                          const npt::Mesh& first, std::size_t vertices, npt::PreparedPose& pose, std::size_t count,
                          const Load& load) {
  constexpr double better = 0.03;
  if (pose.body() == nullptr || pose.body()->confidence >= npt::high_confidence) return;
  npt::PreparedPose tried;
  const auto prepare = [vertices](npt::PoseSequence<npt::DefaultExecutor>& sequence, const npt::Mesh& mesh,
                                  npt::PreparedPose& prepared) {
    const std::vector<npt::Triangle> triangles = npt::triangulate(mesh);
    sequence.prepare({mesh.coordinates(), triangles, "pose"}, vertices, prepared);
  };
  double most = pose.body()->confidence + better;
  std::optional<npt::Mesh> best;
  for (std::size_t k = 0; k < count && most < npt::high_confidence; ++k) {
    try {
      npt::Mesh mesh = load(k);
      if (mesh.vertex_count() != first.vertex_count()) continue;
      npt::PoseSequence<npt::DefaultExecutor> other(transfer);
      prepare(other, mesh, tried);
      if (tried.body() == nullptr || tried.body()->confidence <= most) continue;
      most = tried.body()->confidence;
      best = std::move(mesh);
    } catch (const npt::Error&) {
      continue;
    }
  }
  if (!best) return;
  frames.restart();
  prepare(frames, *best, tried);
  prepare(frames, first, pose);
}

}  // namespace program
