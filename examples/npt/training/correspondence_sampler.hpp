/// Samples for a network that reads meshes: points of a posed surface with their normals, and for each the place on the
/// resting template where it belongs (its canonical coordinates).
/// A sample is a body of random shape and proportions in a random pose (body_variation.hpp), turned anywhere about the
/// vertical axis (some lie or stand on their hands), dressed, pieces missing, noise; its points are drawn by area. A
/// part of the samples may be of surfaces of no such body, or of no more than a piece of one (a bust, a hand): all
/// their points belong to one place far from any body.
/// Shapes    Sample::pose: points [n, 3], centred on their mean, with a root mean square distance of reading_radius;
///           Sample::identity: normals [n, 3], unit or zero; Sample::truth: half the canonical coordinates, [n, 3], so
///           that they fit into tanh; Sample::scale: 0.5, network units in a metre of canonical coordinates
/// Numerics  float; a sample depends on (seed, step, index) only
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/matrix3.hpp>
#include <npt/base/random.hpp>
#include <npt/base/rigid.hpp>
#include <npt/base/vec3.hpp>
#include <npt/base/weighted_choice.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/body_plan.hpp>
#include <npt/body/kinematics.hpp>
#include <npt/body/pose_sampler.hpp>
#include <npt/config.hpp>
#include <npt/estimate/canonical_frame.hpp>
#include <npt/lab/draws.hpp>
#include <npt/mesh/normalise.hpp>
#include <npt/mesh/skinning.hpp>
#include <npt/nn/train/sample.hpp>
#include <training/blocks.hpp>
#include <training/body_variation.hpp>
#include <training/dress.hpp>
#include <training/surface_cloud.hpp>
#include <training/warp.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// A body of a mixture. `weight`: its share of the samples, relative to the others.
struct WeightedCloud {
  std::shared_ptr<const SurfaceCloud> cloud;
  double weight = 1;
};

struct CorrespondenceSampleOptions {
  std::uint64_t seed = 0;
  std::size_t points = 512;
  double blocks = 0;     ///< share whose parts are boxes
  double fallen = 0.2;   ///< share that points anywhere; half of the poses that may be in any direction
  double plain = 0.15;   ///< share of bare bodies without proportions or any of the below
  double patched = 0;    ///< share whose limbs come from bodies drawn for each
  double warped = 0;     ///< share whose resting shape is changed smoothly (warp.hpp)
  bool mirror = false;   ///< half of the samples mirrored, left for right: for bodies that aren't symmetric
  double strangers = 0;  ///< share of surfaces that are no such body's
  double pieces = 0;     ///< share of them that is a piece of one
};

class CorrespondenceSampler final : public SampleSource {
 public:
  /// Draws points by area and their unit normals, upright, in any unit, of something that isn't such a body. [n] each
  using Stranger = std::function<void(Random&, std::size_t n, std::vector<Vec3f>& points, std::vector<Vec3f>& normals)>;

  /// Requires  bodies of the variation's plan; a stranger where options.strangers is above 0
  CorrespondenceSampler(std::vector<WeightedCloud> bodies, std::shared_ptr<const BodyVariation> variation,
                        const CorrespondenceSampleOptions& options, data::Purpose purpose = data::Purpose::training,
                        Stranger stranger = {})
      : bodies_(std::move(bodies)),
        variation_(std::move(variation)),
        stranger_(std::move(stranger)),
        options_(options),
        purpose_(purpose) {
    NPT_ASSERT(!bodies_.empty() && options.points > 0 && (stranger_ || options.strangers <= 0));
    for (const WeightedCloud& member : bodies_) {
      NPT_ASSERT(&member.cloud->plan() == &plan());
      equal_ = equal_ && member.weight == bodies_.front().weight;
      choice_.add(member.weight);
    }
  }

  std::size_t max_vertices() const override { return options_.points; }
  bool equal_counts() const override { return true; }

  /// Draws points by area and their unit normals of a body, upright, in metres: for another kind's strangers. [n] each
  void draw_surface(Random& random, std::size_t n, std::vector<Vec3f>& points, std::vector<Vec3f>& normals) const {
    thread_local Scratch scratch;
    draw_body(random, random, random, random, random, n, false, scratch);
    points.clear(), normals.clear();
    for (const Drawn& p : scratch.drawn) points.push_back(p.at), normals.push_back(p.normal);
  }

  void fill(std::uint64_t step, std::uint64_t index, Sample& s) const override {
    const auto random = [&](data::Part part) { return data::random_for(purpose_, options_.seed, step, index, part); };
    Random choice = random(data::Part::choice), shape = random(data::Part::identity_shape),
           angles = random(data::Part::pose), order = random(data::Part::identity_order),
           more = random(data::Part::augmentation), noise = random(data::Part::noise);
    const std::size_t n = options_.points;
    s.inputs.resize(2);
    std::vector<float>&points = s.inputs[0], &normals = s.inputs[1];
    points.resize(3 * n), normals.resize(3 * n), s.truth.resize(3 * n);
    thread_local Scratch scratch;
    const bool strange = options_.strangers > 0 && choice.uniform() < options_.strangers;
    const bool piece = strange && choice.uniform() < options_.pieces;
    scratch.anywhere = false;
    if (strange && !piece)
      draw_stranger(choice, n, scratch);
    else
      draw_body(choice, shape, angles, order, more, n, piece, scratch);
    const Matrix3 turn = turn_of(more, scratch.anywhere);
    const double sigma = more.uniform() < 0.5 ? 0 : 0.012 * more.uniform();
    const bool blind = more.uniform() < 0.08;                 // no normals
    const float side = more.uniform() < 0.03 ? -1.0F : 1.0F;  // inside out
    for (std::size_t i = 0; i < n; ++i) {
      const Drawn& p = scratch.drawn[i];
      Vec3d at = turn * p.at.as<double>();
      if (sigma > 0) at += Vec3d{noise.normal(), noise.normal(), noise.normal()} * sigma;
      const Vec3f normal = blind ? Vec3f{} : (turn * p.normal.as<double>()).as<float>() * side;
      put(points, i, at.as<float>()), put(normals, i, normal);
      put(s.truth, i, p.canonical * 0.5F);
    }
    const auto point = [&points](std::size_t i) {
      return Vec3f{points[3 * i], points[3 * i + 1], points[3 * i + 2]}.as<double>();
    };
    const NormalisingTransform frame = canonical_frame(n, point);
    for (std::size_t i = 0; i < n; ++i) put(points, i, frame.apply(point(i)).as<float>());
    s.edges.clear(), s.triangles.clear();
    s.reference = -1;
    s.scale = 0.5;
  }

 private:
  /// One body of a sample, with the limbs that are its.
  struct SkinnedCloud {
    const SurfaceCloud* cloud = nullptr;
    std::vector<bool> limbs;
    std::vector<BasicAffine<float>> parts;  ///< [J] stretch and motion
    std::vector<float> betas;
  };
  struct Skin {
    std::vector<SkinnedCloud> clouds;
    data::Warp warp;
    bool blocks = false;
  };
  struct Posed {
    Vec3f at, normal;
    float key = 0;  ///< points with the greatest ones are taken
    std::uint32_t point = 0, cloud = 0;
  };
  /// The body that each limb is taken from.
  using Limbs = std::vector<std::size_t>;
  const BodyPlan& plan() const { return variation_->plan(); }

  /// A point of a sample, upright and in metres.
  struct Drawn {
    Drawn(Vec3f a, Vec3f n, Vec3f c) : at(a), normal(n), canonical(c) {}
    Vec3f at, normal, canonical;
  };
  struct Scratch {
    bool anywhere = false;
    std::vector<Posed> posed;
    std::vector<Posed> chosen;
    std::vector<Drawn> drawn;
    std::vector<Vec3f> points, normals;
  };
  /// piece: no more than what lies about one of the body's points.
  void draw_body(Random& choice, Random& shape, Random& angles, Random& order, Random& more, std::size_t n, bool piece,
                 Scratch& scratch) const {
    const std::size_t first = pick_body(choice);
    const bool plain = choice.uniform() < options_.plain;
    Limbs limbs(plan().limbs.size(), first);
    if (options_.patched > 0 && choice.uniform() < options_.patched) patch(choice, limbs);
    const bool mirrored = options_.mirror && choice.uniform() < 0.5;
    thread_local Skin skin;
    skin.blocks = !plain && options_.blocks > 0 && choice.uniform() < options_.blocks;
    skin.warp = {};
    if (!plain && !skin.blocks && options_.warped > 0 && choice.uniform() < options_.warped)
      skin.warp = data::Warp(shape, [&](Random& random) {
        const auto& points = bodies_[first].cloud->points();
        return points[random.below(static_cast<std::uint32_t>(points.size()))].rest;
      });
    scratch.anywhere = make_skin(limbs, shape, angles, plain, skin);
    data::Dress dress = plain ? data::Dress{} : variation_->draw_dress(more);
    if (piece) {
      const SkinnedCloud& trunk = skin.clouds.front();
      const auto& points = trunk.cloud->points();
      dress.any = true;
      dress.no_hands = dress.no_feet = dress.no_head = false;
      dress.hole_radius = 0;
      const SurfaceCloud::Point* middle = nullptr;  // the other bodies' limbs may have no point near one of its own
      while (middle == nullptr || !trunk.limbs[plan().joints[middle->joint[0]].limb])
        middle = &points[more.below(static_cast<std::uint32_t>(points.size()))];
      dress.piece = middle->canonical;
      dress.piece_radius = static_cast<float>(more.uniform(0.12, 0.4));
    }
    const std::vector<data::Prop> props = plain || piece ? std::vector<data::Prop>{} : variation_->draw_props(more);
    scratch.drawn.clear();
    draw_props(skin, props, more, n, scratch);
    draw_points(skin, dress, order, n - scratch.drawn.size(), scratch);
    for (const Posed& p : scratch.chosen)
      scratch.drawn.emplace_back(p.at, p.normal, skin.clouds[p.cloud].cloud->points()[p.point].canonical);
    for (Drawn& d : scratch.drawn) {
      if (mirrored) d.at.x = -d.at.x, d.normal.x = -d.normal.x, d.canonical.x = -d.canonical.x;
      if (piece) d.canonical = variation_->elsewhere();
    }
  }

  /// As many points as props have of the whole surface; each prop is fastened to a point of the limb that carries it.
  void draw_props(const Skin& skin, const std::vector<data::Prop>& props, Random& random, std::size_t n,
                  Scratch& scratch) const {
    float area = 0, all = usual_area;
    for (const data::Prop& prop : props)
      for (const data::PropPart& part : prop.parts) all += part.area();
    for (const data::Prop& prop : props) {
      const auto carries = std::ranges::find_if(
          skin.clouds, [&](const SkinnedCloud& c) { return c.limbs[plan().joints[prop.joint].limb]; });
      const SurfaceCloud& cloud = *carries->cloud;
      const SurfaceCloud::Point* fastened = nullptr;
      for (int tries = 0; tries < fastening_tries; ++tries) {
        const auto& point = cloud.points()[random.below(static_cast<std::uint32_t>(cloud.points().size()))];
        if (point.joint[0] != prop.joint) continue;
        if (fastened == nullptr || dot(point.rest - fastened->rest, prop.side) > 0) fastened = &point;
      }
      for (const data::PropPart& part : prop.parts) {
        const float before = area;
        area += part.area();
        if (fastened == nullptr) continue;
        const auto number = [&](float to) { return static_cast<std::size_t>(to / all * static_cast<float>(n)); };
        for (std::size_t i = number(before); i < number(area); ++i) {
          Vec3f at, normal;
          part.draw(random, at, normal);
          const BasicAffine<float>& moved = carries->parts[prop.joint];
          scratch.drawn.emplace_back(moved(skin.warp(fastened->rest) + at), normalised(moved.linear * normal),
                                     fastened->canonical);
        }
      }
    }
  }

  /// As high as a person, about.
  void draw_stranger(Random& choice, std::size_t n, Scratch& scratch) const {
    stranger_(choice, n, scratch.points, scratch.normals);
    const NormalisingTransform frame =
        canonical_frame(n, [&](std::size_t i) { return scratch.points[i].template as<double>(); });
    scratch.drawn.clear();
    for (std::size_t i = 0; i < n; ++i)
      scratch.drawn.emplace_back(frame.apply(scratch.points[i].template as<double>()).template as<float>(),
                                 scratch.normals[i], variation_->elsewhere());
  }

  static void put(std::vector<float>& to, std::size_t i, Vec3f p) {
    to[3 * i] = p.x, to[3 * i + 1] = p.y, to[3 * i + 2] = p.z;
  }

  std::size_t pick_body(Random& random) const {
    if (equal_) return random.below(static_cast<std::uint32_t>(bodies_.size()));
    return choice_(random);
  }
  /// Another body for each limb, mostly the same one for both sides; the trunk, the root's limb, stays.
  void patch(Random& random, Limbs& limbs) const {
    const std::vector<JointPlan>& joints = plan().joints;
    std::vector<bool> drawn(limbs.size());
    drawn[joints[0].limb] = true;
    for (const JointPlan& joint : joints) {
      if (drawn[joint.limb]) continue;
      const std::size_t other = joints[joint.mirrored].limb;
      drawn[joint.limb] = drawn[other] = true;
      limbs[joint.limb] = limbs[other] = pick_body(random);
      if (other != joint.limb && random.uniform() < 0.1) limbs[other] = pick_body(random);
    }
  }

  /// A limb's skeleton is that of its body; where it hangs, the body says that has the part above. Whether the pose may
  /// be in any direction.
  bool make_skin(const Limbs& limbs, Random& shape, Random& angles, bool plain, Skin& skin) const {
    const std::size_t limb_count = limbs.size(), joint_count = plan().joint_count();
    Limbs number(limb_count);
    std::size_t count = 0;
    for (std::size_t l = 0; l < limb_count; ++l) {
      std::size_t same = 0;
      while (limbs[same] != limbs[l]) ++same;
      if (same == l) {
        if (skin.clouds.size() <= count) skin.clouds.emplace_back();
        skin.clouds[count].cloud = bodies_[limbs[l]].cloud.get();
        skin.clouds[count].limbs.assign(limb_count, false);
        number[l] = count++;
      }
      number[l] = number[same];
      skin.clouds[number[l]].limbs[l] = true;
    }
    skin.clouds.resize(count);
    std::vector<std::vector<Vec3d>> rest;
    for (SkinnedCloud& own : skin.clouds) {
      own.betas = sample_shape(shape, own.cloud->body().shape_count());
      own.parts.resize(joint_count);
      rest.push_back(own.cloud->body().joints(own.betas));
      for (Vec3d& joint : rest.back()) joint = skin.warp(joint.as<float>()).as<double>();
    }
    std::vector<double> proportions = variation_->draw_proportions(shape);
    if (plain) std::ranges::fill(proportions, 0.0);
    const BodyVariation::Pose drawn = variation_->draw_pose(angles);
    const std::vector<float>& pose = drawn.angles;
    std::vector<Vec3d> grown(joint_count);
    std::vector<Rigid> motion(joint_count);
    const auto stretch = [&](std::size_t c, std::size_t j) {
      Matrix3 result = Matrix3::identity();
      for (std::size_t k = 0; k < proportions.size(); ++k) {
        const Matrix3& g = skin.clouds[c].cloud->growth()[j][k];
        if (!(g == Matrix3{})) result += g * proportions[k];
      }
      return result;
    };
    for (std::size_t j = 0; j < joint_count; ++j) {
      const Matrix3 r = rotation_matrix({static_cast<double>(pose[3 * j]), static_cast<double>(pose[3 * j + 1]),
                                         static_cast<double>(pose[3 * j + 2])});
      if (j == 0) {
        grown[0] = rest[number[0]][0];
        motion[0] = Rigid::about(grown[0], r);
      } else {
        const auto parent = static_cast<std::size_t>(plan().joints[j].parent);
        const std::size_t above = number[plan().joints[parent].limb];
        grown[j] = grown[parent] + stretch(above, parent) * (rest[above][j] - rest[above][parent]);
        motion[j] = motion[parent] * Rigid::about(grown[j], r);
      }
      for (std::size_t c = 0; c < count; ++c) {
        // The stretch about the joint, then the motion.
        const Matrix3 own = stretch(c, j);
        skin.clouds[c].parts[j] = Affine{motion[j].rotation * own, motion[j](grown[j] - own * rest[c][j])}.as<float>();
      }
    }
    return drawn.anywhere;
  }

  /// Most stand upright, some lean, some point anywhere.
  Matrix3 turn_of(Random& r, bool anywhere) const {
    const Matrix3 yaw = rotation_matrix({0, r.uniform(-std::numbers::pi, std::numbers::pi), 0});
    if (r.uniform() >= (anywhere ? 0.5 : options_.fallen))
      return rotation_matrix({0.12 * r.normal(), 0, 0.12 * r.normal()}) * yaw;
    Vec3d axis{r.normal(), r.normal(), r.normal()};
    return rotation_matrix(normalised(axis) * r.uniform(0, std::numbers::pi)) * yaw;
  }

  static constexpr float usual_area = 1.8F;  ///< of a body, in square metres
  /// Points of the body that are looked at for the place of a prop.
  static constexpr int fastening_tries = 1000;
  /// The least piece is about a hundredth of the surface and takes 40 rounds. Beyond these the body is bare and whole.
  static constexpr int most_rounds = 1000;

  /// Poses candidates, more than are needed, and takes n of them by the area that each stands for now: the n greatest
  /// of log(u) / area (Efraimidis and Spirakis, 2006).
  void draw_points(const Skin& skin, const data::Dress& dress, Random& random, std::size_t n, Scratch& scratch) const {
    const std::size_t tries = std::min(5 * n / 2, SurfaceCloud::candidates);
    const auto clouds = static_cast<std::uint32_t>(skin.clouds.size());
    scratch.posed.clear();
    for (int round = 0; scratch.posed.size() < n; ++round) {
      static const data::Dress bare;
      const data::Dress& worn = round < most_rounds ? dress : bare;
      for (std::size_t i = 0; i < tries * clouds; ++i) {
        Posed p;
        if (clouds > 1) p.cloud = random.below(clouds);
        const SkinnedCloud& own = skin.clouds[p.cloud];
        const SurfaceCloud& cloud = *own.cloud;
        p.point = random.below(static_cast<std::uint32_t>(cloud.points().size()));
        if (!own.limbs[plan().joints[cloud.points()[p.point].joint[0]].limb]) continue;
        const double u = 1 - random.uniform();
        float area = 0;
        if (!place(own, p.point, worn, skin, p, area)) continue;
        if (clouds > 1) area *= 1e5F * cloud.area_of_point();
        p.key = static_cast<float>(std::log(u)) / std::max(area, 1e-6F);
        scratch.posed.push_back(p);
      }
    }
    const auto middle = scratch.posed.begin() + static_cast<std::ptrdiff_t>(n);
    if (middle != scratch.posed.end())
      std::nth_element(scratch.posed.begin(), middle, scratch.posed.end(),
                       [](const Posed& a, const Posed& b) { return a.key > b.key; });
    scratch.chosen.assign(scratch.posed.begin(), middle);
  }

  /// Whether the point is there at all.
  bool place(const SkinnedCloud& own, std::uint32_t k, const data::Dress& dress, const Skin& skin, Posed& out,
             float& area) const {
    const SurfaceCloud& cloud = *own.cloud;
    const SurfaceCloud::Point& p = cloud.points()[k];
    Vec3f at = p.rest;
    const std::span<const float> directions = cloud.directions(k);
    for (std::size_t s = 0; s < own.betas.size(); ++s) {
      const float b = own.betas[s];
      at += Vec3f{directions[3 * s], directions[3 * s + 1], directions[3 * s + 2]} * b;
    }
    const Vec3f bare = at;
    float swollen = 1;
    if (dress.any && !variation_->clothe(cloud, p, dress, at, swollen)) return false;
    Vec3f along = skin.warp.carried(bare, p.along), across = skin.warp.carried(bare, p.across);
    at += skin.warp(bare) - bare;
    if (skin.blocks) {
      Vec3f face;
      data::put_on_block(cloud.blocks()[p.joint[0]], at, face);
      along = {face.y, face.z, face.x}, across = cross(face, along);
    }
    // A box is moved by one joint.
    const BasicAffine<float> moved = skin.blocks ? own.parts[p.joint[0]] : blended_motion(p.joint, p.weight, own.parts);
    out.at = moved(at);
    const Vec3f normal = cross(moved.linear * along, moved.linear * across);
    area = length(normal) * p.area * swollen;
    out.normal = normalised(normal);
    return true;
  }

  std::vector<WeightedCloud> bodies_;
  WeightedChoice choice_;
  bool equal_ = true;  ///< all weights
  std::shared_ptr<const BodyVariation> variation_;
  Stranger stranger_;
  CorrespondenceSampleOptions options_;
  data::Purpose purpose_;
};

}  // namespace npt::inline NPT_ABI
