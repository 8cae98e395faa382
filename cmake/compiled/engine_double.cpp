#include <npt/nn/engine/engine.hpp>

namespace npt::inline NPT_ABI {

namespace kernel {
template MicroKernel<double> micro_kernel_of<double, Product::plain>(int);
template void gather_moments(const double*, std::size_t, int, int, double*, double*);
}  // namespace kernel

template class engine::Core<double, DefaultExecutor>;

}  // namespace npt::inline NPT_ABI
