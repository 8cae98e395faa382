// expect: npt: a network lists its inputs
#include <npt/nn/engine/engine.hpp>

// What operator() takes is said nowhere.
struct Net {
  npt::Conv1x1<6, 3> only;
  static constexpr void visit(auto& self, auto&& visitor) { visitor("only", self.only); }
  constexpr auto operator()(auto points, auto normals) const { return cat(points, normals) | only; }
};

npt::Engine<Net> make(const npt::Model<Net>& model) { return npt::Engine<Net>(model); }
