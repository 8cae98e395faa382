/// Some of a mesh's vertices at random, without repeats: O(n) for n of V, and O(V) for a full shuffle.
#pragma once

#include <npt/config.hpp>
#include <npt/core/random.hpp>

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI::data {

/// Draws subsets and orders. Keeps its memory: a warm draw allocates nothing. One thread at a time.
class VertexChoice {
 public:
  /// chosen[0 .. n - 1]: n of 0 .. count - 1, each subset in each order equally likely (Fisher-Yates, stopped after n).
  /// Requires n <= count.
  void draw(std::uint32_t n, std::uint32_t count, Random& random, std::vector<std::uint32_t>& chosen) {
    NPT_ASSERT(n <= count);
    chosen.resize(n);
    swapped_.resize(n);
    while (deck_.size() < count) deck_.push_back(static_cast<std::uint32_t>(deck_.size()));
    for (std::uint32_t i = 0; i < n; ++i) {
      const std::uint32_t j = i + random.below(count - i);
      swapped_[i] = j;
      std::swap(deck_[i], deck_[j]);
      chosen[i] = deck_[i];
    }
    // The deck goes back to its order by undoing n swaps instead of writing it anew: n is often a fiftieth of it.
    for (std::uint32_t i = n; i > 0; --i) std::swap(deck_[i - 1], deck_[swapped_[i - 1]]);
  }

 private:
  std::vector<std::uint32_t> deck_;  ///< 0, 1, 2, ... between two draws
  std::vector<std::uint32_t> swapped_;
};

}  // namespace npt::inline NPT_ABI::data
