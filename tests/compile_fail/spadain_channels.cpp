// expect: the channels of this expression (Given) differ from what the layer takes (Wanted)
#include <npt/nn/engine/engine.hpp>
#include <npt/nn/layer/res_block.hpp>

// A residual block of 32 channels on an expression of 16.
struct Net {
  static constexpr npt::Input inputs[] = {{"points", 3}};
  npt::Conv1x1<3, 16> first;
  npt::SPAdaIN<32> norm;
  npt::Conv1x1<16, 3> last;
  static constexpr void visit(auto& self, auto&& visitor) {
    visitor("first", self.first);
    visitor("norm", self.norm);
    visitor("last", self.last);
  }
  constexpr auto operator()(auto points) const { return norm(points | first, points) | last; }
};

constexpr auto program = npt::graph::program_of<Net>;
