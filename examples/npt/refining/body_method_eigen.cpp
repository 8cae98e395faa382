#include <refining/body_method.hpp>

#include <npt/baseline/fit/canonical_coordinates.hpp>

namespace refining {

std::vector<float> canonical_coordinates(const npt::BodyModel& body) { return npt::canonical_coordinates(body); }

}  // namespace refining
