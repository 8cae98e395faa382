#include <npt/nn/train/gradients.hpp>

namespace npt::inline NPT_ABI {

namespace tape {
template OuterKernel<double> outer_kernel_of<double, 1>(int);
template OuterKernel<double> outer_kernel_of<double, kernel::panel_registers>(int);
template class GradientCore<double, DefaultExecutor>;
}  // namespace tape

}  // namespace npt::inline NPT_ABI
