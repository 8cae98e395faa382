/// Poses of clips as joint angles: a moment of a clip, some between two moments, some with noise.
/// Shapes    a pose: [J, 3] axis angles in radians, an array or a vector of numbers
#pragma once

#include <npt/base/random.hpp>
#include <npt/config.hpp>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace npt::inline NPT_ABI {

template <class Angles>
class ClipPoses {
 public:
  /// Clips, of frames each. One without frames is left out.
  void add(const std::vector<std::vector<Angles>>& clips) {
    for (const auto& clip : clips)
      if (!clip.empty()) clips_.push_back(clip);
  }
  bool empty() const noexcept { return clips_.empty(); }

  /// Every clip is equally likely. Four in ten poses lie between those of two clips, seven in ten have noise of up to
  /// 0.2 radians on all angles but the root's. Requires a clip.
  Angles sample(Random& random) const {
    Angles pose = frame(random);
    const bool between = random.uniform() < 0.4;
    const Angles other = frame(random);
    const auto share = static_cast<float>(between ? random.uniform() : 0.0);
    const double sigma = random.uniform() < 0.3 ? 0 : random.uniform(0.02, 0.2);
    for (std::size_t i = 0; i < pose.size(); ++i) {
      pose[i] += share * (other[i] - pose[i]);
      if (i >= 3) pose[i] += static_cast<float>(sigma * random.normal());
    }
    return pose;
  }

 private:
  const Angles& frame(Random& random) const {
    const auto& clip = clips_[random.below(static_cast<std::uint32_t>(clips_.size()))];
    return clip[random.below(static_cast<std::uint32_t>(clip.size()))];
  }

  std::vector<std::vector<Angles>> clips_;
};

}  // namespace npt::inline NPT_ABI
