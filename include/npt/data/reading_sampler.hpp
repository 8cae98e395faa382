/// Samples for a network that reads meshes: points of a posed surface with their normals, and for each the place on the
/// resting template where it belongs (its canonical coordinates).
/// A sample is a body of random shape and proportions in a random pose, turned anywhere about the vertical axis (some
/// lie or stand on their hands), dressed, shod, with hair, pieces missing, noise; its points are drawn by area. A part
/// of the samples may be of surfaces that are no person's: all their points belong to one place far from any body.
/// Shapes    Sample::pose: points [n, 3], centred on their mean, with a root mean square distance of reading_radius;
///           Sample::identity: normals [n, 3], unit or zero; Sample::truth: half the canonical coordinates, [n, 3], so
///           that they fit into tanh; Sample::scale: 0.5, network units in a metre of canonical coordinates
/// Numerics  float; a sample depends on (seed, step, index) only
#pragma once

#include <npt/body/body_model.hpp>
#include <npt/body/kinematics.hpp>
#include <npt/body/limbs.hpp>
#include <npt/body/pose_sampler.hpp>
#include <npt/body/proportions.hpp>
#include <npt/body/reading_frame.hpp>
#include <npt/body/skeleton.hpp>
#include <npt/config.hpp>
#include <npt/core/matrix3.hpp>
#include <npt/core/random.hpp>
#include <npt/core/vec3.hpp>
#include <npt/data/draws.hpp>
#include <npt/data/sample.hpp>

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

/// A body's surface as candidate points that can be posed one by one: denser on the head, hands and feet, which grow
/// most.
class SurfaceCloud {
 public:
  static constexpr std::size_t candidates = 24000;
  static constexpr std::size_t most_joints = 6;

  struct Point {
    Vec3f rest, along, across;  ///< of the mean shape; two edges of the triangle that it lies on
    Vec3f canonical;
    float area = 1;  ///< that it stands for in the resting surface, relative to a point of the trunk
    std::array<std::uint8_t, most_joints> joint{};
    std::array<float, most_joints> weight{};
  };

  /// canonical: [V, 3], where each vertex of the body belongs on the template
  SurfaceCloud(std::shared_ptr<const BodyModel> body, std::span<const float> canonical) : body_(std::move(body)) {
    NPT_ASSERT(body_->joint_count() == smpl_joint_count && canonical.size() == 3 * body_->vertex_count());
    joints_ = body_->joints({});
    growth_ = body::internal::part_growth(joints_);
    scatter(canonical);
  }

  const BodyModel& body() const noexcept { return *body_; }
  std::span<const Point> points() const noexcept { return points_; }
  std::span<const Vec3d> joints() const noexcept { return joints_; }
  /// [S, 3] the shape directions of a point.
  std::span<const float> directions(std::size_t point) const {
    return std::span(directions_).subspan(3 * point * body_->shape_count(), 3 * body_->shape_count());
  }
  const std::vector<std::array<Matrix3, body_proportion_count>>& growth() const noexcept { return growth_; }
  /// Square metres of the resting surface for each candidate point of the trunk.
  float area_of_point() const noexcept { return area_of_point_; }

 private:
  /// Candidates for each unit of area, relative to the trunk.
  double density(const Triangle& f) const {
    const BodyTables& t = body_->tables();
    double sum = 0;
    for (const std::uint32_t v : f)
      for (std::size_t k = t.weights.start[v]; k < t.weights.start[v + 1]; ++k) {
        using enum SmplJoint;
        const auto is = [joint = t.weights.column[k]](auto... joints) {
          return ((joint == joint_index(joints)) || ...);
        };
        const double more = is(head)                                             ? 4
                            : is(left_wrist, right_wrist, left_hand, right_hand) ? 2
                            : is(left_ankle, right_ankle, left_foot, right_foot) ? 2
                                                                                 : 1;
        sum += more * static_cast<double>(t.weights.value[k]) / 3;
      }
    return sum;
  }

  void scatter(std::span<const float> canonical) {
    const BodyTables& t = body_->tables();
    const std::size_t shapes = body_->shape_count();
    const auto at = [](std::span<const float> xyz, std::uint32_t v) {
      return Vec3f{xyz[3 * std::size_t{v}], xyz[3 * std::size_t{v} + 1], xyz[3 * std::size_t{v} + 2]};
    };
    std::vector<double> up_to;
    double area = 0;
    for (const Triangle& f : t.triangles) {
      const Vec3f a = at(t.v_template, f[0]);
      area += density(f) * static_cast<double>(length(cross(at(t.v_template, f[1]) - a, at(t.v_template, f[2]) - a)));
      up_to.push_back(area);
    }
    area_of_point_ = static_cast<float>(area / 2 / static_cast<double>(candidates));
    Random random(20260101);
    for (std::size_t i = 0; i < candidates; ++i) {
      const double goal = area * (static_cast<double>(i) + random.uniform()) / static_cast<double>(candidates);
      const auto where = std::lower_bound(up_to.begin(), up_to.end(), goal);
      const Triangle& f =
          t.triangles[std::min<std::size_t>(static_cast<std::size_t>(where - up_to.begin()), t.triangles.size() - 1)];
      float u = static_cast<float>(random.uniform()), v = static_cast<float>(random.uniform());
      if (u + v > 1) u = 1 - u, v = 1 - v;
      const std::array<float, 3> share{1 - u - v, u, v};
      Point p;
      p.area = static_cast<float>(1 / density(f));
      const Vec3f a = at(t.v_template, f[0]), b = at(t.v_template, f[1]), c = at(t.v_template, f[2]);
      p.rest = a * share[0] + b * share[1] + c * share[2];
      p.along = normalised(b - a);
      p.across = normalised(cross(cross(b - a, c - a), b - a));
      p.canonical = at(canonical, f[0]) * share[0] + at(canonical, f[1]) * share[1] + at(canonical, f[2]) * share[2];
      std::array<float, smpl_joint_count> weights{};
      for (std::size_t corner = 0; corner < 3; ++corner)
        for (std::size_t k = t.weights.start[f[corner]]; k < t.weights.start[f[corner] + 1]; ++k)
          weights[t.weights.column[k]] += share[corner] * t.weights.value[k];
      float sum = 0;
      for (std::size_t k = 0; k < most_joints; ++k) {
        const auto heaviest = std::ranges::max_element(weights);
        p.joint[k] = static_cast<std::uint8_t>(heaviest - weights.begin());
        p.weight[k] = *heaviest;
        sum += *heaviest;
        *heaviest = 0;
      }
      for (float& w : p.weight) w /= sum;
      points_.push_back(p);
      for (std::size_t s = 0; s < shapes; ++s)
        for (std::size_t axis = 0; axis < 3; ++axis) {
          float d = 0;
          for (std::size_t corner = 0; corner < 3; ++corner)
            d += share[corner] * t.shapedirs[(3 * std::size_t{f[corner]} + axis) * shapes + s];
          directions_.push_back(d);
        }
    }
  }

  std::shared_ptr<const BodyModel> body_;
  std::vector<Vec3d> joints_;
  std::vector<std::array<Matrix3, body_proportion_count>> growth_;
  std::vector<Point> points_;
  std::vector<float> directions_;  ///< [points, S, 3]
  float area_of_point_ = 0;
};

/// Where the points of a surface belong that is no person's, in canonical coordinates: half a metre and more in front
/// of every body.
inline constexpr Vec3f stranger_place{0, 0, 1};

/// A body of a mixture. `weight`: its share of the samples, relative to the others.
struct WeightedCloud {
  std::shared_ptr<const SurfaceCloud> cloud;
  double weight = 1;
};

struct ReadingSampleOptions {
  std::uint64_t seed = 0;
  std::size_t points = 512;
  double natural = 0.7;   ///< share of poses that `natural_pose` draws; the others are uniform in wide ranges
  double fallen = 0.15;   ///< share that points anywhere
  double dressed = 0.45;  ///< share with clothes
  double plain = 0.15;    ///< share of bare bodies of human proportions without any of the below
  double patched = 0;     ///< share whose trunk, head, arms and legs come from bodies drawn for each
  bool mirror = false;    ///< half of the samples mirrored, left for right: for bodies that aren't symmetric
  double strangers = 0;   ///< share of surfaces that are no person's
};

class ReadingSampler final : public SampleSource {
 public:
  /// Draws the angles [24, 3] of a natural pose.
  using NaturalPose = std::function<std::array<float, 3 * smpl_joint_count>(Random&)>;

  /// Draws points by area and their unit normals, upright, in any unit, of something that isn't a person. [n] each
  using Stranger = std::function<void(Random&, std::size_t n, std::vector<Vec3f>& points, std::vector<Vec3f>& normals)>;

  /// Requires  a stranger where options.strangers is above 0
  ReadingSampler(std::vector<WeightedCloud> bodies, NaturalPose natural_pose, const ReadingSampleOptions& options,
                 data::Purpose purpose = data::Purpose::training, Stranger stranger = {})
      : bodies_(std::move(bodies)),
        natural_pose_(std::move(natural_pose)),
        stranger_(std::move(stranger)),
        options_(options),
        purpose_(purpose) {
    NPT_ASSERT(!bodies_.empty() && options.points > 0 && (stranger_ || options.strangers <= 0));
    double sum = 0;
    for (const WeightedCloud& member : bodies_) {
      equal_ = equal_ && member.weight == bodies_.front().weight;
      shares_.push_back(sum += member.weight);
    }
  }
  ReadingSampler(const std::vector<std::shared_ptr<const SurfaceCloud>>& bodies, NaturalPose natural_pose,
                 const ReadingSampleOptions& options, data::Purpose purpose = data::Purpose::training)
      : ReadingSampler(equally(bodies), std::move(natural_pose), options, purpose) {}

  std::size_t max_vertices() const override { return options_.points; }
  std::size_t max_pose_vertices() const override { return options_.points; }
  bool equal_counts() const override { return true; }

  void fill(std::uint64_t step, std::uint64_t index, Sample& s) const override {
    const auto random = [&](data::Part part) { return data::random_for(purpose_, options_.seed, step, index, part); };
    Random choice = random(data::Part::choice), shape = random(data::Part::identity_shape),
           angles = random(data::Part::pose), order = random(data::Part::identity_order),
           more = random(data::Part::augmentation), noise = random(data::Part::noise);
    const std::size_t n = options_.points;
    s.pose.resize(3 * n), s.identity.resize(3 * n), s.truth.resize(3 * n);
    thread_local Scratch scratch;
    const bool strange = options_.strangers > 0 && choice.uniform() < options_.strangers;
    if (strange)
      draw_stranger(choice, n, scratch);
    else
      draw_person(choice, shape, angles, order, more, n, scratch);
    const Matrix3 turn = turn_of(more);
    const double sigma = more.uniform() < 0.5 ? 0 : 0.012 * more.uniform();
    const bool blind = more.uniform() < 0.08;                 // no normals
    const float side = more.uniform() < 0.03 ? -1.0F : 1.0F;  // inside out
    for (std::size_t i = 0; i < n; ++i) {
      const Drawn& p = scratch.drawn[i];
      Vec3d at = turn * p.at.as<double>();
      if (sigma > 0) at += Vec3d{noise.normal(), noise.normal(), noise.normal()} * sigma;
      const Vec3f normal = blind ? Vec3f{} : (turn * p.normal.as<double>()).as<float>() * side;
      put(s.pose, i, at.as<float>()), put(s.identity, i, normal);
      put(s.truth, i, p.canonical * 0.5F);
    }
    const auto point = [&s](std::size_t i) {
      return Vec3f{s.pose[3 * i], s.pose[3 * i + 1], s.pose[3 * i + 2]}.as<double>();
    };
    const ReadingFrame frame = reading_frame(n, point);
    for (std::size_t i = 0; i < n; ++i) put(s.pose, i, frame(point(i)).as<float>());
    s.edges.clear(), s.triangles.clear();
    s.scale = 0.5;
  }

 private:
  /// x -> linear x + shift, in float: a part's stretch and motion.
  struct Affine {
    std::array<float, 9> linear{};
    Vec3f shift;
  };
  /// One body of a sample, with the limbs that are its.
  struct SkinnedCloud {
    const SurfaceCloud* cloud = nullptr;
    std::array<bool, limb_count> limbs{};
    std::array<Affine, smpl_joint_count> parts;
    std::vector<float> betas;
  };
  struct Skin {
    std::vector<SkinnedCloud> clouds;
  };
  struct Posed {
    Vec3f at, normal;
    float key = 0;  ///< points with the greatest ones are taken
    std::uint32_t point = 0, cloud = 0;
  };
  /// A point of a sample, upright and in metres.
  struct Drawn {
    Drawn(Vec3f a, Vec3f n, Vec3f c) : at(a), normal(n), canonical(c) {}
    Vec3f at, normal, canonical;
  };
  struct Scratch {
    std::vector<Posed> posed;
    std::vector<Posed> chosen;
    std::vector<Drawn> drawn;
    std::vector<Vec3f> points, normals;
  };
  /// What hangs on the body, as offsets along its normals, in metres; waves make them uneven.
  struct Dress {
    bool any = false;
    float puff = 0;                       ///< everywhere
    float trunk = 0, legs = 0, arms = 0;  ///< loose clothes, where above 0
    float skirt = 0;                      ///< how far the legs' clothes are spread apart, at the knees
    float hair = 0, hair_back = 0;
    float shoes = 0, heel = 0;
    bool no_hands = false, no_feet = false, no_head = false;
    std::array<Vec3f, 2> hole{};  ///< centres in canonical coordinates
    float hole_radius = 0;
    Vec3f wave;
    float phase = 0, wave_size = 0;
  };

  void draw_person(Random& choice, Random& shape, Random& angles, Random& order, Random& more, std::size_t n,
                   Scratch& scratch) const {
    const std::size_t first = pick_body(choice);
    const bool plain = choice.uniform() < options_.plain;
    std::array<std::size_t, limb_count> limbs;
    limbs.fill(first);
    if (options_.patched > 0 && choice.uniform() < options_.patched) patch(choice, limbs);
    const bool mirrored = options_.mirror && choice.uniform() < 0.5;
    thread_local Skin skin;
    make_skin(limbs, shape, angles, plain, skin);
    const Dress dress = plain ? Dress{} : dress_of(more);
    draw_points(skin, dress, order, n, scratch);
    scratch.drawn.clear();
    for (const Posed& p : scratch.chosen) {
      Drawn& d = scratch.drawn.emplace_back(p.at, p.normal, skin.clouds[p.cloud].cloud->points()[p.point].canonical);
      if (mirrored) d.at.x = -d.at.x, d.normal.x = -d.normal.x, d.canonical.x = -d.canonical.x;
    }
  }

  /// As high as a person, about.
  void draw_stranger(Random& choice, std::size_t n, Scratch& scratch) const {
    stranger_(choice, n, scratch.points, scratch.normals);
    const ReadingFrame frame = reading_frame(n, [&](std::size_t i) { return scratch.points[i].template as<double>(); });
    scratch.drawn.clear();
    for (std::size_t i = 0; i < n; ++i)
      scratch.drawn.emplace_back(frame(scratch.points[i].template as<double>()).template as<float>(),
                                 scratch.normals[i], stranger_place);
  }

  static void put(std::vector<float>& to, std::size_t i, Vec3f p) {
    to[3 * i] = p.x, to[3 * i + 1] = p.y, to[3 * i + 2] = p.z;
  }

  static std::vector<WeightedCloud> equally(const std::vector<std::shared_ptr<const SurfaceCloud>>& bodies) {
    std::vector<WeightedCloud> members;
    members.reserve(bodies.size());
    for (const auto& body : bodies) members.push_back({body, 1});
    return members;
  }
  std::size_t pick_body(Random& random) const {
    if (equal_) return random.below(static_cast<std::uint32_t>(bodies_.size()));
    const double target = random.uniform() * shares_.back();
    return static_cast<std::size_t>(std::upper_bound(shares_.begin(), shares_.end() - 1, target) - shares_.begin());
  }
  /// Another body for the skull, for the arms, for the legs, or all of them; the trunk stays.
  void patch(Random& random, std::array<std::size_t, limb_count>& limbs) const {
    using enum Limb;
    const auto of = [&limbs](Limb limb) -> std::size_t& { return limbs[static_cast<std::size_t>(limb)]; };
    of(skull) = pick_body(random);
    of(left_arm) = of(right_arm) = pick_body(random);
    of(left_leg) = of(right_leg) = pick_body(random);
    if (random.uniform() < 0.1) of(right_arm) = pick_body(random);
    if (random.uniform() < 0.1) of(right_leg) = pick_body(random);
  }

  /// A limb's skeleton is that of its body; where it hangs, the body says that has the part above.
  void make_skin(const std::array<std::size_t, limb_count>& limbs, Random& shape, Random& angles, bool plain,
                 Skin& skin) const {
    std::array<std::size_t, limb_count> number{};
    std::size_t count = 0;
    for (std::size_t l = 0; l < limb_count; ++l) {
      std::size_t same = 0;
      while (limbs[same] != limbs[l]) ++same;
      if (same == l) {
        if (skin.clouds.size() <= count) skin.clouds.emplace_back();
        skin.clouds[count].cloud = bodies_[limbs[l]].cloud.get();
        skin.clouds[count].limbs.fill(false);
        number[l] = count++;
      }
      number[l] = number[same];
      skin.clouds[number[l]].limbs[l] = true;
    }
    skin.clouds.resize(count);
    std::array<std::array<Vec3d, smpl_joint_count>, limb_count> rest;
    for (std::size_t c = 0; c < count; ++c) {
      SkinnedCloud& own = skin.clouds[c];
      own.betas = sample_shape(shape, own.cloud->body().shape_count());
      std::ranges::copy(own.cloud->body().joints(own.betas), rest[c].begin());
    }
    Proportions proportions = sample_proportions(shape);
    if (plain) proportions.fill(0);
    std::array<float, 3 * smpl_joint_count> pose = pose_of(angles);
    std::array<Vec3d, smpl_joint_count> grown;
    std::array<RigidMotion, smpl_joint_count> motion;
    const auto stretch = [&](std::size_t c, std::size_t j) {
      Matrix3 result = Matrix3::identity();
      for (std::size_t k = 0; k < body_proportion_count; ++k) {
        const Matrix3& g = skin.clouds[c].cloud->growth()[j][k];
        if (!(g == Matrix3{})) result += g * proportions[k];
      }
      return result;
    };
    for (std::size_t j = 0; j < smpl_joint_count; ++j) {
      const Matrix3 r = rotation_matrix({static_cast<double>(pose[3 * j]), static_cast<double>(pose[3 * j + 1]),
                                         static_cast<double>(pose[3 * j + 2])});
      if (j == 0) {
        grown[0] = rest[number[0]][0];
        motion[0] = {r, grown[0] - r * grown[0]};
      } else {
        const auto parent = static_cast<std::size_t>(smpl_parents[j]);
        const std::size_t above = number[static_cast<std::size_t>(limb_of(parent))];
        grown[j] = grown[parent] + stretch(above, parent) * (rest[above][j] - rest[above][parent]);
        motion[j] = motion[parent] * RigidMotion{r, grown[j] - r * grown[j]};
      }
      for (std::size_t c = 0; c < count; ++c) {
        // The stretch about the joint, then the motion.
        const Matrix3 own = stretch(c, j), linear = motion[j].rotation * own;
        const Vec3d shift = motion[j](grown[j] - own * rest[c][j]);
        Affine& a = skin.clouds[c].parts[j];
        for (std::size_t row = 0; row < 3; ++row) {
          const Vec3f values = linear.rows[row].as<float>();
          a.linear[3 * row] = values.x, a.linear[3 * row + 1] = values.y, a.linear[3 * row + 2] = values.z;
        }
        a.shift = shift.as<float>();
      }
    }
  }

  std::array<float, 3 * smpl_joint_count> pose_of(Random& random) const {
    if (random.uniform() < options_.natural) return natural_pose_(random);
    std::array<float, 3 * smpl_joint_count> pose =
        sample_pose(random, random.uniform() < 0.75 ? PoseDistribution::wide : PoseDistribution::paper);
    const float amount = static_cast<float>(std::min(1.0, 1.3 * random.uniform()));
    for (std::size_t i = 3; i < pose.size(); ++i) pose[i] *= amount;
    return pose;
  }

  Dress dress_of(Random& r) const {
    const auto uniform = [&r](double low, double high) { return static_cast<float>(r.uniform(low, high)); };
    Dress d;
    d.any = true;
    d.puff = uniform(0, 1) < 0.5F ? uniform(-0.005, 0.03) : 0;
    if (r.uniform() < options_.dressed) {
      if (r.uniform() < 0.8) d.trunk = uniform(0.005, 0.07);
      if (r.uniform() < 0.6) d.legs = uniform(0.005, 0.06);
      if (r.uniform() < 0.5) d.arms = uniform(0.005, 0.05);
      if (r.uniform() < 0.2) d.skirt = uniform(0.1, 1);
    }
    if (r.uniform() < 0.4) d.hair = uniform(0.01, 0.12), d.hair_back = uniform(0, 0.15);
    if (r.uniform() < 0.4) d.shoes = uniform(0.005, 0.03), d.heel = uniform(0, 0.06);
    d.no_hands = r.uniform() < 0.06;
    d.no_feet = r.uniform() < 0.03;
    d.no_head = r.uniform() < 0.02;
    if (r.uniform() < 0.15) {
      for (Vec3f& h : d.hole) h = {uniform(-0.8, 0.8), uniform(-0.9, 0.7), uniform(-0.15, 0.15)};
      d.hole_radius = uniform(0.05, 0.2);
    }
    d.wave = {uniform(-25, 25), uniform(-25, 25), uniform(-25, 25)};
    d.phase = uniform(0, 6.3);
    d.wave_size = uniform(0, 0.5);
    return d;
  }

  /// Most stand upright, some lean, some point anywhere.
  Matrix3 turn_of(Random& r) const {
    const Matrix3 yaw = rotation_matrix({0, r.uniform(-std::numbers::pi, std::numbers::pi), 0});
    if (r.uniform() >= options_.fallen) return rotation_matrix({0.12 * r.normal(), 0, 0.12 * r.normal()}) * yaw;
    Vec3d axis{r.normal(), r.normal(), r.normal()};
    return rotation_matrix(normalised(axis) * r.uniform(0, std::numbers::pi)) * yaw;
  }

  /// Poses candidates, more than are needed, and takes n of them by the area that each stands for now: the n greatest
  /// of log(u) / area (Efraimidis and Spirakis, 2006).
  void draw_points(const Skin& skin, const Dress& dress, Random& random, std::size_t n, Scratch& scratch) const {
    const std::size_t tries = std::min(5 * n / 2, SurfaceCloud::candidates);
    const auto clouds = static_cast<std::uint32_t>(skin.clouds.size());
    scratch.posed.clear();
    for (int round = 0; scratch.posed.size() < n; ++round)
      for (std::size_t i = 0; i < tries * clouds; ++i) {
        Posed p;
        if (clouds > 1) p.cloud = random.below(clouds);
        const SkinnedCloud& own = skin.clouds[p.cloud];
        const SurfaceCloud& cloud = *own.cloud;
        p.point = random.below(static_cast<std::uint32_t>(cloud.points().size()));
        if (!own.limbs[static_cast<std::size_t>(limb_of(cloud.points()[p.point].joint[0]))]) continue;
        const double u = 1 - random.uniform();
        float area = 0;
        if (!place(own, p.point, dress, p, area) && round < 20) continue;
        if (clouds > 1) area *= 1e5F * cloud.area_of_point();
        p.key = static_cast<float>(std::log(u)) / std::max(area, 1e-6F);
        scratch.posed.push_back(p);
      }
    const auto middle = scratch.posed.begin() + static_cast<std::ptrdiff_t>(n);
    if (middle != scratch.posed.end())
      std::nth_element(scratch.posed.begin(), middle, scratch.posed.end(),
                       [](const Posed& a, const Posed& b) { return a.key > b.key; });
    scratch.chosen.assign(scratch.posed.begin(), middle);
  }

  static Vec3f apply(const std::array<float, 9>& m, Vec3f v) {
    return {m[0] * v.x + m[1] * v.y + m[2] * v.z, m[3] * v.x + m[4] * v.y + m[5] * v.z,
            m[6] * v.x + m[7] * v.y + m[8] * v.z};
  }

  /// Whether the point is there at all.
  static bool place(const SkinnedCloud& skin, std::uint32_t k, const Dress& dress, Posed& out, float& area) {
    const SurfaceCloud& cloud = *skin.cloud;
    const SurfaceCloud::Point& p = cloud.points()[k];
    const auto weight_of = [&p](auto... joints) {
      float sum = 0;
      for (std::size_t i = 0; i < SurfaceCloud::most_joints; ++i)
        if (((p.joint[i] == joint_index(joints)) || ...)) sum += p.weight[i];
      return sum;
    };
    Vec3f at = p.rest;
    const std::span<const float> directions = cloud.directions(k);
    for (std::size_t s = 0; s < skin.betas.size(); ++s) {
      const float b = skin.betas[s];
      at += Vec3f{directions[3 * s], directions[3 * s + 1], directions[3 * s + 2]} * b;
    }
    float swollen = 1;
    if (dress.any && !clothe(p, weight_of, dress, at, swollen)) return false;
    std::array<float, 9> linear{};
    Vec3f shift;
    for (std::size_t i = 0; i < SurfaceCloud::most_joints; ++i) {
      const float w = p.weight[i];
      if (w == 0) break;
      const Affine& a = skin.parts[p.joint[i]];
      for (std::size_t e = 0; e < 9; ++e) linear[e] += w * a.linear[e];
      shift += a.shift * w;
    }
    out.at = apply(linear, at) + shift;
    const Vec3f normal = cross(apply(linear, p.along), apply(linear, p.across));
    area = length(normal) * p.area * swollen;
    out.normal = normalised(normal);
    return true;
  }

  /// Moves a resting point outwards to where its clothes, hair or shoes are; false: nothing is there.
  /// swollen: by how much the surface is larger there.
  static bool clothe(const SurfaceCloud::Point& p, const auto& weight_of, const Dress& d, Vec3f& at, float& swollen) {
    using enum SmplJoint;
    if (d.hole_radius > 0)
      for (const Vec3f h : d.hole)
        if (length(p.canonical - h) < d.hole_radius) return false;
    const float hands = weight_of(left_wrist, right_wrist, left_hand, right_hand),
                feet = weight_of(left_ankle, right_ankle, left_foot, right_foot), skull = weight_of(head);
    if (d.no_hands && hands > 0.5F) return false;
    if (d.no_feet && feet > 0.5F) return false;
    if (d.no_head && skull > 0.5F) return false;
    const Vec3f normal = normalised(cross(p.along, p.across));
    const float trunk = weight_of(pelvis, spine1, spine2, spine3, left_collar, right_collar),
                thighs = weight_of(left_hip, right_hip, left_knee, right_knee),
                arms = weight_of(left_shoulder, right_shoulder, left_elbow, right_elbow);
    const float wave = 1 + d.wave_size * std::sin(dot(d.wave, p.canonical) + d.phase);
    const float out = d.puff + (d.trunk * trunk + d.legs * thighs + d.arms * arms) * wave + d.shoes * feet;
    at += normal * out;
    if (d.skirt > 0 && thighs > 0) {
      // A skirt: round about both legs, wider the lower.
      const float depth = std::clamp(-(p.canonical.y + 0.05F) / 0.45F, 0.0F, 1.0F);
      const float wide = d.skirt * 0.12F * depth * thighs;
      const Vec3f away = normalised(Vec3f{p.canonical.x, 0, p.canonical.z});
      at += away * wide;
    }
    if (skull > 0.5F && d.hair > 0 && (normal.y > 0.1F || normal.z < -0.1F)) {
      const float amount = (skull - 0.5F) * 2;
      at += normal * (d.hair * amount * wave);
      swollen += 16 * d.hair * amount;  // a head's radius is about 0.12 m
      at.z -= d.hair_back * amount * std::max(0.0F, -normal.z);
    }
    if (feet > 0 && normal.y < -0.3F) at.y -= d.heel * feet;
    return true;
  }

  std::vector<WeightedCloud> bodies_;
  std::vector<double> shares_;  ///< ascending sums of the weights
  bool equal_ = true;           ///< all weights
  NaturalPose natural_pose_;
  Stranger stranger_;
  ReadingSampleOptions options_;
  data::Purpose purpose_;
};

}  // namespace npt::inline NPT_ABI
