#include <npt/engine/engine.hpp>

template class npt::engine::Core<float, npt::DefaultExecutor>;
