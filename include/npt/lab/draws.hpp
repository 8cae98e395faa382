/// What is random about a sample: a stream of numbers for each of its parts, and which vertices in which order.
#pragma once

#include <npt/base/random.hpp>
#include <npt/config.hpp>

#include <cstdint>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI::data {

/// What a sample is made for. Each has random numbers of its own under every seed, so that a network is never evaluated
/// on what it was trained on because two seeds happen to be equal.
enum class Purpose : std::uint64_t { training = 1, evaluation, support };

/// Parts of a sample that are drawn from streams of their own: an option that takes more or fewer numbers for one of
/// them leaves the others as they are.
enum class Part : std::uint64_t {
  choice,  ///< which body, species, label
  identity_shape,
  identity_pose,
  pose_shape,
  pose,
  identity_order,
  pose_order,
  augmentation,
  noise
};

inline constexpr std::uint64_t max_step = std::uint64_t{1} << 36;
inline constexpr std::uint64_t max_index = std::uint64_t{1} << 20;

/// The numbers for one part of sample `index` of `step`. Requires step < 2^36 and index < 2^20.
inline Random random_for(Purpose purpose, std::uint64_t seed, std::uint64_t step, std::uint64_t index, Part part) {
  NPT_ASSERT(step < max_step && index < max_index);
  const std::uint64_t sample = step << 20 | index;
  return Random(seed, static_cast<std::uint64_t>(purpose) << 60 | sample << 4 | static_cast<std::uint64_t>(part));
}

/// Draws some of a mesh's vertices, without repeats: O(n) for n of V. Keeps its memory: a warm draw allocates nothing.
/// One thread at a time.
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
