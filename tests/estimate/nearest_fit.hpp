// The nearest of a fitter's fits, for tests that need one and don't search.
#pragma once

#include <npt/estimate/correspondence_fit.hpp>
#include <npt/mesh/sampled_surface.hpp>

#include <algorithm>
#include <span>
#include <utility>
#include <vector>

inline npt::CorrespondenceFit nearest_of(std::vector<npt::CorrespondenceFit> fits) {
  return std::move(*std::ranges::min_element(fits, {}, &npt::CorrespondenceFit::relative_distance));
}

/// By the correspondences of one view.
inline npt::CorrespondenceFit nearest_fit(const npt::CorrespondenceFitter& fitter, const npt::SampledSurface& surface,
                                          const npt::Correspondences& seen) {
  const npt::BodyView view(fitter.correspondence_template(), seen);
  return nearest_of(fitter.fits(surface, std::span(&view, 1)));
}
