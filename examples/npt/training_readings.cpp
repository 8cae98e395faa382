#include "training_readings.hpp"

#include "arguments.hpp"

#include <refining/body_method.hpp>

#include <npt/base/as_span.hpp>
#include <npt/base/error.hpp>
#include <npt/body/body_file.hpp>
#include <npt/body/body_plan.hpp>
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/body/natural_poses.hpp>
#include <npt/body/plan_poses.hpp>
#include <npt/lab/rig/humanoid_joints.hpp>
#include <npt/lab/rig/rig_sampler.hpp>
#include <npt/mesh/points.hpp>
#include <training/animal_variation.hpp>
#include <training/objects.hpp>
#include <training/people_variation.hpp>
#include <training/rigged_body.hpp>
#include <training/rigged_quadruped.hpp>

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <iostream>
#include <string>
#include <utility>
#include <vector>

namespace program {

NamedBody load_named_body(const std::string& argument) {
  const auto [file, weight] = split_weight(argument, "--body");
  if (file == "mannequin") return {{npt::borrowed(npt::mannequin()), weight}, "mannequin"};
  return {{std::make_shared<const npt::BodyModel>(npt::load_body(file)), weight},
          std::filesystem::path(file).stem().string()};
}

bool is_person(const NamedRig& named, bool must) {
  try {
    npt::humanoid_joints(named.rig);
  } catch (const npt::Error&) {
    if (must) throw;
    return false;
  }
  return true;
}

namespace {

void name_source(ReadingSet& set, const std::string& name) {
  set.trained_on += (set.trained_on.empty() ? "" : ", ") + name;
}

/// Says so: a character whose joints aren't found would teach that it is none.
void add_stranger(std::vector<npt::WeightedRig>& others, const NamedRig& named, const npt::Error& why) {
  std::cerr << "npt: note: " << named.name << " is none of the kind: " << why.what() << '\n';
  others.push_back({std::make_shared<const npt::RigCharacter>(named.rig), named.weight});
}

/// The clips of rigs without those of --held-out, each of which has to be one of them.
class TrainingClips {
 public:
  explicit TrainingClips(std::vector<std::string> held_out)
      : held_out_(std::move(held_out)), found_(held_out_.size()) {}

  template <class Angles>
  void add(npt::ClipPoses<Angles>& all, const std::vector<std::string>& names,
           const std::vector<std::vector<Angles>>& clips) {
    for (std::size_t c = 0; c < clips.size(); ++c)
      if (!holds_out(names[c])) all.add({clips[c]});
  }
  void check() const {
    for (std::size_t h = 0; h < held_out_.size(); ++h)
      if (!found_[h]) throw npt::Error({"--held-out", {}, "'" + held_out_[h] + "'", "a clip of a rig of the kind"});
  }

 private:
  bool holds_out(const std::string& clip) {
    bool out = false;
    for (std::size_t h = 0; h < held_out_.size(); ++h)
      if (clip == held_out_[h] || npt::rig::internal::own_clip_name(clip) == held_out_[h]) out = found_[h] = true;
    return out;
  }

  std::vector<std::string> held_out_;
  std::vector<bool> found_;
};

/// Made objects in `objects` of the cases, else one of the others: rigs, and bodies as `bodies` draws them.
void add_strangers(ReadingSet& set, std::vector<npt::WeightedRig> rigs, double objects,
                   const std::shared_ptr<const npt::CorrespondenceSampler>& bodies = nullptr) {
  for (const npt::WeightedRig& rig : rigs) name_source(set, std::filesystem::path(rig.rig->name()).stem().string());
  const auto mixture = rigs.empty() ? nullptr : std::make_shared<const npt::RigMixture>(std::move(rigs));
  if (mixture == nullptr && bodies == nullptr) {
    set.stranger = npt::draw_object_surface;
    return;
  }
  set.stranger = [mixture, bodies, objects](npt::Random& random, std::size_t n, std::vector<npt::Vec3f>& points,
                                            std::vector<npt::Vec3f>& normals) {
    if (random.uniform() < objects)
      npt::draw_object_surface(random, n, points, normals);
    else if (mixture != nullptr && (bodies == nullptr || random.uniform() < 0.6))
      npt::draw_rig_surface(*mixture, random, n, points, normals);
    else
      bodies->draw_surface(random, n, points, normals);
  };
}

ReadingSet people_readings(const TrainingArguments& a, const std::vector<NamedBody>& bodies,
                           const std::vector<NamedRig>& rigs) {
  ReadingSet set;
  const auto clips = std::make_shared<npt::ClipPoses<npt::PoseParameters>>();
  TrainingClips own(a.held_out);
  for (const NamedBody& named : bodies) {
    set.clouds.push_back(
        {std::make_shared<const npt::SurfaceCloud>(named.body.body, refining::canonical_coordinates(*named.body.body)),
         named.body.weight});
    name_source(set, named.name);
  }
  std::vector<npt::WeightedRig> others;
  for (const NamedRig& named : rigs) {
    try {
      npt::humanoid_joints(named.rig);
    } catch (const npt::Error& error) {
      add_stranger(others, named, error);
      continue;
    }
    const npt::RiggedBody rig = npt::rigged_body(named.rig, {.longest_edge = 0.04, .frame_rate = 15});
    set.clouds.push_back({std::make_shared<const npt::SurfaceCloud>(rig.body, rig.canonical), named.weight});
    own.add(*clips, rig.clip_names, rig.clips);
    name_source(set, named.name);
  }
  own.check();
  if (set.clouds.empty())
    throw npt::Error({"--rig", {}, "no person", "people's rigs, or --body: the others are what isn't to be read"});
  const bool with_rigs = set.clouds.size() > bodies.size();
  set.options = {.blocks = 0.07,
                 .patched = with_rigs ? 0.4 : 0.0,
                 .warped = 0.4,
                 .mirror = with_rigs,
                 .strangers = others.empty() ? 0.12 : 0.2,  // of the latter three eighths are animals
                 .pieces = 0.12};
  const auto pose = [clips, share = clip_share(a, *clips)](npt::Random& random) {
    return share > 0 && random.uniform() < share ? clips->sample(random) : npt::natural_poses().sample(random);
  };
  set.variation = std::make_shared<const npt::PeopleVariation>(
      pose, npt::PeopleVariationOptions{.folded = 0.12, .standing = 0.15, .stylised = 0.15, .props = true});
  set.trained_on += "; no people: pieces of them, made objects";
  add_strangers(set, std::move(others), 0.5);
  return set;
}

/// The first body is the template.
ReadingSet animal_readings(const TrainingArguments& a, const std::vector<NamedBody>& bodies,
                           const std::vector<NamedRig>& rigs) {
  const npt::BodyModel& model = *bodies.front().body.body;
  const auto& metadata = model.tables().metadata;
  // Of the program's whole run: clouds refer to it.
  static std::vector<std::unique_ptr<const npt::BodyPlan>> plans;
  const npt::BodyPlan& plan = *plans.emplace_back(
      std::make_unique<const npt::BodyPlan>(npt::read_body_plan(metadata.at("plan"), bodies.front().name)));
  const auto authored = metadata.find("poses");
  if (authored == metadata.end())
    throw npt::Error({bodies.front().name, "metadata", "no poses", "a table of poses, as npt_sculpt writes it"});
  const auto poses = std::make_shared<const npt::PlanPoses>(plan, authored->second, bodies.front().name);

  ReadingSet set;
  set.clouds.push_back({std::make_shared<const npt::SurfaceCloud>(bodies.front().body.body,
                                                                  npt::as_span(model.tables().v_template), plan),
                        bodies.front().body.weight});
  name_source(set, bodies.front().name);
  const auto clips = std::make_shared<npt::ClipPoses<std::vector<float>>>();
  TrainingClips own(a.held_out);
  std::vector<npt::WeightedRig> others;
  for (const NamedRig& named : rigs) {
    npt::PlannedBody rig;
    try {
      rig = npt::rigged_quadruped(named.rig, model, plan, {.longest_edge = 0.03, .frame_rate = 15});
    } catch (const npt::Error& error) {
      add_stranger(others, named, error);
      continue;
    }
    set.clouds.push_back({std::make_shared<const npt::SurfaceCloud>(rig.body, rig.canonical, plan), named.weight});
    own.add(*clips, rig.clip_names, rig.clips);
    name_source(set, named.name);
  }
  own.check();
  set.options = {.blocks = 0.05,
                 .fallen = 0.15,
                 .patched = set.clouds.size() > 1 ? 0.3 : 0.0,
                 .mirror = true,
                 .strangers = 0.2,
                 .pieces = 0.12};
  const auto pose = [poses, clips, share = a.clip_poses.value_or(clips->empty() ? 0 : 0.5)](npt::Random& random) {
    return random.uniform() < share ? clips->sample(random) : poses->sample(random);
  };
  const npt::BoundingBox box = npt::bounding_box(model.tables().v_template);
  set.variation = std::make_shared<const npt::AnimalVariation>(
      plan, npt::TemplateReach{box.low.as<float>(), box.high.as<float>()}, pose);
  set.trained_on += "; none of the kind: pieces of them, made objects";
  std::vector<npt::WeightedCloud> people;
  for (const NamedBody& named : std::span(bodies).subspan(1)) {
    people.push_back(
        {std::make_shared<const npt::SurfaceCloud>(named.body.body, npt::as_span(named.body.body->tables().v_template)),
         named.body.weight});
    name_source(set, named.name);
  }
  std::shared_ptr<const npt::CorrespondenceSampler> of_people;
  if (!people.empty())
    of_people = std::make_shared<const npt::CorrespondenceSampler>(
        std::move(people),
        std::make_shared<const npt::PeopleVariation>(
            [](npt::Random& random) { return npt::natural_poses().sample(random); },
            npt::PeopleVariationOptions{.folded = 0.3}),
        npt::CorrespondenceSampleOptions{});
  add_strangers(set, std::move(others), 0.4, of_people);
  return set;
}

}  // namespace

ReadingSet make_reading_set(const TrainingArguments& a, std::vector<NamedRig> rigs) {
  std::vector<NamedBody> bodies;
  for (const std::string& argument :
       a.bodies.empty() && a.rigs.empty() ? std::vector<std::string>{"mannequin"} : a.bodies)
    bodies.push_back(load_named_body(argument));
  const bool planned = !bodies.empty() && bodies.front().body.body->tables().metadata.contains("plan");
  return planned ? animal_readings(a, bodies, rigs) : people_readings(a, bodies, rigs);
}

}  // namespace program
