/// Reads the golden cases.
#pragma once

#include <npt/io/safetensors.hpp>

#include <cstddef>
#include <string>
#include <vector>

namespace support {

inline std::string golden_path(const std::string& name) { return std::string(NPT_TEST_DATA) + "/golden/" + name; }

/// Mesh n of a [N, 3, V] tensor as [V, 3].
template <class T>
std::vector<T> mesh_of(const npt::FileTensor& tensor, std::size_t n) {
  const std::vector<double> values = npt::to_double(tensor);
  const std::size_t vertices = tensor.shape[2];
  std::vector<T> points(3 * vertices);
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (std::size_t v = 0; v < vertices; ++v)
      points[3 * v + axis] = static_cast<T>(values[(3 * n + axis) * vertices + v]);
  return points;
}

}  // namespace support
