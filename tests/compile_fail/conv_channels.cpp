// expect: the channels of this expression (Given) differ from what the layer takes (Wanted)
// expect: 64
// expect: 128
#include <npt/nn/engine/engine.hpp>
#include <npt/nn/layer/relu.hpp>

// 64 channels piped into a convolution that takes 128.
struct Net {
  static constexpr npt::Input inputs[] = {{"points", 3}};
  npt::Conv1x1<3, 64> first;
  npt::Conv1x1<128, 3> second;
  static constexpr void visit(auto& self, auto&& visitor) {
    visitor("first", self.first);
    visitor("second", self.second);
  }
  constexpr auto operator()(auto points) const { return points | first | npt::relu | second; }
};

npt::Engine<Net> make(const npt::Model<Net>& model) { return npt::Engine<Net>(model); }
