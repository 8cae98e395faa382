#include <npt/engine/engine.hpp>

template class npt::engine::Core<double, npt::DefaultExecutor>;
