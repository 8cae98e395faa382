/// What stands behind npt_c.h's types, the border that no exception passes, and the ways between its structs and npt's.
#pragma once

#include "npt_c.h"

#include <npt/base/control.hpp>
#include <npt/base/default_executor.hpp>
#include <npt/base/error.hpp>
#include <npt/body/joint_pose.hpp>
#include <npt/body/skeleton.hpp>
#include <npt/estimate/warning_code.hpp>
#include <npt/mesh/mesh_view.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/scene/skinned_skeleton.hpp>
#include <npt/transfer/character.hpp>
#include <npt/transfer/options.hpp>
#include <npt/transfer/pose.hpp>
#include <npt/transfer/pose_tracker.hpp>
#include <npt/transfer/pose_transfer.hpp>
#include <npt/transfer/result.hpp>
#include <npt/transfer/warning.hpp>
#if __has_include(<Eigen/SparseCholesky>)
#include <npt/transfer/detail_refiner.hpp>
#endif

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <exception>
#include <filesystem>
#include <new>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

struct npt_transfer {
  npt::PoseTransfer transfer;
  std::string description;
};
struct npt_character {
  npt::Character character;
  std::string name;
};
struct npt_pose {
  npt::Pose own;
  const npt::Pose* pose = &own;  ///< or a tracker's
};
struct npt_tracker {
  npt::PoseTracker<npt::DefaultExecutor> tracker;
  npt_pose last;
};

namespace c_api {

// ---- The border: exceptions become a status, a code and a message. A fixed buffer, so that short memory can be
// reported too.

using Text = std::array<char, 2048>;

struct LastError {
  Text message{};
  npt_error_code code = NPT_ERROR_NONE;
  npt_remedy remedy = NPT_REMEDY_NONE;
};
inline thread_local LastError last_error{};

inline void set(Text& text, const char* message) noexcept {
  std::size_t length = std::min(std::strlen(message), text.size() - 1);
  // Not through the middle of a character: those that follow a first byte begin with the bits 10.
  if (message[length] != '\0')
    while (length > 0 && (static_cast<unsigned char>(message[length]) & 0xC0U) == 0x80U) --length;
  std::memcpy(text.data(), message, length);
  text[length] = '\0';
}

inline thread_local Text last_text{};

/// A text for the caller, until this thread's next one.
inline const char* kept(const std::string& text) noexcept {
  set(last_text, text.c_str());
  return last_text.data();
}

inline npt_status failed(npt_status status, npt_error_code code, const char* message,
                         npt_remedy remedy = NPT_REMEDY_NONE) noexcept {
  set(last_error.message, message);
  last_error.code = code;
  last_error.remedy = remedy;
  return status;
}

/// A mistake of the caller, as opposed to bad data.
struct BadArgument {
  const char* message;
};

inline void expect(bool good, const char* message) {
  if (!good) throw BadArgument{message};
}

static_assert(static_cast<int>(npt::ErrorCode::bad_input) + 1 == NPT_ERROR_BAD_INPUT);
static_assert(static_cast<int>(npt::ErrorCode::needs_recognition) + 1 == NPT_ERROR_NEEDS_RECOGNITION);
static_assert(static_cast<int>(npt::ErrorCode::stopped) + 1 == NPT_ERROR_STOPPED);
static_assert(static_cast<int>(npt::Remedy::give_weights) == NPT_REMEDY_GIVE_WEIGHTS);

template <class F>
npt_status guarded(const F& f) noexcept {
  try {
    f();
    return NPT_OK;
  } catch (const BadArgument& mistake) {
    return failed(NPT_BAD_ARGUMENT, NPT_ERROR_ARGUMENT, mistake.message);
  } catch (const npt::Error& error) {
    return failed(error.code() == npt::ErrorCode::stopped ? NPT_STOPPED : NPT_BAD_INPUT,
                  static_cast<npt_error_code>(static_cast<int>(error.code()) + 1), error.what(),
                  static_cast<npt_remedy>(error.remedy()));
  } catch (const std::bad_alloc&) {
    return failed(NPT_NO_MEMORY, NPT_ERROR_MEMORY, "out of memory");
  } catch (const std::exception& error) {
    return failed(NPT_INTERNAL, NPT_ERROR_INTERNAL, error.what());
  } catch (...) {
    return failed(NPT_INTERNAL, NPT_ERROR_INTERNAL, "unknown exception");
  }
}

inline std::filesystem::path path_of(const char* utf8) { return std::u8string(reinterpret_cast<const char8_t*>(utf8)); }

// ---- Options

/// An enumerator as the number that it is: a caller in another language may have written any.
template <class E>
int number_of(const E& value) {
  static_assert(sizeof(E) == sizeof(int));
  int number = 0;
  std::memcpy(&number, &value, sizeof number);
  return number;
}

inline npt::MakeRefinement refinement() {
#if __has_include(<Eigen/SparseCholesky>)
  return npt::detail_refinement;
#else
  throw npt::Error({.file = "refine", .found = "a library built without Eigen", .expected = "one with it"});
#endif
}

inline void expect_numbers(const npt_options& o) {
  const int method = number_of(o.method), quality = number_of(o.body.quality), pairing = number_of(o.network.pairing);
  expect(method >= NPT_AUTOMATIC && method <= NPT_NETWORK, "npt_options: an unknown method");
  expect(quality >= NPT_FAST && quality <= NPT_BEST, "npt_options: an unknown quality");
  expect(pairing >= NPT_RANDOM && pairing <= NPT_AS_GIVEN, "npt_options: an unknown pairing");
  expect(o.threads >= 0, "npt_options: fewer than 0 threads");
  for (const double confidence : {o.body.least_confidence, o.body.high_confidence})
    expect(confidence >= 0 && confidence <= 1, "npt_options: a confidence that isn't between 0 and 1");
}

static_assert(static_cast<int>(npt::Method::automatic) == NPT_AUTOMATIC &&
              static_cast<int>(npt::Method::body) == NPT_BODY && static_cast<int>(npt::Method::network) == NPT_NETWORK);
static_assert(static_cast<int>(npt::Quality::fast) == NPT_FAST && static_cast<int>(npt::Quality::best) == NPT_BEST);
static_assert(static_cast<int>(npt::Pairing::as_given) == NPT_AS_GIVEN);

inline npt::TransferOptions options_from(const npt_options& o) {
  expect(o.size == sizeof(npt_options) && o.version == NPT_OPTIONS_VERSION,
         "npt_options: fill it with npt_default_options, of this version's header");
  expect_numbers(o);
  npt::TransferOptions options;
  options.method = static_cast<npt::Method>(o.method);
  options.body = {static_cast<npt::Quality>(o.body.quality), o.body.least_confidence, o.body.high_confidence,
                  o.body.figure};
  options.network.pairing = static_cast<npt::Pairing>(o.network.pairing);
  options.network.pairings = o.network.pairings;
  options.network.mirror = o.network.mirror != 0;
  options.network.invariant = o.network.invariant != 0;
  options.network.resample = o.network.resample != 0;
  if (o.import.unit != 0) options.import.unit = o.import.unit;
  if (o.refine != 0) options.refinement = refinement();
  if (o.refine_radius != 0) options.refine_radius = o.refine_radius;
  options.seed = o.seed;
  // Vertices are paired by number to see what the network itself does.
  if (options.network.pairing == npt::Pairing::as_given && options.method == npt::Method::automatic)
    options.method = npt::Method::network;
  return options;
}

inline npt::Control control_from(const npt_control* given) {
  npt::Control control;
  if (given == nullptr) return control;
  expect(given->size == sizeof(npt_control), "npt_control: a size that isn't sizeof(npt_control)");
  const npt_control own = *given;
  if (own.progress != nullptr) control.progress = [own](double done) { own.progress(done, own.user); };
  if (own.stop != nullptr) control.stop = [own] { return own.stop(own.user) != 0; };
  return control;
}

// ---- Meshes

constexpr std::size_t most_vertices = std::size_t{1} << 28;

inline npt::MeshView view_of(const npt_mesh* mesh, const char* name) {
  expect(mesh != nullptr, "npt_mesh: a null pointer for a mesh");
  expect(mesh->size == sizeof(npt_mesh), "npt_mesh: a size that isn't sizeof(npt_mesh)");
  expect(mesh->xyz != nullptr, "npt_mesh: a null pointer for coordinates");
  expect(mesh->triangles != nullptr || mesh->triangle_count == 0, "npt_mesh: a null pointer for triangles");
  expect(mesh->vertices <= most_vertices && mesh->triangle_count <= most_vertices,
         "npt_mesh: more than 2^28 vertices or triangles");
  static_assert(sizeof(npt::Triangle) == 3 * sizeof(std::uint32_t));
  return {.xyz = {mesh->xyz, 3 * mesh->vertices},
          .triangles = {reinterpret_cast<const npt::Triangle*>(mesh->triangles), mesh->triangle_count},
          .name = mesh->name != nullptr ? mesh->name : name};
}

inline std::string name_of(const npt_mesh* mesh, const char* name) { return mesh->name != nullptr ? mesh->name : name; }

// ---- Results

static_assert(static_cast<int>(npt::WarningCode::not_recognised) == NPT_WARNING_NOT_RECOGNISED);
static_assert(static_cast<int>(npt::WarningCode::arms_uncertain) == NPT_WARNING_ARMS_UNCERTAIN);
static_assert(static_cast<int>(npt::WarningCode::part_of_mesh) == NPT_WARNING_PART_OF_MESH);
static_assert(npt::Warnings::capacity == NPT_MOST_WARNINGS);

inline std::size_t copy_warnings(const npt::Warnings& warnings, npt_warning* out) {
  for (const npt::Warning& warning : warnings)
    *out++ = {static_cast<npt_warning_code>(warning.code), static_cast<npt_mesh_role>(warning.mesh), warning.value,
              static_cast<npt_remedy>(warning.remedy), warning.kind};
  return warnings.size();
}

/// A kind's name, which is a whole string.
inline const char* name_of(std::string_view kind) { return kind.empty() ? "" : kind.data(); }

inline double number_of(std::optional<double> fraction) { return fraction.value_or(-1); }

inline void expect_result(const npt_result* result) {
  expect(result == nullptr || result->size == sizeof(npt_result), "npt_result: a size that isn't sizeof(npt_result)");
}

inline void fill(npt_result* result, const npt::TransferReport& report, std::optional<double> character,
                 std::optional<double> pose) {
  if (result == nullptr) return;
  result->method = report.method == npt::Method::body ? NPT_BODY : NPT_NETWORK;
  result->confidence = number_of(report.confidence);
  result->character_confidence = number_of(character);
  result->pose_confidence = number_of(pose);
  result->kind = name_of(report.kind);
  result->warning_count = copy_warnings(report.warnings, result->warnings);
}

/// Of a npt::Character or a npt::Pose.
template <class Estimated>
void fill(npt_estimate& estimate, const Estimated& own, double unit) {
  estimate.recognised = own.recognised() ? 1 : 0;
  estimate.confidence = number_of(own.confidence());
  estimate.unit = unit;
  estimate.domain = own.domain().c_str();
  estimate.kind = name_of(own.kind());
  estimate.warning_count = copy_warnings(own.warnings(), estimate.warnings);
}

inline npt::Error not_recognised(const char* what, const char* who) {
  return npt::Error({.file = what,
                     .found = std::string(who) + " that is not recognised",
                     .expected = "a recognised one",
                     .code = npt::ErrorCode::needs_recognition});
}

/// Errors    npt::Error where a caller's memory has no place for so many
inline void expect_joints(std::size_t count) {
  if (count > NPT_JOINTS)
    throw npt::Error(
        {.file = "joints", .found = std::to_string(count), .expected = "at most " + std::to_string(NPT_JOINTS)});
}

inline void fill(npt_joint_pose& joints, const std::optional<npt::JointPose>& own, const char* who) {
  if (!own) throw not_recognised("joints", who);
  joints.joints = own->axis_angles.size() / 3;
  expect_joints(joints.joints);
  float* const angles = &joints.axis_angles[0][0];
  std::fill_n(std::copy(own->axis_angles.begin(), own->axis_angles.end(), angles), 3 * (NPT_JOINTS - joints.joints),
              0.0F);
  joints.root[0] = own->root.x, joints.root[1] = own->root.y, joints.root[2] = own->root.z;
  joints.leg = own->leg;
}

// ---- Skeletons

/// A skeleton as npt_c.h shows it, and what it shows.
struct OwnedSkeleton : npt_skeleton {
  npt::SkinnedSkeleton skeleton;
  std::vector<const char*> name_pointers;
  std::vector<std::int32_t> parent_numbers;
};
static_assert(NPT_JOINTS == npt::fingered_joint_count);
static_assert(sizeof(npt_influence) == sizeof(npt::SkinnedSkeleton::Influence));
static_assert(offsetof(npt_influence, weight) == offsetof(npt::SkinnedSkeleton::Influence, weight));
static_assert(sizeof(npt::Vec3d) == 3 * sizeof(double));

}  // namespace c_api
