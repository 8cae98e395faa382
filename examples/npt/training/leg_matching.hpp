/// Which joints of a leg are which of a plan's leg: by the height at which they are and by the side to which they bend,
/// since a game's animals have fewer joints than their anatomy, and names that don't tell a wrist from an elbow.
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/config.hpp>
#include <npt/scene/scene.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI {

namespace rig::internal {

class LegMatch {
 public:
  /// end: where the leg stands on the floor. The plan's first joint is the first of its own.
  LegMatch(std::span<const Vec3d> own, Vec3d end, double floor, std::span<const Vec3d> model, double model_floor)
      : own_(heights(own, floor)), model_(heights(model, model_floor)) {
    for (std::size_t i = 0; i < own.size(); ++i) own_bend_.push_back(bend(own.front(), own[i], end));
    for (std::size_t i = 0; i < model.size(); ++i)
      model_bend_.push_back(i == 0 || i + 1 == model.size() ? 0 : bend(model[i - 1], model[i], model[i + 1]));
    best_.assign(model.size(), no_item);
    best_[0] = 0;
    chosen_ = best_;
    choose(1, 1, 0);
  }

  /// [model] numbers of own joints, or no_item.
  const std::vector<std::size_t>& matched() const noexcept { return best_; }
  /// How far heights and bends are from the plan's, all in all.
  double cost() const noexcept { return least_; }

 private:
  /// Above the floor, as a share of the first joint's.
  static std::vector<double> heights(std::span<const Vec3d> joints, double floor) {
    std::vector<double> result;
    for (const Vec3d p : joints) result.push_back((p.y - floor) / (joints.front().y - floor));
    return result;
  }
  /// How far a joint is before the straight way from a to b, as a share of that.
  static double bend(Vec3d a, Vec3d p, Vec3d b) {
    const Vec3d way = b - a;
    const double square = dot(way, way);
    if (!(square > 0)) return 0;
    return (p - a - way * (dot(p - a, way) / square)).z / std::sqrt(square);
  }

  double cost(std::size_t i, std::size_t own) const {
    const double off = std::abs(own_[own] - model_[i]);
    const bool ends = i + 1 == model_.size();
    // Three hundredths of the length are straight: a template's wrist, which may bend either way.
    const auto bent = [](double bend) { return std::abs(bend) > 0.03; };
    const bool wrong = !ends && bent(own_bend_[own]) && bent(model_bend_[i]) && own_bend_[own] * model_bend_[i] < 0;
    return off + (wrong ? 0.4 : 0.0);
  }

  /// The cheapest of all ways to choose from joint i of the plan on, of the own ones from `from` on.
  void choose(std::size_t i, std::size_t from, double spent) {
    if (spent >= least_) return;
    if (i == model_.size()) {
      least_ = spent, best_ = chosen_;
      return;
    }
    for (std::size_t own = from; own < own_.size(); ++own) {
      chosen_[i] = own;
      choose(i + 1, own + 1, spent + cost(i, own) + 0.1 * static_cast<double>(own - from));
    }
    chosen_[i] = no_item;
    choose(i + 1, from, spent + 0.2);
  }

  std::vector<double> own_, model_, own_bend_, model_bend_;
  std::vector<std::size_t> best_, chosen_;
  double least_ = std::numeric_limits<double>::infinity();
};

}  // namespace rig::internal

}  // namespace npt::inline NPT_ABI
