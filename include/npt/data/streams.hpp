/// Which random numbers belong to what: a stream for each part of each sample, apart for training and evaluation.
#pragma once

#include <npt/config.hpp>
#include <npt/core/random.hpp>

#include <cstdint>

namespace npt::inline NPT_ABI::data {

/// What a sample is made for. Each has random numbers of its own under every seed, so that a network is never evaluated on
/// what it was trained on because two seeds happen to be equal.
enum class Purpose : std::uint64_t { training = 1, evaluation, support };

/// Parts of a sample that are drawn from streams of their own: an option that takes more or fewer numbers for one of them
/// leaves the others as they are.
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

}  // namespace npt::inline NPT_ABI::data
