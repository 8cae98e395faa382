#include <npt/base/default_executor.hpp>
#include <npt/nn/engine/engine.hpp>
#if NPT_HAS_TBB
#include <npt/base/tbb_executor.hpp>
#endif

namespace npt::inline NPT_ABI {

#if NPT_HAS_TBB
template class BasicTbbExecutor<>;
#endif

namespace kernel {
template MicroKernel<float> micro_kernel_of<float, Product::plain>(int);
template MicroKernel<float> micro_kernel_of<float, Product::bf16_pairs>(int);
template void add_few_columns(int, int, const float*, const float*, float*);
template void multiply_few_rows(int, int, const float*, const float*, const float*, int, float*);
template void gather_moments(const float*, std::size_t, int, int, float*, float*);
}  // namespace kernel

template bool engine::supports<float>(Precision);
template class engine::Core<float, DefaultExecutor>;

}  // namespace npt::inline NPT_ABI
