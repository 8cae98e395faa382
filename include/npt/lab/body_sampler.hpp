/// Training samples from body models: fresh shapes and poses for every sample, or the paper's 16 identities in 400
/// poses; whole meshes or random subsets of their vertices.
/// Shapes    see sample.hpp; pose mesh and truth share the pose, identity mesh and truth share the shape
/// Numerics  a subset is normalised as the whole mesh is: see extreme_vertices.hpp
/// Errors    npt::Error for no body, bodies without SMPL's 24 joints, weights that aren't positive, more vertices asked
///           for than a body has, and options out of range
#pragma once

#include <npt/base/error.hpp>
#include <npt/base/similarity.hpp>
#include <npt/base/weighted_choice.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/pose_sampler.hpp>
#include <npt/config.hpp>
#include <npt/lab/assembly.hpp>
#include <npt/lab/augmentation.hpp>
#include <npt/lab/draws.hpp>
#include <npt/lab/extreme_vertices.hpp>
#include <npt/lab/prepared_body.hpp>
#include <npt/lab/protocol.hpp>
#include <npt/lab/transfer_sample.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/nn/train/sample.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <numeric>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// A body of a mixture. `weight`: its share of the samples, relative to the others.
struct WeightedBody {
  std::shared_ptr<const BodyModel> body;
  double weight = 1;
};

struct BodySamplerOptions : SampleOptions {
  ShapeDistribution shapes = ShapeDistribution::normal;
  double wide_poses = 0;     ///< the part of meshes, of fresh ones, whose pose is drawn from wide_pose_ranges
  double natural_poses = 0;  ///< the part of meshes, of fresh ones, whose pose is drawn from the prior of natural ones
  double clip_poses = 0;     ///< the part of meshes, of fresh ones, whose pose `clip_pose` draws
  std::function<PoseParameters(Random&)> clip_pose{};
  bool protocol = false;    ///< the paper's training set (protocol.hpp) instead of fresh shapes and poses
  bool mix_bodies = false;  ///< identity and pose mesh may come from different bodies of the mixture
  bool own_frame = false;   ///< a subset is normalised by its own box instead of the whole mesh's
};

class BodySampler : public SampleSource {
 public:
  explicit BodySampler(const std::vector<WeightedBody>& bodies, BodySamplerOptions options = {})
      : options_(std::move(options)) {
    data::check_options(options_);
    expect_part("wide_poses", options_.wide_poses);
    expect_part("natural_poses", options_.natural_poses);
    expect_part("wide_poses and natural_poses", options_.wide_poses + options_.natural_poses);
    expect_part("clip_poses", options_.clip_poses);
    expect_part("wide_poses, natural_poses and clip_poses",
                options_.wide_poses + options_.natural_poses + options_.clip_poses);
    NPT_ASSERT(options_.clip_poses == 0 || options_.clip_pose);
    if (bodies.empty()) throw Error({.file = "bodies", .found = "none", .expected = "at least one body"});
    for (const WeightedBody& member : bodies) {
      if (!(member.weight > 0) || !std::isfinite(member.weight))
        throw Error(
            {.file = "weight of a body", .found = std::to_string(member.weight), .expected = "a number above 0"});
      choice_.add(member.weight);
      members_.push_back(Member{data::PreparedBody(member.body), {}, {}});
      Member& prepared = members_.back();
      const BodyModel& body = *prepared.body.model;
      expect_vertices(options_.vertices, body);
      expect_vertices(options_.pose_vertices, body);
      if (options_.protocol) prepared.training.emplace_back(body.shape_count(), options_.shapes);
      if ((options_.vertices != 0 || options_.pose_vertices != 0) && !options_.own_frame)
        prepared.extremes = data::extreme_vertices(body, options_.shapes, options_.yaw,
                                                   {options_.wide_poses, options_.natural_poses + options_.clip_poses});
    }
  }
  explicit BodySampler(std::shared_ptr<const BodyModel> body, BodySamplerOptions options = {})
      : BodySampler(std::vector<WeightedBody>{{std::move(body), 1}}, std::move(options)) {}

  using SampleSource::draw;
  const BodySamplerOptions& options() const noexcept { return options_; }

  std::size_t max_vertices() const override {
    return data::most_vertices(options_.vertices, members_, &Member::vertex_count);
  }
  bool equal_counts() const override {
    const std::size_t mixed = options_.mix_bodies ? members_.size() : 1;
    return data::have_equal_counts(options_, std::span(members_).first(mixed), &Member::vertex_count);
  }

  /// The parameters and bodies of a sample.
  struct Choice {
    std::size_t identity_body = 0, pose_body = 0;
    BodyPair pair;
  };
  Choice choose(std::uint64_t step, std::uint64_t index) const {
    const auto random = [&](data::Part part) { return training_random(step, index, part); };
    Random pick = random(data::Part::choice);
    Choice choice;
    choice.identity_body = choice_(pick);
    choice.pose_body = options_.mix_bodies ? choice_(pick) : choice.identity_body;
    const Member &identity = members_[choice.identity_body], &pose = members_[choice.pose_body];
    if (options_.protocol) {
      const auto of = [&pick](const auto& set) -> const auto& {
        return set[pick.below(static_cast<std::uint32_t>(set.size()))];
      };
      choice.pair.identity_shape = of(identity.training.front().shapes);
      choice.pair.identity_pose = of(identity.training.front().poses);
      choice.pair.pose_shape = of(pose.training.front().shapes);
      choice.pair.pose = of(pose.training.front().poses);
      return choice;
    }
    Random identity_shape = random(data::Part::identity_shape), pose_shape = random(data::Part::pose_shape);
    Random identity_pose = random(data::Part::identity_pose), pose_pose = random(data::Part::pose);
    choice.pair.identity_shape = sample_shape(identity_shape, identity.body.model->shape_count(), options_.shapes);
    const auto drawn = [&](Random& angles) {
      if (options_.wide_poses + options_.natural_poses + options_.clip_poses <= 0) return sample_pose(angles);
      const double kind = pick.uniform();
      if (kind >= 1 - options_.clip_poses) return options_.clip_pose(angles);
      return sample_pose(angles, data::PoseMixture{options_.wide_poses, options_.natural_poses}.at(kind));
    };
    choice.pair.identity_pose = drawn(identity_pose);
    choice.pair.pose_shape = sample_shape(pose_shape, pose.body.model->shape_count(), options_.shapes);
    choice.pair.pose = drawn(pose_pose);
    return choice;
  }

  void fill(std::uint64_t step, std::uint64_t index, Sample& sample) const override {
    const Choice choice = choose(step, index);
    const BodyPair& pair = choice.pair;
    const Member &identity = members_[choice.identity_body], &pose = members_[choice.pose_body];
    data::Scratch& scratch = data::Scratch::of_thread();
    const auto random = [&](data::Part part) { return training_random(step, index, part); };

    Random augmentation = random(data::Part::augmentation);
    const data::Placements placements = data::draw_placements(options_, augmentation);
    const auto make = [&](const Member& member, const std::vector<float>& shape, const PoseParameters& angles,
                          bool whole, const Similarity& placement, std::vector<float>& xyz) {
      const BodyModel& body = *member.body.model;
      xyz.resize(3 * (whole ? body.vertex_count() : scratch.vertices.size()));
      if (whole)
        body.posed(shape, angles, xyz);
      else
        body.posed(shape, angles, scratch.vertices, xyz);
      data::place(placement, xyz);
    };

    const bool whole_pose = pose_vertices() == 0, whole = options_.vertices == 0;
    Random order = random(data::Part::pose_order);
    choose_rows(pose, pose_vertices(), order, scratch, scratch.pose_rows);
    make(pose, pair.pose_shape, pair.pose, whole_pose, placements.pose, scratch.pose);
    if (options_.noise > 0) {
      Random noise = random(data::Part::noise);
      const double sigma = noise.uniform(0, options_.noise);
      data::add_noise(scratch.pose, sigma, noise);
    }
    order = random(data::Part::identity_order);
    choose_rows(identity, options_.vertices, order, scratch, scratch.identity_rows);
    make(identity, pair.identity_shape, pair.identity_pose, whole, placements.identity, scratch.identity);
    make(identity, pair.identity_shape, pair.pose, whole, placements.truth, scratch.truth);

    data::normalise_into(scratch, options_.normalisation, sample);
    sample.edges.clear();
    sample.triangles.clear();
    if (!whole || !options_.topology) return;
    data::places_of(scratch.identity_rows, scratch.places);
    data::renumber_edges(scratch.places, identity.body.edges, sample.edges);
    data::renumber_triangles(scratch.places, identity.body.model->triangles(), sample.triangles);
  }

 private:
  struct Member {
    data::PreparedBody body;
    std::vector<std::uint32_t> extremes;  ///< empty where samples are whole meshes
    std::vector<TrainingSet> training;    ///< one where the protocol is asked for
    std::size_t vertex_count() const { return body.model->vertex_count(); }
  };

  static void expect_part(const char* name, double part) {
    if (!(part >= 0 && part <= 1))
      throw Error({.file = name, .found = std::to_string(part), .expected = "a part, 0 to 1"});
  }
  static void expect_vertices(std::size_t vertices, const BodyModel& body) {
    if (vertices > body.vertex_count())
      throw Error({.file = "vertices of a sample",
                   .found = std::to_string(vertices),
                   .expected = "at most " + std::to_string(body.vertex_count()) + ", which the body has"});
  }
  std::size_t pose_vertices() const { return data::pose_vertices_of(options_); }
  Random training_random(std::uint64_t step, std::uint64_t index, data::Part part) const {
    return data::random_for(data::Purpose::training, options_.seed, step, index, part);
  }

  /// scratch.vertices: the vertices that have to be posed (not for whole meshes). rows: which of the posed ones become
  /// the sample's, in which order.
  void choose_rows(const Member& member, std::size_t vertices, Random& random, data::Scratch& scratch,
                   std::vector<std::uint32_t>& rows) const {
    const auto count = static_cast<std::uint32_t>(member.vertex_count());
    if (vertices == 0 && options_.shuffle) {
      scratch.choice.draw(count, count, random, rows);
      return;
    }
    rows.resize(vertices == 0 ? count : vertices);
    std::iota(rows.begin(), rows.end(), std::uint32_t{0});
    if (vertices == 0) return;
    scratch.choice.draw(static_cast<std::uint32_t>(vertices), count, random, scratch.vertices);
    scratch.vertices.insert(scratch.vertices.end(), member.extremes.begin(), member.extremes.end());
  }

  BodySamplerOptions options_;
  WeightedChoice choice_;
  std::vector<Member> members_;
};

}  // namespace npt::inline NPT_ABI
