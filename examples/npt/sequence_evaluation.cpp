#include "sequence_evaluation.hpp"

#include <npt/core/error.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace program {

namespace {

/// Puts coordinates and faces into a mesh that a backend takes for a new one.
void load(LoadedMesh& loaded, std::span<const float> xyz, std::span<const npt::Triangle> triangles,
          std::uint64_t number) {
  npt::Mesh& mesh = loaded.mesh;
  mesh.positions.resize(xyz.size() / 3);
  std::ranges::copy(xyz, mesh.coordinates().begin());
  mesh.face_start = {0};
  mesh.corners.clear();
  for (const npt::Triangle& t : triangles) {
    mesh.corners.insert(mesh.corners.end(), t.begin(), t.end());
    mesh.face_start.push_back(mesh.corners.size());
  }
  loaded.number = number;
}

}  // namespace

std::vector<npt::SequenceErrors> evaluate_sequences(const npt::SequenceSet& set, TransferBackend& backend,
                                                    const std::function<void()>& after_frame) {
  std::vector<npt::SequenceErrors> sequences;
  LoadedMesh identity{.mesh = {}, .name = "identity"}, pose{.mesh = {}, .name = "pose"};
  std::uint64_t number = 0;
  for (std::size_t s = 0; s < set.count; ++s) {
    bool first = true;
    sequences.push_back(npt::evaluate_sequence(
        set, s,
        [&](const npt::EvaluationPair& frame, std::span<float> result) {
          if (first) load(identity, frame.identity, frame.identity_triangles, ++number);
          first = false;
          load(pose, frame.pose, frame.pose_triangles, ++number);
          const npt::Mesh moved = backend.transfer(identity, pose);
          std::ranges::copy(moved.coordinates(), result.begin());
        },
        after_frame));
  }
  return sequences;
}

SequenceMeans means_of(const std::vector<npt::SequenceErrors>& sequences) {
  SequenceMeans means;
  const auto share = 1 / static_cast<double>(sequences.size());
  for (const npt::SequenceErrors& sequence : sequences) {
    means.jitter += share * sequence.jitter;
    means.true_jitter += share * sequence.true_jitter;
    for (const npt::PairErrors& frame : sequence.frames) {
      means.pmd += share * frame.pmd / static_cast<double>(sequence.frames.size());
      means.edge_error += share * frame.edge_error / static_cast<double>(sequence.frames.size());
    }
  }
  return means;
}

}  // namespace program
