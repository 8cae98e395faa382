/// Reads glTF 2.0, binary or as text, into a Scene; gltf.hpp says what is kept. The project's own JSON reader and no
/// library for glTF: tinygltf 2.7 as Debian builds it refuses every Draco file, hands image loaders ranges that it
/// hasn't checked, and each of its numbers would have to be checked again.
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/quaternion.hpp>
#include <npt/base/vec3.hpp>
#include <npt/config.hpp>
#include <npt/io/gltf_appearance.hpp>
#include <npt/io/gltf_clip_reader.hpp>
#include <npt/io/gltf_document.hpp>
#include <npt/io/gltf_mesh_reader.hpp>
#include <npt/io/json_tree.hpp>
#include <npt/io/text.hpp>
#include <npt/scene/scene.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

namespace internal {

/// `Draco`: with_draco. As a parameter it gives units with and without libdraco two classes, which one program may mix.
template <bool Draco>
class GltfReader {
 public:
  GltfReader(std::string_view file, const std::string& name, const std::optional<std::filesystem::path>& folder)
      : document_(file, name, folder), folder_(folder) {}

  /// What was repaired; empty: nothing.
  const std::string& note() const { return note_; }

  Scene read() {
    check_extensions();
    scene_.appearance = GltfAppearanceReader(document_, folder_).read();
    const std::size_t materials = scene_.appearance == nullptr ? 0 : scene_.appearance->materials.size();
    scene_.meshes = GltfMeshReader<Draco>(document_, materials).read();
    read_nodes();
    read_bones();
    read_skins();
    read_shown();
    check_instances();
    scene_.clips = GltfClipReader(document_, scene_).read();
    return std::move(scene_);
  }

 private:
  using Item = GltfItem;

  /// What a file may ask for and npt can do without understanding it: how surfaces look, and how numbers are packed.
  void check_extensions() const {
    static constexpr std::array<std::string_view, 8> understood{
        "KHR_mesh_quantization", "EXT_meshopt_compression", "KHR_meshopt_compression", "KHR_texture_transform",
        "KHR_texture_basisu",    "KHR_lights_punctual",     "EXT_texture_webp",        "EXT_texture_avif"};
    for (const Item& item : document_.items(document_.root(), "extensionsRequired")) {
      const std::string& name = item.value->text;
      const bool known = std::ranges::find(understood, name) != understood.end() || name.starts_with("KHR_materials_");
#ifdef NPT_WITH_DRACO
      if (name == "KHR_draco_mesh_compression") continue;
#else
      if (name == "KHR_draco_mesh_compression")
        document_.fail(item.place, name,
                       "a file without it: this npt was built without libdraco (Debian: libdraco-dev)");
#endif
      if (!known)
        document_.fail(item.place, in_quotes(name), "extensions that npt knows: Blender exports the file without it");
    }
  }

  static Vec3d vector(const std::vector<double>& v) { return {v[0], v[1], v[2]}; }

  void read_nodes() {
    const std::vector<Item> items = document_.objects(document_.root(), "nodes");
    scene_.nodes.resize(items.size());
    for (std::size_t n = 0; n < items.size(); ++n) {
      const Item& item = items[n];
      SceneNode& node = scene_.nodes[n];
      node.name = document_.text(item, "name");
      if (const auto v = document_.reals(item, "translation", 3); !v.empty()) node.place.translation = vector(v);
      if (const auto v = document_.reals(item, "scale", 3); !v.empty()) node.place.scale = vector(v);
      if (const auto v = document_.reals(item, "rotation", 4); !v.empty()) {
        const double length = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2] + v[3] * v[3]);
        if (!(std::abs(length - 1) < 0.1))
          document_.fail(item.place + ".rotation", "a quaternion of length " + std::to_string(length), "length 1");
        node.place.rotation = normalised(Quaternion{v[0], v[1], v[2], v[3]});
      }
      if (const auto m = document_.reals(item, "matrix", 16); !m.empty())
        node.matrix = affine(m.data(), item.place + ".matrix");
      node.mesh = document_.index(item, "mesh", scene_.meshes.size(), "meshes").value_or(no_item);
      node.weights = document_.reals(item, "weights", 0);
      const std::size_t targets = node.mesh == no_item ? 0 : scene_.meshes[node.mesh].weights.size();
      if (!node.weights.empty() && node.weights.size() != targets)
        document_.fail(item.place + ".weights", std::to_string(node.weights.size()) + " weights",
                       std::to_string(targets) + ", one for each morph target");
      for (const Item& child : document_.items(item, "children")) {
        const std::size_t c = document_.index(child, items.size(), "nodes");
        if (scene_.nodes[c].parent != no_item)
          document_.fail(child.place, "node " + std::to_string(c) + " as a child of two nodes", "one parent");
        scene_.nodes[c].parent = n;
      }
    }
    check_circles(items);
  }

  /// VRM's humanoid bones: an object of them in VRM 1, a list in VRM 0. What isn't as it should be is passed over: nothing
  /// but names of joints depends on it.
  void read_bones() {
    const JsonValue* extensions = document_.root().value->find("extensions");
    for (const char* version : {"VRMC_vrm", "VRM"}) {
      const JsonValue* vrm = extensions == nullptr ? nullptr : extensions->find(version);
      const JsonValue* humanoid = vrm == nullptr ? nullptr : vrm->find("humanoid");
      const JsonValue* bones = humanoid == nullptr ? nullptr : humanoid->find("humanBones");
      if (bones == nullptr) continue;
      for (std::size_t i = 0; i < bones->items.size(); ++i) {
        const JsonValue* name = bones->items[i].find("bone");
        if (i < bones->keys.size())
          name_bone(bones->items[i], bones->keys[i]);
        else if (name != nullptr)
          name_bone(bones->items[i], name->text);
      }
      return;
    }
  }
  void name_bone(const JsonValue& bone, const std::string& name) {
    const JsonValue* node = bone.find("node");
    const auto number = node == nullptr ? std::nullopt : node->whole();
    if (number && *number < scene_.nodes.size()) scene_.nodes[static_cast<std::size_t>(*number)].bone = name;
  }

  void check_circles(const std::vector<Item>& items) const {
    std::vector<std::uint8_t> state(items.size());  // 0 not seen, 1 on the way up, 2 ends at a root
    for (std::size_t n = 0; n < items.size(); ++n) {
      std::size_t at = n;
      for (; at != no_item && state[at] == 0; at = scene_.nodes[at].parent) state[at] = 1;
      if (at != no_item && state[at] == 1) document_.fail(items[at].place, "a node that is its own ancestor", "a tree");
      for (at = n; at != no_item && state[at] == 1; at = scene_.nodes[at].parent) state[at] = 2;
    }
  }

  /// 16 numbers, column by column.
  template <class Number>
  Affine affine(const Number* m, const std::string& place) const {
    const auto column = [&](int c) {
      return Vec3d{static_cast<double>(m[4 * c]), static_cast<double>(m[4 * c + 1]), static_cast<double>(m[4 * c + 2])};
    };
    for (int c = 0; c < 4; ++c)
      if (const double last = static_cast<double>(m[4 * c + 3]); !(std::abs(last - (c == 3 ? 1 : 0)) < 1e-5))
        document_.fail(place, "a last row with " + std::to_string(last), "0 0 0 1");
    return {Matrix3::from_columns(column(0), column(1), column(2)), column(3)};
  }

  /// Some exporters write a last row of zeros, and other programs never look at it.
  Affine inverse_bind(float* m, const std::string& place) {
    if (m[3] == 0 && m[7] == 0 && m[11] == 0 && m[15] == 0) {
      m[15] = 1;
      if (note_.empty()) note_ = place + ": the last row is 0 0 0 0, taken as 0 0 0 1";
    }
    return affine(m, place);
  }

  void read_skins() {
    for (const Item& item : document_.objects(document_.root(), "skins")) {
      Skin skin{.name = document_.text(item, "name")};
      for (const Item& joint : document_.items(item, "joints"))
        skin.joints.push_back(document_.index(joint, scene_.nodes.size(), "nodes"));
      if (skin.joints.empty()) document_.fail(item.place, "no joints", "at least one");
      skin.inverse_binds.resize(skin.joints.size());
      if (const auto number = document_.index(item, "inverseBindMatrices", document_.accessor_count(), "accessors")) {
        std::vector<float> values = document_.floats(*number, 16, "inverse bind matrices");
        if (values.size() / 16 < skin.joints.size())
          document_.fail(item.place, std::to_string(values.size() / 16) + " inverse bind matrices",
                         std::to_string(skin.joints.size()) + ", one for each joint");
        for (std::size_t j = 0; j < skin.joints.size(); ++j)
          skin.inverse_binds[j] =
              inverse_bind(&values[16 * j], item.place + ".inverseBindMatrices, joint " + std::to_string(j));
      }
      scene_.skins.push_back(std::move(skin));
    }
    const std::vector<Item> nodes = document_.objects(document_.root(), "nodes");
    for (std::size_t n = 0; n < nodes.size(); ++n) {
      scene_.nodes[n].skin = document_.index(nodes[n], "skin", scene_.skins.size(), "skins").value_or(no_item);
      if (scene_.nodes[n].mesh == no_item) scene_.nodes[n].skin = no_item;
    }
  }

  /// The nodes of the scene that is shown, each before its children.
  void read_shown() {
    const std::vector<Item> scenes = document_.objects(document_.root(), "scenes");
    std::vector<std::vector<std::size_t>> children(scene_.nodes.size());
    std::vector<std::size_t> open;
    const std::vector<Item> nodes = document_.objects(document_.root(), "nodes");
    for (std::size_t n = 0; n < nodes.size(); ++n)
      for (const Item& child : document_.items(nodes[n], "children"))
        children[n].push_back(document_.index(child, nodes.size(), "nodes"));
    const std::size_t shown = document_.index(document_.root(), "scene", scenes.size(), "scenes").value_or(0);
    if (scenes.empty()) {
      for (std::size_t n = 0; n < scene_.nodes.size(); ++n)
        if (scene_.nodes[n].parent == no_item) open.push_back(n);
    } else {
      for (const Item& item : document_.items(scenes[shown], "nodes"))
        open.push_back(document_.index(item, scene_.nodes.size(), "nodes"));
    }
    std::vector<bool> seen(scene_.nodes.size());
    std::reverse(open.begin(), open.end());
    while (!open.empty()) {
      const std::size_t n = open.back();
      open.pop_back();
      if (seen[n]) continue;
      seen[n] = true;
      if (scene_.nodes[n].mesh != no_item) scene_.shown.push_back(n);
      open.insert(open.end(), children[n].rbegin(), children[n].rend());
    }
  }

  /// What only a node brings together: a mesh's joints and its skin; points beside surfaces.
  void check_instances() {
    bool faces = false;
    for (const std::size_t n : scene_.shown) {
      const SceneMesh& mesh = scene_.meshes[scene_.nodes[n].mesh];
      for (const VertexBlock& block : mesh.blocks) {
        document_.spend(block.positions.size() * (3 + block.influences), "nodes[" + std::to_string(n) + "]");
        if (scene_.nodes[n].skin == no_item) continue;
        const std::size_t joints = scene_.skins[scene_.nodes[n].skin].joints.size();
        for (std::size_t i = 0; i < block.joints.size(); ++i)
          if (block.joints[i] >= joints)
            document_.fail(
                "nodes[" + std::to_string(n) + "].mesh",
                "joint " + std::to_string(block.joints[i]) + " at vertex " + std::to_string(i / block.influences),
                "one of the skin's " + std::to_string(joints) + " joints");
      }
      for (const ScenePrimitive& primitive : mesh.primitives) {
        document_.spend(3 * primitive.triangles.size(), "nodes[" + std::to_string(n) + "]");
        faces = faces || !primitive.triangles.empty();
      }
    }
    if (faces)
      std::erase_if(scene_.shown, [&](std::size_t n) {
        return std::ranges::all_of(scene_.meshes[scene_.nodes[n].mesh].primitives,
                                   [](const ScenePrimitive& p) { return p.triangles.empty(); });
      });
  }

  GltfDocument document_;
  std::optional<std::filesystem::path> folder_;
  Scene scene_;
  std::string note_;
};

}  // namespace internal

/// A scene from the bytes of a glTF file, binary or text. `name` stands in the messages of errors; `folder`: where
/// files that it names are looked for; nothing: they are refused. `notes` gets a sentence for what was repaired.
template <bool Draco = internal::with_draco>
Scene parse_gltf(std::string_view file, const std::string& name,
                 const std::optional<std::filesystem::path>& folder = {}, std::vector<std::string>* notes = nullptr) {
  internal::GltfReader<Draco> reader(file, name, folder);
  Scene scene = reader.read();
  if (notes != nullptr && !reader.note().empty()) notes->push_back(name + ": " + reader.note());
  return scene;
}

}  // namespace npt::inline NPT_ABI
