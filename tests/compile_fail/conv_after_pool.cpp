// expect: this layer needs values per vertex, but the expression was pooled
#include <npt/nn/engine/engine.hpp>
#include <npt/nn/layer/relu.hpp>

// A convolution over the vertices of what no longer has any.
struct Net {
  static constexpr npt::Input inputs[] = {{"pose", 3}, {"identity", 3}};
  npt::Conv1x1<3, 8> first;
  npt::Conv1x1<8, 8> second;
  npt::Conv1x1<11, 3> last;
  static constexpr void visit(auto& self, auto&& visitor) {
    visitor("first", self.first);
    visitor("second", self.second);
    visitor("last", self.last);
  }
  constexpr auto operator()(auto pose, auto identity) const {
    return cat(pose | first | npt::relu | npt::max_pool | second, identity) | last;
  }
};

constexpr auto program = npt::graph::program_of<Net>;
