/// The directions in which a mesh is looked at: points are turned about the vertical axis before they go through the
/// correspondence network, and another axis is turned upwards first where that shows more of a body.
/// Threads   all members are const and may be called by any number of threads at a time
/// Numerics  the same bits for any number of threads
#pragma once

#include <npt/base/as_span.hpp>
#include <npt/base/matrix3.hpp>
#include <npt/base/vec3.hpp>
#include <npt/config.hpp>
#include <npt/estimate/canonical_frame.hpp>
#include <npt/estimate/correspondence_estimator.hpp>
#include <npt/estimate/correspondence_fit.hpp>
#include <npt/estimate/part_motion.hpp>
#include <npt/estimate/robust_distance.hpp>
#include <npt/mesh/sampled_surface.hpp>

#include <algorithm>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

struct ViewOptions {
  int count = usual_turns;  ///< about the vertical axis; half of them where one of these shows a body well
  bool all = false;         ///< all of them in any case
};

template <class Exec>
class CorrespondenceViews {
 public:
  using Samples = std::span<const SampledSurface::Sample>;

  /// Both must outlive it.
  CorrespondenceViews(const BasicCorrespondenceEstimator<Exec>& estimator, const CorrespondenceTemplate& rest,
                      ViewOptions options)
      : estimator_(estimator), rest_(rest), options_(options) {}

  /// Of the mesh turned upright: the median of the views, and each of them.
  std::vector<BodyView> about_vertical(Samples samples, const Matrix3& upright) const {
    const int half = (options_.count + 1) / 2;
    std::vector<BodyView> views = views_of(samples, half, upright);
    if (!options_.all && least_residual(as_span(views)) < usual_error) return views;  // half of them are enough
    const Matrix3 between = rotation_matrix({0, std::numbers::pi / half, 0});
    for (BodyView& view : views_of(samples, half, between * upright)) views.push_back(std::move(view));
    return views;
  }

  /// The mesh turned as it is said, from so many sides: the median.
  Correspondences seen(Samples samples, const Matrix3& turned, int turns = 1) const {
    return std::move(estimator_.read(samples, {.turns = turns, .upright = turned}).front());
  }

  /// For each other axis that may point up, the view of few points that a body explains best.
  std::vector<BodyView> other_axes(Samples samples) const {
    constexpr int turns = 4;
    std::vector<BodyView> best;
    for (const Vec3d turn : std::span(upright_turns).subspan(1)) {
      std::vector<BodyView> views = views_of(few(samples), turns, rotation_matrix(turn));
      best.push_back(std::move(*std::ranges::min_element(views, {}, residual_of)));
    }
    return best;
  }

  /// PartMotion::residual of the best view.
  static double least_residual(std::span<const BodyView> views) {
    return residual_of(*std::ranges::min_element(views, {}, residual_of));
  }

  /// BodyView::few of them.
  static Samples few(Samples samples) { return samples.first(std::min(samples.size(), BodyView::few)); }

 private:
  static double residual_of(const BodyView& view) { return view.motion.residual; }

  std::vector<BodyView> views_of(Samples samples, int turns, const Matrix3& upright) const {
    std::vector<BodyView> views;
    for (Correspondences& seen : estimator_.read(samples, {.turns = turns, .upright = upright}))
      views.emplace_back(rest_, std::move(seen));
    return views;
  }

  const BasicCorrespondenceEstimator<Exec>& estimator_;
  const CorrespondenceTemplate& rest_;
  ViewOptions options_;
};

}  // namespace npt::inline NPT_ABI
