// expect: the channels of this expression (Given) differ from what the layer takes (Wanted)
#include <npt/nn/engine/engine.hpp>

// A network has to end in three coordinates.
struct Net {
  static constexpr npt::Input inputs[] = {{"points", 3}};
  npt::Conv1x1<3, 4> only;
  static constexpr void visit(auto& self, auto&& visitor) { visitor("only", self.only); }
  constexpr auto operator()(auto points) const { return points | only; }
};

constexpr auto program = npt::graph::program_of<Net>;
