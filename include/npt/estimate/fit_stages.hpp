/// The stages of a fit of a body to a read surface (reading_fit.hpp): what counts in each, how much, how far away, and
/// at how many points.
/// Units     metres; radians
#pragma once

#include <npt/config.hpp>

#include <cstddef>

namespace npt::inline NPT_ABI {

namespace fit::internal {

/// The weights and sizes of a stage.
struct FitStage {
  int iterations = 0;
  double enough = 1e-2;  ///< a step that makes E less by a smaller share of it is the last one
  /// E without priors at which they count as given, and places not at all; above, both grow along with it: the farther
  /// the body stays from the surface, as under clothes, the less the surface alone says.
  double usual_distance = 0;
  double slack = 0;           ///< E may grow by this share of it in a step: closest points jump
  double scale = 0.1;         ///< of the robust kernel, in metres
  double place_weight = 0;    ///< of the places
  double surface_weight = 1;  ///< of the distances
  double facing = 0;          ///< least cosine between normals
  double pose_prior = 0, bend_prior = 0, shape_prior = 0;
  std::size_t probes = 0, samples = 0, places = 0;
};

/// In the order in which a fit takes them.
struct FitStages {
  /// To the read places alone.
  static constexpr FitStage places{.iterations = 4,
                                   .scale = 0.15,
                                   .place_weight = 1,
                                   .surface_weight = 0,
                                   .pose_prior = 0.1,
                                   .bend_prior = 0.05,
                                   .shape_prior = 0.5,
                                   .places = 300};
  /// To places and, where the body comes near, the surface.
  static constexpr FitStage wide{.iterations = 4,
                                 .scale = 0.12,
                                 .place_weight = 0.2,
                                 .surface_weight = 1,
                                 .facing = 0.2,
                                 .pose_prior = 0.03,
                                 .bend_prior = 0.03,
                                 .shape_prior = 0.15,
                                 .probes = 300,
                                 .samples = 400,
                                 .places = 200};
  /// Nearer.
  static constexpr FitStage middle{.iterations = 4,
                                   .scale = 0.08,
                                   .place_weight = 0.02,
                                   .surface_weight = 1,
                                   .facing = 0.2,
                                   .pose_prior = 0.005,
                                   .bend_prior = 0.005,
                                   .shape_prior = 0.025,
                                   .probes = 500,
                                   .samples = 600,
                                   .places = 200};
  /// From a start that was not read: limbs elsewhere.
  static constexpr FitStage astray{.iterations = 6,
                                   .scale = 0.08,
                                   .surface_weight = 1,
                                   .facing = 0.2,
                                   .pose_prior = 0.003,
                                   .bend_prior = 0.003,
                                   .shape_prior = 0.025,
                                   .probes = 400,
                                   .samples = 500};
  /// By what candidates are compared.
  static constexpr FitStage judged{.scale = 0.1, .surface_weight = 1, .facing = 0.2, .probes = 300, .samples = 400};
  /// All vertices.
  static constexpr FitStage fine{.iterations = 4,
                                 .usual_distance = 0.1,
                                 .slack = 0.02,
                                 .scale = 0.05,
                                 .place_weight = 0.07,
                                 .surface_weight = 1,
                                 .facing = 0.2,
                                 .pose_prior = 0.0005,
                                 .bend_prior = 0.0005,
                                 .shape_prior = 0.005,
                                 .probes = 800,
                                 .samples = 1000,
                                 .places = 300};
  /// The last one.
  static constexpr FitStage finest{.iterations = 5,
                                   .enough = -1,
                                   .usual_distance = 0.05,
                                   .slack = 0.05,
                                   .scale = 0.03,
                                   .place_weight = 0.04,
                                   .surface_weight = 1,
                                   .facing = 0.3,
                                   .pose_prior = 0.00005,
                                   .bend_prior = 0.00005,
                                   .shape_prior = 0.0015,
                                   .probes = 1000,
                                   .samples = 1100,
                                   .places = 300};
  /// How near the body is in the end.
  static constexpr FitStage measured{.scale = 0.05, .surface_weight = 1, .facing = 0, .probes = 1000, .samples = 1500};
};

}  // namespace fit::internal

}  // namespace npt::inline NPT_ABI
