// A network in a file that has `using namespace npt`, and std beside it: every name of the vocabulary is found, the C
// library's tanh too.
#include <doctest/doctest.h>

#include <npt/npt.hpp>

#include <cmath>
#include <vector>

#include "support/nets.hpp"
#include "support/plain_loops.hpp"

namespace {

using namespace npt;  // NOLINT(google-build-using-namespace): what is tested
using namespace std;  // NOLINT(google-build-using-namespace)

struct PlainVocabulary {
  static constexpr npt::Input inputs[] = {{"pose", 3}, {"identity", 3}};
  Conv1x1<3, 8> a;
  SPAdaIN<8> s;
  ResBlock<8> block;
  Conv1x1<11, 8> b;
  Conv1x1<8, 8> d;
  Conv1x1<11, 3> c;
  static constexpr void visit(auto& self, auto&& visitor) {
    visitor("a", self.a);
    visitor("s", self.s);
    visitor("block", self.block);
    visitor("b", self.b);
    visitor("c", self.c);
    visitor("d", self.d);
  }
  constexpr auto operator()(auto pose, auto identity) const {
    const auto f = pose | a | instance_norm | relu | max_pool;
    const auto g = block(s(cat(f, identity) | b, identity) | tanh() | d, identity);
    return cat(g | d | tanh, identity) | c | tanh;
  }
};

}  // namespace

TEST_CASE("a network compiles under using namespace npt and std, and computes what it says") {
  Model<PlainVocabulary, double> model;
  randomise(model, 3);
  const Engine<PlainVocabulary, double> engine(model, 1);
  const auto pose = support::random_points<double>(70, 1), identity = support::random_points<double>(50, 2);
  vector<double> result(identity.size());
  engine({pose, identity}, result);
  CHECK(support::relative_error(result, plain::forward(model, support::to_map(pose), support::to_map(identity))) <
        1e-10);
  CHECK(tanh(0.0) == 0.0);  // the C library's is still there
}
