/// What training varies of a kind of body: proportions, poses, and what is put on a body or taken from it.
/// Shapes    angles: [3 J] axis angles of the plan's joints; proportions: [K] relative changes, in the plan's order
/// Threads   all members are const
#pragma once

#include <npt/base/random.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_plan.hpp>
#include <npt/config.hpp>
#include <training/dress.hpp>
#include <training/props.hpp>
#include <training/surface_cloud.hpp>

#include <vector>

namespace npt::inline NPT_ABI {

class BodyVariation {
 public:
  struct Pose {
    std::vector<float> angles;
    bool anywhere = false;  ///< is drawn in any direction more often than others: crouching, lying
  };

  /// The plan must outlive it. elsewhere: where the points of a surface belong that is none of this kind, in canonical
  /// coordinates: far from every body, and in its plane of symmetry.
  BodyVariation(const BodyPlan& plan, Vec3f elsewhere) : plan_(plan), elsewhere_(elsewhere) {}
  BodyVariation(const BodyVariation&) = delete;
  BodyVariation& operator=(const BodyVariation&) = delete;
  virtual ~BodyVariation() = default;

  const BodyPlan& plan() const noexcept { return plan_; }
  Vec3f elsewhere() const noexcept { return elsewhere_; }

  virtual std::vector<double> draw_proportions(Random& random) const = 0;
  virtual Pose draw_pose(Random& random) const = 0;
  virtual data::Dress draw_dress(Random& random) const = 0;
  /// What is carried or worn beside that.
  virtual std::vector<data::Prop> draw_props(Random&) const { return {}; }
  /// Moves a resting point outwards to where its clothes, hair or wool are; false: nothing is there. swollen: by how
  /// much the surface is larger there.
  virtual bool clothe(const SurfaceCloud& cloud, const SurfaceCloud::Point& p, const data::Dress& dress, Vec3f& at,
                      float& swollen) const = 0;

 private:
  const BodyPlan& plan_;
  Vec3f elsewhere_;
};

}  // namespace npt::inline NPT_ABI
