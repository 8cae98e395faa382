/// npt info: what a mesh, a skeleton, a motion, a file of weights or a body file holds.
#include "arguments.hpp"
#include "report.hpp"
#include "subcommand.hpp"

#include <formats/motion.hpp>
#include <formats/read.hpp>

#include <npt/base/default_executor.hpp>
#include <npt/base/error.hpp>
#include <npt/body/roles/bone_map.hpp>
#include <npt/body/roles/joint_role.hpp>
#include <npt/body/roles/joint_roles.hpp>
#include <npt/body/roles/rest_pose.hpp>
#include <npt/body/roles/root_motion.hpp>
#include <npt/io/file.hpp>
#include <npt/io/mesh_file.hpp>
#include <npt/io/safetensors.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/topology.hpp>
#include <npt/mesh/union_find.hpp>
#include <npt/nets/network_list.hpp>
#include <npt/scene/motion_of_scene.hpp>
#include <npt/scene/pose.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <limits>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <system_error>
#include <vector>

namespace info_command {

namespace fs = std::filesystem;
using program::Report;

struct Options {
  std::vector<fs::path> files;
  bool json = false;
  bool bones = false;
  fs::path bone_map{};  ///< empty: as found
};

/// Sets among the vertices for which `counts` holds.
std::size_t set_count(npt::UnionFind& sets, const std::vector<bool>& counts) {
  std::set<std::uint32_t> names;
  for (std::uint32_t v = 0; v < counts.size(); ++v)
    if (counts[v]) names.insert(sets.find(v));
  return names.size();
}

/// Sides of faces by how many faces have them: 1 at a border, 2 inside, more where surfaces meet.
struct EdgeUse {
  std::size_t edges = 0, crowded = 0;
  std::vector<npt::Edge> border;
};

EdgeUse edge_use(const npt::Mesh& mesh) {
  std::vector<npt::Edge> sides;
  for (std::size_t f = 0; f < mesh.face_count(); ++f) {
    const auto face = mesh.face(f);
    for (std::size_t i = 0; i < face.size(); ++i) {
      const std::uint32_t a = face[i], b = face[(i + 1) % face.size()];
      if (a != b) sides.push_back({std::min(a, b), std::max(a, b)});
    }
  }
  std::ranges::sort(sides);
  EdgeUse use;
  for (std::size_t i = 0, end = 0; i < sides.size(); i = end) {
    while (end < sides.size() && sides[end] == sides[i]) ++end;
    ++use.edges;
    if (end - i == 1) use.border.push_back(sides[i]);
    if (end - i > 2) ++use.crowded;
  }
  return use;
}

void describe_topology(Report& report, const npt::Mesh& mesh) {
  std::map<std::size_t, std::size_t> sizes;
  for (std::size_t f = 0; f < mesh.face_count(); ++f) ++sizes[mesh.face(f).size()];
  Report by_size = Report::object();
  for (const auto& [corners, count] : sizes)
    by_size[corners == 3 ? "triangles" : corners == 4 ? "quads" : "polygons_of_" + std::to_string(corners)] = count;
  if (!by_size.empty()) report["faces_by_size"] = by_size;
  if (mesh.face_count() == 0) return;

  const EdgeUse use = edge_use(mesh);
  npt::UnionFind pieces(mesh.vertex_count()), borders(mesh.vertex_count());
  std::vector<bool> used(mesh.vertex_count()), at_border(mesh.vertex_count());
  for (std::size_t f = 0; f < mesh.face_count(); ++f)
    for (std::uint32_t v : mesh.face(f)) {
      used[v] = true;
      pieces.unite(v, mesh.face(f)[0]);
    }
  for (const npt::Edge& edge : use.border) {
    at_border[edge[0]] = at_border[edge[1]] = true;
    borders.unite(edge[0], edge[1]);
  }
  report["edges"] = use.edges;
  report["components"] = set_count(pieces, used);
  report["surface"] = use.border.empty() ? "closed"
                                         : "open: " + std::to_string(use.border.size()) + " border edges in " +
                                               std::to_string(set_count(borders, at_border)) + " borders";
  report["border_edges"] = use.border.size();
  if (use.crowded != 0) report["edges_of_more_than_two_faces"] = use.crowded;
  const auto unused = std::ranges::count(used, false);
  if (unused != 0) report["vertices_without_face"] = unused;
}

void describe_box(Report& report, const npt::Mesh& mesh) {
  constexpr float most = std::numeric_limits<float>::max();
  npt::Vec3f low{most, most, most}, high = -low;
  for (npt::Vec3f p : mesh.positions) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  const npt::Vec3d size = high.as<double>() - low.as<double>();
  report["lowest"] = {low.x, low.y, low.z};
  report["highest"] = {high.x, high.y, high.z};
  report["size"] = {size.x, size.y, size.z};
}

void describe_attributes(Report& report, const npt::Mesh& mesh) {
  if (!mesh.normals.empty())
    report["normals"] =
        std::to_string(mesh.normals.size()) + (mesh.corner_normal.empty() ? ", one a vertex" : ", by corner");
  if (!mesh.texcoords.empty())
    report["texture_coordinates"] =
        std::to_string(mesh.texcoords.size()) + " of " + std::to_string(mesh.texcoord_size) + " numbers";
  Report properties = Report::array();
  for (const npt::VertexProperty& property : mesh.properties) properties.push_back(property.type + " " + property.name);
  if (!properties.empty()) report["vertex_properties"] = properties;
  Report tags = Report::object();
  for (const npt::MeshTag& tag : mesh.tags) tags[tag.keyword] = tags.value(tag.keyword, 0) + 1;
  if (!tags.empty()) report["tags"] = tags;
}

std::string in_units(double value, const char* unit) {
  char text[48];
  std::snprintf(text, sizeof text, "%.3f %s", value, unit);
  return text;
}

/// How its curves are sampled, and where it goes.
void describe_clip(Report& report, const npt::Motion& motion, const npt::JointRoles& roles) {
  char text[64];
  if (motion.rate > 0)
    std::snprintf(text, sizeof text, "%g frames a second", motion.rate);
  else
    std::snprintf(text, sizeof text, "keys");
  report["rate"] = text;
  if (roles.confidence < 0.3) return;
  const npt::RootPath root = npt::root_motion_of(motion, roles);
  report["root_motion"] = root.joint == npt::no_item ? "in place"
                                                     : "moved " + in_units(std::hypot(root.way.x, root.way.z), "m") +
                                                           " by " + motion.joints[root.joint].name;
}

/// A skeleton in the file's own coordinates. `names`: with its joints', which scenes with skins have already.
void describe_skeleton(Report& report, const npt::Motion& motion, bool names) {
  const npt::JointRoles roles = npt::joint_roles(motion);
  if (names) {
    Report joints = Report::array();
    for (const npt::MotionJoint& joint : motion.joints)
      if (!joint.end) joints.push_back(joint.name);
    report["joint_count"] = joints.size();
    report["joints"] = joints;
  }
  if (!roles.dialect.empty()) report["joint_names"] = roles.dialect;
  const bool person = roles.kind() == npt::SkeletonKind::person;
  report[person ? "person" : "four_legged_animal"] =
      std::to_string(std::lround(100 * roles.confidence)) + " % confidence";
  if (roles.confidence >= 0.3 && person) report["rest_pose"] = npt::to_string(npt::rest_pose_of(motion, roles));
  report["up_axis"] = npt::up_axis(motion);
  report["unit"] = in_units(npt::metres_a_unit(motion), "m");
}

/// What only a scene has: its parts, materials, joints and clips.
void describe_scene(Report& report, const npt::Scene& scene, const std::string& file) {
  Report parts = Report::array(), materials = Report::array(), clips = Report::array(), joints = Report::array();
  for (const std::size_t n : scene.shown) {
    const npt::SceneNode& node = scene.nodes[n];
    const npt::SceneMesh& mesh = scene.meshes[node.mesh];
    std::size_t targets = mesh.weights.size();
    Report part{{"name", node.name.empty() ? mesh.name : node.name}};
    part["primitives"] = std::to_string(mesh.primitives.size()) + " primitives";
    if (node.skin != npt::no_item) part["skin"] = "skinned";
    if (targets != 0) part["targets"] = std::to_string(targets) + " morph targets";
    parts.push_back(part);
  }
  if (scene.appearance != nullptr)
    for (const npt::AppearanceMaterial& material : scene.appearance->materials) materials.push_back(material.label);
  std::set<std::size_t> nodes;
  for (const npt::Skin& skin : scene.skins)
    for (const std::size_t joint : skin.joints)
      if (nodes.insert(joint).second) joints.push_back(scene.nodes[joint].name);
  for (const npt::Clip& clip : scene.clips) {
    clips.push_back({{"name", clip.name}, {"length", in_units(clip.length(), "s")}});
    if (!npt::has_skeleton(scene)) continue;
    const npt::Motion motion = npt::motion_of(scene, &clip, file);
    describe_clip(clips.back(), motion, npt::joint_roles(motion));
  }
  if (!parts.empty()) report["parts"] = parts;
  if (!materials.empty()) report["materials"] = materials;
  if (scene.appearance != nullptr && !scene.appearance->images.empty())
    report["images"] = scene.appearance->images.size();
  if (!joints.empty()) report["joint_count"] = joints.size();
  if (!joints.empty()) report["joints"] = joints;
  if (npt::has_skeleton(scene)) {
    const npt::Motion motion = npt::motion_of(scene, scene.clips.empty() ? nullptr : &scene.clips.front(), file);
    describe_skeleton(report, motion, joints.empty());
  }
  if (!clips.empty()) report["clips"] = clips;
}

Report describe_mesh(const fs::path& file) {
  const bool is_scene = formats::is_scene(file);
  const npt::Scene scene = is_scene ? formats::read_scene(file) : npt::Scene{};
  if (is_scene && scene.shown.empty() && npt::has_skeleton(scene)) {
    Report report{{"file", file.string()}, {"kind", scene.clips.empty() ? "skeleton" : "skeleton and clips"}};
    describe_scene(report, scene, file.string());
    return report;
  }
  const npt::Mesh mesh = is_scene ? npt::ScenePoser(scene, file.string()).mesh() : formats::read_mesh(file);
  Report report{{"file", file.string()}, {"kind", mesh.face_count() == 0 ? "points" : "mesh"}};
  report["vertices"] = mesh.vertex_count();
  report["faces"] = mesh.face_count();
  describe_topology(report, mesh);
  describe_box(report, mesh);
  describe_attributes(report, mesh);
  if (is_scene) describe_scene(report, scene, file.string());
  return report;
}

Report describe_bvh(const fs::path& file) {
  const npt::Motion motion = formats::read_bvh_motion(file);
  Report report{{"file", file.string()}, {"kind", "skeleton and clip"}};
  describe_skeleton(report, motion, true);
  Report clip{{"name", motion.clip.name}, {"length", in_units(motion.clip.length(), "s")}};
  describe_clip(clip, motion, npt::joint_roles(motion));
  report["clips"] = Report::array({clip});
  return report;
}

/// The roles of a file's joints, as --bone-map reads them.
std::string bones_of(const fs::path& file, const fs::path& map) {
  const npt::Scene scene = formats::is_bvh(file) ? npt::Scene{} : formats::read_scene(file);
  const npt::Motion motion =
      formats::is_bvh(file)
          ? formats::read_bvh_motion(file)
          : npt::motion_of(scene, scene.clips.empty() ? nullptr : &scene.clips.front(), file.string());
  npt::JointRoles roles = npt::joint_roles(motion);
  if (!map.empty()) roles = npt::parse_bone_map(npt::read_file(map), motion, roles, map.string());
  return npt::format_bone_map(motion, roles);
}

std::uint64_t dimension(const npt::SafetensorsFile& file, const char* tensor, std::size_t i) {
  const npt::FileTensor* t = file.find(tensor);
  return t != nullptr && i < t->shape.size() ? t->shape[i] : 0;
}

bool has_all(const npt::SafetensorsFile& file, std::initializer_list<const char*> tensors) {
  return std::ranges::all_of(tensors, [&](const char* name) { return file.find(name) != nullptr; });
}

/// NaN and infinity in tensors of floating point.
std::size_t count_non_finite(const npt::SafetensorsFile& file) {
  std::size_t count = 0;
  for (const npt::FileTensor& tensor : file.tensors())
    if (std::string_view(npt::to_string(tensor.dtype)).find('F') != std::string_view::npos)
      for (double v : npt::to_double(tensor, npt::NonFinite::keep)) count += std::isfinite(v) ? 0U : 1U;
  return count;
}

/// The inputs of the network that the weights are of, where they say which one.
void describe_inputs(Report& report, const npt::SafetensorsFile& file) {
  try {
    const auto& network = npt::find_network<npt::AllNetworks, npt::DefaultExecutor>(file);
    report["inputs"] = npt::input_names(network.program->inputs);
  } catch (const npt::Error&) {  // a network of somebody's own, or metadata that are missing: described without
  }
}

void describe_kind(Report& report, const npt::SafetensorsFile& file) {
  if (has_all(file, {"encoder.conv1.weight", "encoder.conv3.weight", "decoder.conv4.weight"})) {
    const std::string* net = file.find_metadata("net");
    const bool correspondence = net != nullptr && *net == "correspondence";
    report["kind"] = correspondence ? "weights of a correspondence network" : "weights of a pose transfer network";
    report[correspondence ? "width" : "bottleneck"] = dimension(file, "encoder.conv3.weight", 0);
    describe_inputs(report, file);
    if (correspondence) return;
    for (const auto& [prefix, what] :
         {std::pair("correspondence/", "correspondence network"), std::pair("fit_bias/", "bias of fits")})
      if (!file.part(prefix).tensors().empty()) report["body estimation"].push_back(what);
    for (const char* key : {"order", "feature", "output_scale"}) {
      const std::string* value = file.find_metadata(key);
      report[key] = value != nullptr ? *value : "not stated: has to be given where the weights are used";
    }
  } else if (has_all(file, {"v_template", "shapedirs", "weights", "parents", "f"})) {
    report["kind"] = "body";
    report["vertices"] = dimension(file, "v_template", 0);
    report["triangles"] = dimension(file, "f", 0);
    report["joints"] = dimension(file, "parents", 0);
    report["shape_directions"] = dimension(file, "shapedirs", 2);
    report["pose_corrections"] = file.find("posedirs") != nullptr;
  } else {
    report["kind"] = "tensors";
  }
}

Report describe_tensors(const fs::path& path) {
  const npt::SafetensorsFile file = npt::SafetensorsFile::read(path);
  Report report{{"file", path.string()}};
  describe_kind(report, file);
  std::uint64_t numbers = 0;
  Report tensors = Report::array();
  for (const npt::FileTensor& tensor : file.tensors()) {
    numbers += tensor.count();
    tensors.push_back(
        {{"name", tensor.name}, {"type", npt::to_string(tensor.dtype)}, {"shape", npt::to_string(tensor.shape)}});
  }
  report["numbers"] = numbers;
  if (const std::size_t bad = count_non_finite(file); bad != 0) report["nan_or_infinite"] = bad;
  for (const auto& [key, value] : file.metadata()) report["metadata"][key] = value;
  if (!tensors.empty()) report["tensors"] = tensors;
  return report;
}

/// Whether a file has weights or a body in it, whatever its name: a header's length and the '{' that it begins with. A
/// mesh file begins with text, which read as a length is beyond any file's.
bool holds_tensors(const fs::path& path) {
  if (program::extension_of(path) == ".safetensors") return true;
  std::error_code code;
  if (!fs::is_regular_file(path, code)) return false;  // opening a pipe could block
  std::uint64_t length = 0;
  std::array<char, sizeof length + 1> begin{};
  std::ifstream file(path, std::ios::binary);
  if (!file.read(begin.data(), begin.size())) return false;
  std::memcpy(&length, begin.data(), sizeof length);
  return length <= npt::SafetensorsFile::max_header && begin.back() == '{';
}

/// The metadata, too, on a line each.
void print_for_people(const Report& report) {
  Report shown = report;
  shown.erase("border_edges");  // stands in "surface"
  if (report.contains("metadata")) {
    shown["metadata"] = Report::array();
    for (const auto& [key, value] : report["metadata"].items())
      shown["metadata"].push_back({{"key", key + ":"}, {"value", value}});
  }
  program::print(std::cout, shown);
}

void run(const Options& options) {
  if (options.bones) {
    for (const fs::path& file : options.files) std::cout << bones_of(file, options.bone_map);
    return;
  }
  Report reports = Report::array();
  for (const fs::path& file : options.files)
    reports.push_back(holds_tensors(file)     ? describe_tensors(file)
                      : formats::is_bvh(file) ? describe_bvh(file)
                                              : describe_mesh(file));
  if (options.json) {
    std::cout << reports.dump(2, ' ', false, Report::error_handler_t::replace) << '\n';
    return;
  }
  for (std::size_t i = 0; i < reports.size(); ++i) {
    if (i > 0) std::cout << '\n';
    print_for_people(reports[i]);
  }
}

void add(CLI::App& command) {
  auto o = std::make_shared<Options>();
  command
      .add_option(
          "FILE", o->files,
          "Describe these: meshes (.ply, .obj, .glb, .fbx, ...), skeletons and clips (.bvh, and files without a "
          "mesh), weights and body models (safetensors, under any name)")
      ->required();
  command.add_flag("--json", o->json, "Print JSON: an array with an object for each file");
  auto* bones = command.add_flag(
      "--bones", o->bones, "Print a bone map: which joint is the hips, a hand, ..., with a confidence from 0 to 1");
  command.add_option("--bone-map", o->bone_map, "Read a corrected bone map, whose lines go before what is found")
      ->needs(bones);
  command.callback([o] { run(*o); });
}

const program::Subcommand registered("info", "Say what a mesh, skeleton, clip, weights file or body model holds", add);

}  // namespace info_command
