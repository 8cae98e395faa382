/// A training sample as the network sees it, and what makes samples for a trainer.
/// Shapes    inputs: [V, channels] each, truth: [V, 3], row major
#pragma once

#include <npt/config.hpp>
#include <npt/mesh/topology.hpp>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace npt::inline NPT_ABI {

struct Sample {
  std::vector<std::vector<float>> inputs;  ///< in the network's order
  std::vector<float> truth;                ///< [V, 3] what the result should be
  std::vector<Edge> edges;                 ///< of the result, each once; empty: losses on edges don't count
  std::vector<Triangle> triangles;         ///< likewise
  int reference = -1;  ///< number of the input whose edge lengths are right for the result; -1: none
  double scale = 1;    ///< network units in a unit of the meshes

  std::size_t vertex_count() const noexcept { return truth.size() / 3; }
};

/// Gives a trainer its samples. A sample depends on (seed, step, index) only, so that neither threads nor a resumed
/// training change it.
/// Threads   all members may be called by any number of threads at a time
class SampleSource {
 public:
  virtual ~SampleSource() = default;

  /// Overwrites `sample` with sample `index` (below 2^20) of the batch of `step` (below 2^36). Memory is used again.
  virtual void fill(std::uint64_t step, std::uint64_t index, Sample& sample) const = 0;

  /// The most vertices that a sample's truth can have.
  virtual std::size_t max_vertices() const = 0;
  /// Whether all inputs of every sample have equally many vertices, as networks need that read them vertex by vertex.
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
