/// Counter-based random numbers: Philox4x32-10 (Salmon et al., "Parallel Random Numbers: As Easy as 1, 2, 3", SC 2011).
/// A draw depends on (seed, stream, position) only, never on threads, platform or library.
#pragma once

#include <npt/config.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// One Philox4x32-10 block: a keyed bijection of a 128-bit counter.
constexpr std::array<std::uint32_t, 4> philox(std::array<std::uint32_t, 4> counter, std::array<std::uint32_t, 2> key) {
  for (int round = 0; round < 10; ++round) {
    const std::uint64_t a = std::uint64_t{0xD2511F53U} * counter[0];
    const std::uint64_t b = std::uint64_t{0xCD9E8D57U} * counter[2];
    counter = {static_cast<std::uint32_t>(b >> 32) ^ counter[1] ^ key[0], static_cast<std::uint32_t>(b),
               static_cast<std::uint32_t>(a >> 32) ^ counter[3] ^ key[1], static_cast<std::uint32_t>(a)};
    key[0] += 0x9E3779B9U;
    key[1] += 0xBB67AE85U;
  }
  return counter;
}

/// A stream of random numbers. Streams of one seed are independent; copies continue from the same position.
class Random {
 public:
  using result_type = std::uint32_t;

  explicit constexpr Random(std::uint64_t seed, std::uint64_t stream = 0) : seed_(seed), stream_(stream) {}

  static constexpr result_type min() { return 0; }
  static constexpr result_type max() { return 0xFFFFFFFFU; }

  constexpr std::uint32_t operator()() {
    const std::size_t lane = position_ % 4;
    if (lane == 0) {
      const std::uint64_t block = position_ / 4;
      block_ = philox({static_cast<std::uint32_t>(block), static_cast<std::uint32_t>(block >> 32),
                       static_cast<std::uint32_t>(stream_), static_cast<std::uint32_t>(stream_ >> 32)},
                      {static_cast<std::uint32_t>(seed_), static_cast<std::uint32_t>(seed_ >> 32)});
    }
    ++position_;
    return block_[lane];
  }

  /// Uniform in [0, 1), 53 bits.
  constexpr double uniform() {
    const std::uint64_t high = (*this)() >> 5;
    const std::uint64_t low = (*this)() >> 6;
    return static_cast<double>((high << 26) | low) * 0x1p-53;
  }
  constexpr double uniform(double low, double high) { return low + (high - low) * uniform(); }

  /// Standard normal (Box-Muller, one of the pair).
  double normal() {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
    return radius * std::cos(2.0 * std::numbers::pi * uniform());
  }

  /// Uniform in 0 .. n-1 without bias (Lemire's multiplication with rejection). Requires n > 0.
  constexpr std::uint32_t below(std::uint32_t n) {
    NPT_ASSERT(n > 0);
    const std::uint32_t threshold = (0U - n) % n;
    for (;;) {
      const std::uint64_t product = std::uint64_t{(*this)()} * n;
      if (static_cast<std::uint32_t>(product) >= threshold) return static_cast<std::uint32_t>(product >> 32);
    }
  }

 private:
  std::uint64_t seed_;
  std::uint64_t stream_;
  std::uint64_t position_ = 0;
  std::array<std::uint32_t, 4> block_{};
};

/// A uniformly random order of 0 .. n-1 (Fisher-Yates), into memory that is used again. order[new position] = old
/// position.
NPT_INLINE void random_permutation(std::uint32_t n, Random& random, std::vector<std::uint32_t>& order) {
  order.resize(n);
  for (std::uint32_t i = 0; i < n; ++i) order[i] = i;
  for (std::uint32_t i = n; i > 1; --i) std::swap(order[i - 1], order[random.below(i)]);
}

/// A uniformly random order of 0 .. n-1 (Fisher-Yates). result[new position] = old position.
NPT_INLINE std::vector<std::uint32_t> random_permutation(std::uint32_t n, Random& random) {
  std::vector<std::uint32_t> order;
  random_permutation(n, random, order);
  return order;
}

}  // namespace npt::inline NPT_ABI
