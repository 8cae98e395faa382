#include <npt/train/gradients.hpp>

template class npt::tape::GradientCore<float, npt::DefaultExecutor>;
