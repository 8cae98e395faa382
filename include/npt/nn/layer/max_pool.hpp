/// Maximum over the vertices: y[c] = max over v of x[c, v]. The paper's compact pose feature (supplement C.2).
/// Shapes     x: [C, V]   y: [C], which broadcasts to every vertex where it meets per-vertex channels
/// Numerics   NaN in gives NaN out
/// Gradients  x: at the first vertex that has the maximum
#pragma once

#include <npt/config.hpp>

namespace npt::inline NPT_ABI {

struct MaxPool {};
inline constexpr MaxPool max_pool{};

}  // namespace npt::inline NPT_ABI
