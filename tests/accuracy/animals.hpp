/// Pairs of four-legged animals, each with its ground truth, in units of the identity's longest side.
///   template   bodies of the shipped template in random proportions, both meshes in random poses. The truth has the
///              pose's angles as they are: how a shape stands at rest isn't taken out of them
///   clips      an animal of ../shared/data in the first frame of its Idle, another one in a moment of a clip that both
///              have. The truth is the first animal in its own clip, as far on: each species moves in its own way
///   rotations  the same pairs, answered by the rigs: the identity's joints turn as the pose's, of the same names, turn
///              from their Idle. What is left is how differently the species move, and no reading of a pose tells that
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/as_span.hpp>
#include <npt/base/error.hpp>
#include <npt/base/random.hpp>
#include <npt/body/body_kind.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/kind_file.hpp>
#include <npt/body/plan_poses.hpp>
#include <npt/body/plan_proportions.hpp>
#include <npt/io/safetensors.hpp>
#include <npt/lab/draws.hpp>
#include <npt/lab/evaluation.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/points.hpp>
#include <npt/mesh/topology.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/scene/pose.hpp>
#include <npt/scene/scene.hpp>

#include <formats/read.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace accuracy {

/// What the weights never saw of a pair.
enum class Unseen { clip, species, both };

/// A pair of meshes with faces; the truth has the identity's.
inline npt::EvaluationPair pair_of(std::string name, const npt::Mesh& identity, const npt::Mesh& pose,
                                   const npt::Mesh& truth) {
  npt::EvaluationPair pair{.name = std::move(name),
                           .pose = {pose.coordinates().begin(), pose.coordinates().end()},
                           .identity = {identity.coordinates().begin(), identity.coordinates().end()},
                           .truth = {truth.coordinates().begin(), truth.coordinates().end()},
                           .pose_triangles = npt::triangulate(pose),
                           .edges = npt::unique_edges(identity),
                           .identity_triangles = npt::triangulate(identity)};
  const double side = npt::bounding_box(pair.identity).longest_side();
  for (std::vector<float>* xyz : {&pair.pose, &pair.identity, &pair.truth})
    for (float& x : *xyz) x = static_cast<float>(static_cast<double>(x) / side);
  return pair;
}

/// Bodies of the template in a weights file.
inline npt::EvaluationSet template_animals(const std::string& weights, std::size_t count) {
  const npt::SafetensorsFile file = npt::SafetensorsFile::read(weights);
  const std::shared_ptr<const npt::BodyKind> kind = npt::load_body_kind(file);
  const std::string* table = file.find_metadata("body/poses");
  if (kind == nullptr || table == nullptr)
    throw npt::Error({.file = weights, .found = "no template with poses", .expected = "a kind of body's weights"});
  const auto poses = std::make_shared<const npt::PlanPoses>(kind->plan, *table, weights);
  return {.name = "template", .count = count, .pair = [kind, poses](std::size_t i) {
            const auto random = [i](npt::data::Part part) {
              return npt::data::random_for(npt::data::Purpose::evaluation, 0, 0, i, part);
            };
            const std::size_t own = kind->body->shape_count() - kind->plan.proportions.size();
            npt::Random shape = random(npt::data::Part::identity_shape), other = random(npt::data::Part::pose_shape),
                        stands = random(npt::data::Part::identity_pose), moves = random(npt::data::Part::pose);
            const std::vector<float> identity = npt::sample_character(kind->plan, shape, own),
                                     pose = npt::sample_character(kind->plan, other, own);
            const std::vector<float> at_first = poses->sample(stands), goal = poses->sample(moves);
            return pair_of("template", npt::to_mesh(*kind->body, identity, at_first),
                           npt::to_mesh(*kind->body, pose, goal), npt::to_mesh(*kind->body, identity, goal));
          }};
}

/// The animals of ../shared/data whose clips have common names.
class ClipAnimals {
 public:
  /// folder: with NAME.glb
  explicit ClipAnimals(const std::string& folder) {
    for (const char* name : {"Alpaca", "Cow", "Deer", "Donkey", "Fox", "Horse", "Husky"}) {
      const std::string path = folder + "/" + name + ".glb";
      animals_.push_back({name, std::make_unique<const npt::Scene>(formats::read_scene(path))});
      Animal& animal = animals_.back();
      animal.poser = std::make_unique<const npt::ScenePoser>(*animal.scene, name);
      for (const npt::Clip& clip : animal.scene->clips)
        animal.clips.emplace(clip.name.substr(clip.name.rfind('|') + 1), &clip);
    }
  }

  struct Moment {
    std::size_t identity = 0, pose = 0;
    std::string clip;
    std::size_t sixth = 0;  ///< of the clip's length
  };

  /// count different moments, drawn from a seed.
  std::vector<Moment> draw(Unseen unseen, std::size_t count, std::uint64_t seed) const {
    npt::Random random(seed);
    std::vector<Moment> moments;
    std::set<std::string> taken;
    const auto below = [&random](std::size_t n) { return std::size_t{random.below(static_cast<std::uint32_t>(n))}; };
    while (moments.size() < count) {
      Moment moment{.identity = below(animals_.size()), .pose = below(animals_.size()), .clip = {}, .sixth = below(6)};
      auto clip = animals_[moment.identity].clips.begin();
      std::advance(clip, below(animals_[moment.identity].clips.size()));
      moment.clip = clip->first;
      if (moment.identity == moment.pose || !animals_[moment.pose].clips.contains(moment.clip)) continue;
      const bool species = is_unseen(moment.identity) || is_unseen(moment.pose), held = is_held_out(moment.clip);
      const bool fits = unseen == Unseen::clip ? held && !species : species && held == (unseen == Unseen::both);
      if (fits && taken.insert(name_of(moment)).second) moments.push_back(std::move(moment));
    }
    return moments;
  }

  npt::EvaluationPair pair(const Moment& moment) const {
    return pair_of(name_of(moment), at(moment.identity, "Idle", 0), at(moment.pose, moment.clip, moment.sixth),
                   at(moment.identity, moment.clip, moment.sixth));
  }

  /// The same with an answer in the pose's place, by rotations of joints.
  npt::EvaluationPair pair_by_rotations(const Moment& moment) const {
    return pair_of(name_of(moment), at(moment.identity, "Idle", 0), turned(moment),
                   at(moment.identity, moment.clip, moment.sixth));
  }

 private:
  struct Animal {
    std::string name;
    std::unique_ptr<const npt::Scene> scene;
    std::unique_ptr<const npt::ScenePoser> poser{};
    std::map<std::string, const npt::Clip*> clips{};
  };

  bool is_unseen(std::size_t animal) const { return animals_[animal].name == "Deer"; }
  static bool is_held_out(const std::string& clip) {
    return clip == "Gallop" || clip == "Attack_Headbutt" || clip == "Idle_HitReact_Left";
  }
  std::string name_of(const Moment& moment) const {
    return animals_[moment.identity].name + " as " + animals_[moment.pose].name + ", " + moment.clip + " " +
           std::to_string(moment.sixth) + "/6";
  }
  npt::Mesh at(std::size_t number, const std::string& name, std::size_t sixth) const {
    const Animal& animal = animals_[number];
    const npt::Clip* clip = animal.clips.at(name);
    npt::Mesh mesh = animal.poser->mesh();
    animal.poser->positions(clip, seconds(*clip, sixth), mesh.coordinates());
    return mesh;
  }

  static double seconds(const npt::Clip& clip, std::size_t sixth) {
    return clip.length() * static_cast<double>(sixth) / 6;
  }

  static npt::ScenePose stands(const Animal& animal, const std::string& name, std::size_t sixth) {
    const npt::Clip* clip = animal.clips.at(name);
    return animal.poser->pose(clip, seconds(*clip, sixth));
  }

  npt::Mesh turned(const Moment& moment) const {
    const Animal &identity = animals_[moment.identity], &pose = animals_[moment.pose];
    const npt::ScenePose own = stands(identity, "Idle", 0), idle = stands(pose, "Idle", 0),
                         goal = stands(pose, moment.clip, moment.sixth);
    std::map<std::string, std::size_t> joints;
    for (const npt::Skin& skin : pose.scene->skins)
      for (const std::size_t joint : skin.joints) joints.emplace(pose.scene->nodes[joint].name, joint);
    npt::Scene scene = *identity.scene;
    std::vector<std::optional<npt::Affine>> worlds(scene.nodes.size());
    const auto place = [&](std::size_t n, const auto& again) -> const npt::Affine& {
      if (worlds[n]) return *worlds[n];
      npt::SceneNode& node = scene.nodes[n];
      const npt::Affine parent = node.parent == npt::no_item ? npt::Affine() : again(node.parent, again),
                        parent_was = node.parent == npt::no_item ? npt::Affine() : own.worlds[node.parent];
      npt::Affine world = parent * (npt::inverse(parent_was) * own.worlds[n]);
      if (const auto joint = joints.find(node.name); joint != joints.end())
        world.linear =
            goal.worlds[joint->second].linear * npt::inverse(idle.worlds[joint->second]).linear * own.worlds[n].linear;
      node.matrix = npt::inverse(parent) * world;
      return worlds[n].emplace(world);
    };
    for (std::size_t n = 0; n < scene.nodes.size(); ++n) place(n, place);
    return npt::ScenePoser(scene).mesh();
  }

  std::vector<Animal> animals_;
};

/// by_rotations: each with its answer in the pose's place
inline npt::EvaluationSet clip_animals(const std::string& folder, Unseen unseen, std::size_t count,
                                       bool by_rotations = false) {
  const auto animals = std::make_shared<const ClipAnimals>(folder);
  return {.name = "clips",
          .count = count,
          .pair = [animals, moments = animals->draw(unseen, count, 1), by_rotations](std::size_t i) {
            return by_rotations ? animals->pair_by_rotations(moments[i]) : animals->pair(moments[i]);
          }};
}

}  // namespace accuracy
