/// The refinement of transferred meshes as `npt transfer` and `npt evaluate` use it. A build with Eigen has it
/// (refiner_eigen.cpp); in any other, asking for it is an error that says so (refiner_missing.cpp).
#pragma once

#include <npt/mesh/triangles.hpp>

#include <memory>
#include <optional>
#include <span>
#include <string>

namespace refining {

/// Gives positions of one identity its surface detail; see npt::DetailRefiner.
class Refiner {
 public:
  virtual ~Refiner() = default;
  /// In place; [V, 3]. May be called by any number of threads at a time.
  virtual void refine(std::span<float> positions) const = 0;
};

/// The radius where none is given.
double default_radius();

/// `name` stands in messages of errors.
/// Errors    npt::Error where this build can't refine, and those of npt::DetailRefiner
std::unique_ptr<const Refiner> make_refiner(std::span<const float> identity, std::span<const npt::Triangle> triangles,
                                            double radius, const std::string& name);

/// Throws npt::Error where this build can't refine.
void expect_available();

}  // namespace refining
