/// Writing a Scene as binary glTF 2.0. Everything stands in the one file: meshes, skins, clips, materials as they came,
/// images byte for byte.
/// Errors    npt::Error for names that are no UTF-8 and for 4 GiB or more
/// Source    glTF 2.0 specification; what it asks for is checked with Khronos' validator in the tests
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/error.hpp>
#include <npt/base/quaternion.hpp>
#include <npt/base/vec3.hpp>
#include <npt/config.hpp>
#include <npt/io/glb.hpp>
#include <npt/io/json.hpp>
#include <npt/io/text.hpp>
#include <npt/scene/scene.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

namespace internal {

/// JSON objects and lists as text: commas where they belong.
class JsonText {
 public:
  explicit JsonText(const std::string& name) : name_(name) {}

  JsonText& open(char bracket) {
    comma();
    text_ += bracket;
    fresh_ = true;
    return *this;
  }
  JsonText& close(char bracket) {
    text_ += bracket;
    fresh_ = false;
    return *this;
  }
  JsonText& key(std::string_view key) {
    comma();
    quoted(key);
    text_ += ':';
    fresh_ = true;
    return *this;
  }
  JsonText& string(std::string_view value) {
    comma();
    quoted(value);
    return *this;
  }
  /// JSON that is ready.
  JsonText& raw(std::string_view json) {
    comma();
    text_ += json;
    return *this;
  }
  template <class Number>
  JsonText& number(Number value) {
    comma();
    append_number(text_, value);
    return *this;
  }
  template <std::unsigned_integral Number>
  JsonText& member(std::string_view name, Number value) {
    return key(name).number(std::uint64_t{value});
  }
  JsonText& member(std::string_view name, std::string_view value) { return key(name).string(value); }
  template <class Values>
  JsonText& list(const Values& values) {
    open('[');
    for (const auto& value : values) {
      if constexpr (std::is_integral_v<std::remove_cvref_t<decltype(value)>>)
        number(std::uint64_t{value});
      else if constexpr (std::is_convertible_v<decltype(value), std::string_view>)
        string(value);
      else
        number(static_cast<double>(value));
    }
    return close(']');
  }
  std::string take() { return std::move(text_); }

 private:
  void comma() {
    if (!fresh_) text_ += ',';
    fresh_ = false;
  }
  void quoted(std::string_view value) {
    if (!append_json_string(text_, value))
      throw Error({.file = name_, .place = in_quotes(value), .found = "bytes that are no UTF-8", .expected = "UTF-8"});
  }
  const std::string& name_;
  std::string text_;
  bool fresh_ = true;
};

class GltfWriter {
 public:
  GltfWriter(const Scene& scene, const std::string& name)
      : scene_(scene), name_(name), accessors_(name), views_(name), json_(name) {}

  std::string write() {
    accessors_.open('[');
    views_.open('[');
    json_.open('{').key("asset").open('{').member("version", "2.0").member("generator", "npt " NPT_VERSION);
    json_.close('}');
    write_scene();
    if (!scene_.meshes.empty()) write_meshes();
    if (!scene_.skins.empty()) write_skins();
    write_clips();
    if (scene_.appearance != nullptr) write_appearance(*scene_.appearance);
    accessors_.close(']');
    views_.close(']');
    if (accessor_count_ > 0) json_.key("accessors").raw(accessors_.take());
    if (view_count_ > 0) {
      json_.key("bufferViews").raw(views_.take());
      json_.key("buffers").open('[').open('{').member("byteLength", bytes_.size()).close('}').close(']');
    }
    json_.close('}');
    return format_glb(json_.take(), bytes_, name_);
  }

 private:
  static constexpr unsigned vertex_target = 34962, index_target = 34963;

  // Bytes.

  template <class T>
  void append(T value) {
    auto raw = std::bit_cast<std::array<char, sizeof(T)>>(value);
    if constexpr (std::endian::native == std::endian::big) std::reverse(raw.begin(), raw.end());
    bytes_.append(raw.data(), raw.size());
  }
  std::size_t begin_view() {
    bytes_.append((4 - bytes_.size() % 4) % 4, '\0');
    return bytes_.size();
  }
  std::size_t end_view(std::size_t start, unsigned target = 0) {
    views_.open('{').member("buffer", 0U).member("byteOffset", start).member("byteLength", bytes_.size() - start);
    if (target != 0) views_.member("target", target);
    views_.close('}');
    return view_count_++;
  }
  template <class T>
  static constexpr unsigned component_type = std::same_as<T, std::uint8_t>    ? 5121
                                             : std::same_as<T, std::uint16_t> ? 5123
                                             : std::same_as<T, std::uint32_t> ? 5125
                                                                              : 5126;
  /// An accessor over rows of `width` numbers. bounds: whether to say the least and the most of each column.
  template <class T>
  std::size_t accessor(const std::vector<T>& values, std::size_t width, unsigned target, bool bounds = false) {
    const std::size_t start = begin_view();
    for (const T value : values) append(value);
    const std::size_t view = end_view(start, target);
    static constexpr std::array<const char*, 5> types{"", "SCALAR", "VEC2", "VEC3", "VEC4"};
    accessors_.open('{').member("bufferView", view).member("componentType", component_type<T>);
    accessors_.member("count", values.size() / width).member("type", width == 16 ? "MAT4" : types[width]);
    if (bounds) {
      std::vector<T> least(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(width)), most = least;
      for (std::size_t i = width; i < values.size(); ++i) {
        least[i % width] = std::min(least[i % width], values[i]);
        most[i % width] = std::max(most[i % width], values[i]);
      }
      accessors_.key("min").list(least).key("max").list(most);
    }
    accessors_.close('}');
    return accessor_count_++;
  }

  template <class Rows>
  static std::vector<float> flat(const Rows& rows, std::size_t width = 0) {
    std::vector<float> values;
    for (const auto& row : rows) {
      if constexpr (std::same_as<std::remove_cvref_t<decltype(row)>, Vec3f>) {
        for (const float x : {row.x, row.y, row.z}) values.push_back(x + 0.0F);
      } else {
        values.insert(values.end(), row.begin(),
                      width == 0 ? row.end() : row.begin() + static_cast<std::ptrdiff_t>(width));
      }
    }
    return values;
  }

  // The scene.

  void write_scene() {
    std::vector<std::vector<std::size_t>> children(scene_.nodes.size());
    std::vector<std::size_t> roots;
    for (std::size_t n = 0; n < scene_.nodes.size(); ++n) {
      const std::size_t parent = scene_.nodes[n].parent;
      (parent == no_item ? roots : children[parent]).push_back(n);
    }
    // A reader goes through the tree: what is shown first stands first in it.
    std::vector<std::size_t> rank(scene_.nodes.size(), no_item);
    for (std::size_t i = 0; i < scene_.shown.size(); ++i)
      for (std::size_t n = scene_.shown[i]; n != no_item && rank[n] == no_item; n = scene_.nodes[n].parent) rank[n] = i;
    const auto earlier = [&](std::size_t a, std::size_t b) { return rank[a] < rank[b]; };
    std::ranges::stable_sort(roots, earlier);
    for (std::vector<std::size_t>& own : children) std::ranges::stable_sort(own, earlier);
    json_.member("scene", 0U).key("scenes").open('[').open('{').key("nodes").list(roots).close('}').close(']');
    json_.key("nodes").open('[');
    for (std::size_t n = 0; n < scene_.nodes.size(); ++n) write_node(scene_.nodes[n], children[n]);
    json_.close(']');
  }

  void write_node(const SceneNode& node, const std::vector<std::size_t>& children) {
    json_.open('{');
    if (!node.name.empty()) json_.member("name", node.name);
    const NodePlace& p = node.place;
    if (node.matrix) {
      json_.key("matrix").list(column_major(*node.matrix));
    } else {
      if (p.translation != Vec3d{})
        json_.key("translation").list(std::array{p.translation.x, p.translation.y, p.translation.z});
      if (p.rotation != Quaternion{}) json_.key("rotation").list(components(p.rotation));
      if (p.scale != Vec3d{1, 1, 1}) json_.key("scale").list(std::array{p.scale.x, p.scale.y, p.scale.z});
    }
    if (node.mesh != no_item) json_.member("mesh", node.mesh);
    if (node.skin != no_item) json_.member("skin", node.skin);
    if (!node.weights.empty()) json_.key("weights").list(node.weights);
    if (!children.empty()) json_.key("children").list(children);
    json_.close('}');
  }

  static std::array<double, 16> column_major(const Affine& a) {
    const auto& r = a.linear.rows;
    return {r[0].x, r[1].x, r[2].x, 0, r[0].y,    r[1].y,    r[2].y,    0,
            r[0].z, r[1].z, r[2].z, 0, a.shift.x, a.shift.y, a.shift.z, 1};
  }

  void write_meshes() {
    json_.key("meshes").open('[');
    for (const SceneMesh& mesh : scene_.meshes) {
      json_.open('{');
      if (!mesh.name.empty()) json_.member("name", mesh.name);
      std::vector<std::string> attributes, targets;
      for (const VertexBlock& block : mesh.blocks) {
        attributes.push_back(write_attributes(block));
        targets.push_back(write_targets(block));
      }
      json_.key("primitives").open('[');
      for (const ScenePrimitive& primitive : mesh.primitives) {
        json_.open('{').key("attributes").raw(attributes[primitive.block]);
        if (!targets[primitive.block].empty()) json_.key("targets").raw(targets[primitive.block]);
        if (primitive.triangles.empty())
          json_.member("mode", 0U);
        else
          json_.member("indices", write_indices(primitive, mesh.blocks[primitive.block].positions.size()));
        if (primitive.material != no_item) json_.member("material", primitive.material);
        json_.close('}');
      }
      json_.close(']');
      if (!mesh.weights.empty()) json_.key("weights").list(mesh.weights);
      json_.close('}');
    }
    json_.close(']');
  }

  std::string write_attributes(const VertexBlock& block) {
    JsonText text(name_);
    text.open('{').member("POSITION", accessor(flat(block.positions), 3, vertex_target, true));
    if (!block.normals.empty()) text.member("NORMAL", accessor(flat(block.normals), 3, vertex_target));
    for (std::size_t set = 0; set < block.texcoords.size(); ++set)
      text.member("TEXCOORD_" + std::to_string(set), accessor(flat(block.texcoords[set]), 2, vertex_target));
    if (!block.colours.empty()) {
      const std::size_t width = block.with_alpha ? 4 : 3;
      text.member("COLOR_0", accessor(flat(block.colours, width), width, vertex_target));
    }
    for (std::size_t set = 0; 4 * set < block.influences; ++set) {
      std::vector<std::uint16_t> joints;
      std::vector<float> weights;
      for (std::size_t v = 0; v < block.positions.size(); ++v)
        for (std::size_t i = 4 * set; i < 4 * set + 4; ++i) {
          joints.push_back(block.joints[v * block.influences + i]);
          weights.push_back(block.weights[v * block.influences + i]);
        }
      const bool few = std::ranges::all_of(joints, [](std::uint16_t j) { return j < 256; });
      text.member("JOINTS_" + std::to_string(set),
                  few ? accessor(std::vector<std::uint8_t>(joints.begin(), joints.end()), 4, vertex_target)
                      : accessor(joints, 4, vertex_target));
      text.member("WEIGHTS_" + std::to_string(set), accessor(weights, 4, vertex_target));
    }
    for (const VertexAttribute& other : block.others)
      text.member(other.name, accessor(other.values, other.width, vertex_target));
    return text.close('}').take();
  }

  std::string write_targets(const VertexBlock& block) {
    if (block.targets.empty()) return {};
    JsonText text(name_);
    text.open('[');
    for (const MorphTarget& target : block.targets) {
      text.open('{');
      if (!target.positions.empty()) text.member("POSITION", accessor(flat(target.positions), 3, vertex_target, true));
      if (!target.normals.empty()) text.member("NORMAL", accessor(flat(target.normals), 3, vertex_target));
      text.close('}');
    }
    return text.close(']').take();
  }

  std::size_t write_indices(const ScenePrimitive& primitive, std::size_t vertices) {
    std::vector<std::uint32_t> corners;
    for (const Triangle& t : primitive.triangles) corners.insert(corners.end(), t.begin(), t.end());
    // 65535 restarts a strip, and no vertex may have it.
    if (vertices < 65536) return accessor(std::vector<std::uint16_t>(corners.begin(), corners.end()), 1, index_target);
    return accessor(corners, 1, index_target);
  }

  void write_skins() {
    json_.key("skins").open('[');
    for (const Skin& skin : scene_.skins) {
      std::vector<float> matrices;
      for (const Affine& bind : skin.inverse_binds)
        for (const double x : column_major(bind)) matrices.push_back(static_cast<float>(x) + 0.0F);
      json_.open('{');
      if (!skin.name.empty()) json_.member("name", skin.name);
      json_.key("joints").list(skin.joints).member("inverseBindMatrices", accessor(matrices, 16, 0)).close('}');
    }
    json_.close(']');
  }

  // A clip that moves nothing is no animation to glTF.
  void write_clips() {
    const auto moves = [](const Clip& clip) { return !clip.channels.empty(); };
    if (std::ranges::none_of(scene_.clips, moves)) return;
    json_.key("animations").open('[');
    for (const Clip& clip : scene_.clips) {
      if (!moves(clip)) continue;
      JsonText samplers(name_), channels(name_);
      samplers.open('[');
      channels.open('[');
      std::size_t count = 0;
      for (const ClipChannel& c : clip.channels) {
        static constexpr std::array<const char*, 4> paths{"translation", "rotation", "scale", "weights"};
        static constexpr std::array<const char*, 3> hows{"STEP", "LINEAR", "CUBICSPLINE"};
        const std::size_t width = c.path == ChannelPath::weights ? 1 : c.width;
        samplers.open('{').member("input", times_accessor(c.times)).member("output", accessor(c.values, width, 0));
        samplers.member("interpolation", hows[static_cast<std::size_t>(c.interpolation)]).close('}');
        channels.open('{').member("sampler", count++).key("target").open('{').member("node", c.node);
        channels.member("path", paths[static_cast<std::size_t>(c.path)]).close('}').close('}');
      }
      json_.open('{').member("name", clip.name).key("samplers").raw(samplers.close(']').take());
      json_.key("channels").raw(channels.close(']').take()).close('}');
    }
    json_.close(']');
  }
  /// Channels mostly share their keys' times.
  std::size_t times_accessor(const std::vector<float>& times) {
    const auto known = times_.find(times);
    if (known != times_.end()) return known->second;
    return times_[times] = accessor(times, 1, 0, true);
  }

  void write_appearance(const Appearance& look) {
    const auto list = [&](const char* key, const std::vector<std::string>& texts) {
      if (texts.empty()) return;
      json_.key(key).open('[');
      for (const std::string& text : texts) json_.raw(text);
      json_.close(']');
    };
    std::vector<std::string> materials;
    for (const AppearanceMaterial& material : look.materials) materials.push_back(named(material));
    list("materials", materials);
    list("textures", look.textures);
    list("samplers", look.samplers);
    if (!look.images.empty()) {
      json_.key("images").open('[');
      for (const AppearanceImage& image : look.images) {
        const std::size_t start = begin_view();
        bytes_ += image.bytes;
        json_.open('{').member("bufferView", end_view(start)).member("mimeType", image.mime_type);
        if (!image.name.empty()) json_.member("name", image.name);
        json_.close('}');
      }
      json_.close(']');
    }
    if (!look.extensions_used.empty()) json_.key("extensionsUsed").list(look.extensions_used);
    if (!look.extensions_required.empty()) json_.key("extensionsRequired").list(look.extensions_required);
  }
  /// The specification's default is metal; a material that came without anything is dull instead.
  std::string named(const AppearanceMaterial& material) const {
    if (!material.json.empty()) return material.json;
    const bool coloured = std::ranges::any_of(scene_.meshes, [](const SceneMesh& mesh) {
      return std::ranges::any_of(mesh.blocks, [](const VertexBlock& block) { return !block.colours.empty(); });
    });
    JsonText text(name_);
    text.open('{');
    if (!material.label.empty()) text.member("name", material.label);
    text.key("pbrMetallicRoughness").open('{').key("baseColorFactor");
    text.list(coloured ? std::array{1.0, 1.0, 1.0, 1.0} : std::array{0.8, 0.8, 0.8, 1.0});
    text.member("metallicFactor", 0U).key("roughnessFactor").number(0.8).close('}');
    return text.close('}').take();
  }

  const Scene& scene_;
  const std::string& name_;
  JsonText accessors_, views_, json_;
  std::string bytes_;
  std::size_t accessor_count_ = 0, view_count_ = 0;
  std::map<std::vector<float>, std::size_t> times_;
};

}  // namespace internal

/// The bytes of a GLB file. `name` stands in the messages of errors.
inline std::string format_gltf(const Scene& scene, const std::string& name) {
  return internal::GltfWriter(scene, name).write();
}

}  // namespace npt::inline NPT_ABI
