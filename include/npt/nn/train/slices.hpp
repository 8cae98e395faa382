/// The learned values of a parameter buffer, cut into pieces: elementwise work on several threads, and sums whose order
/// doesn't depend on them. Attributes (such as the output's scale) and the padding between tensors are in no piece.
#pragma once

#include <npt/config.hpp>
#include <npt/nn/layer/parameter.hpp>

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI {

/// Elements first .. last - 1 of a parameter buffer, of one tensor.
struct Slice {
  std::size_t first = 0, last = 0;
  std::size_t size() const { return last - first; }
};

/// 8192 elements are a few microseconds of work: enough for a task, few enough that two threads end together.
inline std::vector<Slice> learned_slices(std::span<const NamedParameter> parameters, std::size_t largest = 8192) {
  std::vector<Slice> slices;
  for (const NamedParameter& p : parameters) {
    if (p.parameter.attribute) continue;
    const auto begin = static_cast<std::size_t>(p.parameter.offset);
    const std::size_t end = begin + static_cast<std::size_t>(p.parameter.size());
    for (std::size_t first = begin; first < end; first += largest)
      slices.push_back({first, std::min(first + largest, end)});
  }
  return slices;
}

}  // namespace npt::inline NPT_ABI
