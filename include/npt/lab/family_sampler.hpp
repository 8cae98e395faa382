/// Training samples from a family of species with labelled poses (family.hpp): the identity of one species, the pose
/// mesh of another, the truth the identity's own mesh of that label. For networks with the pooled feature, or subsets
/// of equally many vertices.
/// Errors    npt::Error for a family that is none, held-out labels that it doesn't have, no label left to train with,
///           more vertices asked for than a species has, and options out of range
#pragma once

#include <npt/base/error.hpp>
#include <npt/base/similarity.hpp>
#include <npt/config.hpp>
#include <npt/lab/assembly.hpp>
#include <npt/lab/augmentation.hpp>
#include <npt/lab/draws.hpp>
#include <npt/lab/family.hpp>
#include <npt/lab/transfer_sample.hpp>
#include <npt/nn/train/sample.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <ranges>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// What makes more of a family's few poses. Both keep what a pose is: the same is done to the meshes of either species.
struct FamilyOptions {
  /// Part of the samples whose pose lies between those of two labels, vertex by vertex: half of them between two of one
  /// movement ("Run_00" and "Run_03"), half between any two. As large a part of the identity meshes lies between two of
  /// one movement.
  double blend = 0;
  bool mirror = false;  ///< every other sample is its own mirror image, left for right (x for -x)
};

class FamilySampler : public SampleSource {
 public:
  /// `held_out`: labels, or their parts before '_', that no sample shows.
  explicit FamilySampler(std::shared_ptr<const Family> family, const std::vector<std::string>& held_out = {},
                         SampleOptions options = {}, FamilyOptions more = {})
      : options_(options), more_(more), index_(std::move(family), held_out) {
    data::check_options(options_);
    if (!(more_.blend >= 0 && more_.blend <= 1))
      throw Error({.file = "blend", .found = std::to_string(more_.blend), .expected = "a part, 0 to 1"});
    for (std::size_t i = 0; i < index_.shared().size(); ++i)
      if (!index_.shared()[i].training.empty()) usable_.push_back(i);
    if (usable_.empty())
      throw Error({.file = index_.name(),
                   .found = "no label that two species share and that is not held out",
                   .expected = "at least one"});
    for (const Species& species : index_.species()) movements_.push_back(movements_of(species));
    for (const Species& species : index_.species())
      if (std::max(options_.vertices, options_.pose_vertices) > species.vertex_count())
        throw Error(
            {.file = "vertices of a sample",
             .found = std::to_string(std::max(options_.vertices, options_.pose_vertices)),
             .expected = "at most " + std::to_string(species.vertex_count()) + ", which " + species.name + " has"});
  }

  using SampleSource::draw;
  const SampleOptions& options() const noexcept { return options_; }
  const data::FamilyIndex& family() const noexcept { return index_; }

  std::size_t max_vertices() const override {
    return data::most_vertices(options_.vertices, index_.species(), &Species::vertex_count);
  }
  bool equal_counts() const override {
    return data::have_equal_counts(options_, index_.species(), &Species::vertex_count);
  }

  /// What a sample is made of: meshes, and what is done to them.
  struct Choice {
    data::FamilyPair meshes;
    std::size_t second_pose_label = 0, second_truth_label = 0;
    float second_share = 0;  ///< of the second label's mesh in pose and truth
    std::size_t second_identity_label = 0;
    float identity_share = 0;  ///< of the second label's mesh in the identity
    bool mirrored = false;
  };

  /// Every two species that share a label are equally likely.
  Choice choose(std::uint64_t step, std::uint64_t index) const {
    Random random = random_for(step, index, data::Part::choice);
    const data::SharedPoses& shared = index_.shared()[usable_[data::pick(random, usable_.size())]];
    const auto [own, other] = shared.training[data::pick(random, shared.training.size())];
    const auto labels = index_.own_labels(shared.identity);
    Choice choice{{shared.identity, labels[data::pick(random, labels.size())], shared.pose, other, own}};
    // Each draws its numbers whether they are used or not: one option leaves the other's samples as they are.
    const bool mirrored = random.uniform() < 0.5, blended = random.uniform() < more_.blend;
    auto second = shared.training[data::pick(random, shared.training.size())];
    const double share = random.uniform();
    const bool one_movement = random.uniform() < 0.5, identity_blended = random.uniform() < more_.blend;
    const double within = random.uniform(), identity_share = random.uniform(), within_identity = random.uniform();
    choice.mirrored = more_.mirror && mirrored;
    const auto movement = [&](std::size_t label) { return movements_[shared.identity][label]; };
    if (blended) {
      if (one_movement)
        second = one_of_movement(
            shared.training, [&](const auto& l) { return movement(l.in_identity); }, movement(own), within);
      choice.second_truth_label = second.in_identity;
      choice.second_pose_label = second.in_pose;
      choice.second_share = static_cast<float>(0.5 * share);
    }
    if (identity_blended) {
      choice.second_identity_label =
          one_of_movement(labels, movement, movement(choice.meshes.identity_label), within_identity);
      choice.identity_share = static_cast<float>(0.5 * identity_share);
    }
    return choice;
  }

  void fill(std::uint64_t step, std::uint64_t index, Sample& sample) const override {
    const Choice choice = choose(step, index);
    const data::FamilyPair& pair = choice.meshes;
    const Species &identity = index_.species(pair.identity), &pose = index_.species(pair.pose);
    data::Scratch& scratch = data::Scratch::of_thread();
    Random augmentation = random_for(step, index, data::Part::augmentation);
    const data::Placements placements = data::draw_placements(options_, augmentation);
    const auto make = [&choice](const std::vector<float>& mesh, const std::vector<float>& second, float share,
                                const Similarity& placement, std::vector<float>& xyz) {
      xyz = mesh;
      if (share > 0)
        for (std::size_t k = 0; k < xyz.size(); ++k) xyz[k] += share * (second[k] - xyz[k]);
      if (choice.mirrored)
        for (std::size_t k = 0; k < xyz.size(); k += 3) xyz[k] = -xyz[k];
      data::place(placement, xyz);
    };
    make(identity.meshes[pair.identity_label], identity.meshes[choice.second_identity_label], choice.identity_share,
         placements.identity, scratch.identity);
    make(identity.meshes[pair.truth_label], identity.meshes[choice.second_truth_label], choice.second_share,
         placements.truth, scratch.truth);
    make(pose.meshes[pair.pose_label], pose.meshes[choice.second_pose_label], choice.second_share, placements.pose,
         scratch.pose);
    if (options_.noise > 0) {
      Random noise = random_for(step, index, data::Part::noise);
      const double sigma = noise.uniform(0, options_.noise);
      data::add_noise(scratch.pose, sigma, noise);
    }
    Random order = random_for(step, index, data::Part::pose_order);
    data::choose_rows(pose.vertex_count(), pose_vertices(), options_.shuffle, order, scratch.choice, scratch.pose_rows);
    order = random_for(step, index, data::Part::identity_order);
    data::choose_rows(identity.vertex_count(), options_.vertices, options_.shuffle, order, scratch.choice,
                      scratch.identity_rows);
    data::normalise_into(scratch, options_.normalisation, sample);
    sample.edges.clear();
    sample.triangles.clear();
    if (options_.vertices != 0 || !options_.topology) return;
    data::places_of(scratch.identity_rows, scratch.places);
    data::renumber_edges(scratch.places, identity.edges, sample.edges);
    data::renumber_triangles(scratch.places, identity.triangles, sample.triangles);
  }

 private:
  /// One of the labels that belong to `movement`, of which there is at least one. `draw`: from 0 to 1.
  template <class Labels, class MovementOf>
  static std::ranges::range_value_t<Labels> one_of_movement(const Labels& labels, const MovementOf& movement_of,
                                                            std::size_t movement, double draw) {
    const auto belongs = [&](const auto& label) { return movement_of(label) == movement; };
    const auto count = static_cast<double>(std::ranges::count_if(labels, belongs));
    auto wanted = static_cast<std::size_t>(draw * count);
    for (const auto& label : labels)
      if (belongs(label) && wanted-- == 0) return label;
    throw Error({.file = "movement", .found = "no label", .expected = "at least the one that it was taken from"});
  }
  /// The number of each label's movement: of the first label with the same text before the last '_'.
  static std::vector<std::size_t> movements_of(const Species& species) {
    const auto movement = [](const std::string& label) { return lower_case(label.substr(0, label.rfind('_'))); };
    std::vector<std::size_t> result;
    for (const std::string& label : species.labels) {
      const auto first = std::ranges::find_if(
          species.labels, [&](const std::string& other) { return movement(other) == movement(label); });
      result.push_back(static_cast<std::size_t>(first - species.labels.begin()));
    }
    return result;
  }

  Random random_for(std::uint64_t step, std::uint64_t index, data::Part part) const {
    return data::random_for(data::Purpose::training, options_.seed, step, index, part);
  }
  std::size_t pose_vertices() const { return data::pose_vertices_of(options_); }

  SampleOptions options_;
  FamilyOptions more_;
  data::FamilyIndex index_;
  std::vector<std::vector<std::size_t>> movements_;  ///< [species][label]
  std::vector<std::size_t> usable_;                  ///< of index_.shared(): those with labels to train with
};

}  // namespace npt::inline NPT_ABI
