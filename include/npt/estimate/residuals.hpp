/// What speaks against an estimated body, and its energy: one number by which the estimates of a mesh are ranked.
///   E = log c + 2 log s + log p + log t
/// Each residual is a mean over many numbers of unknown deviation, which differs from character to character. With
/// Jeffreys' prior of that deviation, -log p of n such numbers is n log of their mean, whatever its unit: no residual
/// needs a weight for people and another one for monsters. The surface counts twice, since far more numbers stand
/// behind it: with once, people whose limbs were found by a search ended at 28 mm in clothes instead of 21.
/// Of 138 moments of 50 rigged characters, by families, the fit of the least energy is right in 0.83, as is the best of
/// all fits; by surface alone it is in 0.67, without the pose in 0.79; the first fit is in 0.77.
/// Units     metres; pose: squared deviations of natural poses
#pragma once

#include <npt/config.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

namespace npt::inline NPT_ABI {

struct EstimateResiduals {
  /// Between where the points are seen to belong, once the mesh is turned to stand upright and to face +z as the fitted
  /// body says, and where the fitted body has them: the mean, each counted up to `most_correspondence`.
  double correspondences = 0;
  static constexpr double most_correspondence = 0.5;
  /// Of the two parts that meet at a joint: the same of their points, and the greater distance from the surface
  /// (CorrespondenceFit::part_distances).
  struct Joint {
    double correspondences = 0, surface = 0;
  };
  std::vector<Joint> joints{};  ///< [J]
  double surface = 0;           ///< CorrespondenceFit::relative_distance
  double pose = 0;              ///< CorrespondenceFit::pose_deviation
  double shape = 0;             ///< CorrespondenceFit::shape_deviation
  double torn = 0;              ///< PlacePatches::torn, where limbs touch; else 0

  /// Below these residuals differences don't matter: people have 0.03 and 0.006, the mannequin's own meshes 0.03 and
  /// 0.001.
  static constexpr double least_correspondence = 0.01, least_surface = 0.001, least_pose = 0.1, least_torn = 0.01;

  double energy() const {
    return std::log(correspondences + least_correspondence) + energy_of_fit(surface, pose) +
           std::log(torn + least_torn);
  }
  /// The two terms that a fit knows without reading the mesh again.
  static double energy_of_fit(double surface, double pose) {
    return 2 * std::log(surface + least_surface) + std::log(pose + least_pose);
  }

  static constexpr std::size_t feature_count = 4;
  using Features = std::array<double, feature_count>;
  static constexpr std::array<const char*, feature_count> names{"correspondences", "surface", "pose", "shape"};
  /// The logarithms by which ConfidenceModel says how probable it is that the estimate is right.
  Features features() const {
    return {std::log(correspondences + least_correspondence), std::log(surface + least_surface),
            std::log(pose + least_pose), std::log(1 + shape / 100)};
  }
  static constexpr std::size_t joint_feature_count = 2;
  std::array<double, joint_feature_count> joint_features(std::size_t j) const {
    return {std::log(joints[j].correspondences + least_correspondence), std::log(joints[j].surface + least_surface)};
  }
};

}  // namespace npt::inline NPT_ABI
