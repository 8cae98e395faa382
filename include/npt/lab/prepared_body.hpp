/// A body model as samplers and evaluations hold it: shared, fit for random poses, with its edges.
#pragma once

#include <npt/base/error.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/skeleton.hpp>
#include <npt/config.hpp>
#include <npt/mesh/topology.hpp>

#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI::data {

struct PreparedBody {
  std::shared_ptr<const BodyModel> model;
  std::vector<Edge> edges;

  /// Errors  npt::Error for no body, and for one without the 24 joints that poses are drawn for
  explicit PreparedBody(std::shared_ptr<const BodyModel> body) : model(std::move(body)) {
    if (!model) throw Error({.file = "body", .found = "none", .expected = "a body model"});
    if (model->joint_count() != smpl_joint_count)
      throw Error({.file = "body",
                   .found = std::to_string(model->joint_count()) + " joints",
                   .expected = std::to_string(smpl_joint_count) + ", which random poses are made for"});
    edges = edges_of_triangles(model->triangles());
  }
};

}  // namespace npt::inline NPT_ABI::data
