/// Disjoint sets of the numbers below n, which are united and asked for.
/// Numerics    a set is named by its least number, in whatever order sets were united
/// Complexity  O(log n) a call on the average: path halving, without ranks
/// Source      Tarjan, "Efficiency of a good but not linear set union algorithm", 1975
#pragma once

#include <npt/config.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace npt::inline NPT_ABI {

class UnionFind {
 public:
  /// Each number is a set of its own.
  explicit UnionFind(std::size_t size) : parent_(size) { std::iota(parent_.begin(), parent_.end(), 0U); }

  /// The least number of a's set.
  std::uint32_t find(std::uint32_t a) {
    while (parent_[a] != a) a = parent_[a] = parent_[parent_[a]];
    return a;
  }
  /// Makes the sets of a and b one. False where they are one already.
  bool unite(std::uint32_t a, std::uint32_t b) {
    a = find(a);
    b = find(b);
    parent_[std::max(a, b)] = std::min(a, b);
    return a != b;
  }
  /// [n] The least number of each number's set.
  std::vector<std::uint32_t> sets() {
    for (std::uint32_t a = 0; a < parent_.size(); ++a) parent_[a] = find(a);
    return parent_;
  }

 private:
  std::vector<std::uint32_t> parent_;
};

}  // namespace npt::inline NPT_ABI
