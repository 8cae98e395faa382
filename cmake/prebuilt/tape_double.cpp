#include <npt/train/gradients.hpp>

template class npt::tape::GradientCore<double, npt::DefaultExecutor>;
