/// A body's surface as candidate points, which samples for a network that reads meshes are drawn from.
#pragma once

#include <npt/base/matrix3.hpp>
#include <npt/base/random.hpp>
#include <npt/base/vec3.hpp>
#include <npt/base/weighted_choice.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/body_plan.hpp>
#include <npt/body/body_tables.hpp>
#include <npt/body/people_plan.hpp>
#include <npt/body/plan_proportions.hpp>
#include <npt/config.hpp>
#include <npt/mesh/mesh.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// A body's surface as candidate points that can be posed one by one: denser on the head, hands and feet, which grow
/// most.
class SurfaceCloud {
 public:
  static constexpr std::size_t candidates = 24000;
  static constexpr std::size_t most_joints = 6;

  struct Point {
    Vec3f rest, along, across;  ///< of the mean shape; two edges of the triangle that it lies on
    Vec3f canonical;
    float area = 1;  ///< that it stands for in the resting surface, relative to a point of the trunk
    std::array<std::uint8_t, most_joints> joint{};
    std::array<float, most_joints> weight{};
  };

  /// A box about a part, along the axes: a robot's, or a figure's made of cubes.
  struct Block {
    Vec3f low, high;
    void add(Vec3f p) {
      low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    }
  };

  /// canonical: [V, 3], where each vertex of the body belongs on the template. The plan must outlive it.
  SurfaceCloud(std::shared_ptr<const BodyModel> body, std::span<const float> canonical,
               const BodyPlan& plan = people_plan())
      : body_(std::move(body)), plan_(&plan) {
    NPT_ASSERT(body_->joint_count() == plan.joint_count() && canonical.size() == 3 * body_->vertex_count());
    joints_ = body_->joints({});
    growth_ = part_growth(plan, joints_);
    scatter(canonical);
    find_blocks();
    find_head();
  }

  const BodyModel& body() const noexcept { return *body_; }
  const BodyPlan& plan() const noexcept { return *plan_; }
  std::span<const Point> points() const noexcept { return points_; }
  std::span<const Vec3d> joints() const noexcept { return joints_; }
  /// [S, 3] the shape directions of a point.
  std::span<const float> directions(std::size_t point) const {
    return std::span(directions_).subspan(3 * point * body_->shape_count(), 3 * body_->shape_count());
  }
  /// [J, K] how each part grows with each of the plan's proportions.
  const std::vector<std::vector<Matrix3>>& growth() const noexcept { return growth_; }
  /// [J] of what each joint moves in the resting surface, hands with their wrists, the trunk as one.
  std::span<const Block> blocks() const noexcept { return blocks_; }
  /// The middle of the head, in canonical coordinates.
  Vec3f head() const noexcept { return head_; }
  /// Square metres of the resting surface for each candidate point of the trunk.
  float area_of_point() const noexcept { return area_of_point_; }

 private:
  void find_blocks() {
    std::vector<bool> begun(joints_.size());
    blocks_.resize(joints_.size());
    for (const Point& p : points_) {
      const std::size_t part = block_of(p.joint[0]);
      // What lies between two parts would make both boxes larger.
      if (p.weight[0] < 0.6F && part != 0) continue;
      if (!begun[part]) blocks_[part] = {p.rest, p.rest};
      blocks_[part].add(p.rest);
      begun[part] = true;
    }
    for (std::size_t j = 0; j < joints_.size(); ++j) blocks_[j] = blocks_[block_of(j)];
  }
  /// The joint whose block a joint's points belong to.
  std::size_t block_of(std::size_t joint) const {
    switch (plan_->joints[joint].kind) {
      case JointKind::spine:
      case JointKind::girdle:
        return 0;
      case JointKind::tip:
      case JointKind::appendage:
        return static_cast<std::size_t>(plan_->joints[joint].parent);
      default:
        return joint;
    }
  }
  void find_head() {
    float count = 0;
    for (const Point& p : points_)
      if (plan_->joints[p.joint[0]].kind == JointKind::head) head_ += p.canonical, ++count;
    head_ = head_ / std::max(count, 1.0F);
  }

  /// Candidates for each unit of area, relative to the trunk.
  double density(const Triangle& f) const {
    const BodyTables& t = body_->tables();
    double sum = 0;
    for (const std::uint32_t v : f)
      for (std::size_t k = t.weights.start[v]; k < t.weights.start[v + 1]; ++k)
        sum += plan_->joints[t.weights.column[k]].density * static_cast<double>(t.weights.value[k]) / 3;
    return sum;
  }

  void scatter(std::span<const float> canonical) {
    const BodyTables& t = body_->tables();
    const std::size_t shapes = body_->shape_count();
    const auto at = [](std::span<const float> xyz, std::uint32_t v) {
      return Vec3f{xyz[3 * std::size_t{v}], xyz[3 * std::size_t{v} + 1], xyz[3 * std::size_t{v} + 2]};
    };
    WeightedChoice areas;
    for (const Triangle& f : t.triangles) {
      const Vec3f a = at(t.v_template, f[0]);
      const float area = length(cross(at(t.v_template, f[1]) - a, at(t.v_template, f[2]) - a));
      areas.add(density(f) * static_cast<double>(area));
    }
    area_of_point_ = static_cast<float>(areas.total() / 2 / static_cast<double>(candidates));
    Random random(20260101);
    for (std::size_t i = 0; i < candidates; ++i) {
      const double part = static_cast<double>(i) + random.uniform();
      const Triangle& f = t.triangles[areas.at(areas.total() * part / static_cast<double>(candidates))];
      float u = static_cast<float>(random.uniform()), v = static_cast<float>(random.uniform());
      if (u + v > 1) u = 1 - u, v = 1 - v;
      const std::array<float, 3> share{1 - u - v, u, v};
      Point p;
      p.area = static_cast<float>(1 / density(f));
      const Vec3f a = at(t.v_template, f[0]), b = at(t.v_template, f[1]), c = at(t.v_template, f[2]);
      p.rest = a * share[0] + b * share[1] + c * share[2];
      p.along = normalised(b - a);
      p.across = normalised(cross(cross(b - a, c - a), b - a));
      p.canonical = at(canonical, f[0]) * share[0] + at(canonical, f[1]) * share[1] + at(canonical, f[2]) * share[2];
      std::vector<float> weights(joints_.size());
      for (std::size_t corner = 0; corner < 3; ++corner)
        for (std::size_t k = t.weights.start[f[corner]]; k < t.weights.start[f[corner] + 1]; ++k)
          weights[t.weights.column[k]] += share[corner] * t.weights.value[k];
      float sum = 0;
      for (std::size_t k = 0; k < most_joints; ++k) {
        const auto heaviest = std::ranges::max_element(weights);
        p.joint[k] = static_cast<std::uint8_t>(heaviest - weights.begin());
        p.weight[k] = *heaviest;
        sum += *heaviest;
        *heaviest = 0;
      }
      for (float& w : p.weight) w /= sum;
      points_.push_back(p);
      for (std::size_t s = 0; s < shapes; ++s)
        for (std::size_t axis = 0; axis < 3; ++axis) {
          float d = 0;
          for (std::size_t corner = 0; corner < 3; ++corner)
            d += share[corner] * t.shapedirs[(3 * std::size_t{f[corner]} + axis) * shapes + s];
          directions_.push_back(d);
        }
    }
  }

  std::shared_ptr<const BodyModel> body_;
  const BodyPlan* plan_;
  std::vector<Vec3d> joints_;
  std::vector<std::vector<Matrix3>> growth_;
  std::vector<Point> points_;
  std::vector<float> directions_;  ///< [points, S, 3]
  std::vector<Block> blocks_;
  Vec3f head_;
  float area_of_point_ = 0;
};

}  // namespace npt::inline NPT_ABI
