/// A family: species of different shapes and vertex counts whose meshes carry labels, where the same label is the same
/// pose (a horse's and a cow's "Walk_03"). Cross-species pairs have a truth then: the identity's own mesh of the pose's
/// label. Labels are compared without regard to the case of ASCII letters.
/// Errors    npt::Error for a species without labels, a label twice, meshes of a species with different vertex counts,
///           fewer than two species, and where no two species share a label
/// Source    Wang et al., CVPR 2020, Fig. 14: camel to horse, which the pooled feature makes possible
#pragma once

#include <npt/base/error.hpp>
#include <npt/base/random.hpp>
#include <npt/config.hpp>
#include <npt/io/text.hpp>
#include <npt/lab/assembly.hpp>
#include <npt/lab/draws.hpp>
#include <npt/lab/evaluation.hpp>
#include <npt/lab/shuffled_pair.hpp>
#include <npt/mesh/topology.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// One shape in many poses.
struct Species {
  std::string name;
  std::vector<std::string> labels;         ///< [P]
  std::vector<std::vector<float>> meshes;  ///< [P] of [V, 3], one for each label
  std::vector<Triangle> triangles;         ///< of all meshes
  std::vector<Edge> edges;                 ///< of all meshes, each once

  std::size_t vertex_count() const { return meshes.empty() ? 0 : meshes.front().size() / 3; }
};

struct Family {
  std::string name;  ///< where it came from, for messages
  std::vector<Species> species;
};

namespace data {

/// Whether `label` is `pattern`, or begins with it and '_': "Walk" holds all of "Walk_00", "Walk_01".
inline bool label_matches(std::string_view label, std::string_view pattern) {
  const std::string l = lower_case(label), p = lower_case(pattern);
  return l == p || l.starts_with(p + "_");
}

inline void check_species(const Species& species, const std::string& source) {
  const std::string place = "species '" + species.name + "'";
  const auto fail = [&](std::string at, std::string found, std::string expected) {
    throw Error(
        {.file = source, .place = place + std::move(at), .found = std::move(found), .expected = std::move(expected)});
  };
  if (species.labels.empty()) fail("", "no labels", "a label for each mesh");
  if (species.labels.size() != species.meshes.size())
    fail("", std::to_string(species.labels.size()) + " labels",
         std::to_string(species.meshes.size()) + ", one for each mesh");
  for (std::size_t i = 0; i < species.meshes.size(); ++i) {
    const std::vector<float>& mesh = species.meshes[i];
    if (mesh.empty() || mesh.size() != species.meshes.front().size())
      fail(", label '" + species.labels[i] + "'", std::to_string(mesh.size() / 3) + " vertices",
           mesh.empty() ? "at least one"
                        : std::to_string(species.vertex_count()) + ", as many as '" + species.labels.front() + "' has");
  }
  std::vector<std::string> sorted;
  for (const std::string& label : species.labels) sorted.push_back(lower_case(label));
  std::ranges::sort(sorted);
  if (const auto twice = std::ranges::adjacent_find(sorted); twice != sorted.end())
    fail("", "label '" + *twice + "' for a second mesh", "each label once");
  for (const Triangle& t : species.triangles)
    for (const std::uint32_t v : t)
      if (v >= species.vertex_count())
        fail("", "a triangle at vertex " + std::to_string(v),
             "vertices below " + std::to_string(species.vertex_count()));
}

/// One shape in a pose that another species shows: numbers of species and of labels in them.
struct FamilyPair {
  std::size_t identity = 0, identity_label = 0;
  std::size_t pose = 0, pose_label = 0;
  std::size_t truth_label = 0;  ///< the pose's label among the identity's
};

/// What two species share.
struct SharedPoses {
  struct Labels {
    std::size_t in_identity = 0, in_pose = 0;
  };
  std::size_t identity = 0, pose = 0;
  std::vector<Labels> training, held_out;
};

/// A checked family, with the labels that its species share and those kept from training.
class FamilyIndex {
 public:
  FamilyIndex(std::shared_ptr<const Family> family, const std::vector<std::string>& held_out)
      : family_(std::move(family)) {
    if (!family_) throw Error({.file = "family", .found = "none", .expected = "a family of meshes"});
    if (family_->species.size() < 2)
      throw Error({.file = family_->name,
                   .found = std::to_string(family_->species.size()) + " species",
                   .expected = "at least two, to give one the pose of another"});
    for (const Species& species : family_->species) check_species(species, family_->name);
    split(held_out);
    for (std::size_t a = 0; a < species().size(); ++a)
      for (std::size_t b = 0; b < species().size(); ++b)
        if (a != b) share(a, b);
  }

  const std::vector<Species>& species() const { return family_->species; }
  const Species& species(std::size_t i) const { return family_->species[i]; }
  const std::string& name() const { return family_->name; }
  /// Every two species, in both orders.
  std::span<const SharedPoses> shared() const { return shared_; }
  /// A species' labels that training may use; for a species that is wholly held out, all.
  std::span<const std::size_t> own_labels(std::size_t i) const { return own_labels_[i]; }

 private:
  void split(const std::vector<std::string>& patterns) {
    for (const std::string& pattern : patterns) {
      const bool any = std::ranges::any_of(species(), [&](const Species& s) {
        return std::ranges::any_of(s.labels, [&](const std::string& l) { return label_matches(l, pattern); });
      });
      if (!any)
        throw Error({.file = name(),
                     .place = "held-out labels",
                     .found = "'" + pattern + "'",
                     .expected = "a label of the family, or the part of one before '_'"});
    }
    for (const Species& s : species()) {
      std::vector<bool>& out = held_out_.emplace_back();
      std::vector<std::size_t>& own = own_labels_.emplace_back();
      for (const std::string& label : s.labels)
        out.push_back(std::ranges::any_of(patterns, [&](const std::string& p) { return label_matches(label, p); }));
      for (std::size_t i = 0; i < out.size(); ++i)
        if (!out[i]) own.push_back(i);
      for (std::size_t i = 0; own.empty() && i < out.size(); ++i) own.push_back(i);
    }
  }
  void share(std::size_t a, std::size_t b) {
    SharedPoses& poses = shared_.emplace_back();
    poses.identity = a;
    poses.pose = b;
    for (std::size_t i = 0; i < species(a).labels.size(); ++i)
      for (std::size_t k = 0; k < species(b).labels.size(); ++k)
        if (lower_case(species(a).labels[i]) == lower_case(species(b).labels[k]))
          (held_out_[a][i] ? poses.held_out : poses.training).push_back({i, k});
  }

  std::shared_ptr<const Family> family_;
  std::vector<std::vector<bool>> held_out_;  ///< of each species' labels
  std::vector<std::vector<std::size_t>> own_labels_;
  std::vector<SharedPoses> shared_;
};

inline std::size_t pick(Random& random, std::size_t count) { return random.below(static_cast<std::uint32_t>(count)); }

/// Pair as meshes, shuffled as body_evaluation_pair does.
inline EvaluationPair family_evaluation_pair(const FamilyIndex& family, const FamilyPair& pair, std::uint64_t seed,
                                             std::size_t i) {
  const Species &identity = family.species(pair.identity), &pose = family.species(pair.pose);
  const auto order_of = [&](const Species& species, Part part) {
    return VertexOrder(species.vertex_count(), random_for(Purpose::evaluation, seed, 0, i, part));
  };
  EvaluationPair result = shuffled_pair({.pose = pose.meshes[pair.pose_label],
                                         .identity = identity.meshes[pair.identity_label],
                                         .truth = identity.meshes[pair.truth_label],
                                         .pose_triangles = pose.triangles,
                                         .identity_triangles = identity.triangles,
                                         .edges = identity.edges},
                                        order_of(pose, Part::pose_order), order_of(identity, Part::identity_order));
  result.name = identity.name + " " + identity.labels[pair.identity_label] + " as " + pose.name + " " +
                pose.labels[pair.pose_label];
  return result;
}

}  // namespace data

/// `count` pairs of two species each, in the held-out labels, or in any label where none is held out; 0: every pair of
/// species in every such label once. The identity mesh is in a random pose that isn't held out.
/// Errors  npt::Error where no two species share such a label, and those of a family
inline EvaluationSet family_pairs(std::shared_ptr<const Family> family, const std::vector<std::string>& held_out,
                                  std::size_t count = 0, std::uint64_t seed = 0) {
  auto index = std::make_shared<const data::FamilyIndex>(std::move(family), held_out);
  std::vector<data::FamilyPair> pairs;
  for (const data::SharedPoses& shared : index->shared())
    for (const auto& [own, other] : held_out.empty() ? shared.training : shared.held_out)
      pairs.push_back({shared.identity, 0, shared.pose, other, own});
  if (pairs.empty())
    throw Error({.file = index->name(),
                 .found = "no label that two species share",
                 .expected = held_out.empty() ? "one" : "one among those held out"});
  Random random = data::random_for(data::Purpose::evaluation, seed, 0, 0, data::Part::choice);
  for (std::size_t i = pairs.size(); i > 1; --i) std::swap(pairs[i - 1], pairs[data::pick(random, i)]);
  if (count != 0 && count < pairs.size()) pairs.resize(count);
  for (data::FamilyPair& pair : pairs) {
    const auto own = index->own_labels(pair.identity);
    pair.identity_label = own[data::pick(random, own.size())];
  }
  const std::size_t size = pairs.size();
  return {.name = held_out.empty() ? "all labels" : "held-out labels",
          .count = size,
          .pair = [index, seed, list = std::make_shared<const std::vector<data::FamilyPair>>(std::move(pairs))](
                      std::size_t i) { return data::family_evaluation_pair(*index, (*list)[i], seed, i); }};
}

}  // namespace npt::inline NPT_ABI
