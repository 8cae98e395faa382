#include <doctest/doctest.h>

#include <npt/nets/pose_transfer_net.hpp>
#include <npt/nn/tape/lower.hpp>

#include <array>
#include <cstddef>

namespace tape = npt::tape;

namespace {

template <class Net>
constexpr const tape::Tape& tape_of = tape::tape_of<Net>;

std::size_t index(int i) { return static_cast<std::size_t>(i); }

/// Runs a tape backwards on names: what each buffer holds when it is written, added to and read.
void check_adjoints(const tape::Tape& t) {
  std::array<std::array<int, tape::max_adjoints>, 2> buffers{};
  for (auto& side : buffers) side.fill(-1);
  const auto holder = [&](int a) -> int& {
    return buffers[t.activation(t.adjoint(a).activation).encoded ? 0 : 1][index(t.adjoint(a).buffer)];
  };
  for (int a = 0; a < t.adjoint_count; ++a)
    if (t.adjoint(a).starts_at_zero) holder(a) = a;
  for (int i = t.stage_count - 1; i >= 0; --i) {
    for (int a = 0; a < t.adjoint_count; ++a)
      if (t.adjoint(a).activation == t.stage(i).output && t.adjoint(a).dense) CHECK(holder(a) == a);
    for (int p = 0; p < t.stage(i).path_count; ++p) {
      const tape::ReadPath& path = t.stage(i).paths[index(p)];
      if (path.adjoint < 0) continue;
      if (path.overwrites)
        holder(path.adjoint) = path.adjoint;
      else
        CHECK(holder(path.adjoint) == path.adjoint);
    }
  }
}

}  // namespace

TEST_CASE("the paper's network lowers to a stage a convolution and one that gathers the result") {
  constexpr const tape::Tape& t = tape_of<npt::PoseTransferNet<>>;
  static_assert(t.stage_count == 16 + 1);
  static_assert(t.multiply_adds == 6035762);  // as the program's
  static_assert(t.paired);
  static_assert(!tape_of<npt::PoseTransferNet<64, npt::ConvRelu, npt::Pooled>>.paired);
  CHECK(!t.stage(t.stage_count - 1).product);
}

TEST_CASE("an adjoint's buffer holds it from the first gradient that arrives to the stage that takes it on") {
  check_adjoints(tape_of<npt::PoseTransferNet<>>);
  check_adjoints(tape_of<npt::PoseTransferNet<128, npt::ReluConv>>);
  check_adjoints(tape_of<npt::PoseTransferNet<128, npt::ConvRelu, npt::Pooled>>);
  check_adjoints(tape_of<npt::PoseTransferNet<128, npt::ReluConv, npt::Pooled>>);
}
