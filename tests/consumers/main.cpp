/// What every consumer project builds: a small network with random weights, run twice, its result checked. That of
/// find_package includes the umbrella header, which takes 10 s at -O0; the others 6.
#ifdef UMBRELLA
#include <npt/npt.hpp>
#endif
#include <npt/base/default_executor.hpp>
#include <npt/config.hpp>
#include <npt/nets/pose_transfer_net.hpp>
#include <npt/nn/engine/engine.hpp>
#include <npt/nn/engine/model.hpp>

#include <cmath>
#include <cstddef>
#include <cstdio>
#include <vector>

int main() {
  npt::Model<npt::PoseTransferNet<16>> model;
  npt::randomise(model, 1);
  const npt::Engine engine(model);
#ifdef EXPECT_NO_TBB
  static_assert(!NPT_HAS_TBB);
#else
  static_assert(NPT_HAS_TBB);
#endif
  std::vector<float> pose, identity;
  for (int i = 0; i < 300; ++i) {
    pose.push_back(std::sin(static_cast<float>(i)));
    identity.push_back(std::cos(static_cast<float>(i)));
  }
  std::vector<float> first(identity.size()), second(identity.size());
  engine({pose, identity}, first);
  engine({pose, identity}, second);
  for (std::size_t i = 0; i < first.size(); ++i)
    if (!std::isfinite(first[i]) || first[i] != second[i]) return 1;
  std::printf("npt %s, %s, threads: %d\n", NPT_VERSION, npt::compiled_isa(), engine.executor().slots());
  return 0;
}
