#include "training_course.hpp"

#include "arguments.hpp"
#include "rig_arguments.hpp"
#include "training_readings.hpp"

#include <npt/base/error.hpp>
#include <npt/body/proportions.hpp>
#include <npt/lab/body_pairs.hpp>
#include <npt/lab/body_sampler.hpp>
#include <npt/lab/family_file.hpp>
#include <npt/lab/family_sampler.hpp>
#include <npt/lab/rig/rig.hpp>
#include <npt/lab/rig/rig_sampler.hpp>
#include <training/clip_poses.hpp>
#include <training/correspondence_sampler.hpp>
#include <training/rigged_body.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace program {

namespace {

npt::BodySamplerOptions sampler_options(const TrainingArguments& a, const StageArguments& stage,
                                        npt::Normalisation normalisation) {
  npt::BodySamplerOptions options;
  options.seed = a.seed;
  options.vertices = stage.vertices;
  options.topology = a.edge_loss != "none";
  options.normalisation = normalisation;
  options.yaw = a.yaw;
  const std::vector<float> range = parse_numbers(a.scale_range, "--scale-range");
  if (range.size() != 2) throw npt::Error({"--scale-range", {}, std::to_string(range.size()) + " numbers", "LOW,HIGH"});
  options.scale_low = static_cast<double>(range[0]);
  options.scale_high = static_cast<double>(range[1]);
  options.noise = a.noise;
  options.shapes = a.shapes == "normal" ? npt::ShapeDistribution::normal : npt::ShapeDistribution::uniform;
  options.wide_poses = a.wide_poses;
  options.natural_poses = a.natural_poses;
  options.protocol = a.protocol;
  options.mix_bodies = a.mix_bodies;
  return options;
}

/// `make_source(stage)` for each stage.
template <class MakeSource>
void add_stages(TrainingCourse& course, const TrainingArguments& a, bool paired, MakeSource&& make_source) {
  const std::vector<StageArguments> stages = parse_stages(a);
  for (const StageArguments& stage : stages) {
    course.sources.push_back(make_source(stage));
    const npt::SampleSource& source = *course.sources.back();
    if (paired && !source.equal_counts())
      throw npt::Error({"--feature",
                        {},
                        "per-vertex with meshes of different vertex counts",
                        "pooled, a number of vertices that all meshes have, or meshes that agree"});
    course.stages.push_back({stage.begin, stage.batch, &source});
  }
  const bool whole = std::ranges::any_of(stages, [](const StageArguments& s) { return s.vertices == 0; });
  if (a.edge_loss != "none" && !whole)
    throw npt::Error({"--edge-loss",
                      {},
                      a.edge_loss + " with random vertices only, which have no edges",
                      "a stage of whole meshes, such as --stage 0:60x96 --stage 0.7:2xall, or --vertices all"});
}

void use_bodies(TrainingCourse& course, const TrainingArguments& a, bool paired, const std::vector<NamedRig>& rigs) {
  std::vector<NamedBody> bodies;
  for (const std::string& argument :
       a.bodies.empty() && rigs.empty() ? std::vector<std::string>{"mannequin"} : a.bodies)
    bodies.push_back(load_named_body(argument));
  npt::ClipPoses<npt::PoseParameters> clips;
  for (const NamedRig& named : rigs) {
    const npt::RiggedBody rig = npt::rigged_body(named.rig, {.frame_rate = 15});
    clips.add(rig.clips);
    // Proportions are all the shapes that a rig has: twice as far apart as people's.
    npt::Proportions unit = npt::human_proportion_deviations;
    for (double& deviation : unit) deviation *= 2;
    bodies.push_back(
        {{std::make_shared<const npt::BodyModel>(npt::with_proportions(*rig.body, unit)), named.weight}, named.name});
  }
  std::vector<npt::WeightedBody> mixture;
  for (const NamedBody& body : bodies) {
    mixture.push_back(body.body);
    course.trained_on += (course.trained_on.empty() ? "" : ", ") + body.name;
  }
  const double share = clip_share(a, clips);
  if (share > 0 && a.protocol)
    throw npt::Error({"--protocol", {}, "with --rig, whose poses are its clips'", "one of them, or --clip-poses 0"});
  add_stages(course, a, paired, [&](const StageArguments& stage) {
    npt::BodySamplerOptions options = sampler_options(a, stage, course.normalisation);
    options.clip_poses = share;
    options.clip_pose = [clips](npt::Random& random) { return clips.sample(random); };
    return std::make_unique<npt::BodySampler>(mixture, options);
  });
  course.unit = "metre";
  course.validated_on =
      "unseen identities and poses of " + course.trained_on + ", seed " + std::to_string(validation_seed);
  const npt::ShapeDistribution shapes =
      a.shapes == "normal" ? npt::ShapeDistribution::normal : npt::ShapeDistribution::uniform;
  course.make_validation = [bodies, shapes](std::size_t pairs) {
    std::vector<npt::EvaluationSet> sets;
    const std::size_t each = (pairs + bodies.size() - 1) / bodies.size();
    for (const NamedBody& body : bodies)
      sets.push_back(npt::body_pairs(body.body.body,
                                     npt::fresh_pairs(each, validation_seed, body.body.body->shape_count(), shapes),
                                     body.name, validation_seed));
    return sets;
  };
}

/// Rigs of any kind, in the poses of each other's clips.
void use_rigs(TrainingCourse& course, const TrainingArguments& a, bool paired, const std::vector<NamedRig>& rigs) {
  if (a.protocol || a.mix_bodies || a.wide_poses > 0 || a.natural_poses > 0 || a.clip_poses || a.shapes != "normal")
    throw npt::Error({"--rig",
                      {},
                      "rigs that aren't all people's, with an option for bodies",
                      "no --protocol, --mix-bodies, --wide-poses, --natural-poses, --clip-poses or --shapes"});
  std::vector<npt::WeightedRig> members;
  for (const NamedRig& named : rigs) {
    members.push_back({std::make_shared<const npt::RigCharacter>(named.rig), named.weight});
    course.trained_on += (course.trained_on.empty() ? "" : ", ") + named.name;
  }
  const auto mixture = std::make_shared<const npt::RigMixture>(std::move(members), a.held_out);
  add_stages(course, a, paired, [&](const StageArguments& stage) {
    return std::make_unique<npt::RigSampler>(mixture, sampler_options(a, stage, course.normalisation));
  });
  course.unit = "the longest side of a character as bound";
  course.validated_on = (a.held_out.empty() ? "clips, trained on, of " : "held-out clips of ") + course.trained_on +
                        ", seed " + std::to_string(validation_seed);
  if (paired) {
    // Whole meshes of two characters can't be paired.
    course.make_validation = [](std::size_t) { return std::vector<npt::EvaluationSet>{}; };
    course.validated_on.clear();
    return;
  }
  course.make_validation = [mixture](std::size_t pairs) {
    return std::vector<npt::EvaluationSet>{npt::rig_pairs(mixture, pairs, validation_seed)};
  };
}

/// Whether all rigs are people's; those that aren't can't be mixed with bodies.
/// Errors    npt::Error of the first rig that isn't, where bodies are mixed in
bool are_people(const std::vector<NamedRig>& rigs, bool must) {
  return std::ranges::all_of(rigs, [must](const NamedRig& named) { return is_person(named, must); });
}

/// Points of bodies in any pose and their canonical coordinates, for the network that reads meshes.
void use_readings(TrainingCourse& course, const TrainingArguments& a, std::vector<NamedRig> rigs) {
  const auto set = std::make_shared<const ReadingSet>(make_reading_set(a, std::move(rigs)));
  const auto source = [set, seed = a.seed](std::size_t points, npt::data::Purpose purpose) {
    npt::CorrespondenceSampleOptions options = set->options;
    options.seed = seed;
    options.points = points;
    return std::make_unique<npt::CorrespondenceSampler>(set->clouds, set->variation, options, purpose, set->stranger);
  };
  for (const StageArguments& stage : parse_stages(a)) {
    if (stage.vertices == 0)
      throw npt::Error(
          {"--stage", {}, "all vertices", "a number of points: a correspondence network sees points of the surface"});
    course.sources.push_back(source(stage.vertices, npt::data::Purpose::training));
    course.stages.push_back({stage.begin, stage.batch, course.sources.back().get()});
  }
  course.trained_on = set->trained_on;
  course.with_negatives = true;
  course.normalisation = npt::Normalisation::none;
  course.distance_loss = 0.01;
  course.unit = "metre";
  course.validated_on = "readings of unseen shapes and poses of " + course.trained_on + ", halved";
  const std::shared_ptr<const npt::SampleSource> unseen = source(1500, npt::data::Purpose::evaluation);
  course.make_validation = [unseen](std::size_t pairs) {
    return std::vector<npt::EvaluationSet>{{"readings", pairs, [unseen](std::size_t i) {
                                              npt::Sample s = unseen->draw(0, i);
                                              npt::EvaluationPair pair;
                                              pair.name = "reading " + std::to_string(i);
                                              pair.pose = std::move(s.inputs[0]);
                                              pair.identity = std::move(s.inputs[1]);
                                              pair.truth = std::move(s.truth);
                                              return pair;
                                            }}};
  };
}

void use_family(TrainingCourse& course, const TrainingArguments& a, bool paired) {
  if (a.protocol || a.mix_bodies || a.wide_poses > 0 || a.natural_poses > 0 || a.shapes != "normal")
    throw npt::Error({"--family",
                      {},
                      "with an option for bodies",
                      "no --protocol, --mix-bodies, --wide-poses, --natural-poses or --shapes"});
  const auto family = std::make_shared<const npt::Family>(npt::load_family(*a.family));
  for (const npt::Species& species : family->species)
    course.trained_on += (course.trained_on.empty() ? "" : ", ") + species.name;
  add_stages(course, a, paired, [&](const StageArguments& stage) {
    return std::make_unique<npt::FamilySampler>(family, a.held_out, sampler_options(a, stage, course.normalisation),
                                                npt::FamilyOptions{.blend = a.blend, .mirror = a.mirror});
  });
  course.unit = "the meshes' own";
  course.validated_on = (a.held_out.empty() ? "all labels, trained on, of " : "held-out labels of ") +
                        course.trained_on + ", seed " + std::to_string(validation_seed);
  if (paired) {
    // Whole meshes of two species can't be paired.
    course.make_validation = [](std::size_t) { return std::vector<npt::EvaluationSet>{}; };
    course.validated_on.clear();
    return;
  }
  course.make_validation = [family, held_out = a.held_out](std::size_t pairs) {
    return std::vector<npt::EvaluationSet>{npt::family_pairs(family, held_out, pairs, validation_seed)};
  };
}

}  // namespace

TrainingCourse make_training_course(const TrainingArguments& arguments, bool paired) {
  TrainingCourse course;
  std::vector<NamedRig> rigs = load_rigs(arguments.rigs);
  rename_joints(arguments.joint_names, {&rigs});
  const bool reader = arguments.variant.net == "correspondence";
  const bool people = reader || arguments.family || are_people(rigs, !arguments.bodies.empty());
  course.normalisation = arguments.normalisation ? npt::parse_normalisation(*arguments.normalisation, "--normalisation")
                         : arguments.family || !people ? npt::Normalisation::sphere
                                                       : npt::Normalisation::centre;
  if (!arguments.held_out.empty() && rigs.empty() && !arguments.family)
    throw npt::Error({"--held-out", {}, "neither --family nor --rig", "what has the labels or clips to be held out"});
  if (reader)
    use_readings(course, arguments, std::move(rigs));
  else if (arguments.family)
    use_family(course, arguments, paired);
  else if (people)
    use_bodies(course, arguments, paired, rigs);
  else
    use_rigs(course, arguments, paired, rigs);
  return course;
}

}  // namespace program
