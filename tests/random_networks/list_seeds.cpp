// list_seeds FIRST COUNT: the first COUNT seeds from FIRST on whose typed network can be lowered, both for the engine
// and for training.
#include <npt/nn/graph/lower.hpp>
#include <npt/nn/tape/lower.hpp>

#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include "composition.hpp"
#include "recorded_graph.hpp"

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  using namespace random_networks;
  std::uint64_t seed = std::strtoull(argv[1], nullptr, 10);
  for (std::uint64_t left = std::strtoull(argv[2], nullptr, 10); left > 0; ++seed) {
    const RecordedGraph recorded = record(composition_of(seed, hidden_condition), Operations::of_the_library);
    try {
      const npt::graph::Graph used = npt::graph::reaching_output(recorded.graph);
      npt::graph::lower(used);
      npt::tape::lower_to_tape(used);
    } catch (const char*) {
      continue;
    }
    std::printf("%llu\n", static_cast<unsigned long long>(seed));
    --left;
  }
}
