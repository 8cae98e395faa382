// Networks by the hundred that are graphs at run time: the lowerings are called there, and the loops of their chains
// come from a table of all chains of up to two layers, with NPT_LONG_TESTS three. Nothing is compiled for a network, so
// that 200 a second are checked: the engine in fp32 and bfloat16, the tape in double (its table takes longest to
// compile).
#include <doctest/doctest.h>

#include <npt/nn/layer/instance_norm.hpp>
#include <npt/nn/layer/spadain.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <string>
#include <vector>

#include "blend.hpp"
#include "composition.hpp"
#include "network.hpp"
#include "recorded_graph.hpp"

namespace random_networks {

namespace {

namespace graph = npt::graph;
namespace kernel = npt::kernel;

#ifdef NPT_LONG_TESTS
constexpr std::size_t longest_chain = 3;
#else
constexpr std::size_t longest_chain = 2;
#endif

struct CompiledChain {
  std::vector<graph::OperationId> operations;
  kernel::RowTransform<float> fp32 = nullptr, bf16 = nullptr;
  npt::tape::ChainLoops<double> tape{};
};
using Chains = std::vector<CompiledChain>;

template <class... Ops>
void add_chains(Chains& chains) {
  constexpr bool adds = (std::is_same_v<Ops, kernel::AddTile> || ...);
  constexpr bool normalises = (Ops::normalises || ...);
  constexpr bool finishes =
      !normalises && ((Ops::other_channels == 0) && ...);  // in front of a norm nothing reads a second input
  CompiledChain chain{.operations = {graph::operation_id<Ops>...}};
  chain.fp32 = &kernel::transform_rows<float, Ops...>;
  if constexpr (!adds) {
    if constexpr (npt::simd::has_bf16) chain.bf16 = &kernel::transform_rows_to_bf16<float, Ops...>;
    chain.tape = npt::tape::internal::loops_of_chain<double, true, true, finishes, Ops...>();
  }
  chains.push_back(std::move(chain));
  if constexpr (sizeof...(Ops) < longest_chain) {
    add_chains<Ops..., Blend>(chains);
    add_chains<Ops..., npt::Modulate<3>>(chains);
    if constexpr (!adds && !normalises) add_chains<Ops..., npt::InstanceNorm>(chains);
    if constexpr (!normalises) add_chains<Ops..., kernel::AddTile>(chains);
  }
}

const Chains& compiled_chains() {
  static const Chains chains = [] {
    Chains all;
    add_chains<>(all);
    return all;
  }();
  return chains;
}

const CompiledChain* find(const graph::Signature& signature) {
  for (const CompiledChain& chain : compiled_chains())
    if (static_cast<int>(chain.operations.size()) == signature.count &&
        std::equal(chain.operations.begin(), chain.operations.end(), signature.operations.begin()))
      return &chain;
  return nullptr;
}

/// A composition as a recorded graph, and everything that is made of it.
class RecordedNetwork {
 public:
  explicit RecordedNetwork(const Composition& composition)
      : recorded_(record(composition, Operations::one_activation)), used_(graph::reaching_output(recorded_.graph)) {
    network_.text = text_of(composition);
    network_.graph = &used_;
    network_.parameters = recorded_.parameters;
    network_.buffer_size = recorded_.buffer_size;
    lower();
  }
  RecordedNetwork(const RecordedNetwork&) = delete;
  RecordedNetwork& operator=(const RecordedNetwork&) = delete;

  const Network& network() const { return network_; }

 private:
  void lower() {
    try {
      program_ = graph::lower(used_);
      bf16_program_ = graph::lower(used_, {.pack_every_operand = true});
      if (find_rows(*program_)) network_.program = &*program_;
      if (npt::simd::has_bf16 && network_.program != nullptr) network_.bf16_program = &*bf16_program_;
    } catch (const char*) {  // lower() says what it can't express
    }
    network_.fp32.rows = rows_fp32_;
    network_.bf16_rows = rows_bf16_;
    try {
      tape_ = npt::tape::lower_to_tape(used_);
      if (find_loops(*tape_)) network_.tape = &*tape_;
    } catch (const char*) {
    }
    network_.fp64.tape = loops_;
  }

  bool find_rows(const graph::Program& program) {
    for (int s = 0; s < program.signature_count; ++s) {
      const CompiledChain* chain = find(program.signatures[static_cast<std::size_t>(s)]);
      if (chain == nullptr) return false;
      rows_fp32_.push_back(chain->fp32);
      rows_bf16_.push_back(chain->bf16);
    }
    return true;
  }
  bool find_loops(const npt::tape::Tape& tape) {
    for (int s = 0; s < tape.signature_count; ++s) {
      const CompiledChain* chain = find(tape.signatures[static_cast<std::size_t>(s)].operations);
      if (chain == nullptr) return false;
      loops_.push_back(chain->tape);
    }
    return true;
  }

  RecordedGraph recorded_;
  graph::Graph used_;  ///< what reaches the output
  Network network_;
  std::optional<graph::Program> program_, bf16_program_;
  std::optional<npt::tape::Tape> tape_;
  std::vector<kernel::RowTransform<float>> rows_fp32_, rows_bf16_;
  std::vector<npt::tape::ChainLoops<double>> loops_;
};

std::uint64_t number_from_environment(const char* name, std::uint64_t otherwise) {
  const char* text = std::getenv(name);
  return text == nullptr ? otherwise : std::strtoull(text, nullptr, 10);
}

}  // namespace

}  // namespace random_networks

TEST_CASE("graphs by the hundred: engine, tape and plain loops agree") {
  using namespace random_networks;
  const std::uint64_t first = number_from_environment("NPT_FIRST_SEED", 1);
  const std::uint64_t count = number_from_environment("NPT_SEEDS", 200);
  std::uint64_t engines = 0, tapes = 0;
  for (std::uint64_t seed = first; seed < first + count; ++seed) {
    const RecordedNetwork recorded(composition_of(seed, 3));
    engines += recorded.network().program != nullptr ? 1U : 0U;
    tapes += recorded.network().tape != nullptr ? 1U : 0U;
    check(recorded.network(), seed);
  }
  MESSAGE(count, " graphs, ", engines, " run by the engine, ", tapes, " trained");
  // What can't be lowered, or has a longer chain than the table, proves nothing: most must be neither.
  if (count >= 100) {
    CHECK(2 * engines > count);
    CHECK(2 * tapes > count);
  }
}
