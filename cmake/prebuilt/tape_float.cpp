#include <npt/train/gradients.hpp>
#include <npt/train/trainer.hpp>

template class npt::tape::GradientCore<float, npt::DefaultExecutor>;
template class npt::Trainer<npt::tape::GradientCore<float, npt::DefaultExecutor>>;
