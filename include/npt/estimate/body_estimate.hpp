/// How a body lies in a mesh, and what can be said of it: how reliable it is, what a user should know.
/// Shapes    fit: as BodyFit, of the J joints of a kind's plan
/// Units     metres, radians; centre in the mesh's unit
#pragma once

#include <npt/base/error.hpp>
#include <npt/base/matrix3.hpp>
#include <npt/base/sort.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_plan.hpp>
#include <npt/body/hands.hpp>
#include <npt/body/kinematics.hpp>
#include <npt/config.hpp>
#include <npt/estimate/canonical_frame.hpp>
#include <npt/estimate/confidence.hpp>
#include <npt/estimate/correspondence_fit.hpp>
#include <npt/estimate/residuals.hpp>
#include <npt/estimate/surface_track.hpp>
#include <npt/estimate/warning_code.hpp>
#include <npt/mesh/mesh_view.hpp>
#include <npt/mesh/points.hpp>
#include <npt/mesh/sampled_surface.hpp>

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
  Vec3d centre;                                   ///< of the surface, in the mesh's unit
  double metres = 1;                              ///< in a unit of the mesh, for a body of usual size
  CorrespondenceFit fit;                          ///< without angles where no body has the mesh's size
  std::array<HandBend, 2> hands;                  ///< left and right, beyond the fit's angles
  std::shared_ptr<const SampledSurface> surface;  ///< whose samples the next frame of a sequence moves
  std::shared_ptr<const SurfaceTrack> track;      ///< that it was followed by; none: read for itself
  std::vector<bool> figure{};                     ///< [T] the triangles that are the body's; empty: all
  std::size_t followed = 0;                       ///< how many frames ago a mesh of the sequence was read for itself
  EstimateResiduals residuals;                    ///< what speaks against it
  double confidence = 0;                          ///< ConfidenceModel of the residuals
  std::vector<double> joint_confidence;           ///< [J] the same of each joint alone

  /// Whether a limb of a pair is so much farther from the surface than the other parts that it may be in the wrong
  /// place: of 300 mannequins estimated right 18, of 60 people of another model's shapes 4.
  bool doubtful(const LimbPair& pair) const {
    std::vector<double> all = fit.part_distances;
    double off = 0;
    for (const std::size_t j : joints_of(pair)) off = std::max(off, all[j]);
    return off > std::max(0.003, 1.7 * median(std::span<double>(all)));
  }
  /// Of the joints of both limbs.
  double least_joint_confidence(const LimbPair& pair) const {
    double least = 1;
    for (const std::size_t j : joints_of(pair))
      least = std::min(least, joint_confidence.empty() ? 0 : joint_confidence[j]);
    return least;
  }
  /// From where a limb begins to where its end does.
  static std::vector<std::size_t> joints_of(const LimbPair& pair) {
    std::vector<std::size_t> all;
    for (const std::vector<std::size_t>& joints : pair.joints)
      for (std::size_t k = pair.first; k <= pair.middle() + 1; ++k) all.push_back(joints[k]);
    return all;
  }
  /// The body's own vertical axis, from pelvis to chest, in the mesh's coordinates; unit.
  Vec3d up() const { return fit.body.axis_angles.empty() ? Vec3d{0, 1, 0} : joint_rotation(0) * Vec3d{0, 1, 0}; }
  /// Of a mesh in which a body lies: the rotation of a joint in its parent's frame.
  Matrix3 joint_rotation(std::size_t j) const { return npt::joint_rotation(as_span(fit.body.axis_angles), j); }
  /// Turns the mesh's axis upwards that is nearest to the body's, and about it, so that the body faces +z.
  Matrix3 upright_and_front() const {
    const Matrix3 upright = turn_upright(up());
    const Vec3d front = upright * joint_rotation(0) * Vec3d{0, 0, 1};
    return rotation_matrix({0, -std::atan2(front.x, front.z), 0}) * upright;
  }
  /// [J] The angles of the fit, the root's without the axis that is up and the direction in which it looks.
  std::vector<Vec3d> angles_without_direction() const {
    std::vector<Vec3d> angles(fit.body.axis_angles.size() / 3);
    for (std::size_t j = 0; j < angles.size(); ++j)
      angles[j] = axis_angle(j == 0 ? upright_and_front() * joint_rotation(0) : joint_rotation(j));
    return angles;
  }
  static constexpr double odd_shape = 450;  ///< CorrespondenceFit::shape_deviation from which on a user is told
  /// What a user should know of the mesh, or nothing. Limbs behind a girdle count as arms, the others as legs.
  std::vector<WarningCode> warnings(const BodyPlan& plan) const {
    using enum WarningCode;
    std::vector<WarningCode> codes;
    const Vec3d axis = up();
    if (axis.y < -0.5)
      codes.push_back(upside_down);
    else if (axis.y < 0.5)
      codes.push_back(std::abs(axis.z) > std::abs(axis.x) ? lying_or_z_up : lying);
    // Where more of these than not are wrong.
    bool arms = false, legs = false;
    for (const LimbPair& pair : plan.limb_pairs()) (pair.first > 0 ? arms : legs) |= least_joint_confidence(pair) < 0.5;
    if (arms) codes.push_back(arms_uncertain);
    if (legs) codes.push_back(legs_uncertain);
    if (confidence < high_confidence && fit.shape_deviation() > odd_shape) codes.push_back(unusual_proportions);
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
