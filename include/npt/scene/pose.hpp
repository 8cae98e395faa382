/// A scene as one mesh: all its primitives, in the pose that its nodes stand in or at a time of a clip.
///   ScenePoser poser(scene);
///   Mesh mesh = poser.mesh();                                 as the scene stands
///   poser.positions(&clip, 0.5, mesh.coordinates());          the same vertices half a second into a clip
/// Each node that shows a mesh is a part (tag "o", its name); materials are tags "usemtl". Morph targets are added, and
/// linear blend skinning by_joints a vertex by its joints alone, as glTF wants it; other meshes are moved by their node.
/// Numerics  in double, rounded once
/// Errors    npt::Error for a scene that shows no vertices, and for points that leave the range of a float
/// Source    glTF 2.0 specification, sections 3.5.3 and 3.7.3
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/error.hpp>
#include <npt/base/vec3.hpp>
#include <npt/config.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/normals.hpp>
#include <npt/mesh/skinning.hpp>
#include <npt/mesh/validate.hpp>
#include <npt/scene/clip.hpp>
#include <npt/scene/motion.hpp>
#include <npt/scene/scene.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// Node places and morph weights at a moment.
struct ScenePose {
  std::vector<Affine> worlds;                ///< [nodes] from the node's to the scene's coordinates
  std::vector<std::vector<double>> weights;  ///< [nodes] of the morph targets of its mesh, or empty
};

namespace internal {

/// One line, never empty.
inline std::string tag_text(const std::string& name, const std::string& otherwise) {
  std::string text = name.empty() ? otherwise : name;
  for (char& c : text)
    if (static_cast<unsigned char>(c) < 0x20) c = '_';
  return text;
}

}  // namespace internal

class ScenePoser {
 public:
  /// Keeps a reference. `name` stands in the messages of errors.
  explicit ScenePoser(const Scene& scene, std::string name = "scene") : scene_(scene), name_(std::move(name)) {
    std::vector<bool> placed(scene.nodes.size());
    for (std::size_t n = 0; n < scene.nodes.size(); ++n) {
      const std::size_t before = order_.size();
      for (std::size_t m = n; m != no_item && !placed[m]; m = scene.nodes[m].parent) {
        placed[m] = true;
        order_.push_back(m);
      }
      std::reverse(order_.begin() + static_cast<std::ptrdiff_t>(before), order_.end());
    }
    for (const std::size_t n : scene.shown)
      for (const VertexBlock& block : scene.meshes[scene.nodes[n].mesh].blocks) vertices_ += block.positions.size();
  }

  std::size_t vertex_count() const noexcept { return vertices_; }

  /// Where the nodes are; `clip` nullptr: as the scene stands.
  ScenePose pose(const Clip* clip = nullptr, double time = 0) const {
    std::vector<NodePlace> places(scene_.nodes.size());
    ScenePose pose{std::vector<Affine>(places.size()), std::vector<std::vector<double>>(places.size())};
    for (std::size_t n = 0; n < places.size(); ++n) {
      const SceneNode& node = scene_.nodes[n];
      places[n] = node.place;
      if (node.mesh != no_item)
        pose.weights[n] = node.weights.empty() ? scene_.meshes[node.mesh].weights : node.weights;
    }
    if (clip != nullptr)
      for (const ClipChannel& channel : clip->channels) move(channel, time, places[channel.node], pose);
    for (const std::size_t n : order_) {
      const SceneNode& node = scene_.nodes[n];
      const Affine own = node.matrix ? *node.matrix : places[n].affine();
      pose.worlds[n] = node.parent == no_item ? own : pose.worlds[node.parent] * own;
    }
    return pose;
  }

  /// The scene's vertices at a moment. xyz: [V, 3]; normals: [V] or empty
  void positions(const Clip* clip, double time, std::span<float> xyz, std::span<Vec3f> normals = {}) const {
    const ScenePose now = pose(clip, time);
    std::size_t first = 0;
    for (const std::size_t n : scene_.shown)
      for (const VertexBlock& block : scene_.meshes[scene_.nodes[n].mesh].blocks) {
        const std::size_t count = block.positions.size();
        place(block, n, now, xyz.subspan(3 * first, 3 * count),
              normals.empty() ? normals : normals.subspan(first, count));
        first += count;
      }
    for (std::size_t i = 0; i < xyz.size(); ++i)
      if (!std::isfinite(xyz[i]))
        throw Error({.file = name_,
                     .place = "vertex " + std::to_string(i / 3),
                     .found = std::to_string(xyz[i]),
                     .expected = "a finite number after its nodes and joints moved it"});
  }

  /// The scene as it stands, with all that a mesh can carry.
  Mesh mesh() const {
    Mesh mesh;
    if (vertices_ == 0) throw Error({.file = name_, .found = "a scene that shows no mesh", .expected = "vertices"});
    mesh.positions.resize(vertices_);
    mesh.appearance = scene_.appearance;
    add_faces(mesh);
    add_texcoords(mesh);
    add_properties(mesh);
    const auto has_normals = [](const VertexBlock& block) { return !block.normals.empty(); };
    const bool any = any_block(has_normals);
    if (any) mesh.normals.resize(vertices_);
    positions(nullptr, 0, mesh.coordinates(), mesh.normals);
    if (any) complete_normals(mesh);
    validate(mesh, name_);
    return mesh;
  }

 private:
  template <class Has>
  bool any_block(Has&& has) const {
    for (const std::size_t n : scene_.shown)
      for (const VertexBlock& block : scene_.meshes[scene_.nodes[n].mesh].blocks)
        if (has(block)) return true;
    return false;
  }
  /// Calls f(block, first vertex) for each block that is shown.
  template <class F>
  void each_block(F&& f) const {
    std::size_t first = 0;
    for (const std::size_t n : scene_.shown)
      for (const VertexBlock& block : scene_.meshes[scene_.nodes[n].mesh].blocks) {
        f(block, first);
        first += block.positions.size();
      }
  }

  static void move(const ClipChannel& channel, double time, NodePlace& place, ScenePose& pose) {
    if (channel.path == ChannelPath::weights)
      channel.sample(time, pose.weights[channel.node]);
    else
      set_from(channel, time, place);
  }

  void place(const VertexBlock& block, std::size_t node, const ScenePose& now, std::span<float> xyz,
             std::span<Vec3f> normals) const {
    const std::size_t skin_number = scene_.nodes[node].skin;
    const bool by_joints = skin_number != no_item && block.influences > 0;
    std::vector<Affine> joints;
    if (by_joints) {
      const Skin& skin = scene_.skins[skin_number];
      joints.reserve(skin.joints.size());
      for (std::size_t j = 0; j < skin.joints.size(); ++j)
        joints.push_back(now.worlds[skin.joints[j]] * skin.inverse_binds[j]);
    }
    const std::vector<double>& weights = now.weights[node];
    for (std::size_t v = 0; v < block.positions.size(); ++v) {
      Vec3d p = block.positions[v].as<double>();
      Vec3d normal = block.normals.empty() ? Vec3d{} : block.normals[v].as<double>();
      for (std::size_t t = 0; t < block.targets.size(); ++t) {
        const MorphTarget& target = block.targets[t];
        if (t >= weights.size() || weights[t] == 0) continue;
        if (!target.positions.empty()) p += target.positions[v].as<double>() * weights[t];
        if (!target.normals.empty()) normal += target.normals[v].as<double>() * weights[t];
      }
      const std::size_t first = v * block.influences;
      const Affine motion = by_joints
                                ? blended_motion(std::span(block.joints).subspan(first, block.influences),
                                                 std::span(block.weights).subspan(first, block.influences), joints)
                                : now.worlds[node];
      const Vec3f moved = motion(p).as<float>();
      xyz[3 * v] = moved.x, xyz[3 * v + 1] = moved.y, xyz[3 * v + 2] = moved.z;
      if (!normals.empty()) normals[v] = normalised(cofactors(motion.linear) * normal).as<float>();
    }
  }

  void add_faces(Mesh& mesh) const {
    std::size_t first = 0;
    const std::string plain = "material";
    for (const std::size_t n : scene_.shown) {
      const SceneNode& node = scene_.nodes[n];
      const SceneMesh& shown = scene_.meshes[node.mesh];
      std::vector<std::size_t> starts;
      for (const VertexBlock& block : shown.blocks) {
        starts.push_back(first);
        first += block.positions.size();
      }
      bool named = false;
      for (const ScenePrimitive& primitive : shown.primitives) {
        if (primitive.triangles.empty()) continue;
        if (!named)
          mesh.tags.push_back(
              {mesh.face_count(), "o",
               internal::tag_text(node.name.empty() ? shown.name : node.name, "node_" + std::to_string(n))});
        named = true;
        mesh.tags.push_back({mesh.face_count(), "usemtl",
                             primitive.material != no_item && scene_.appearance != nullptr
                                 ? scene_.appearance->materials[primitive.material].label
                                 : plain});
        if (mesh.face_start.empty()) mesh.face_start.push_back(0);
        for (const Triangle& triangle : primitive.triangles) {
          for (const std::uint32_t v : triangle)
            mesh.corners.push_back(static_cast<std::uint32_t>(starts[primitive.block] + v));
          mesh.face_start.push_back(mesh.corners.size());
        }
      }
    }
  }

  void add_texcoords(Mesh& mesh) const {
    if (mesh.corners.empty() || !any_block([](const VertexBlock& b) { return !b.texcoords.empty(); })) return;
    mesh.texcoord_size = 2;
    mesh.texcoords_from_top = true;
    mesh.texcoords.resize(vertices_);
    std::vector<bool> has(vertices_);
    each_block([&](const VertexBlock& block, std::size_t first) {
      if (block.texcoords.empty()) return;
      for (std::size_t v = 0; v < block.positions.size(); ++v) {
        mesh.texcoords[first + v] = {block.texcoords[0][v][0], block.texcoords[0][v][1], 0};
        has[first + v] = true;
      }
    });
    mesh.corner_texcoord = mesh.corners;
    for (std::uint32_t& corner : mesh.corner_texcoord)
      if (!has[corner]) corner = no_index;
  }

  template <class Has, class Value>
  void add_property(Mesh& mesh, const std::string& name, double otherwise, Has&& has, Value&& value) const {
    if (!any_block(has)) return;
    mesh.properties.push_back({name, "float", std::vector<double>(vertices_, otherwise)});
    std::vector<double>& values = mesh.properties.back().values;
    each_block([&](const VertexBlock& block, std::size_t first) {
      if (!has(block)) return;
      for (std::size_t v = 0; v < block.positions.size(); ++v) values[first + v] = static_cast<double>(value(block, v));
    });
  }
  void add_properties(Mesh& mesh) const {
    const char* colours[] = {"red", "green", "blue", "alpha"};
    for (std::size_t c = 0; c < 4; ++c)
      add_property(
          mesh, colours[c], 1, [c](const VertexBlock& b) { return !b.colours.empty() && (c < 3 || b.with_alpha); },
          [c](const VertexBlock& b, std::size_t v) { return b.colours[v][c]; });
    std::size_t sets = 0;
    each_block([&](const VertexBlock& block, std::size_t) { sets = std::max(sets, block.texcoords.size()); });
    for (std::size_t set = 1; set < sets; ++set)
      for (std::size_t c = 0; c < 2; ++c)
        add_property(
            mesh, "texcoord" + std::to_string(set) + (c == 0 ? "_u" : "_v"), 0,
            [set](const VertexBlock& b) { return b.texcoords.size() > set; },
            [set, c](const VertexBlock& b, std::size_t v) { return b.texcoords[set][v][c]; });
    add_others(mesh);
  }
  /// What npt doesn't know: "_NAME", or where it has several numbers "_NAME.x" and so on.
  void add_others(Mesh& mesh) const {
    std::vector<std::pair<std::string, std::size_t>> known;
    each_block([&](const VertexBlock& block, std::size_t) {
      for (const VertexAttribute& other : block.others) {
        const auto same = [&](const auto& k) { return k.first == other.name; };
        const auto found = std::find_if(known.begin(), known.end(), same);
        if (found == known.end())
          known.emplace_back(other.name, other.width);
        else
          found->second = std::max(found->second, other.width);
      }
    });
    for (const auto& [name, width] : known)
      for (std::size_t c = 0; c < width; ++c) {
        const auto in = [&name = name, c](const VertexBlock& b) {
          const auto same = [&](const VertexAttribute& other) { return other.name == name && c < other.width; };
          const auto found = std::find_if(b.others.begin(), b.others.end(), same);
          return found == b.others.end() ? nullptr : &*found;
        };
        add_property(
            mesh, width == 1 ? name : name + '.' + "xyzw"[c], 0, [&](const VertexBlock& b) { return in(b) != nullptr; },
            [&](const VertexBlock& b, std::size_t v) { return in(b)->values[v * in(b)->width + c]; });
      }
  }

  /// Blocks that came without normals get those of their faces.
  void complete_normals(Mesh& mesh) const {
    std::vector<Vec3f> own;
    each_block([&](const VertexBlock& block, std::size_t first) {
      if (!block.normals.empty()) return;
      if (own.empty()) own = vertex_normals(mesh);
      std::copy_n(own.begin() + static_cast<std::ptrdiff_t>(first), block.positions.size(),
                  mesh.normals.begin() + static_cast<std::ptrdiff_t>(first));
    });
  }

  const Scene& scene_;
  std::string name_;
  std::vector<std::size_t> order_;  ///< nodes, parents before children
  std::size_t vertices_ = 0;
};

/// All clips' names, for messages: "Walk", "Run".
inline std::string clip_names(const Scene& scene) {
  std::string names;
  for (const Clip& clip : scene.clips) names += (names.empty() ? "'" : ", '") + clip.name + "'";
  return names.empty() ? "none" : names;
}

/// The clip of a name; also by what stands behind the last '|' ("Armature|Walk"), where one alone has it.
/// Errors    npt::Error that lists the clips
inline const Clip& find_clip(const Scene& scene, const std::string& name, const std::string& file) {
  const Clip* found = nullptr;
  std::size_t count = 0;
  for (const Clip& clip : scene.clips) {
    if (clip.name == name) return clip;
    if (clip.name.substr(clip.name.rfind('|') + 1) != name) continue;
    found = &clip;
    ++count;
  }
  if (count != 1)
    throw Error({.file = file,
                 .found = (count == 0 ? "no clip '" : "several clips '") + name + "'",
                 .expected = "one of " + clip_names(scene)});
  return *found;
}

}  // namespace npt::inline NPT_ABI
