/// The sets of pairs on which accuracy is measured: each has its exact ground truth, and meshes in metres at the
/// identity's own size (npt/lab/evaluation.hpp). Counts are chosen so that all of them take 90 s on two cores.
///   made by the project     the mannequin in poses of three kinds, with proportions, with clothes, by the network alone
///   from ../shared/data     other people, clothes and triangulations, rigged characters by their own skinning, animals
/// Animals by body estimation, and by their network beside it, are in lengths of the identity (animals.hpp).
#pragma once

#include "animals.hpp"

#include <npt/body/body_file.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/body/pose_sampler.hpp>
#include <npt/body/proportions.hpp>
#include <npt/lab/body_pairs.hpp>
#include <npt/lab/clothes.hpp>
#include <npt/lab/evaluation.hpp>
#include <npt/lab/pair_files.hpp>
#include <npt/lab/protocol.hpp>
#include <npt/lab/rig/rig.hpp>
#include <npt/lab/rig/rig_character.hpp>
#include <npt/lab/rig/rig_sampler.hpp>

#include <formats/read.hpp>

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace accuracy {

/// What takes a set's pairs: the transfer of people or of animals with default settings, the network alone of either,
/// or nothing, where the answer stands in the pose's place.
enum class Method { people, network, animals, quadrupeds, given };

struct Set {
  std::string key;    ///< in bounds.txt and wrong.txt
  std::string title;  ///< in the guides' table
  Method method = Method::people;
  bool shared = false;  ///< needs ../shared/data
  std::function<npt::EvaluationSet()> make{};
  bool by_length = false;  ///< in lengths of the identity's longest side: all pairs that aren't refused count
};

using Body = std::shared_ptr<const npt::BodyModel>;

inline Body mannequin() { return npt::borrowed(npt::mannequin()); }
inline Body dressed(const Body& body) { return std::make_shared<const npt::BodyModel>(npt::with_clothes(*body)); }
inline std::string shared_data(const std::string& name) { return std::string(NPT_SHARED) + "/data/" + name; }
inline Body other_person() {
  return std::make_shared<const npt::BodyModel>(npt::load_body(shared_data("human_6890.safetensors")));
}

/// Random shapes in random poses.
inline npt::EvaluationSet fresh(const Body& body, std::size_t count, npt::PoseDistribution poses) {
  return npt::body_pairs(body, npt::fresh_pairs(count, 0, body->shape_count(), npt::ShapeDistribution::normal, poses),
                         "fresh");
}
/// The same of mannequins with random proportions.
inline npt::EvaluationSet characters(std::size_t count, npt::PoseDistribution poses) {
  const auto body = std::make_shared<const npt::BodyModel>(npt::with_proportions(npt::mannequin()));
  return npt::body_pairs(
      body, npt::fresh_character_pairs(count, 0, npt::mannequin().shape_count(), npt::ShapeDistribution::normal, poses),
      "characters");
}
/// The first pairs of the paper's protocol, unseen identities in unseen poses.
inline npt::EvaluationSet paper(const Body& body, std::size_t count) {
  npt::EvaluationSet set = npt::protocol_sets(body)[1];
  set.count = count;
  return set;
}

/// Sets one after another.
inline npt::EvaluationSet joined(std::vector<npt::EvaluationSet> sets) {
  npt::EvaluationSet all{.name = "joined"};
  for (const npt::EvaluationSet& set : sets) all.count += set.count;
  all.pair = [sets = std::move(sets)](std::size_t i) {
    std::size_t s = 0;
    for (; i >= sets[s].count; ++s) i -= sets[s].count;
    return sets[s].pair(i);
  };
  return all;
}

/// Characters whose joints have the same names, in moments of each other's clips.
struct RigGroup {
  std::vector<std::string> files;  ///< in ../shared/data
  std::size_t pairs = 0;
  std::vector<std::string> clips{};  ///< of which the poses are; none: all
};

inline npt::EvaluationSet rigged(const std::vector<RigGroup>& groups) {
  std::vector<npt::EvaluationSet> sets;
  for (const RigGroup& group : groups) {
    std::vector<npt::WeightedRig> rigs;
    for (const std::string& file : group.files) {
      const std::string path = shared_data(file);
      rigs.push_back({std::make_shared<const npt::RigCharacter>(npt::make_rig(formats::read_scene(path), path))});
    }
    const auto mixture = std::make_shared<const npt::RigMixture>(std::move(rigs), group.clips);
    sets.push_back(npt::in_metres(npt::rig_pairs(mixture, group.pairs, sets.size() + 1), npt::assumed_size));
  }
  return joined(std::move(sets));
}

/// A few of each kind; most of those that are no realistic people are wrong today.
inline npt::EvaluationSet rigged_people() {
  const std::string folder = "characters/humanoids/";
  return rigged({{{folder + "q2019_man_longsleeve.fbx", folder + "q2019_woman_dress.fbx"}, 3},
                 {{"glb/Knight.glb"}, 3},
                 {{"glb/Astronaut.glb"}, 1},
                 {{"glb/Cyberpunk.glb"}, 1},
                 {{folder + "qskeleton2018.glb"}, 1},
                 {{folder + "quac_pirate_female.glb"}, 1},
                 {{folder + "kenney_mini_female_a.glb"}, 1},
                 {{folder + "kk_skeleton_mage.glb"}, 1},
                 {{folder + "qmon_orc.glb"}, 1}});
}

/// In clips that the shipped network wasn't trained on; nor was it on the deer.
inline npt::EvaluationSet animals() {
  return rigged({{{"glb/Alpaca.glb", "glb/Cow.glb", "glb/Deer.glb", "glb/Donkey.glb", "glb/Fox.glb", "glb/Horse.glb",
                   "glb/Husky.glb"},
                  40,
                  {"Gallop", "Attack_Headbutt", "Idle_HitReact_Left"}}});
}

/// A list beside this file, of identity, pose and ground truth.
inline npt::EvaluationSet listed(const std::string& name) {
  return npt::file_pairs(std::string(NPT_SOURCE_DIR) + "/tests/accuracy/" + name);
}

inline std::string weights_file(Method method) {
  const bool animals = method == Method::animals || method == Method::quadrupeds;
  return std::string(NPT_SOURCE_DIR) + "/examples/weights/" + (animals ? "quadruped" : "human") + ".safetensors";
}

/// A set of animals twice: by their network, and by body estimation.
inline void add_animals(std::vector<Set>& sets, const std::string& key, const std::string& title, bool shared,
                        const std::function<npt::EvaluationSet()>& make) {
  sets.push_back({key + "-network", title + ", by the network", Method::quadrupeds, shared, make, true});
  sets.push_back({key + "-body", title + ", by body estimation", Method::animals, shared, make, true});
}

inline std::vector<Set> made_sets() {
  constexpr auto natural = npt::PoseDistribution::natural, wide = npt::PoseDistribution::wide;
  std::vector<Set> sets{
      {"natural", "mannequin, natural poses in any direction", Method::people, false,
       [] { return fresh(mannequin(), 10, natural); }},
      {"wide", "mannequin, wide poses", Method::people, false, [] { return fresh(mannequin(), 8, wide); }},
      {"paper", "mannequin, the paper's protocol, unseen poses", Method::people, false,
       [] { return paper(mannequin(), 8); }},
      {"proportions", "mannequin with random proportions, natural poses", Method::people, false,
       [] { return characters(10, natural); }},
      {"clothes", "mannequin in clothes, natural poses", Method::people, false,
       [] { return fresh(dressed(mannequin()), 8, natural); }},
      {"network", "mannequin, the paper's protocol, by the network", Method::network, false,
       [] { return paper(mannequin(), 16); }},
  };
  // Not by their network, which is for animals that stand upright and look the same way.
  sets.push_back({"template", "the template, random proportions and poses, any direction, by body estimation",
                  Method::animals, false, [] { return template_animals(weights_file(Method::animals), 20); }, true});
  return sets;
}

inline std::vector<Set> shared_sets() {
  constexpr auto natural = npt::PoseDistribution::natural;
  std::vector<Set> sets{
      {"other-natural", "another body model, natural poses", Method::people, true,
       [] { return fresh(other_person(), 6, natural); }},
      {"other-paper", "another body model, the paper's protocol, unseen poses", Method::people, true,
       [] { return paper(other_person(), 6); }},
      {"other-clothes", "another body model in clothes, natural poses", Method::people, true,
       [] { return fresh(dressed(other_person()), 6, natural); }},
      {"other-network", "another body model, the paper's protocol, by the network", Method::network, true,
       [] { return paper(other_person(), 16); }},
      {"people", "two people of no body model", Method::people, true, [] { return listed("people.txt"); }},
      {"clothed", "dressed people, and other triangulations", Method::people, true,
       [] { return listed("clothed.txt"); }},
      {"rigged", "rigged characters in moments of their own clips", Method::people, true, rigged_people},
      {"animals", "four-legged animals in new clips, by their network", Method::quadrupeds, true, animals},
  };
  for (const auto& [key, title, unseen] : {std::tuple("clips", "known species, new clips", Unseen::clip),
                                           std::tuple("species", "a new species, known clips", Unseen::species),
                                           std::tuple("both", "a new species, new clips", Unseen::both)}) {
    const auto make = [which = unseen](bool by_rotations) {
      return [which, by_rotations] { return clip_animals(shared_data("glb"), which, 20, by_rotations); };
    };
    add_animals(sets, key, title, true, make(false));
    sets.push_back({std::string(key) + "-rotations", std::string(title) + ", by the rigs' own rotations", Method::given,
                    true, make(true), true});
  }
  return sets;
}

}  // namespace accuracy
