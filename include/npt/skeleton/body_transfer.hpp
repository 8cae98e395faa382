/// Pose transfer between characters, by bodies: a network reads where each point of a mesh belongs on a resting body,
/// the body with proportions is fitted to points and places, the identity is bound to it, and linear blend skinning
/// gives it the pose mesh's joint angles. No mesh needs to rest, to be one piece, or to be of any unit.
///   const npt::BodyTransfer transfer(npt::Reader::open("reader.safetensors"));
///   npt::BoundCharacter character = transfer.bind(identity);        once an identity
///   npt::BodyReading reading = transfer.read(pose);                 once a pose
///   transfer.pose(character, reading, result);                      [V, 3]
/// The identity's root joint stays in its place.
/// Shapes    meshes: [V, 3] floats with triangles; result: as the identity
/// Threads   all members are const and may be called by any number of threads at a time
/// Numerics  the same bits for any number of threads
/// Errors    npt::Error for a mesh without triangles that have an area, and for coordinates that are not finite
/// Source    skinning as Wang et al., CVPR 2020, supplement C.1; reading and fit: docs/transfer.md
#pragma once

#include <npt/body/kinematics.hpp>
#include <npt/body/proportions.hpp>
#include <npt/body/sparse_matrix.hpp>
#include <npt/config.hpp>
#include <npt/core/error.hpp>
#include <npt/core/sort.hpp>
#include <npt/core/vec3.hpp>
#include <npt/fit/body_fit.hpp>
#include <npt/fit/finger_fit.hpp>
#include <npt/fit/fit_surface.hpp>
#include <npt/fit/limb_search.hpp>
#include <npt/fit/reading_fit.hpp>
#include <npt/mannequin/finger_joints.hpp>
#include <npt/mannequin/mannequin.hpp>
#include <npt/mesh/mesh_view.hpp>
#include <npt/reading/reader.hpp>
#include <npt/scene/affine.hpp>
#include <npt/scene/skinned_skeleton.hpp>
#include <npt/skeleton/body_weights.hpp>
#include <npt/skeleton/joint_names.hpp>
#include <npt/skeleton/skeleton_pose.hpp>
#include <npt/transfer/body_method.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <numbers>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// A mesh as a body: p -> (p - centre) metres lies where the fitted body does.
struct BodyReading {
  Vec3d centre;                               ///< of the surface, in the mesh's unit
  double metres = 1;                          ///< in a unit of the mesh, for a body of usual size
  ReadingFit fit;                             ///< without angles where no body has the mesh's size
  std::array<HandBend, 2> hands;              ///< left and right, beyond the fit's angles
  std::shared_ptr<const FitSurface> surface;  ///< whose samples the next frame of a sequence moves
  bool told = false;                          ///< by a reader that tells people from other things
  /// Metres between what was read of a point in several turns about the vertical axis: the median distance from the
  /// reading in the middle, and of these the points' median.
  double disagreement = 0;

  /// How sure it is that the mesh is a person and was read right, from 0 to 1: as likeness(), but a reader that would
  /// have told another thing lets the body keep a greater distance, as around big heads, and what lies between hardly
  /// like a person and surely one counts as 0.6 to 0.85: such characters come out better through bodies than by the
  /// network. Ten pairs of a robot with a gun, likeness 0.2 to 0.9, ended at 188e-4 where most had been left to the
  /// network at 670e-4, ten of a knight at 4e-4 instead of 115e-4. Not where the reading contradicts itself or turns
  /// disagree: things that pass for people are read in another way from each side.
  double trust() const {
    if (!told) return likeness();
    constexpr double hardly = 0.2, surely = 0.85, least = 0.6;
    const double like = agreement() * likeness(0.0145, 0.0185);
    const bool consistent = fit.reading_residual < (disagreement < 0.03 ? 0.17 : 0.135);
    if (like < hardly || !consistent) return like;
    return like < surely ? least + (like - hardly) * ((surely - least) / (surely - hardly)) : like;
  }

  /// Whether turns agree, from 0 to 1; 1 where both surfaces have the other within 3 cm nearly everywhere.
  /// Measured: disagreement is 0.01 to 0.03 of 122 people, bodies with random proportions and dressed ones, 0.01 to
  /// 0.06 of 81 of 84 moments of rigged characters, 0.033 to 0.18 of nine in ten made objects in which a body can lie.
  double agreement() const { return fit.trust() > 0.96 ? 1 : falling(disagreement, 0.035, 0.065); }

  /// How much the mesh is like a body, from 0 to 1: the share of both surfaces that have the other within 3 cm, less
  /// where the reading contradicts itself, where the body keeps a distance (none up to `near`, all from `far` on), and
  /// where its shape is nobody's.
  /// Measured with the defaults: people 0.98, dressed ones 0.97, stylised ones 0.88 and more; animals, a cube and an
  /// egg below 0.45.
  double likeness(double near = 0.010, double far = 0.020) const {
    if (fit.body.axis_angles.empty()) return 0;
    // Where all limbs lie as near as the trunk, the fit has put right what the reading contradicts.
    const double more = doubtful(LimbPair::arms) || doubtful(LimbPair::legs) ? 0 : 0.06;
    return fit.trust() * falling(fit.reading_residual, 0.08 + more, 0.2 + more) *
           falling(fit.relative_distance, near, far) * falling(shape_oddity(), 800, 1200);
  }
  /// 1 up to `from`, 0 from `to` on.
  static double falling(double x, double from, double to) { return std::clamp((to - x) / (to - from), 0.0, 1.0); }
  /// The shape's sum of squared deviations: people up to 60, bodies with random proportions 270, a cartoon knight 290,
  /// a frog with a head of a third of his height 850; a tree 2800, a lamp 1900, a table, to which a body can be
  /// flattened, 700 to 1300.
  double shape_oddity() const {
    double sum = 0;
    for (const float beta : fit.body.betas) sum += static_cast<double>(beta) * static_cast<double>(beta);
    return sum;
  }
  /// Whether an arm or a leg is that much farther from the surface than the other parts that it may be in the wrong
  /// place. Of 300 mannequins read right 18 are in doubt; of 60 people of another model's shapes 4, one of them
  /// rightly.
  bool doubtful(LimbPair pair) const {
    using enum SmplJoint;
    std::array<double, smpl_joint_count> all = fit.part_distances;
    const auto worst = [&all](auto... joints) { return std::max({all[joint_index(joints)]...}); };
    const double off = pair == LimbPair::legs
                           ? worst(left_hip, right_hip, left_knee, right_knee, left_ankle, right_ankle)
                           : worst(left_shoulder, right_shoulder, left_elbow, right_elbow, left_wrist, right_wrist);
    return off > std::max(0.003, 1.7 * median(std::span<double>(all)));
  }
  /// The body's own vertical axis, from pelvis to chest, in the mesh's coordinates; unit.
  Vec3d up() const { return fit.body.axis_angles.empty() ? Vec3d{0, 1, 0} : joint_rotation(0) * Vec3d{0, 1, 0}; }
  /// Of a mesh in which a body lies: the rotation of a joint in its parent's frame.
  Matrix3 joint_rotation(std::size_t j) const { return npt::joint_rotation(fit.body.axis_angles, j); }
  /// The turn about the vertical axis after which the body faces +z.
  Matrix3 facing_front() const {
    const Vec3d front = joint_rotation(0) * Vec3d{0, 0, 1};
    return rotation_matrix({0, -std::atan2(front.x, front.z), 0});
  }
  static constexpr double odd_shape = 450;  ///< shape_oddity() from which on a user is told
  /// What a user should know of the mesh, or nothing.
  std::string notes() const {
    std::string text;
    const auto add = [&text](const std::string& note) { text += (text.empty() ? "" : "; ") + note; };
    const Vec3d axis = up();
    if (axis.y < -0.7)
      add("reads as upside down");
    else if (axis.y < 0.5)
      add(std::abs(axis.z) > 0.85 ? "reads as lying, or its vertical axis is z" : "reads as lying or bent over");
    const bool arms = doubtful(LimbPair::arms), legs = doubtful(LimbPair::legs);
    if (arms || legs) {
      const std::string limbs = arms && legs ? "arms and legs" : arms ? "arms" : "legs";
      add("its " + limbs + " may be misread");
    }
    if (shape_oddity() > odd_shape) add("its proportions are no person's");
    if (fit.facing < 0) add("its faces are turned inwards");
    return text;
  }
};

/// An identity bound to the body that was fitted to it.
struct BoundCharacter {
  BodyReading reading;
  BodyFit body;                   ///< the reading's, with finger joints: 40
  std::vector<Vec3d> joints;      ///< [40] where they are, in the body's coordinates
  std::array<HandBend, 2> hands;  ///< as measured on the mesh itself
  std::array<bool, 2> fingers{};  ///< whether the hands have any
  std::vector<Vec3d> points;      ///< [V] in the body's coordinates
  SparseMatrix weights;           ///< [V, 40]

  /// [40, 3] the pose's joint angles [24, 3] with its hands, where this character has fingers to close.
  std::vector<float> angles(std::span<const float> axis_angles, const BodyReading& pose) const {
    return with_fingers(axis_angles, {fingers[0] ? pose.hands[0] : hands[0], fingers[1] ? pose.hands[1] : hands[1]});
  }

  /// [40] How the joints move to joint angles [40, 3], in the body's coordinates. `fingered`: the body with finger
  /// joints
  std::vector<RigidMotion> motions(const BodyModel& fingered, std::span<const float> axis_angles) const {
    std::vector<RigidMotion> result = skeleton_motions(fingered, body, axis_angles);
    for (std::size_t j = smpl_joint_count; j < result.size(); ++j) {
      const auto parent = static_cast<std::size_t>(fingered.tables().parents[j]);
      result[j].shift = result[parent](joints[j]) - result[j].rotation * joints[j];
    }
    return result;
  }

  /// Where the joints' motions [J] bring a vertex, in the body's coordinates.
  Vec3d moved(std::size_t v, std::span<const RigidMotion> motions) const {
    Vec3d sum;
    for (std::size_t i = weights.start[v]; i < weights.start[v + 1]; ++i)
      sum += motions[weights.column[i]](points[v]) * static_cast<double>(weights.value[i]);
    return sum;
  }
};

struct BodyTransferOptions {
  std::size_t read_points = 1500;  ///< of a surface that the network reads
  int turns = 8;                   ///< in which it reads them; half of them where one of these reads well
  /// Seven candidates instead of the fit's own three: of 110 natural poses 4 instead of 6 end beyond 3 cm, for a tenth
  /// of the time.
  ReadingFitOptions fit{.candidates = 7};
};

template <class Exec = DefaultExecutor>
class BasicBodyTransfer {
 public:
  explicit BasicBodyTransfer(BasicReader<Exec> reader, BodyTransferOptions options = {})
      : reader_(std::move(reader)),
        options_(std::move(options)),
        fitter_(std::make_unique<ReadingFitter>(
            std::make_shared<const BodyModel>(with_proportions(mannequin(), human_proportion_deviations)),
            options_.fit)),
        fingers_(std::make_shared<const BodyModel>(with_finger_joints(fitter_->model()))),
        limbs_(fitter_->shared_model()) {}

  /// SMPL's 24 joints: what is fitted.
  const BodyModel& body() const noexcept { return fitter_->model(); }
  /// With finger joints, 40: what characters are bound to.
  const BodyModel& fingered_body() const noexcept { return fingers_.model(); }
  const ReadingFitter& fitter() const noexcept { return *fitter_; }
  const BasicReader<Exec>& reader() const noexcept { return reader_; }

  /// How a body lies in a mesh.
  BodyReading read(const MeshView& mesh) const {
    BodyReading reading;
    reading.told = reader_.tells_people();
    reading.surface = surface_of(mesh, reading);
    if (mesh.xyz.size() < 3 * fewest_vertices) return reading;
    const FitSurface& surface = *reading.surface;
    const auto samples = surface.samples().first(std::min(options_.read_points, surface.samples().size()));
    std::vector<Reading> readings = read_turns(samples, Matrix3::identity());
    if (least_residual(readings) > hopeless_residual) {
      const auto [upright, residual] = best_turn(samples);
      if (residual > hopeless_residual) return reading;  // nothing like a person
      readings = read_turns(samples, upright);
    }
    fit(surface, readings, reading);
    search_limbs(surface, readings, reading);
    if (likely(reading) && in_doubt(reading)) read_again(surface, samples, reading);
    if (reading.likeness() < sure_fit) read_turned(surface, samples, reading);
    if (reading.trust() > 0) reading.hands = fingers_(surface, reading.fit);
    return reading;
  }

  /// The next frame of a sequence, from the last one's reading.
  BodyReading follow(const MeshView& mesh, const BodyReading& last) const {
    BodyReading reading;
    reading.told = last.told;
    reading.disagreement = last.disagreement;
    reading.metres = last.metres;
    reading.centre = last.centre;
    if (last.fit.body.axis_angles.empty()) return read(mesh);
    reading.surface = std::make_shared<const FitSurface>(
        last.surface->moved(std::span<const Vec3d>(points_at(mesh, reading)), mesh.triangles));
    reading.fit = fitter_->refit(*reading.surface, last.fit);
    // A jump, or a fit that lost its way: read anew.
    if (reading.likeness() < last.likeness() - 0.03) return read(mesh);
    reading.hands = fingers_(*reading.surface, reading.fit, last.hands);
    return reading;
  }

  /// Of a mesh in which a body lies.
  ReadJoints joints(const BodyReading& reading) const {
    expect_body(reading, "mesh");
    const BodyFit& fit = reading.fit.body;
    const std::vector<Vec3d> rest = body().joints(fit.betas);
    double legs = 0;  // joints 1, 4, 7 are the left hip, knee and ankle, 2, 5, 8 the right ones
    for (const std::size_t hip : {std::size_t{1}, std::size_t{2}})
      legs += length(rest[hip + 3] - rest[hip]) + length(rest[hip + 6] - rest[hip + 3]);
    return {fit.axis_angles, (rest[0] + fit.translation) / reading.metres + reading.centre,
            0.5 * legs / reading.metres};
  }

  BoundCharacter bind(const MeshView& identity) const { return bind(identity, read(identity)); }
  BoundCharacter bind(const MeshView& identity, BodyReading reading) const {
    BoundCharacter character;
    character.reading = std::move(reading);
    const BodyReading& r = character.reading;
    expect_body(r, identity.name);
    character.body = r.fit.body;
    character.body.axis_angles = with_fingers(r.fit.body.axis_angles, r.hands);
    character.points = points_at(identity, r);
    const auto closed = [&r](std::size_t side) { return std::ranges::max(r.hands[side].middle) > least_closed; };
    std::array<skeleton::internal::HandMeasure, 2> measured;
    character.weights = body_weights(fingered_body(), character.body, character.points, identity.triangles,
                                     {.facing = r.fit.facing, .closed = {closed(0), closed(1)}}, &measured);
    const std::vector<Vec3d> rest = fingered_body().joints(r.fit.body.betas);
    const auto motions = fingered_body().bone_motions(r.fit.body.betas, character.body.axis_angles);
    for (std::size_t j = 0; j < rest.size(); ++j)
      character.joints.push_back(motions[j](rest[j]) + r.fit.body.translation);
    character.hands = measured_hands(r, measured, character.joints);
    character.fingers = {measured[0].fingers, measured[1].fingers};
    character.body.axis_angles = with_fingers(r.fit.body.axis_angles, character.hands);
    return character;
  }

  /// An identity's skeleton and skin weights, in its own unit, place and pose. Joints have their usual humanoid names.
  SkinnedSkeleton skeleton(const BoundCharacter& identity, JointNames names = JointNames::vrm) const {
    SkinnedSkeleton skeleton;
    for (std::size_t j = 0; j < identity.joints.size(); ++j) {
      const int parent = fingered_body().tables().parents[j];
      skeleton.names.emplace_back(joint_name(j, names));
      skeleton.parents.push_back(parent < 0 ? SkinnedSkeleton::no_parent : static_cast<std::size_t>(parent));
      skeleton.joints.push_back(identity.joints[j] / identity.reading.metres + identity.reading.centre);
    }
    const SparseMatrix& weights = identity.weights;
    skeleton.start.assign(weights.start.begin(), weights.start.end());
    for (std::size_t i = 0; i < weights.value.size(); ++i)
      skeleton.influences.push_back({static_cast<std::uint16_t>(weights.column[i]), weights.value[i]});
    return skeleton;
  }

  /// [J] How the identity's joints move to the pose's angles, in its own unit and place.
  std::vector<Affine> motions(const BoundCharacter& identity, const BodyReading& pose) const {
    expect_body(pose, "pose");
    return motions(identity, identity.angles(pose.fit.body.axis_angles, pose));
  }
  /// [J] How the identity's joints move to joint angles [40, 3], in its own unit and place.
  std::vector<Affine> motions(const BoundCharacter& identity, std::span<const float> axis_angles) const {
    std::vector<Affine> result;
    for (const RigidMotion& m : identity.motions(fingered_body(), axis_angles)) {
      const Vec3d centre = identity.reading.centre;
      result.push_back({m.rotation, m.shift / identity.reading.metres + centre - m.rotation * centre});
    }
    return result;
  }

  /// The identity's vertices with the pose's joint angles, in its own unit and place.
  void pose(const BoundCharacter& identity, const BodyReading& pose, std::span<float> result) const {
    expect_body(pose, "pose");
    this->pose(identity, identity.angles(pose.fit.body.axis_angles, pose), result);
  }
  /// The identity's vertices with joint angles [40, 3], in its own unit and place.
  void pose(const BoundCharacter& identity, std::span<const float> axis_angles, std::span<float> result) const {
    if (result.size() != 3 * identity.points.size())
      throw Error({.file = "result",
                   .found = std::to_string(result.size()) + " numbers",
                   .expected = "three for each of " + std::to_string(identity.points.size()) + " vertices"});
    const std::vector<RigidMotion> motions = identity.motions(fingered_body(), axis_angles);
    for (std::size_t v = 0; v < identity.points.size(); ++v) {
      const Vec3f p = (identity.moved(v, motions) / identity.reading.metres + identity.reading.centre).as<float>();
      result[3 * v] = p.x, result[3 * v + 1] = p.y, result[3 * v + 2] = p.z;
    }
  }

  /// Errors    npt::Error where no body lies in a mesh
  static void expect_body(const BodyReading& reading, std::string_view name) {
    if (reading.fit.body.axis_angles.empty())
      throw Error({.file = std::string(name),
                   .found = "a mesh in which no body can lie",
                   .expected = "a person, for the way through bodies"});
  }

 private:
  /// Radians of the middle joints beyond which fingers may touch the palm.
  static constexpr double least_closed = 0.8;

  /// A fit with a likeness from here on needs no second look from other sides: of people standing upright most end at
  /// 0.98.
  static constexpr double sure_fit = 0.92;

  /// How far the hands are closed after the fingers of closed ones were measured; their joints' places, too.
  static std::array<HandBend, 2> measured_hands(const BodyReading& reading,
                                                const std::array<skeleton::internal::HandMeasure, 2>& measured,
                                                std::span<Vec3d> joints) {
    // Radians that no finger bends: then it was measured wrongly.
    constexpr double least = -0.4, most = 2.1;
    std::array<HandBend, 2> hands = reading.hands;
    for (std::size_t side = 0; side < 2; ++side)
      for (std::size_t f = 0; f < finger_count; ++f) {
        const skeleton::internal::FingerMeasure& finger = measured[side].closed[f];
        for (std::size_t k = 0; k < 2; ++k)
          if (finger.joints[k]) joints[middle_finger_joint(side, f) + k] = *finger.joints[k];
        const double middle = hands[side].middle[f] + finger.turns[0];
        const double end = hands[side].middle[f] * 2 / 3 + finger.turns[1] - finger.turns[0];
        if (std::min(middle, end) < least || std::max(middle, end) > most) continue;
        hands[side].middle[f] = middle;
        hands[side].end[f] = end - middle * 2 / 3;
      }
    return hands;
  }

  /// A mesh of fewer vertices has no limbs that bend: no person, but a tetrahedron reads like one from some sides, and
  /// took 3 s.
  static constexpr std::size_t fewest_vertices = 32;
  /// What is hardly like a person isn't worth a second look.
  static bool likely(const BodyReading& reading) {
    return reading.fit.trust() > 0.7 && reading.fit.reading_residual < 0.15;
  }
  static bool in_doubt(const BodyReading& reading) {
    return reading.likeness() < sure_fit || reading.doubtful(LimbPair::legs) || reading.doubtful(LimbPair::arms);
  }

  /// Half of the turns; the other half, between them, only where not even the best of these explains its points well.
  std::vector<Reading> read_turns(std::span<const FitSurface::Sample> samples, const Matrix3& upright) const {
    const int half = (options_.turns + 1) / 2;
    std::vector<Reading> readings = reader_.read(samples, {.turns = half, .upright = upright});
    if (least_residual(readings) < good_residual) return readings;
    const Matrix3 between = rotation_matrix({0, std::numbers::pi / half, 0});
    for (Reading& r : reader_.read(samples, {.turns = half, .upright = between * upright}))
      readings.push_back(std::move(r));
    return readings;
  }

  /// A second look in the directions between the first ones, the likeliest readings fitted each for itself; kept where
  /// it is nearer.
  void read_again(const FitSurface& surface, std::span<const FitSurface::Sample> samples, BodyReading& reading) const {
    constexpr std::size_t looks = 3;
    const Matrix3 between = rotation_matrix({0, std::numbers::pi / options_.turns, 0});
    const std::vector<Reading> readings = reader_.read(samples, {.turns = options_.turns, .upright = between});
    std::vector<std::pair<double, std::size_t>> ranked;
    ranked.reserve(readings.size());
    for (const Reading& r : readings) ranked.emplace_back(motion_of(r).residual, ranked.size());
    std::ranges::sort(ranked);
    for (std::size_t i = 0; i < std::min(looks, ranked.size()); ++i) {
      const Reading& r = readings[ranked[i].second];
      BodyReading other = reading;
      fit(surface, std::span(&r, 1), other);
      if (other.fit.relative_distance < 1.3 * reading.fit.relative_distance)
        search_limbs(surface, std::span(&r, 1), other);
      if (other.likeness() > 0.5 * reading.likeness() && other.fit.relative_distance < reading.fit.relative_distance)
        reading = std::move(other);
      if (!in_doubt(reading)) return;
    }
  }

  /// Other poses of arms or legs that are in doubt.
  void search_limbs(const FitSurface& surface, std::span<const Reading> readings, BodyReading& reading) const {
    if (reading.fit.trust() < 0.7) return;
    std::vector<LimbSearch::Angles> read;
    for (int round = 0; round < 2; ++round) {
      const double before = reading.fit.relative_distance;
      for (const LimbPair pair : {LimbPair::legs, LimbPair::arms}) {
        if (!reading.doubtful(pair)) continue;
        if (read.empty()) read = read_angles(readings, reading);
        const std::vector<BodyFit> starts = limbs_(surface, reading.fit.body, pair, reading.fit.facing, read, 8);
        reading.fit = fitter_->nearest(surface, reading.fit, starts);
      }
      if (reading.fit.relative_distance > 0.97 * before) return;
    }
  }

  /// Of each reading the angles of the motion, limbs hung on the fitted trunk.
  std::vector<LimbSearch::Angles> read_angles(std::span<const Reading> readings, const BodyReading& reading) const {
    std::vector<LimbSearch::Angles> all;
    const std::vector<RigidMotion> fitted = body().bone_motions(reading.fit.body.betas, reading.fit.body.axis_angles);
    for (const Reading& r : readings) {
      const PartMotion motion = motion_of(r);
      LimbSearch::Angles& angles = all.emplace_back(motion.axis_angles.begin(), motion.axis_angles.end());
      for (const std::size_t j : {1U, 2U, 13U, 14U}) {
        const auto parent = static_cast<std::size_t>(smpl_parents[j]);
        set_joint_rotation(angles, j, fitted[parent].rotation.transposed() * motion.parts[j].rotation);
      }
    }
    return all;
  }

  /// Reads meshes that lie, stand on their hands, or have another vertical axis: turned so that each axis points up,
  /// few points in four directions; the best by the motion's residual is read and fitted, and kept where it is better.
  void read_turned(const FitSurface& surface, std::span<const FitSurface::Sample> samples, BodyReading& reading) const {
    const auto [best, least] = best_turn(samples);
    if (reading.likeness() > 0 && least > 1.1 * reading.fit.reading_residual) return;
    BodyReading other = reading;
    const std::vector<Reading> turned = read_turns(samples, best);
    fit(surface, turned, other);
    search_limbs(surface, turned, other);
    if (other.likeness() > reading.likeness()) reading = std::move(other);
  }

  /// Residual of the best of several readings, from few points, beyond which a mesh isn't worth a fit: people have 0.02
  /// to 0.12 and some 0.17 before limbs are swapped, a tetrahedron or a cube 0.2 and more.
  static constexpr double hopeless_residual = 0.19;
  /// The same, below which half of the turns are enough.
  static constexpr double good_residual = 0.05;

  double least_residual(std::span<const Reading> readings) const {
    double least = std::numeric_limits<double>::infinity();
    for (const Reading& r : readings) least = std::min(least, motion_of(r).residual);
    return least;
  }
  /// From few of its points.
  PartMotion motion_of(const Reading& r) const {
    return part_motion(fitter_->read_template(), std::span(r).first(std::min<std::size_t>(r.size(), 400)));
  }

  struct Turn {
    Matrix3 upright = Matrix3::identity();
    double residual = std::numeric_limits<double>::infinity();
  };

  /// Of the turns that make another axis point up the one whose readings, of few points, fit best.
  Turn best_turn(std::span<const FitSurface::Sample> samples) const {
    const double h = std::numbers::pi / 2;
    const std::array<Vec3d, 5> turns{{{2 * h, 0, 0}, {h, 0, 0}, {-h, 0, 0}, {0, 0, h}, {0, 0, -h}}};
    const auto few = samples.first(std::min<std::size_t>(samples.size(), 500));
    Turn best;
    for (const Vec3d turn : turns) {
      const Matrix3 upright = rotation_matrix(turn);
      if (const double residual = least_residual(reader_.read(few, {.turns = 4, .upright = upright}));
          residual < best.residual)
        best = {upright, residual};
    }
    return best;
  }

  static Vec3d at(const MeshView& mesh, std::size_t v) {
    return Vec3f{mesh.xyz[3 * v], mesh.xyz[3 * v + 1], mesh.xyz[3 * v + 2]}.as<double>();
  }

  /// Fits the body; a mesh of quite another size than any body's keeps none.
  void fit(const FitSurface& surface, std::span<const Reading> readings, BodyReading& reading) const {
    if (readings.size() > 1) reading.disagreement = disagreement_of(readings);
    try {
      reading.fit = fitter_->fit(surface, readings);
    } catch (const Error&) {
      reading.fit = {};
    }
  }

  /// Of readings in several turns, as read_turns() gives them: each half of the turns behind its own median.
  double disagreement_of(std::span<const Reading> readings) const {
    const auto half = static_cast<std::size_t>((options_.turns + 1) / 2);
    if (half < 2 || readings.size() <= half) return 0;
    std::vector<double> of_points, distances;
    for (std::size_t i = 0; i < readings.front().size(); ++i) {
      double least = std::numeric_limits<double>::infinity();
      for (std::size_t a = 0; a < readings.size(); ++a) {
        if (a % (half + 1) == 0) continue;
        distances.clear();
        for (std::size_t b = 0; b < readings.size(); ++b)
          if (b % (half + 1) != 0) distances.push_back(length(readings[a][i].place - readings[b][i].place));
        least = std::min(least, median(std::span(distances)));
      }
      of_points.push_back(least);
    }
    return median(std::span(of_points));
  }

  static std::vector<Vec3d> points_at(const MeshView& mesh, const BodyReading& reading) {
    std::vector<Vec3d> points(mesh.vertex_count());
    for (std::size_t v = 0; v < points.size(); ++v) points[v] = (at(mesh, v) - reading.centre) * reading.metres;
    return points;
  }

  /// The surface at about a body's size, about its own centre.
  std::shared_ptr<const FitSurface> surface_of(const MeshView& mesh, BodyReading& reading) const {
    double area = 0;
    Vec3d centre;
    for (const Triangle& t : mesh.triangles) {
      const Vec3d a = at(mesh, t[0]), b = at(mesh, t[1]), c = at(mesh, t[2]);
      const double own = 0.5 * length(cross(b - a, c - a));
      area += own;
      centre += (a + b + c) * (own / 3);
    }
    if (!(area > 0) || !std::isfinite(area))
      throw Error({.file = std::string(mesh.name),
                   .found = std::to_string(mesh.triangles.size()) + " triangles without an area",
                   .expected = "a surface"});
    reading.centre = centre / area;
    reading.metres = std::sqrt(fitter_->area() / area);
    const std::vector<Vec3d> points = points_at(mesh, reading);
    return std::make_shared<const FitSurface>(std::span<const Vec3d>(points), mesh.triangles, FitSurface::default_count,
                                              std::string(mesh.name));
  }

  BasicReader<Exec> reader_;
  BodyTransferOptions options_;
  std::unique_ptr<const ReadingFitter> fitter_;
  FingerFitter fingers_;
  LimbSearch limbs_;
};

using BodyTransfer = BasicBodyTransfer<>;

}  // namespace npt::inline NPT_ABI
