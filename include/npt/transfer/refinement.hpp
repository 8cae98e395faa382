/// What a transfer knows of a refinement: a step behind the network that gives the result the identity's surface
/// detail. Eigen, which the library's own needs, stays out of this header; <npt/transfer/detail_refiner.hpp> has
/// npt::detail_refinement.
#pragma once

#include <npt/config.hpp>
#include <npt/mesh/mesh_view.hpp>

#include <memory>
#include <span>

namespace npt::inline NPT_ABI {

/// A refinement prepared for one identity mesh.
/// Threads   refine may be called by any number of threads at a time
class Refinement {
 public:
  Refinement() = default;
  Refinement(const Refinement&) = delete;
  Refinement& operator=(const Refinement&) = delete;
  virtual ~Refinement() = default;

  /// Refines positions of the identity in place. [V, 3]
  virtual void refine(std::span<float> positions) const = 0;
};

/// The radius of refinement where nothing says another, as a share of the root of the mesh's area (1.3 m for a person).
inline constexpr double default_refine_radius = 0.04;

/// Makes a refinement for an identity mesh. `radius`: detail below this share of the root of the mesh's area comes from
/// the identity.
/// Errors    npt::Error for a mesh that it can't refine, and a radius out of range
using MakeRefinement = std::unique_ptr<const Refinement> (*)(const MeshView& identity, double radius);

}  // namespace npt::inline NPT_ABI
