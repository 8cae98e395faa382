/// What a correspondence network learns from: bodies and rigs of one kind, what varies of them, and what is none of
/// their kind.
/// Errors    npt::Error for bodies and rigs that can't be read, and for none of the kind
#pragma once

#include "rig_arguments.hpp"
#include "training_arguments.hpp"

#include <npt/lab/body_sampler.hpp>
#include <training/body_variation.hpp>
#include <training/clip_poses.hpp>
#include <training/correspondence_sampler.hpp>

#include <memory>
#include <string>
#include <vector>

namespace program {

struct NamedBody {
  npt::WeightedBody body;
  std::string name;
};

/// argument: of --body
NamedBody load_named_body(const std::string& argument);

/// Whether the rig is a person's.
/// Errors    npt::Error that says why it isn't, where it must be
bool is_person(const NamedRig& named, bool must);

/// The part of poses that come from the rigs' clips.
template <class Angles>
double clip_share(const TrainingArguments& a, const npt::ClipPoses<Angles>& clips) {
  if (clips.empty() && a.clip_poses)
    throw npt::Error({"--clip-poses", {}, a.rigs.empty() ? "no --rig" : "rigs without clips", "a rig with clips"});
  return clips.empty() ? 0 : a.clip_poses.value_or(0.25);
}

struct ReadingSet {
  std::vector<npt::WeightedCloud> clouds;
  std::shared_ptr<const npt::BodyVariation> variation;
  npt::CorrespondenceSampler::Stranger stranger;
  npt::CorrespondenceSampleOptions options;  ///< but for the seed and the number of points
  std::string trained_on;
};

/// People, or where the first body's file holds a plan (body_plan.hpp) that kind. Bodies and rigs of other kinds, and
/// made objects, are what the network learns not to read.
ReadingSet make_reading_set(const TrainingArguments& a, std::vector<NamedRig> rigs);

}  // namespace program
