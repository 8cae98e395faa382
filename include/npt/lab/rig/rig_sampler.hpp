/// Training samples from rigged characters of any kind: identity and pose mesh are characters with varied proportions,
/// the same one or two whose joints share names; their poses are moments of a rig's clips, three in ten between two
/// moments, four in ten with limbs of two, six in ten disturbed; half of all samples are mirrored. The truth is the
/// identity's character in the pose mesh's pose. Where not all vertices are taken, every second sample takes points of
/// the surfaces by area instead, so that a network doesn't depend on how meshes are divided into triangles.
/// Unit      of lengths (noise, errors): the longest side of a character's box as bound
/// Shapes    see sample.hpp
/// Numerics  a sample depends on (seed, step, index) only
/// Errors    npt::Error for no rig, rigs that share fewer than half of their joints' names with no other, clips held
///           out that no rig has, more vertices asked for than a rig has, and options out of range
#pragma once

#include <npt/base/error.hpp>
#include <npt/base/similarity.hpp>
#include <npt/base/weighted_choice.hpp>
#include <npt/config.hpp>
#include <npt/lab/assembly.hpp>
#include <npt/lab/augmentation.hpp>
#include <npt/lab/draws.hpp>
#include <npt/lab/evaluation.hpp>
#include <npt/lab/rig/rig_character.hpp>
#include <npt/lab/shuffled_pair.hpp>
#include <npt/lab/transfer_sample.hpp>
#include <npt/mesh/resample.hpp>
#include <npt/nn/train/sample.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// A rig of a mixture. `weight`: its share of the samples, relative to the others.
struct WeightedRig {
  std::shared_ptr<const RigCharacter> rig;
  double weight = 1;
};

namespace rig::internal {

/// What stands behind the last '|' of a clip's name: Blender writes the armature's name before it.
inline std::string own_clip_name(const std::string& name) { return name.substr(name.rfind('|') + 1); }

}  // namespace rig::internal

/// Rigs, which of them share poses, and which of their clips are for training.
class RigMixture {
 public:
  /// `held_out`: clips, by their names or what stands behind the last '|' of them.
  explicit RigMixture(std::vector<WeightedRig> rigs, const std::vector<std::string>& held_out = {})
      : rigs_(std::move(rigs)) {
    if (rigs_.empty()) throw Error({.file = "rigs", .found = "none", .expected = "at least one"});
    std::vector<bool> used(held_out.size());
    for (const WeightedRig& member : rigs_) {
      if (!(member.weight > 0) || !std::isfinite(member.weight))
        throw Error({.file = "weight of a rig", .found = std::to_string(member.weight), .expected = "above 0"});
      choice_.add(member.weight);
      std::vector<std::size_t>&shown = shown_.emplace_back(), &kept = held_.emplace_back();
      const std::vector<std::string>& names = member.rig->clip_names();
      for (std::size_t c = 0; c < names.size(); ++c) {
        const std::string own = rig::internal::own_clip_name(names[c]);
        bool out = false;
        for (std::size_t h = 0; h < held_out.size(); ++h)
          if (held_out[h] == names[c] || held_out[h] == own) out = used[h] = true;
        (out ? kept : shown).push_back(c);
      }
      if (shown.empty())
        throw Error({.file = member.rig->name(), .found = "no clip that isn't held out", .expected = "at least one"});
    }
    for (std::size_t h = 0; h < held_out.size(); ++h)
      if (!used[h]) throw Error({"--held-out", {}, "'" + held_out[h] + "'", "a clip of a rig"});
    for (std::size_t a = 0; a < rigs_.size(); ++a) {
      std::vector<std::size_t>& others = partners_.emplace_back();
      for (std::size_t b = 0; b < rigs_.size(); ++b)
        if (share_names(*rigs_[a].rig, *rigs_[b].rig)) others.push_back(b);
    }
  }

  const std::vector<WeightedRig>& rigs() const noexcept { return rigs_; }
  const RigCharacter& rig(std::size_t i) const { return *rigs_[i].rig; }
  const std::vector<std::size_t>& shown(std::size_t i) const { return shown_[i]; }
  const std::vector<std::size_t>& held_out(std::size_t i) const { return held_[i]; }
  const std::vector<std::size_t>& partners(std::size_t i) const { return partners_[i]; }

  std::size_t pick(Random& random) const { return choice_(random); }
  /// A pose of a rig from these of its clips.
  RigPose pose(std::size_t i, const std::vector<std::size_t>& clips, bool plain, Random& random) const {
    const RigCharacter& own = rig(i);
    const auto frame = [&]() -> const RigPose& {
      const auto& clip = own.clips()[clips[random.below(static_cast<std::uint32_t>(clips.size()))]];
      return clip[random.below(static_cast<std::uint32_t>(clip.size()))];
    };
    const RigPose& first = frame();
    if (plain) return first;
    const double kind = random.uniform();
    const bool disturbed = random.uniform() < 0.6;
    const RigPose& second = frame();
    const double share = random.uniform(), amount = random.uniform(0.0, 0.4);
    const RigPose pose = kind < 0.3   ? own.between(first, second, share)
                         : kind < 0.7 ? own.mixed(first, second, random)
                                      : first;
    return disturbed ? own.disturbed(pose, amount, random) : pose;
  }

 private:
  /// Half of the joints of each have their namesakes in the other.
  static bool share_names(const RigCharacter& a, const RigCharacter& b) {
    std::size_t common = 0;
    for (const auto& [name, number] : a.joints()) common += b.joints().contains(name) ? 1U : 0U;
    return 2 * common >= std::max(a.joints().size(), b.joints().size());
  }

  std::vector<WeightedRig> rigs_;
  WeightedChoice choice_;
  std::vector<std::vector<std::size_t>> shown_, held_, partners_;
};

class RigSampler : public SampleSource {
 public:
  explicit RigSampler(std::shared_ptr<const RigMixture> mixture, SampleOptions options = {})
      : options_(options), mixture_(std::move(mixture)) {
    data::check_options(options_);
    for (const WeightedRig& member : mixture_->rigs())
      if (std::max(options_.vertices, options_.pose_vertices) > member.rig->vertex_count())
        throw Error({.file = "vertices of a sample",
                     .found = std::to_string(std::max(options_.vertices, options_.pose_vertices)),
                     .expected = "at most " + std::to_string(member.rig->vertex_count()) + ", which " +
                                 member.rig->name() + " has"});
  }

  std::size_t max_vertices() const override {
    return data::most_vertices(options_.vertices, mixture_->rigs(), count_of);
  }
  bool equal_counts() const override { return data::have_equal_counts(options_, mixture_->rigs(), count_of); }

  void fill(std::uint64_t step, std::uint64_t index, Sample& sample) const override {
    const auto random = [&](data::Part part) {
      return data::random_for(data::Purpose::training, options_.seed, step, index, part);
    };
    data::Scratch& scratch = data::Scratch::of_thread();
    Random choice = random(data::Part::choice);
    const std::size_t a = mixture_->pick(choice);
    const std::vector<std::size_t>& partners = mixture_->partners(a);
    const std::size_t b = partners[choice.below(static_cast<std::uint32_t>(partners.size()))];
    const bool mirrored = choice.uniform() < 0.5;
    const RigCharacter &identity = mixture_->rig(a), &pose = mixture_->rig(b);
    Random shape = random(data::Part::identity_shape), other_shape = random(data::Part::pose_shape);
    Random stands = random(data::Part::identity_pose), moves = random(data::Part::pose);
    const RigProportions own = identity.sample_proportions(shape), others = pose.sample_proportions(other_shape);
    const RigPose stand = mixture_->pose(a, mixture_->shown(a), false, stands);
    const RigPose goal = mixture_->pose(b, mixture_->shown(b), false, moves);
    Random augmentation = random(data::Part::augmentation);
    const data::Placements placements = data::draw_placements(options_, augmentation);
    const auto make = [mirrored](const RigCharacter& rig, const RigProportions& proportions, const RigCharacter& source,
                                 const RigPose& taken, const Similarity& placement, std::vector<float>& xyz) {
      xyz.resize(3 * rig.vertex_count());
      rig.posed(proportions, source, taken, xyz);
      const auto unit = static_cast<float>(1 / rig.extent());
      for (float& x : xyz) x *= unit;
      if (mirrored)
        for (std::size_t k = 0; k < xyz.size(); k += 3) xyz[k] = -xyz[k];
      data::place(placement, xyz);
    };
    make(identity, own, identity, stand, placements.identity, scratch.identity);
    make(identity, own, pose, goal, placements.truth, scratch.truth);
    make(pose, others, pose, goal, placements.pose, scratch.pose);
    if (options_.noise > 0) {
      Random noise = random(data::Part::noise);
      const double sigma = noise.uniform(0, options_.noise);
      data::add_noise(scratch.pose, sigma, noise);
    }
    const bool by_area = options_.vertices != 0 && choice.uniform() < 0.5;
    Random order = random(data::Part::pose_order);
    choose(pose, pose_vertices(), by_area, order, scratch, scratch.pose, nullptr, scratch.pose_rows, options_.shuffle);
    order = random(data::Part::identity_order);
    choose(identity, options_.vertices, by_area, order, scratch, scratch.identity, &scratch.truth,
           scratch.identity_rows, options_.shuffle);
    data::normalise_into(scratch, options_.normalisation, sample);
    sample.edges.clear();
    sample.triangles.clear();
    if (options_.vertices != 0 || !options_.topology) return;
    data::places_of(scratch.identity_rows, scratch.places);
    data::renumber_edges(scratch.places, identity.edges(), sample.edges);
    data::renumber_triangles(scratch.places, identity.triangles(), sample.triangles);
  }

 private:
  /// Vertices of a mesh, or points of its surface, which are appended to it and to its other pose.
  static void choose(const RigCharacter& rig, std::size_t count, bool by_area, Random& random, data::Scratch& scratch,
                     std::vector<float>& xyz, std::vector<float>* other, std::vector<std::uint32_t>& rows,
                     bool shuffle) {
    const std::size_t vertices = rig.vertex_count();
    if (!by_area || count == vertices) {
      data::choose_rows(vertices, count, shuffle, random, scratch.choice, rows);
      return;
    }
    thread_local DrawScratch draw;
    thread_local std::vector<SurfacePoint> points;
    draw_points(xyz, rig.triangles(), count, random, draw, points);
    rows.resize(count);
    for (std::size_t i = 0; i < count; ++i) rows[i] = static_cast<std::uint32_t>(vertices + i);
    for (std::vector<float>* mesh : {&xyz, other}) {
      if (mesh == nullptr) continue;
      mesh->resize(3 * (vertices + count));
      for (std::size_t i = 0; i < count; ++i) {
        const Vec3f p = position_of(points[i], *mesh);
        (*mesh)[3 * (vertices + i)] = p.x, (*mesh)[3 * (vertices + i) + 1] = p.y, (*mesh)[3 * (vertices + i) + 2] = p.z;
      }
    }
  }

  static std::size_t count_of(const WeightedRig& member) { return member.rig->vertex_count(); }
  std::size_t pose_vertices() const { return data::pose_vertices_of(options_); }

  SampleOptions options_;
  std::shared_ptr<const RigMixture> mixture_;
};

/// Points by area of one of the characters, in a pose and with proportions as RigSampler draws them, and their
/// triangles' normals: for readers of people, which are to tell what isn't one. points, normals: [n]
inline void draw_rig_surface(const RigMixture& mixture, Random& random, std::size_t n, std::vector<Vec3f>& points,
                             std::vector<Vec3f>& normals) {
  const std::size_t i = mixture.pick(random);
  const RigCharacter& rig = mixture.rig(i);
  const RigProportions proportions = rig.sample_proportions(random);
  const RigPose pose = mixture.pose(i, mixture.shown(i), false, random);
  thread_local std::vector<float> xyz;
  thread_local DrawScratch scratch;
  thread_local std::vector<SurfacePoint> drawn;
  xyz.resize(3 * rig.vertex_count());
  rig.posed(proportions, rig, pose, xyz);
  draw_points(xyz, rig.triangles(), n, random, scratch, drawn);
  points.clear(), normals.clear();
  for (const SurfacePoint& p : drawn) {
    const Vec3d a = point_at(xyz, p.corners[0]), b = point_at(xyz, p.corners[1]), c = point_at(xyz, p.corners[2]);
    points.push_back(position_of(p, xyz));
    normals.push_back(normalised(cross(b - a, c - a)).as<float>());
  }
}

/// Which of a mixture's rigs give identity and pose meshes, by their indices; none: all.
struct RigRoles {
  std::vector<std::size_t> identities, poses;
};

/// `count` pairs of rigs as they came, in held-out clips, or in any where none is held out; the identity stands in a
/// frame of a clip that isn't.
/// Errors  npt::Error where no identity takes a pose
inline EvaluationSet rig_pairs(const std::shared_ptr<const RigMixture>& mixture, std::size_t count, std::uint64_t seed,
                               const RigRoles& roles = {}) {
  const auto takes_part = [](const std::vector<std::size_t>& chosen, std::size_t i) {
    return chosen.empty() || std::ranges::find(chosen, i) != chosen.end();
  };
  bool any = false;
  for (std::size_t i = 0; i < mixture->rigs().size(); ++i) any = any || !mixture->held_out(i).empty();
  std::vector<std::size_t> sources;
  std::vector<std::vector<std::size_t>> takers(mixture->rigs().size());
  for (std::size_t i = 0; i < mixture->rigs().size(); ++i) {
    if (!takes_part(roles.poses, i) || (any && mixture->held_out(i).empty())) continue;
    for (const std::size_t partner : mixture->partners(i))
      if (takes_part(roles.identities, partner)) takers[i].push_back(partner);
    if (!takers[i].empty()) sources.push_back(i);
  }
  if (sources.empty())
    throw Error(
        {.file = "pairs of rigs",
         .found = any ? "no rig with a held-out clip that another's joints can take" : "no two that share joints",
         .expected = "rigs whose joints have the same names"});
  return {.name = any ? "held-out clips" : "clips",
          .count = count,
          .pair = [mixture, seed, sources, takers, any](std::size_t i) {
            const auto random = [&](data::Part part) {
              return data::random_for(data::Purpose::evaluation, seed, 0, i, part);
            };
            Random choice = random(data::Part::choice), stands = random(data::Part::identity_pose),
                   moves = random(data::Part::pose);
            const auto pick = [&choice](const std::vector<std::size_t>& of) {
              return of[choice.below(static_cast<std::uint32_t>(of.size()))];
            };
            const std::size_t b = pick(sources), a = pick(takers[b]);
            const RigCharacter &identity = mixture->rig(a), &pose = mixture->rig(b);
            const RigPose stand = mixture->pose(a, mixture->shown(a), true, stands);
            const std::size_t clip = pick(any ? mixture->held_out(b) : mixture->shown(b));
            const RigPose goal = mixture->pose(b, {clip}, true, moves);
            std::vector<float> at(3 * identity.vertex_count()), goal_at(at), other(3 * pose.vertex_count());
            identity.posed({}, identity, stand, at);
            identity.posed({}, pose, goal, goal_at);
            pose.posed({}, pose, goal, other);
            for (float& x : at) x /= static_cast<float>(identity.extent());
            for (float& x : goal_at) x /= static_cast<float>(identity.extent());
            for (float& x : other) x /= static_cast<float>(pose.extent());
            const auto order_of = [&](const RigCharacter& rig, data::Part part) {
              return data::VertexOrder(rig.vertex_count(), random(part));
            };
            EvaluationPair result = data::shuffled_pair({.pose = other,
                                                         .identity = at,
                                                         .truth = goal_at,
                                                         .pose_triangles = pose.triangles(),
                                                         .identity_triangles = identity.triangles(),
                                                         .edges = identity.edges()},
                                                        order_of(pose, data::Part::pose_order),
                                                        order_of(identity, data::Part::identity_order));
            result.name = rig::internal::stem(identity.name()) + " as " + rig::internal::stem(pose.name()) + ", " +
                          rig::internal::own_clip_name(pose.clip_names()[clip]);
            return result;
          }};
}

}  // namespace npt::inline NPT_ABI
