// expect: only expressions of equal channel counts can be added
#include <npt/nn/engine/engine.hpp>
#include <npt/nn/layer/relu.hpp>

// 8 channels plus 9 channels.
struct Net {
  static constexpr npt::Input inputs[] = {{"points", 3}};
  npt::Conv1x1<3, 8> a;
  npt::Conv1x1<3, 9> b;
  npt::Conv1x1<8, 3> last;
  static constexpr void visit(auto& self, auto&& visitor) {
    visitor("a", self.a);
    visitor("b", self.b);
    visitor("last", self.last);
  }
  constexpr auto operator()(auto points) const { return ((points | a) + (points | b)) | last; }
};

constexpr auto program = npt::graph::program_of<Net>;
