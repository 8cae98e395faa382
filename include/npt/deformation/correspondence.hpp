/// Which triangles of two meshes belong together, found from a few markers: the source is registered onto the target, and
/// triangles whose centroids then are nearest are paired. Once for a pair of bodies, whatever their poses later.
/// Shapes    registered: [Vs] the source's vertices where they lie on the target
/// Errors    npt::Error as surface_of() and register_surfaces() throw it, and for meshes of which one is inside out
/// Source    Sumner and Popovic, "Deformation Transfer for Triangle Meshes", SIGGRAPH 2004, section 5
#pragma once

#include <npt/config.hpp>
#include <npt/core/error.hpp>
#include <npt/core/vec3.hpp>
#include <npt/deformation/markers.hpp>
#include <npt/deformation/registration.hpp>
#include <npt/deformation/surface.hpp>
#include <npt/deformation/triangle_pairs.hpp>
#include <npt/linear/similarity.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/parallel/executor.hpp>

#include <span>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

struct CorrespondenceOptions {
  bool weld = true;  ///< vertices of one mesh at the same point are one
  RegistrationOptions registration;
};

struct Correspondence {
  std::vector<TrianglePair> pairs;
  Similarity similarity;  ///< from source to target, by the markers
  std::vector<Vec3f> registered;
};

template <Executor Exec = SerialExecutor>
Correspondence find_correspondence(const Mesh& source, const Mesh& target, std::span<const Marker> markers,
                                   const CorrespondenceOptions& options = {}, const RegistrationProgress& progress = {},
                                   const Exec& executor = Exec()) {
  const deformation::Surface from = deformation::surface_of(source, "source", options.weld);
  const deformation::Surface to = deformation::surface_of(target, "target", options.weld);
  const Registration registration = register_surfaces(from, to, markers, options.registration, progress, executor);
  Correspondence result{nearest_pairs(from, registration.points, to, executor), registration.similarity, {}};
  if (result.pairs.empty())
    throw Error({.file = "source and target",
                 .found = "no triangles that face the same way",
                 .expected = "two meshes whose faces turn the same way around, and markers at matching places"});
  for (const std::uint32_t p : from.point_of) result.registered.push_back(registration.points[p].as<float>());
  return result;
}

}  // namespace npt::inline NPT_ABI
