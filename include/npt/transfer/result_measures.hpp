/// What can be measured of a result without its ground truth: where it is torn, what runs into what, and how much of
/// the meshes their bodies explain.
#pragma once

#include <npt/config.hpp>
#include <npt/mesh/edge_stretch.hpp>

#include <optional>

namespace npt::inline NPT_ABI {

/// Measured on 50 characters in poses of people, by the body method: three are torn, with a common stretch of 4.8 to
/// 7.4 and confidences that refuse them (0.08 to 0.21); the others have 1.3 to 3.3. Penetration (0 to 0.11, torn ones
/// 0.01 to 0.05) and the identity's coverage (0.58 to 0.99, torn ones 0.73 to 0.84) don't tell right from wrong by
/// themselves: people who sit on their heels have a penetration of 0.19. So none is a warning.
struct ResultMeasures {
  EdgeStretch stretch;  ///< of the result's edges, from the identity's
  /// Share of the surface's area, 0 to 1, that lies inside another part of the mesh and didn't in the identity. Of a
  /// mesh whose triangles face consistently.
  double penetration = 0;
  /// Share of the surface, 0 to 1, that has its estimated body within 3 cm, of the identity and of the pose mesh; none
  /// where no body was estimated. A frame that is followed has that of the frame from which the sequence goes on.
  std::optional<double> identity_coverage, pose_coverage;
};

NPT_INLINE_CLASS(class, ResultMeter);  // of result_meter.hpp

}  // namespace npt::inline NPT_ABI
