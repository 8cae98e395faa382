/// The whole network at the paper's vertex count, on one thread and on all; Eigen on the same weights and meshes.
#include <support/common.hpp>
#include <support/eigen_net.hpp>
#include <support/nets.hpp>

#include <npt/base/tbb_executor.hpp>

#include <algorithm>
#include <string>
#include <thread>

namespace {

constexpr int vertices = bench::paper_vertices;

/// A network with random weights, two meshes, and the result in double.
template <class Net>
struct Case {
  Case() : pose(support::random_points<float>(vertices, 5)), identity(support::random_points<float>(vertices, 6)) {
    npt::randomise(model, 9);
    expected = reference::forward(support::weights_of(model), support::to_map(pose), support::to_map(identity),
                                  support::variant_of<Net>(1));
  }
  static const Case& get() {
    static const Case c;
    return c;
  }
  double flops() const { return 2 * npt::graph::program_of<Net>.multiply_adds * vertices; }

  npt::Model<Net> model;
  std::vector<float> pose, identity;
  reference::Map expected;
};

template <class Net>
void forward(benchmark::State& state) {
  const Case<Net>& c = Case<Net>::get();
  const int threads = static_cast<int>(state.range(0));
  const npt::Engine engine(c.model, npt::TbbExecutor(threads));
  std::vector<float> result(c.identity.size());
  engine({c.pose, c.identity}, result);
  if (!bench::verified(state, support::relative_error(result, c.expected))) return;
  bench::time_flops(
      state, c.flops(),
      [&] {
        engine({c.pose, c.identity}, result);
      },
      threads);
}

template <int B>
void eigen(benchmark::State& state) {
  const auto& c = Case<npt::PoseTransferNet<B>>::get();
  const bench::EigenNet net(support::weights_of(c.model));
  const bench::EigenMatrix pose = bench::to_eigen(support::to_map(c.pose));
  const bench::EigenMatrix identity = bench::to_eigen(support::to_map(c.identity));
  bench::EigenMatrix y = net.forward(pose, identity);
  bench::Difference difference;
  for (int axis = 0; axis < 3; ++axis)
    for (int v = 0; v < vertices; ++v)
      difference.add(y(axis, v), c.expected.row(static_cast<std::size_t>(axis))[static_cast<std::size_t>(v)]);
  if (!bench::verified(state, difference.relative(), 1e-4)) return;
  bench::time_flops(state, c.flops(), [&] { y = net.forward(pose, identity); });
}

const int all_threads = static_cast<int>(std::thread::hardware_concurrency());

/// Registers a network on one thread, on all, and Eigen beside it.
void add(const char* name, void (*npt_forward)(benchmark::State&), void (*eigen_forward)(benchmark::State&)) {
  const auto npt_name = std::string("npt/") + name;
  benchmark::RegisterBenchmark(npt_name.c_str(), npt_forward)
      ->ArgName("threads")
      ->Arg(1)
      ->Unit(benchmark::kMillisecond);
  if (all_threads > 1)
    benchmark::RegisterBenchmark(npt_name.c_str(), npt_forward)
        ->ArgName("threads")
        ->Arg(all_threads)
        ->UseRealTime()
        ->Unit(benchmark::kMillisecond);
  if (eigen_forward != nullptr)
    benchmark::RegisterBenchmark((std::string("eigen/") + name).c_str(), eigen_forward)->Unit(benchmark::kMillisecond);
}

[[maybe_unused]] const bool registered = [] {
  add("bottleneck:1024", forward<npt::PoseTransferNet<1024>>, eigen<1024>);
  add("bottleneck:1024/relu_conv", forward<npt::PoseTransferNet<1024, npt::ReluConv>>, nullptr);
  add("bottleneck:256", forward<npt::PoseTransferNet<256>>, eigen<256>);
  add("bottleneck:128", forward<npt::PoseTransferNet<128>>, eigen<128>);
  return true;
}();

}  // namespace
