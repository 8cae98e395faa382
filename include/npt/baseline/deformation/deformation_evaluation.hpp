/// Deformation transfer on the paper's protocol. It needs a third mesh that a network doesn't: the pose mesh's own
/// body, in the pose that the identity mesh is in. Two readings:
///   rest           source and target rest meshes are both in the rest pose
///   identity_pose  they are both in the pose in which the protocol gives the identity mesh
/// Either way the truth is the identity's shape in the pose mesh's pose, vertex orders are shuffled independently, as
/// body_pairs() shuffles them, and the correspondence is found from control points, never from vertex numbers.
/// Errors    npt::Error for a body without the 24 joints, another number of control points than 5 and 13
/// Source    Wang et al., CVPR 2020, section 4.2, Table 1
#pragma once

#include <npt/base/executor.hpp>
#include <npt/baseline/deformation/control_points.hpp>
#include <npt/baseline/deformation/correspondence.hpp>
#include <npt/baseline/deformation/deformation_transfer.hpp>
#include <npt/baseline/deformation/markers.hpp>
#include <npt/body/body_model.hpp>
#include <npt/config.hpp>
#include <npt/lab/assembly.hpp>
#include <npt/lab/draws.hpp>
#include <npt/lab/evaluation.hpp>
#include <npt/lab/prepared_body.hpp>
#include <npt/lab/protocol.hpp>
#include <npt/lab/shuffled_pair.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/topology.hpp>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

enum class ThirdMesh { rest, identity_pose };

/// What deformation transfer is given for a pair, and what it should make of it.
struct DeformationCase {
  Mesh source, target;       ///< rest meshes: the pose mesh's body, and the identity
  std::vector<float> pose;   ///< [V, 3] the pose mesh, in the source's vertex order
  std::vector<float> truth;  ///< [V, 3] in the target's vertex order
  std::vector<Marker> markers;
};

/// Pair `i` of a list. `seed` is of the vertex orders, and with it pose, target and truth have the orders that
/// body_pairs(body, pairs, name, seed) gives them.
inline DeformationCase deformation_case(const BodyModel& body, const BodyPair& pair, std::size_t i, std::uint64_t seed,
                                        std::size_t control_points, ThirdMesh third) {
  const PoseParameters rest{};
  const PoseParameters& reference = third == ThirdMesh::rest ? rest : pair.identity_pose;
  const auto order_of = [&](data::Part part) {
    return data::VertexOrder(body.vertex_count(), data::random_for(data::Purpose::evaluation, seed, 0, i, part));
  };
  const data::VertexOrder of_source = order_of(data::Part::pose_order),
                          of_target = order_of(data::Part::identity_order);
  const auto mesh_in_order = [&](const data::VertexOrder& order, const std::vector<float>& shape,
                                 std::vector<float>& posed) {
    Mesh mesh = to_mesh(body, shape, reference);
    body.posed(shape, reference, order.rows, mesh.coordinates());
    for (std::uint32_t& corner : mesh.corners) corner = order.places[corner];
    posed.resize(3 * body.vertex_count());
    body.posed(shape, pair.pose, order.rows, posed);
    return mesh;
  };
  DeformationCase result;
  result.source = mesh_in_order(of_source, pair.pose_shape, result.pose);
  result.target = mesh_in_order(of_target, pair.identity_shape, result.truth);
  for (const std::uint32_t v : control_vertices(body, control_points))
    result.markers.push_back({of_source.places[v], of_target.places[v]});
  return result;
}

/// The result of a case, [V, 3].
template <Executor Exec = SerialExecutor>
std::vector<float> run_deformation_case(const DeformationCase& given, const CorrespondenceOptions& options = {},
                                        const Exec& executor = Exec()) {
  const Correspondence found = find_correspondence(given.source, given.target, given.markers, options, {}, executor);
  std::vector<float> result(given.truth.size());
  DeformationTransfer(given.source, given.target, found.pairs, {.weld = options.weld})(given.pose, result, executor);
  return result;
}

/// The errors on a list of pairs of a body: "DT (5)" and "DT (13)" of Table 1. With an executor of several slots, pairs
/// run side by side and `after_pair` is called by several threads at a time; what it throws ends the run.
template <Executor Exec = SerialExecutor>
Evaluation evaluate_deformation(const BodyModel& body, std::span<const BodyPair> pairs, std::string name,
                                std::uint64_t seed, std::size_t control_points, ThirdMesh third = ThirdMesh::rest,
                                const Exec& executor = Exec(), const std::function<void()>& after_pair = {}) {
  if (pairs.empty()) throw Error({.file = name, .found = "no pairs to evaluate", .expected = "at least one"});
  Evaluation evaluation{.name = std::move(name), .pairs = std::vector<PairErrors>(pairs.size())};
  executor.for_each(static_cast<int>(pairs.size()), [&](int n, int) {
    const auto i = static_cast<std::size_t>(n);
    const DeformationCase given = deformation_case(body, pairs[i], i, seed, control_points, third);
    const std::vector<float> result = run_deformation_case(given);
    EvaluationPair pair;
    pair.name = "pair " + std::to_string(i);
    pair.truth = given.truth;
    pair.edges = unique_edges(given.target);
    pair.identity.assign(given.target.coordinates().begin(), given.target.coordinates().end());
    evaluation.pairs[i] = pair_errors(pair, result);
    if (after_pair) after_pair();
  });
  return evaluation;
}

}  // namespace npt::inline NPT_ABI
