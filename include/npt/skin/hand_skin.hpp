/// The skin of a hand: whether it has fingers, and a closed one's weights. Where fingers touch
/// the palm, what lies nearest on a body tells little; where a point is on the way from the wrist to a fingertip is the
/// same for a fist and an open hand.
///   r = g / (g + h)
/// g the distance from the wrist along edges, h that from the nearest fingertip: both are short on the inner side of a
/// bend and long on the outer one. The weights are those that a body's hand has at the same r. Tips are where g has its
/// greatest values around; the one whose finger parts from the others nearest to the wrist is the thumb, which stays
/// with the palm.
/// Meshes    a hand that isn't attached to a forearm counts as one without fingers
#pragma once

#include <npt/base/sort.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/hands.hpp>
#include <npt/body/skeleton.hpp>
#include <npt/config.hpp>
#include <npt/mesh/geodesics.hpp>
#include <npt/mesh/topology.hpp>
#include <npt/mesh/union_find.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

namespace skeleton::internal {

/// Skin weights in rows, and the surface that they belong to.
struct WeightRows {
  std::span<const Vec3d> points;  ///< [P]
  const Neighbours* around;       ///< of P points
  std::span<float> weights;       ///< [P, stride]
  std::size_t stride;

  float* row(std::size_t p) const { return &weights[p * stride]; }
};

NPT_INLINE_CLASS(class, HandSkin);
/// The skin of one hand, of a mesh or of a body.
template <class>
class BasicHandSkin {
 public:
  BasicHandSkin(const WeightRows& mesh, const HandJoints& joints) : mesh_(mesh), hand_(joints) {
    const auto forearm = [this](std::size_t p) {
      return static_cast<double>(mesh_.row(p)[hand_.forearm]) > of_hand(p);
    };
    std::vector<std::uint32_t> wrist;
    for (std::uint32_t p = 0; p < mesh_.points.size(); ++p) {
      const std::span<const std::uint32_t> ring = mesh_.around->of(p);
      if (of_hand(p) > 0.5 && !forearm(p) && std::any_of(ring.begin(), ring.end(), forearm)) wrist.push_back(p);
    }
    const std::vector<double> from_wrist = paths(wrist, [&](std::size_t p) { return !forearm(p); }).distance;
    find_tips(from_wrist);
    place_.assign(mesh_.points.size(), outside);
    if (tips_.empty()) return;
    Geodesics tips = paths(tips_, [&](std::size_t p) { return from_wrist[p] < far; });
    const std::vector<double>& from_tips = tips.distance;
    tip_of_ = std::move(tips.nearest);
    std::replace(tip_of_.begin(), tip_of_.end(), no_index, 0U);
    for (const double d : from_wrist)
      if (d < far) reach_ = std::max(reach_, d);
    for (std::size_t p = 0; p < place_.size(); ++p)
      if (from_wrist[p] < far && from_tips[p] < far)
        place_[p] = from_wrist[p] / std::max(from_wrist[p] + from_tips[p], negligible);
    for (const std::uint32_t p : thumb_) place_[p] = 0;
  }

  /// Whether there are four fingers beside a thumb here as there are on the body. What reaches twice as far is no
  /// hand but something that has grown together with it.
  bool like(const BasicHandSkin& body) const {
    return tips_.size() == finger_count && body.tips_.size() == finger_count && reach_ < 2 * body.reach_;
  }

  /// Weights as in `body`'s hand.
  /// Requires  like(body)
  void take(const BasicHandSkin& body) {
    const Profile profile = body.profile();
    const auto fingers = fingers_as_in(body);
    for (std::size_t p = 0; p < place_.size(); ++p) {
      if (place_[p] < 0) continue;
      const double at = place_[p] * (profile.size() - 1);
      const std::size_t low = std::min(static_cast<std::size_t>(at), profile.size() - 2);
      const double share = at - static_cast<double>(low);
      float* row = mesh_.row(p);
      const float forearm = row[hand_.forearm];
      const double all = 1 - static_cast<double>(forearm);
      std::fill_n(row, mesh_.stride, 0.0F);
      row[hand_.forearm] = forearm;
      const std::array<std::size_t, 4> joints = joints_of(fingers[tip_of_[p]]);
      for (std::size_t k = 0; k < joints.size(); ++k)
        row[joints[k]] = static_cast<float>(all * ((1 - share) * profile[low][k] + share * profile[low + 1][k]));
    }
  }

  /// Fingers that bend with the hand alone.
  void stiffen() {
    for (std::size_t p = 0; p < mesh_.points.size(); ++p) {
      float* row = mesh_.row(p);
      for (std::size_t f = 0; f < finger_count; ++f)
        for (const std::size_t k : {2U, 3U}) row[hand_.hand] += std::exchange(row[joints_of(f)[k]], 0.0F);
    }
  }

 private:
  static constexpr double far = std::numeric_limits<double>::infinity(), outside = -1;
  /// Shares of wrist, hand and finger joints, by r.
  using Profile = std::array<std::array<double, 4>, 41>;

  /// Those of wrist and hand, and of a finger.
  std::array<std::size_t, 4> joints_of(std::size_t finger) const {
    const std::size_t middle = hand_.middles[finger];
    return {hand_.wrist, hand_.hand, middle, middle + 1};
  }
  /// Shares of wrist, hand, middle and end joints at a point.
  std::array<double, 4> shares(std::size_t p) const {
    const float* row = mesh_.row(p);
    std::array<double, 4> sum{static_cast<double>(row[hand_.wrist]), static_cast<double>(row[hand_.hand])};
    for (std::size_t f = 0; f < finger_count; ++f)
      for (std::size_t k = 2; k < 4; ++k) sum[k] += static_cast<double>(row[joints_of(f)[k]]);
    return sum;
  }
  double of_hand(std::size_t p) const {
    const std::array<double, 4> s = shares(p);
    return s[0] + s[1] + s[2] + s[3];
  }

  template <class Inside>
  Geodesics paths(std::span<const std::uint32_t> from, const Inside& inside) const {
    return geodesics(mesh_.points, *mesh_.around, from, inside);
  }

  /// [tips] which of a body's fingers each of this mesh's is, as they lie beside each other.
  /// Requires  four here and there
  std::array<std::size_t, finger_count> fingers_as_in(const BasicHandSkin& body) const {
    std::array<Vec3d, finger_count> ends;  // the body's, by finger
    for (const std::uint32_t tip : body.tips_) {
      const float* row = body.mesh_.row(tip);
      std::size_t finger = 0;
      for (std::size_t f = 1; f < finger_count; ++f)
        if (row[joints_of(f)[3]] > row[joints_of(finger)[3]]) finger = f;
      ends[finger] = body.mesh_.points[tip];
    }
    std::array<std::size_t, finger_count> order{}, result{};
    std::iota(order.begin(), order.end(), std::size_t{0});
    stable_sort_by(order, [&](std::size_t i) { return dot(mesh_.points[tips_[i]], ends.back() - ends.front()); });
    for (std::size_t f = 0; f < finger_count; ++f) result[order[f]] = f;
    return result;
  }

  /// Fills tips_ and thumb_.
  void find_tips(std::span<const double> from_wrist) {
    struct Tip {
      std::uint32_t point = 0;
      double parts = 0;  ///< g where the finger parts from a longer one
    };
    std::vector<std::uint32_t> order;
    for (std::uint32_t p = 0; p < from_wrist.size(); ++p)
      if (from_wrist[p] < far) order.push_back(p);
    if (order.empty()) return;
    stable_sort_by(order, [&](std::uint32_t p) { return -from_wrist[p]; });
    const double least = 0.12 * from_wrist[order.front()];  // a finger stands out by more
    std::vector<Tip> found;
    std::vector<bool> seen(from_wrist.size(), false);
    std::vector<std::uint32_t> top(from_wrist.size());
    UnionFind pieces(from_wrist.size());
    for (const std::uint32_t p : order) {
      seen[p] = true;
      top[p] = p;
      for (const std::uint32_t n : mesh_.around->of(p)) {
        if (!seen[n] || pieces.find(n) == pieces.find(p)) continue;
        std::uint32_t longer = top[pieces.find(p)], shorter = top[pieces.find(n)];
        if (from_wrist[longer] < from_wrist[shorter]) std::swap(longer, shorter);
        if (from_wrist[shorter] - from_wrist[p] > least) found.push_back({shorter, from_wrist[p]});
        pieces.unite(p, n);
        top[pieces.find(p)] = longer;
      }
    }
    found.push_back({top[pieces.find(order.front())], 0});
    for (const Tip& t : found) tips_.push_back(t.point);
    if (found.size() < 2) return;
    // The last one to be found parts nearest to the wrist; the longest stands behind it.
    const Tip thumb = found[found.size() - 2];
    tips_.erase(tips_.end() - 2);
    const std::array<std::uint32_t, 1> from{thumb.point};
    const std::vector<double> reached =
        paths(from, [&](std::size_t p) { return from_wrist[p] < far && from_wrist[p] > thumb.parts; }).distance;
    for (std::uint32_t p = 0; p < reached.size(); ++p)
      if (reached[p] < far) thumb_.push_back(p);
  }

  /// Means over the hand without its thumb.
  Profile profile() const {
    Profile sum{};
    std::array<double, std::tuple_size_v<Profile>> count{};
    for (std::size_t p = 0; p < place_.size(); ++p) {
      const std::array<double, 4> own = shares(p);
      const double all = own[0] + own[1] + own[2] + own[3];
      if (!(place_[p] > 0) || !(all > 0)) continue;
      const auto bin = static_cast<std::size_t>(std::lround(place_[p] * (sum.size() - 1)));
      for (std::size_t k = 0; k < own.size(); ++k) sum[bin][k] += own[k] / all;
      ++count[bin];
    }
    // Bins without a point are as the one before.
    std::array<double, 4> last{1, 0, 0, 0};
    for (std::size_t b = 0; b < sum.size(); ++b) {
      if (count[b] > 0)
        for (std::size_t k = 0; k < 4; ++k) last[k] = sum[b][k] / count[b];
      sum[b] = last;
    }
    return sum;
  }

  WeightRows mesh_;
  HandJoints hand_;
  std::vector<std::uint32_t> tips_, thumb_;  ///< the fingers' tips, without the thumb's; points of the thumb
  std::vector<double> place_;                ///< [P] r; below 0 outside of the hand
  std::vector<std::uint32_t> tip_of_;        ///< [P] number of the nearest tip
  double reach_ = 0;                         ///< the greatest distance from the wrist
};

}  // namespace skeleton::internal

}  // namespace npt::inline NPT_ABI
