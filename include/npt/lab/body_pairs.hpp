/// Pairs to evaluate on, from a body model: the paper's protocol, or fresh ones from a seed. At full resolution.
/// Every mesh's vertices are shuffled, pose and identity independently: a body's own order would tell a network that
/// pairs vertices which belongs to which.
#pragma once

#include <npt/base/error.hpp>
#include <npt/base/random.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/pose_sampler.hpp>
#include <npt/body/proportions.hpp>
#include <npt/config.hpp>
#include <npt/lab/assembly.hpp>
#include <npt/lab/draws.hpp>
#include <npt/lab/evaluation.hpp>
#include <npt/lab/prepared_body.hpp>
#include <npt/lab/protocol.hpp>
#include <npt/lab/shuffled_pair.hpp>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

namespace data {

/// Pair `i` as meshes. Vertex orders come from (seed, i).
inline EvaluationPair body_evaluation_pair(const PreparedBody& body, const BodyPair& pair, std::uint64_t seed,
                                           std::size_t i) {
  const BodyModel& model = *body.model;
  const auto order_of = [&](Part part) {
    return VertexOrder(model.vertex_count(), random_for(Purpose::evaluation, seed, 0, i, part));
  };
  EvaluationPair result{
      .name = "pair " + std::to_string(i), .pose = {}, .identity = {}, .truth = {}, .pose_triangles = {}, .edges = {}};
  for (std::vector<float>* xyz : {&result.pose, &result.identity, &result.truth}) xyz->resize(3 * model.vertex_count());
  const VertexOrder of_pose = order_of(Part::pose_order), of_identity = order_of(Part::identity_order);
  model.posed(pair.pose_shape, pair.pose, of_pose.rows, result.pose);
  renumber_triangles(of_pose.places, model.triangles(), result.pose_triangles);
  model.posed(pair.identity_shape, pair.identity_pose, of_identity.rows, result.identity);
  model.posed(pair.identity_shape, pair.pose, of_identity.rows, result.truth);
  renumber_edges(of_identity.places, body.edges, result.edges);
  renumber_triangles(of_identity.places, model.triangles(), result.identity_triangles);
  return result;
}

}  // namespace data

/// The pairs on this body. `seed` is of the vertex orders only.
/// Errors  npt::Error for a body without SMPL's 24 joints
inline EvaluationSet body_pairs(std::shared_ptr<const BodyModel> body, std::vector<BodyPair> pairs, std::string name,
                                std::uint64_t seed = 0) {
  auto prepared = std::make_shared<const data::PreparedBody>(std::move(body));
  const std::size_t count = pairs.size();
  return {.name = std::move(name),
          .count = count,
          .pair = [prepared, seed, list = std::make_shared<const std::vector<BodyPair>>(std::move(pairs))](
                      std::size_t i) { return data::body_evaluation_pair(*prepared, (*list)[i], seed, i); }};
}

namespace data {

/// `shape(random)` draws the shape parameters of one mesh.
template <class Shape>
std::vector<BodyPair> draw_pairs(std::size_t count, std::uint64_t seed, PoseDistribution poses, const Shape& shape) {
  if (count >= max_index)
    throw Error(
        {.file = "pairs", .found = std::to_string(count), .expected = "fewer than " + std::to_string(max_index)});
  std::vector<BodyPair> pairs(count);
  for (std::size_t i = 0; i < count; ++i) {
    const auto random = [&](Part part) { return random_for(Purpose::evaluation, seed, 0, i, part); };
    Random identity_shape = random(Part::identity_shape), identity_pose = random(Part::identity_pose);
    Random pose_shape = random(Part::pose_shape), pose = random(Part::pose);
    pairs[i] = {shape(identity_shape), sample_pose(identity_pose, poses), shape(pose_shape), sample_pose(pose, poses)};
  }
  return pairs;
}

}  // namespace data

/// Parameters of `count` pairs from a seed. Training never draws the same, whatever its seed.
inline std::vector<BodyPair> fresh_pairs(std::size_t count, std::uint64_t seed, std::size_t shape_count,
                                         ShapeDistribution distribution = ShapeDistribution::normal,
                                         PoseDistribution poses = PoseDistribution::paper) {
  return data::draw_pairs(count, seed, poses,
                          [&](Random& random) { return sample_shape(random, shape_count, distribution); });
}

/// Parameters of `count` pairs of with_proportions(body), whose meshes have random proportions each. `own_shapes`: the
/// body's own shape parameters, which are those of fresh_pairs.
inline std::vector<BodyPair> fresh_character_pairs(std::size_t count, std::uint64_t seed, std::size_t own_shapes,
                                                   ShapeDistribution distribution = ShapeDistribution::normal,
                                                   PoseDistribution poses = PoseDistribution::paper) {
  return data::draw_pairs(count, seed, poses,
                          [&](Random& random) { return sample_character(random, own_shapes, distribution); });
}

/// The protocol's two sets on a body: "seen" and "unseen" poses.
inline std::vector<EvaluationSet> protocol_sets(const std::shared_ptr<const BodyModel>& body,
                                                ShapeDistribution distribution = ShapeDistribution::normal) {
  if (!body) throw Error({.file = "body", .found = "none", .expected = "a body model"});
  return {body_pairs(body, seen_pose_pairs(body->shape_count(), distribution), "seen poses", protocol::seen_pair_seed),
          body_pairs(body, unseen_pose_pairs(body->shape_count(), distribution), "unseen poses",
                     protocol::unseen_pair_seed)};
}

}  // namespace npt::inline NPT_ABI
