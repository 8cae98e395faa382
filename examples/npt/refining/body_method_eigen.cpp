#include <refining/body_method.hpp>

#include <npt/baseline/fit/canonical_coordinates.hpp>
#include <npt/transfer/body_method.hpp>

namespace refining {

npt::MakeBodyMethod body_method(npt::Method) { return npt::body_method; }

std::vector<float> canonical_coordinates(const npt::BodyModel& body) { return npt::canonical_coordinates(body); }

}  // namespace refining
