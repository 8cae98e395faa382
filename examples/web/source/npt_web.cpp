/// What the package's JavaScript calls: npt behind functions of numbers and pointers. Files are those of the module's
/// own file system, in memory. Every function that can fail returns 0 or nullptr then, and web_error() says why.
///
/// Handles are owned by the caller, who releases each by its function; a mesh, a transfer and a character must outlive
/// what was made of them.
#include "npt_web.hpp"

#include <formats/read.hpp>

#include <npt/base/random.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/body/pose_sampler.hpp>
#include <npt/body/proportions.hpp>
#include <npt/io/gltf.hpp>
#include <npt/io/json.hpp>
#include <npt/io/mesh_file.hpp>
#include <npt/mesh/normals.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/mesh/validate.hpp>
#include <npt/npt.hpp>
#include <npt/scene/clip.hpp>
#include <npt/scene/pose.hpp>
#include <npt/transfer/animation.hpp>
#include <npt/transfer/detail_refiner.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <exception>
#include <filesystem>
#include <memory>
#include <new>
#include <optional>
#include <span>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace {

using namespace web;

/// The paper's network in all its variants. The ablations, a third of the size, are for studies.
template <int Bottleneck>
using Variants = npt::NetworkList<npt::PoseTransferNet<Bottleneck, npt::ConvRelu, npt::PerVertex>,
                                  npt::PoseTransferNet<Bottleneck, npt::ConvRelu, npt::Pooled>,
                                  npt::PoseTransferNet<Bottleneck, npt::ReluConv, npt::PerVertex>,
                                  npt::PoseTransferNet<Bottleneck, npt::ReluConv, npt::Pooled>>;
using Networks = typename npt::internal::JoinedLists<Variants<1024>, Variants<512>, Variants<256>, Variants<128>,
                                                     Variants<64>>::type;

struct Pose {
  std::string name;
  npt::Pose pose;
};

struct Tracker {
  npt::PoseTracker<> tracker;
};

/// A character through a sequence: made frame by frame, and then written.
struct Animation {
  const Character& character;
  npt::Animator<> animator{character.owner.transfer, character.character};
  npt::Animation finished{};

  const npt::Animation& frames() const { return finished.positions.empty() ? animator.animation() : finished; }
};

/// The mesh in other positions.
npt::Mesh moved(const Mesh& own, std::span<const float> xyz) {
  npt::Mesh mesh = own.mesh;
  std::copy(xyz.begin(), xyz.end(), mesh.coordinates().begin());
  npt::recompute_normals(mesh);
  npt::validate(mesh, "result for " + own.name);
  return mesh;
}

// ---- reports ----

const char* code_of(npt::WarningCode code) {
  using enum npt::WarningCode;
  switch (code) {
    case not_recognised:
      return "not_recognised";
    case low_confidence:
      return "low_confidence";
    case no_surface:
      return "no_surface";
    case upside_down:
      return "upside_down";
    case lying:
      return "lying";
    case lying_or_z_up:
      return "lying_or_z_up";
    case arms_uncertain:
      return "arms_uncertain";
    case legs_uncertain:
      return "legs_uncertain";
    case unusual_proportions:
      return "unusual_proportions";
    case faces_inward:
      return "faces_inward";
    case unit_assumed:
      return "unit_assumed";
    case part_of_mesh:
      return "part_of_mesh";
  }
  return "";
}

const char* code_of(npt::ErrorCode code) {
  using enum npt::ErrorCode;
  switch (code) {
    case bad_input:
      return "bad_input";
    case not_recognised:
      return "not_recognised";
    case unknown_unit:
      return "unknown_unit";
    case missing_weights:
      return "missing_weights";
    case foreign:
      return "foreign";
    case domains_differ:
      return "domains_differ";
    case needs_recognition:
      return "needs_recognition";
    case stopped:
      return "stopped";
  }
  return "";
}

const char* code_of(npt::Remedy remedy) {
  using enum npt::Remedy;
  switch (remedy) {
    case none:
      return "none";
    case look_at_result:
      return "look_at_result";
    case choose_method:
      return "choose_method";
    case give_unit:
      return "give_unit";
    case give_weights:
      return "give_weights";
  }
  return "";
}

std::string text_of(const npt::Warnings& warnings, const std::string& identity, const std::string& pose) {
  std::string text = "[";
  for (const npt::Warning& warning : warnings) {
    text += text.back() == '[' ? "" : ",";
    text += std::string("{\"code\":\"") + code_of(warning.code) + "\",\"mesh\":\"" +
            (warning.mesh == npt::MeshRole::identity ? "identity" : "pose") + "\",\"value\":" + number(warning.value) +
            ",\"text\":" + quoted(npt::text_of(warning, identity, pose)) + ",\"remedy\":\"" + code_of(warning.remedy) +
            "\"}";
  }
  return text + "]";
}

std::string text_of(const std::optional<double>& confidence) { return confidence ? number(*confidence) : "null"; }

std::string text_of(const npt::TransferReport& report, const std::string& identity, const std::string& pose) {
  return std::string("{\"method\":") + (report.method == npt::Method::network ? "\"network\"" : "\"body\"") +
         ",\"kind\":" + quoted(std::string(report.kind)) + ",\"confidence\":" + text_of(report.confidence) +
         ",\"warnings\":" + text_of(report.warnings, identity, pose) + "}";
}

/// What a character and a pose say of themselves.
template <class Prepared>
std::string text_of(const Prepared& prepared, const std::string& name) {
  return std::string("{\"recognised\":") + (prepared.recognised() ? "true" : "false") +
         ",\"confidence\":" + text_of(prepared.confidence()) + ",\"domain\":" + quoted(prepared.domain()) +
         ",\"kind\":" + quoted(std::string(prepared.kind())) +
         ",\"warnings\":" + text_of(prepared.warnings(), name, name) + "}";
}

npt::Random random_for(double seed, std::uint64_t stream) {
  return npt::Random(static_cast<std::uint64_t>(seed), stream);
}

}  // namespace

extern "C" {

NPT_WEB const char* web_version() { return NPT_VERSION; }
NPT_WEB const char* web_error() { return last_error.c_str(); }
NPT_WEB int web_error_kind() { return static_cast<int>(last_kind); }
NPT_WEB const char* web_error_code() { return code_of(last_code); }
NPT_WEB const char* web_error_remedy() { return code_of(last_remedy); }

// ---- meshes ----

/// The mesh in a file, in the format that its name says.
NPT_WEB Mesh* web_read(const char* path, const char* name) {
  return guarded(static_cast<Mesh*>(nullptr), [&] {
    auto mesh = std::make_unique<Mesh>(Mesh{.name = name});
    mesh->in_metres = formats::is_scene(path);
    if (mesh->in_metres) {
      mesh->scene = std::make_unique<npt::Scene>(formats::read_scene(path));
      mesh->poser = std::make_unique<npt::ScenePoser>(*mesh->scene, mesh->name);
      mesh->mesh = mesh->poser->mesh();
    } else {
      mesh->mesh = formats::read_mesh(path);
    }
    return adopted(std::move(mesh));
  });
}

/// A mesh of the caller's arrays, which are copied. triangles may be nullptr.
NPT_WEB Mesh* web_make(const char* name, const float* xyz, std::uint32_t vertices, const std::uint32_t* triangles,
                       std::uint32_t triangle_count) {
  return guarded(static_cast<Mesh*>(nullptr), [&] {
    auto mesh = std::make_unique<Mesh>(Mesh{.name = name});
    mesh->mesh.positions.resize(vertices);
    std::copy_n(xyz, std::size_t{3} * vertices, mesh->mesh.coordinates().data());
    if (triangle_count > 0) {
      mesh->mesh.corners.assign(triangles, triangles + std::size_t{3} * triangle_count);
      for (std::size_t f = 0; f <= triangle_count; ++f) mesh->mesh.face_start.push_back(3 * f);
    }
    return adopted(std::move(mesh));
  });
}

/// The built-in mannequin, as npt generate makes it. pose 0: at rest, 1: of the paper's, 2: wide, 3: natural; angles,
/// [24, 3], take its place where they are given.
NPT_WEB Mesh* web_mannequin(const char* name, double shape_seed, int proportions, int pose, double pose_seed,
                            const float* angles) {
  return guarded(static_cast<Mesh*>(nullptr), [&] {
    static std::unique_ptr<const npt::BodyModel> plain, varied;
    std::unique_ptr<const npt::BodyModel>& body = proportions != 0 ? varied : plain;
    if (body == nullptr)
      body = std::make_unique<const npt::BodyModel>(proportions != 0 ? npt::with_proportions(npt::mannequin())
                                                                     : npt::mannequin());
    npt::Random of_shape = random_for(shape_seed, 0), of_pose = random_for(pose_seed, 1);
    std::vector<float> betas = npt::sample_shape(
        of_shape, body->shape_count() - (proportions != 0 ? npt::body_proportion_count : std::size_t{0}));
    if (proportions != 0)
      for (const double p : npt::sample_proportions(of_shape)) betas.push_back(static_cast<float>(p));
    std::vector<float> theta;
    if (angles != nullptr) {
      theta.assign(angles, angles + 3 * npt::smpl_joint_count);
    } else if (pose != 0) {
      constexpr std::array kinds{npt::PoseDistribution::paper, npt::PoseDistribution::wide,
                                 npt::PoseDistribution::natural};
      const auto drawn = npt::sample_pose(of_pose, kinds.at(static_cast<std::size_t>(pose) - 1));
      theta.assign(drawn.begin(), drawn.end());
    }
    return adopted(std::make_unique<Mesh>(Mesh{.name = name, .mesh = npt::to_mesh(*body, betas, theta)}));
  });
}

/// Name, counts, clips, as JSON.
NPT_WEB const char* web_mesh_info(const Mesh* mesh) {
  return guarded(static_cast<const char*>(nullptr), [&] {
    std::string text = "{\"name\":" + quoted(mesh->name) +
                       ",\"vertices\":" + std::to_string(mesh->mesh.vertex_count()) +
                       ",\"faces\":" + std::to_string(mesh->mesh.face_count()) +
                       ",\"triangles\":" + std::to_string(mesh->triangles.size()) + ",\"clips\":[";
    if (mesh->scene != nullptr)
      for (const npt::Clip& clip : mesh->scene->clips)
        text += (text.back() == '[' ? "{\"name\":" : ",{\"name\":") + quoted(clip.name) +
                ",\"length\":" + number(clip.length()) + "}";
    return returned(text + "]}");
  });
}
NPT_WEB const float* web_positions(const Mesh* mesh) { return mesh->mesh.coordinates().data(); }
NPT_WEB const void* web_triangles(const Mesh* mesh) { return mesh->triangles.data(); }

/// Moves the mesh to a time of one of its clips; below 0: as its file has it at rest.
NPT_WEB int web_move(Mesh* mesh, std::int32_t clip, double time) {
  return guarded(0, [&] {
    if (mesh->scene == nullptr) return 1;
    if (clip < 0)
      mesh->mesh = mesh->poser->mesh();
    else
      mesh->poser->positions(&mesh->scene->clips.at(static_cast<std::size_t>(clip)), time, mesh->mesh.coordinates());
    npt::recompute_normals(mesh->mesh);
    return 1;
  });
}
/// Times of a clip's frames in seconds, as a JSON array.
NPT_WEB const char* web_frame_times(const Mesh* mesh, std::uint32_t clip, double rate) {
  return guarded(static_cast<const char*>(nullptr), [&] {
    constexpr int most_frames = 100'000;
    const npt::Clip& own = mesh->scene->clips.at(clip);
    if (!(own.length() * rate <= most_frames))
      throw npt::Error({.file = mesh->name,
                        .place = "clip '" + own.name + "'",
                        .found = number(own.length()) + " s",
                        .expected = "at most " + std::to_string(most_frames) + " frames"});
    std::string text = "[";
    for (const double time : npt::frame_times(own, rate)) text += (text.back() == '[' ? "" : ",") + number(time);
    return returned(text + "]");
  });
}

/// Writes the mesh in positions of its own or, where xyz is given, in these. `transfer`, which may be nullptr, knows
/// the unit.
NPT_WEB int web_write(const Transfer* transfer, const Mesh* mesh, const float* xyz, const char* path) {
  return guarded(0, [&] {
    const std::size_t count = 3 * mesh->mesh.vertex_count();
    npt::Mesh written = xyz == nullptr ? mesh->mesh : moved(*mesh, {xyz, count});
    npt::write_mesh(path, npt::scaled(std::move(written), metres_in(transfer, *mesh, path)));
    return 1;
  });
}
NPT_WEB void web_release_mesh(Mesh* mesh) { delete mesh; }

// ---- transfers ----

/// Opens weights, and further ones, each a domain: paths, a line each. method 0: automatic, 1: body, 2: network;
/// quality 0: fast, 1: balanced, 2: best; figure 0: the one that is recognised; refine_radius, unit 0: inferred from
/// weights and meshes; threads 0: all.
NPT_WEB Transfer* web_open(const char* weights, const char* further, int method, int quality, int figure, int pairings,
                           int mirror, int refine, double refine_radius, int invariant, int resample, double unit,
                           double seed, int threads) {
  return guarded(static_cast<Transfer*>(nullptr), [&] {
    npt::TransferOptions options;
    options.method = method == 1 ? npt::Method::body : method == 2 ? npt::Method::network : npt::Method::automatic;
    options.body.quality = quality == 0   ? npt::Quality::fast
                           : quality == 2 ? npt::Quality::best
                                          : npt::Quality::balanced;
    options.body.figure = static_cast<std::size_t>(figure);
    options.network.pairings = pairings;
    options.network.mirror = mirror != 0;
    options.network.invariant = invariant != 0;
    options.network.resample = resample != 0;
    if (refine != 0) options.refinement = npt::detail_refinement;
    if (refine_radius != 0) options.refine_radius = refine_radius;
    if (unit != 0) options.import.unit = unit;
    options.seed = static_cast<std::uint64_t>(seed);
    // The bytes are kept: the files go away when this returns.
    std::vector<npt::SafetensorsFile> files{npt::SafetensorsFile::read(weights)};
    std::istringstream lines(further);
    for (std::string path; std::getline(lines, path);) files.push_back(npt::SafetensorsFile::read(path));
    return new Transfer{npt::PoseTransfer::open<Networks>(std::span<const npt::SafetensorsFile>(files), options,
                                                          npt::DefaultExecutor(threads))};
  });
}

/// Its description, and what its weights hold, as JSON.
NPT_WEB const char* web_describe(const Transfer* transfer) {
  return guarded(static_cast<const char*>(nullptr), [&] {
    const npt::PoseTransfer& own = transfer->transfer;
    return returned("{\"description\":" + quoted(own.description()) + ",\"pairsVertices\":" +
                    (own.pairs_vertices() ? "true" : "false") + ",\"hasBody\":" + (own.has_body() ? "true" : "false") +
                    ",\"highConfidence\":" + number(own.options().body.high_confidence) + "}");
  });
}
NPT_WEB void web_close(Transfer* transfer) { delete transfer; }

// ---- characters and poses ----

NPT_WEB Character* web_character(const Transfer* transfer, const Mesh* mesh) {
  return guarded(static_cast<Character*>(nullptr), [&] {
    return new Character{*transfer, mesh->name, transfer->transfer.character(mesh->view())};
  });
}
/// A character that web_save_character wrote.
NPT_WEB Character* web_load_character(const Transfer* transfer, const char* path) {
  return guarded(static_cast<Character*>(nullptr), [&] {
    return new Character{*transfer, path, transfer->transfer.load_character(path)};
  });
}
NPT_WEB int web_save_character(const Character* character, const char* path) {
  return guarded(0, [&] {
    character->character.save(path);
    return 1;
  });
}
/// The mesh of a character, of triangles alone.
NPT_WEB Mesh* web_character_mesh(const Character* character) {
  return guarded(static_cast<Mesh*>(nullptr), [&] {
    auto mesh = std::make_unique<Mesh>(Mesh{.name = character->name});
    const std::span<const float> xyz = character->character.positions();
    mesh->mesh.positions.resize(xyz.size() / 3);
    std::copy(xyz.begin(), xyz.end(), mesh->mesh.coordinates().begin());
    npt::set_faces(mesh->mesh, character->character.triangles());
    return adopted(std::move(mesh));
  });
}
/// Whether it is recognised, its confidence and warnings, as JSON.
NPT_WEB const char* web_character_info(const Character* character) {
  return guarded(static_cast<const char*>(nullptr),
                 [&] { return returned(text_of(character->character, character->name)); });
}
NPT_WEB void web_release_character(Character* character) { delete character; }

NPT_WEB Pose* web_pose(const Transfer* transfer, const Mesh* mesh, std::uint32_t identity_vertices) {
  return guarded(static_cast<Pose*>(nullptr), [&] {
    return new Pose{mesh->name, transfer->transfer.pose(mesh->view(), identity_vertices)};
  });
}
NPT_WEB const char* web_pose_info(const Pose* pose) {
  return guarded(static_cast<const char*>(nullptr), [&] { return returned(text_of(pose->pose, pose->name)); });
}
NPT_WEB void web_release_pose(Pose* pose) { delete pose; }

/// How a character takes a pose, as JSON.
NPT_WEB const char* web_report(const Character* character, const Pose* pose) {
  return guarded(static_cast<const char*>(nullptr), [&] {
    const npt::TransferReport report = character->owner.transfer.report(character->character, pose->pose);
    return returned(text_of(report, character->name, pose->name));
  });
}

/// result: [V, 3]
NPT_WEB int web_apply(const Character* character, const Pose* pose, float* result) {
  return guarded(0, [&] {
    const std::size_t count = 3 * character->character.vertex_count();
    character->owner.transfer.apply(character->character, pose->pose, {result, count});
    return 1;
  });
}

/// Metres in a unit of the mesh, inferred from its size; 0 where that is no person's.
NPT_WEB double web_unit(const Transfer* transfer, const Mesh* mesh) {
  try {
    return transfer->transfer.unit_of(mesh->view());
  } catch (const std::exception&) {
    return 0;
  }
}

// ---- sequences ----

NPT_WEB Tracker* web_open_tracker(const Transfer* transfer) {
  return guarded(static_cast<Tracker*>(nullptr), [&] { return new Tracker{npt::PoseTracker<>(transfer->transfer)}; });
}
/// The next frame's pose, a copy.
NPT_WEB Pose* web_next_pose(Tracker* tracker, const Mesh* frame, std::uint32_t identity_vertices) {
  return guarded(static_cast<Pose*>(nullptr), [&] {
    return new Pose{frame->name, tracker->tracker.next(frame->view(), identity_vertices)};
  });
}
NPT_WEB void web_close_tracker(Tracker* tracker) { delete tracker; }

NPT_WEB Animation* web_open_animation(const Character* character) {
  return guarded(static_cast<Animation*>(nullptr), [&] { return new Animation{.character = *character}; });
}
/// Transfers the first frame, followed from the best of it and of `count` others: its report, as JSON.
NPT_WEB const char* web_start_animation(Animation* animation, const Mesh* first, const Mesh* const* others,
                                        std::uint32_t count) {
  return guarded(static_cast<const char*>(nullptr), [&] {
    const npt::TransferReport report = animation->animator.start(
        first->mesh, first->name, count, [others](std::size_t k) -> npt::Mesh { return others[k]->mesh; });
    return returned(text_of(report, animation->character.name, first->name));
  });
}
/// Transfers the next frame: its report, as JSON.
NPT_WEB const char* web_add_frame(Animation* animation, const Mesh* frame) {
  return guarded(static_cast<const char*>(nullptr), [&] {
    const npt::TransferReport report = animation->animator.add(frame->view());
    return returned(text_of(report, animation->character.name, frame->name));
  });
}
/// After the last frame; follow_root: along the poses' root trajectory.
NPT_WEB int web_finish_animation(Animation* animation, int follow_root) {
  return guarded(0, [&] {
    animation->finished = animation->animator.finish(follow_root != 0);
    return 1;
  });
}
/// The number of the frame with the lowest confidence.
NPT_WEB std::uint32_t web_weakest_frame(const Animation* animation) {
  return static_cast<std::uint32_t>(animation->frames().weakest);
}
/// [V, 3]
NPT_WEB const float* web_frame(const Animation* animation, std::uint32_t i) {
  return guarded(static_cast<const float*>(nullptr), [&] { return animation->frames().positions.at(i).data(); });
}
/// A GLB that moves, once it is finished. mesh: the character's; times: seconds of each frame.
NPT_WEB int web_write_animation(const Animation* animation, const Mesh* mesh, const char* path, const char* clip,
                                const double* times) {
  return guarded(0, [&] {
    const npt::Animation& frames = animation->finished;
    const double metres =
        fs::path(path).extension() == ".glb"
            ? npt::output_unit(animation->character.owner.transfer, animation->character.character, mesh->in_metres)
            : 1;
    npt::write_scene(path, npt::animation_scene(mesh->mesh, fs::path(mesh->name).stem().string(), frames, clip,
                                                {times, frames.positions.size()}, metres));
    return 1;
  });
}
NPT_WEB void web_close_animation(Animation* animation) { delete animation; }

}  // extern "C"
