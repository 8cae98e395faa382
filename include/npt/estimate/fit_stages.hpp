/// The stages of a fit of a body to a surface and its correspondences (correspondence_fit.hpp): what counts in each,
/// how much, how far away, and at how many points.
/// Units     metres; radians
#pragma once

#include <npt/config.hpp>
#include <npt/estimate/robust_distance.hpp>
#include <npt/mesh/sampled_surface.hpp>
#include <npt/solve/damped_steps.hpp>

#include <cstddef>

namespace npt::inline NPT_ABI {

namespace fit::internal {

/// Points with correspondences that a stage takes.
inline constexpr std::size_t stage_places = 300;
/// Of both surfaces in coarse stages.
inline constexpr std::size_t few_points = 400;

/// The weights and sizes of a stage.
struct FitStage {
  double scale = 0;         ///< of the robust kernel, in metres
  double place_weight = 0;  ///< of the places
  double prior = 0;         ///< of a squared deviation of the pose
  double shape_prior = 5;   ///< times that: of one of the shape
  std::size_t points = 0;   ///< of both surfaces
  double facing = least_facing;
  StepLimits steps{};  ///< closest points jump: on all vertices E may grow a little in a step
  /// E without priors at which they count as given, and places not at all; above, both grow along with it: the farther
  /// the body stays from the surface, as under clothes, the less the surface alone says.
  double usual_distance = 0;
};

/// In the order in which a fit takes them: the kernel narrows, and the nearer the surface is, the less priors and
/// places count.
struct FitStages {
  /// Of the finest stage. The others' are multiples.
  static constexpr double least_scale = 0.03, least_prior = 5e-5;

  /// To the places alone.
  static constexpr FitStage places{.scale = 5 * least_scale, .place_weight = 1, .prior = 2000 * least_prior};
  /// To places and, where the body comes near, the surface.
  static constexpr FitStage wide{
      .scale = 4 * least_scale, .place_weight = 0.2, .prior = 600 * least_prior, .points = few_points};
  /// Nearer.
  static constexpr FitStage middle{.scale = 0.08, .place_weight = 0.02, .prior = 100 * least_prior, .points = 600};
  /// From a start that no network saw: limbs elsewhere.
  static constexpr FitStage astray{.scale = middle.scale, .prior = middle.prior, .points = few_points};
  /// By what candidates are compared.
  static constexpr FitStage judged{.scale = 2 * usual_error, .points = few_points};
  /// All vertices.
  static constexpr FitStage fine{.scale = 2 * least_scale,
                                 .place_weight = 0.07,
                                 .prior = 10 * least_prior,
                                 .points = 1000,
                                 .steps = {.slack = 0.05},
                                 .usual_distance = 0.1};
  /// The last one, which doesn't stop early; the best fit is polished. With a prior of 0.0003, and 5 times that for the
  /// shape, other models' people end at 21.7 mm instead of 18.0 in natural poses, at 25.4 instead of 21.4 in clothes.
  static constexpr FitStage finest{.scale = least_scale,
                                   .place_weight = 0.04,
                                   .prior = least_prior,
                                   .shape_prior = 30,
                                   .points = fine.points,
                                   .steps = {.steps = 3, .slack = fine.steps.slack, .enough = -1},
                                   .usual_distance = fine.usual_distance / 2};
  /// Of the best fit: two steps more of the finest stage, by all samples.
  static constexpr FitStage polish = [] {
    FitStage stage = finest;
    stage.points = SampledSurface::default_count;
    stage.steps.steps = 2;
    return stage;
  }();
  /// How near the body is in the end.
  static constexpr FitStage measured{.scale = fine.scale, .points = fine.points, .facing = 0};
};

}  // namespace fit::internal

}  // namespace npt::inline NPT_ABI
