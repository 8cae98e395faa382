#include <npt/nn/train/gradients.hpp>
#include <npt/nn/train/trainer.hpp>

namespace npt::inline NPT_ABI {

namespace tape {
template OuterKernel<float> outer_kernel_of<float, 1>(int);
template OuterKernel<float> outer_kernel_of<float, kernel::panel_registers>(int);
template class GradientCore<float, DefaultExecutor>;
}  // namespace tape

template class Trainer<tape::GradientCore<float, DefaultExecutor>>;

}  // namespace npt::inline NPT_ABI
