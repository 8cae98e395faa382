/// How a body lies in a mesh, and what can be said of it: how reliable it is, what a user should know.
/// Shapes    fit: as BodyFit, of SMPL's 24 joints
/// Units     metres, radians; centre in the mesh's unit
#pragma once

#include <npt/base/error.hpp>
#include <npt/base/matrix3.hpp>
#include <npt/base/sort.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/kinematics.hpp>
#include <npt/body/skeleton.hpp>
#include <npt/config.hpp>
#include <npt/estimate/correspondence_fit.hpp>
#include <npt/estimate/finger_fit.hpp>
#include <npt/estimate/fit_surface.hpp>
#include <npt/estimate/limb_search.hpp>
#include <npt/estimate/surface_track.hpp>
#include <npt/estimate/warning_code.hpp>
#include <npt/mesh/mesh_view.hpp>
#include <npt/mesh/points.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace npt::inline NPT_ABI {

NPT_INLINE_CLASS(struct, BodyEstimate);
/// A mesh as a body: p -> (p - centre) metres lies where the fitted body does.
template <class>
struct BasicBodyEstimate {
  Vec3d centre;                               ///< of the surface, in the mesh's unit
  double metres = 1;                          ///< in a unit of the mesh, for a body of usual size
  CorrespondenceFit fit;                      ///< without angles where no body has the mesh's size
  std::array<HandBend, 2> hands;              ///< left and right, beyond the fit's angles
  std::shared_ptr<const FitSurface> surface;  ///< whose samples the next frame of a sequence moves
  std::shared_ptr<const SurfaceTrack> track;  ///< that it was followed by; none: read for itself
  std::vector<bool> figure{};                 ///< [T] the triangles that are the body's; empty: all
  std::size_t followed = 0;                   ///< how many frames ago a mesh of the sequence was read for itself
  bool told = false;                          ///< by a reader that tells people from other things
  /// Metres between what was read of a point in several turns about the vertical axis: the median distance from the
  /// reading in the middle, and of these the points' median.
  double disagreement = 0;

  /// How sure it is that the mesh is a person and was read right, from 0 to 1: as likeness(), but a reader that would
  /// have told another thing lets the body keep a greater distance, as around big heads, and what lies between hardly
  /// like a person and surely one counts as 0.6 to 0.85: such characters come out better by body estimation than by the
  /// network. Ten pairs of a robot with a sword, likeness 0.2 to 0.9, ended at 188e-4 where most had been left to the
  /// network at 670e-4, ten of a knight at 4e-4 instead of 115e-4. Not where the reading contradicts itself or turns
  /// disagree: things that pass for people are read in another way from each side. Unless the body lies so close that
  /// it must be one.
  double confidence() const {
    if (!told || fit.body.axis_angles.empty()) return likeness();
    constexpr double hardly = 0.2, surely = 0.85, least = 0.6;
    const double like = agreement() * likeness(0.0145, 0.0185);
    const bool consistent = fit.correspondence_residual < (disagreement < 0.03 ? 0.17 : 0.135);
    if (like < hardly || !consistent) return std::max(like, confidence_by_closeness());
    return like < surely ? least + (like - hardly) * ((surely - least) / (surely - hardly)) : like;
  }

  /// From 0 to `most_by_closeness`: a surface along which a body of usual shape lies within 1.1 cm, both ways, is a
  /// body's, however it was read. A knight who rolls, and one who crouches, were read in another way from each side and
  /// fitted to 1.1 cm: 8 and 14e-4 by body estimation, 1310 and 2055e-4 by the network. Of 265 man-made objects none comes so
  /// close with a shape that people have.
  double confidence_by_closeness() const {
    return most_by_closeness * fit.confidence() * falling(fit.relative_distance, 0.0115, 0.013) *
           falling(shape_oddity(), odd_shape, 800);
  }
  static constexpr double most_by_closeness = 0.8;

  /// Whether turns agree, from 0 to 1; 1 where both surfaces have the other within 3 cm nearly everywhere.
  /// Measured: disagreement is 0.01 to 0.03 of 122 people, bodies with random proportions and dressed ones, 0.01 to
  /// 0.06 of 81 of 84 moments of rigged characters, 0.033 to 0.18 of nine in ten made objects in which a body can lie.
  double agreement() const { return fit.confidence() > 0.96 ? 1 : falling(disagreement, 0.035, 0.065); }

  /// How much the mesh is like a body, from 0 to 1: the share of both surfaces that have the other within 3 cm, less
  /// where the reading contradicts itself, where the body keeps a distance (none up to `near`, all from `far` on), and
  /// where its shape is nobody's.
  /// Measured with the defaults: people 0.98, dressed ones 0.97, stylised ones 0.88 and more; animals, a cube and an
  /// egg below 0.45.
  double likeness(double near = 0.010, double far = 0.020) const {
    if (fit.body.axis_angles.empty()) return 0;
    // Where all limbs lie as near as the trunk, the fit has put right what the reading contradicts.
    const double more = doubtful(LimbPair::arms) || doubtful(LimbPair::legs) ? 0 : 0.06;
    return fit.confidence() * falling(fit.correspondence_residual, 0.08 + more, 0.2 + more) *
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
  Matrix3 joint_rotation(std::size_t j) const { return npt::joint_rotation(as_span(fit.body.axis_angles), j); }
  /// The turn about the vertical axis after which the body faces +z.
  Matrix3 facing_front() const {
    const Vec3d front = joint_rotation(0) * Vec3d{0, 0, 1};
    return rotation_matrix({0, -std::atan2(front.x, front.z), 0});
  }
  static constexpr double odd_shape = 450;  ///< shape_oddity() from which on a user is told
  /// What a user should know of the mesh, or nothing.
  std::vector<WarningCode> warnings() const {
    using enum WarningCode;
    std::vector<WarningCode> codes;
    const Vec3d axis = up();
    if (axis.y < -0.7)
      codes.push_back(upside_down);
    else if (axis.y < 0.5)
      codes.push_back(std::abs(axis.z) > 0.85 ? lying_or_z_up : lying);
    if (doubtful(LimbPair::arms)) codes.push_back(arms_uncertain);
    if (doubtful(LimbPair::legs)) codes.push_back(legs_uncertain);
    if (shape_oddity() > odd_shape) codes.push_back(unusual_proportions);
    if (fit.facing < 0) codes.push_back(faces_inward);
    if (!figure.empty()) codes.push_back(part_of_mesh);
    return codes;
  }
  /// [V] A mesh's vertices in the body's coordinates.
  std::vector<Vec3d> points_of(const MeshView& mesh) const {
    std::vector<Vec3d> points(mesh.vertex_count());
    for (std::size_t v = 0; v < points.size(); ++v) points[v] = (point_at(mesh.xyz, v) - centre) * metres;
    return points;
  }
};

/// Errors    npt::Error where no body lies in a mesh
NPT_INLINE void expect_body(const BodyEstimate& reading, std::string_view name) {
  if (reading.fit.body.axis_angles.empty())
    throw Error({.file = std::string(name),
                 .found = "a mesh in which no body can lie",
                 .expected = "a person, for body estimation",
                 .code = ErrorCode::not_recognised});
}

}  // namespace npt::inline NPT_ABI
