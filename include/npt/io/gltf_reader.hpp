/// Reading glTF 2.0, binary or as text, into a Scene; gltf.hpp says what is kept. The project's own JSON reader and no
/// library for glTF: tinygltf 2.7 as Debian builds it refuses every Draco file, hands image loaders ranges that it
/// hasn't checked, and each of its numbers would have to be checked again.
#pragma once

#include <npt/config.hpp>
#include <npt/core/error.hpp>
#include <npt/core/vec3.hpp>
#include <npt/io/gltf_document.hpp>
#include <npt/mesh/appearance.hpp>
#include <npt/scene/affine.hpp>
#include <npt/scene/scene.hpp>

#ifdef NPT_WITH_DRACO
#include <npt/io/draco.hpp>
#endif

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

namespace internal {

#ifdef NPT_WITH_DRACO
constexpr bool with_draco = true;
#else
constexpr bool with_draco = false;
#endif

/// `Draco`: with_draco. As a parameter it gives units with and without libdraco two classes, which one program may mix.
template <bool Draco>
class GltfReader {
 public:
  GltfReader(std::string_view file, const std::string& name, const std::optional<std::filesystem::path>& folder)
      : document_(file, name, folder), folder_(folder) {}

  Scene read() {
    check_extensions();
    read_materials();
    read_meshes();
    read_nodes();
    read_skins();
    read_shown();
    check_instances();
    read_clips();
    return std::move(scene_);
  }

 private:
  using Kind = JsonValue::Kind;
  using Item = GltfItem;

  /// What a file may ask for and npt can do without understanding it: how surfaces look, and quantised numbers.
  void check_extensions() const {
    static constexpr std::array<std::string_view, 6> understood{"KHR_mesh_quantization", "KHR_texture_transform",
                                                                "KHR_texture_basisu",    "KHR_lights_punctual",
                                                                "EXT_texture_webp",      "EXT_texture_avif"};
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
      if (name == "EXT_meshopt_compression")
        document_.fail(item.place, name, "a file without it: npt can't read meshopt's compression");
      if (!known) document_.fail(item.place, in_quotes(name), "extensions that npt knows");
    }
  }

  // Materials.

  void read_materials() {
    const std::vector<Item> materials = document_.objects(document_.root(), "materials");
    if (materials.empty()) return;
    auto look = std::make_shared<Appearance>();
    std::set<std::string> labels, extensions;
    for (std::size_t i = 0; i < materials.size(); ++i) {
      std::string label = document_.text(materials[i], "name");
      for (char& c : label)
        if (static_cast<unsigned char>(c) < 0x20) c = '_';
      while (label.ends_with(' ')) label.pop_back();
      label.erase(0, std::min(label.find_first_not_of(' '), label.size()));
      if (label.empty()) label = "material_" + std::to_string(i);
      const std::string stem = label;
      for (int n = 1; !labels.insert(label).second; ++n) label = stem + "." + std::to_string(n);
      look->materials.push_back({label, json_of(materials[i], extensions)});
    }
    for (const Item& item : document_.objects(document_.root(), "textures"))
      look->textures.push_back(json_of(item, extensions));
    for (const Item& item : document_.objects(document_.root(), "samplers"))
      look->samplers.push_back(json_of(item, extensions));
    for (const Item& item : document_.objects(document_.root(), "images")) look->images.push_back(image(item));
    check_references(*look);
    const auto named = [&](const char* key) {
      std::vector<std::string> result;
      for (const Item& item : document_.items(document_.root(), key))
        if (extensions.contains(item.value->text)) result.push_back(item.value->text);
      return result;
    };
    look->extensions_used.assign(extensions.begin(), extensions.end());
    look->extensions_required = named("extensionsRequired");
    scene_.appearance = std::move(look);
  }

  static std::string json_of(const Item& item, std::set<std::string>& extensions) {
    collect_extensions(*item.value, extensions);
    std::string text;
    append_json(text, *item.value);
    return text;
  }
  static void collect_extensions(const JsonValue& value, std::set<std::string>& names) {
    if (const JsonValue* extensions = value.find("extensions"))
      names.insert(extensions->keys.begin(), extensions->keys.end());
    for (const JsonValue& item : value.items) collect_extensions(item, names);
  }

  AppearanceImage image(const Item& item) const {
    AppearanceImage result{document_.text(item, "name"), document_.text(item, "mimeType"), {}};
    if (const auto uri = document_.member(item, "uri", Kind::string)) {
      UriBytes read = read_uri(uri->value->text, folder_, document_.name(), uri->place);
      result.bytes = std::move(read.bytes);
      if (result.mime_type.empty()) result.mime_type = std::move(read.mime_type);
    } else {
      result.bytes = document_.view(item, "bufferView");
    }
    // A file beside the document tells its type by its first bytes.
    if (result.mime_type.empty())
      result.mime_type = result.bytes.starts_with("\x89PNG")        ? "image/png"
                         : result.bytes.starts_with("\xFF\xD8\xFF") ? "image/jpeg"
                         : result.bytes.starts_with("RIFF")         ? "image/webp"
                                                                    : "image/ktx2";
    return result;
  }

  /// Indices that would lead nowhere in what is written.
  void check_references(const Appearance& look) const {
    for (const Item& item : document_.objects(document_.root(), "textures")) {
      document_.index(item, "source", look.images.size(), "images");
      document_.index(item, "sampler", look.samplers.size(), "samplers");
    }
    for (const Item& item : document_.objects(document_.root(), "materials"))
      check_textures(item, look.textures.size());
  }
  void check_textures(const Item& object, std::size_t textures) const {
    for (std::size_t i = 0; i < object.value->items.size(); ++i) {
      const JsonValue& value = object.value->items[i];
      if (!value.is(Kind::object)) continue;
      const std::string& key = object.value->keys.empty() ? std::string() : object.value->keys[i];
      if (key == "extras") continue;
      const Item member{&value, object.place + "." + key};
      if (key.ends_with("Texture")) document_.index(member, "index", textures, "textures");
      check_textures(member, textures);
    }
  }

  // Meshes.

  void read_meshes() {
    for (const Item& item : document_.objects(document_.root(), "meshes")) {
      SceneMesh mesh{.name = document_.text(item, "name")};
      std::map<std::string, std::size_t> blocks;  // by the accessors that they are made of
      std::size_t targets = 0;
      const std::vector<Item> primitives = document_.objects(item, "primitives");
      if (primitives.empty()) document_.fail(item.place, "no primitives", "at least one");
      for (std::size_t p = 0; p < primitives.size(); ++p) {
        const std::size_t own = document_.objects(primitives[p], "targets").size();
        if (p > 0 && own != targets)
          document_.fail(primitives[p].place, std::to_string(own) + " morph targets",
                         std::to_string(targets) + ", as the mesh's first primitive has");
        targets = own;
        read_primitive(primitives[p], mesh, blocks);
      }
      // Lines and points stand beside surfaces as helpers; alone, points are the mesh.
      if (std::ranges::any_of(mesh.primitives, [](const ScenePrimitive& p) { return !p.triangles.empty(); })) {
        std::erase_if(mesh.primitives, [](const ScenePrimitive& p) { return p.triangles.empty(); });
        drop_unused_blocks(mesh);
      }
      mesh.weights = document_.reals(item, "weights", targets);
      if (mesh.weights.size() != targets) mesh.weights.assign(targets, 0.0);
      scene_.meshes.push_back(std::move(mesh));
    }
  }

  static void drop_unused_blocks(SceneMesh& mesh) {
    std::vector<std::size_t> place(mesh.blocks.size(), no_item);
    std::vector<VertexBlock> kept;
    for (std::size_t b = 0; b < mesh.blocks.size(); ++b) {
      if (std::ranges::none_of(mesh.primitives, [b](const ScenePrimitive& p) { return p.block == b; })) continue;
      place[b] = kept.size();
      kept.push_back(std::move(mesh.blocks[b]));
    }
    mesh.blocks = std::move(kept);
    for (ScenePrimitive& primitive : mesh.primitives) primitive.block = place[primitive.block];
  }

  void read_primitive(const Item& item, SceneMesh& mesh, std::map<std::string, std::size_t>& blocks) {
    const std::uint64_t mode = document_.whole(item, "mode").value_or(4);
    if (mode > 6) document_.fail(item.place, "mode " + std::to_string(mode), "0 to 6");
    if (mode >= 1 && mode <= 3) return;  // lines
    const Item attributes = document_.need(item, "attributes", Kind::object);
    ScenePrimitive primitive;
    if (scene_.appearance != nullptr)
      primitive.material =
          document_.index(item, "material", scene_.appearance->materials.size(), "materials").value_or(no_item);
    if (const auto extensions = document_.member(item, "extensions", Kind::object))
      if (const auto draco = document_.member(*extensions, "KHR_draco_mesh_compression", Kind::object);
          draco && decodes(attributes)) {
        mesh.blocks.push_back(draco_block(item, attributes, *draco, primitive));
        primitive.block = mesh.blocks.size() - 1;
        mesh.primitives.push_back(std::move(primitive));
        return;
      }
    std::string key;
    append_json(key, *attributes.value);
    if (const JsonValue* targets = item.value->find("targets")) append_json(key, *targets);
    const auto [known, fresh] = blocks.emplace(key, mesh.blocks.size());
    if (fresh) mesh.blocks.push_back(block(item, attributes));
    primitive.block = known->second;
    if (mode >= 4) primitive.triangles = triangles(item, mode, mesh.blocks[primitive.block].positions.size());
    mesh.primitives.push_back(std::move(primitive));
  }

  std::vector<Triangle> triangles(const Item& item, std::uint64_t mode, std::size_t vertices) {
    std::vector<std::uint32_t> corners;
    if (const auto number = document_.index(item, "indices", document_.accessor_count(), "accessors")) {
      corners = document_.wholes(*number, 1, "indices");
      for (std::size_t i = 0; i < corners.size(); ++i)
        if (corners[i] >= vertices)
          document_.fail(item.place + ".indices", "vertex " + std::to_string(corners[i]) + " at " + std::to_string(i),
                         "a vertex below " + std::to_string(vertices));
    } else {
      corners.resize(vertices);
      for (std::uint32_t v = 0; v < vertices; ++v) corners[v] = v;
    }
    std::vector<Triangle> result;
    if (mode == 4 && corners.size() % 3 != 0)
      document_.fail(item.place, std::to_string(corners.size()) + " corners", "three for each triangle");
    if (mode == 4)
      for (std::size_t i = 0; i < corners.size(); i += 3)
        result.push_back({corners[i], corners[i + 1], corners[i + 2]});
    // In a strip every second triangle is turned; a fan keeps its first vertex. Strips are joined by empty triangles.
    for (std::size_t i = 0; mode != 4 && i + 2 < corners.size(); ++i) {
      const Triangle t = mode == 6    ? Triangle{corners[0], corners[i + 1], corners[i + 2]}
                         : i % 2 == 0 ? Triangle{corners[i], corners[i + 1], corners[i + 2]}
                                      : Triangle{corners[i + 1], corners[i], corners[i + 2]};
      if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) result.push_back(t);
    }
    return result;
  }

  /// An attribute's accessor; nothing where the primitive doesn't have it.
  std::optional<std::size_t> accessor(const Item& attributes, const std::string& name) const {
    return document_.index(attributes, name.c_str(), document_.accessor_count(), "accessors");
  }
  std::size_t components_of(std::size_t accessor) const { return document_.accessor_type(accessor) == "VEC3" ? 3 : 4; }

  /// What reads the numbers of an attribute: accessors, or Draco.
  struct Source {
    virtual ~Source() = default;
    virtual bool has(const std::string& name) const = 0;
    virtual std::vector<float> floats(const std::string& name, std::size_t components) = 0;
    virtual std::vector<std::uint32_t> wholes(const std::string& name) = 0;  ///< four each
    virtual std::size_t colour_components(const std::string& name) const = 0;
  };

  VertexBlock block_from(const Item& item, Source& source) {
    VertexBlock block;
    if (!source.has("POSITION")) document_.fail(item.place, "no POSITION", "positions");
    block.positions = vectors(source.floats("POSITION", 3));
    const std::size_t count = block.positions.size();
    const auto expect = [&](std::size_t got, const std::string& name) {
      if (got != count)
        document_.fail(item.place + ".attributes." + name, std::to_string(got) + " elements",
                       std::to_string(count) + ", as positions");
    };
    if (source.has("NORMAL")) {
      block.normals = vectors(source.floats("NORMAL", 3));
      expect(block.normals.size(), "NORMAL");
    }
    for (std::size_t set = 0; set < most_sets && source.has("TEXCOORD_" + std::to_string(set)); ++set) {
      const std::string name = "TEXCOORD_" + std::to_string(set);
      const std::vector<float> values = source.floats(name, 2);
      expect(values.size() / 2, name);
      block.texcoords.emplace_back(count);
      for (std::size_t v = 0; v < count; ++v) block.texcoords.back()[v] = {values[2 * v], values[2 * v + 1]};
    }
    if (source.has("COLOR_0")) {
      const std::size_t width = source.colour_components("COLOR_0");
      const std::vector<float> values = source.floats("COLOR_0", width);
      expect(values.size() / width, "COLOR_0");
      block.with_alpha = width == 4;
      block.colours.assign(count, {1, 1, 1, 1});
      for (std::size_t v = 0; v < count; ++v)
        for (std::size_t c = 0; c < width; ++c) block.colours[v][c] = values[width * v + c];
    }
    read_influences(item, source, block, expect);
    return block;
  }

  template <class Expect>
  void read_influences(const Item& item, Source& source, VertexBlock& block, Expect&& expect) {
    std::vector<std::vector<std::uint32_t>> joints;
    std::vector<std::vector<float>> weights;
    for (std::size_t set = 0; set < most_sets && source.has("JOINTS_" + std::to_string(set)); ++set) {
      const std::string j = "JOINTS_" + std::to_string(set), w = "WEIGHTS_" + std::to_string(set);
      if (!source.has(w)) document_.fail(item.place, j + " without " + w, "both or none");
      joints.push_back(source.wholes(j));
      weights.push_back(source.floats(w, 4));
      expect(joints.back().size() / 4, j);
      expect(weights.back().size() / 4, w);
    }
    const std::size_t count = block.positions.size();
    block.influences = 4 * joints.size();
    for (std::size_t v = 0; v < count && !joints.empty(); ++v) {
      double sum = 0;
      for (std::size_t i = 0; i < block.influences; ++i) {
        const float weight = weights[i / 4][4 * v + i % 4];
        const std::uint32_t joint = joints[i / 4][4 * v + i % 4];
        if (!(weight >= 0))
          document_.fail(item.place + ".attributes.WEIGHTS_" + std::to_string(i / 4),
                         std::to_string(weight) + " at vertex " + std::to_string(v), "weights that are not negative");
        if (weight > 0 && joint > 0xFFFF)
          document_.fail(item.place + ".attributes.JOINTS_" + std::to_string(i / 4),
                         "joint " + std::to_string(joint) + " at vertex " + std::to_string(v), "a joint of the skin");
        sum += static_cast<double>(weight);
        block.joints.push_back(weight > 0 ? static_cast<std::uint16_t>(joint) : std::uint16_t{0});
        block.weights.push_back(weight);
      }
      // Rounded weights don't sum to 1, and some exporters leave vertices without any: those go with the first joint.
      float* own = &block.weights[v * block.influences];
      if (std::abs(sum - 1) < 1e-6) continue;
      if (sum > 0)
        for (std::size_t i = 0; i < block.influences; ++i)
          own[i] = static_cast<float>(static_cast<double>(own[i]) / sum);
      else
        own[0] = 1, block.joints[v * block.influences] = 0;
    }
  }

  static std::vector<Vec3f> vectors(const std::vector<float>& values) {
    std::vector<Vec3f> result(values.size() / 3);
    for (std::size_t i = 0; i < result.size(); ++i) result[i] = {values[3 * i], values[3 * i + 1], values[3 * i + 2]};
    return result;
  }

  struct AccessorSource final : Source {
    AccessorSource(GltfReader& own, const Item& attributes_) : reader(own), attributes(attributes_) {}
    bool has(const std::string& name) const override { return attributes.value->find(name) != nullptr; }
    std::size_t number(const std::string& name) const { return reader.accessor(attributes, name).value(); }
    std::vector<float> floats(const std::string& name, std::size_t components) override {
      return reader.document_.floats(number(name), components, name);
    }
    std::vector<std::uint32_t> wholes(const std::string& name) override {
      return reader.document_.wholes(number(name), 4, name);
    }
    std::size_t colour_components(const std::string& name) const override { return reader.components_of(number(name)); }
    GltfReader& reader;
    const Item& attributes;
  };

  VertexBlock block(const Item& item, const Item& attributes) {
    AccessorSource source(*this, attributes);
    VertexBlock block = block_from(item, source);
    for (const Item& target : document_.objects(item, "targets")) {
      MorphTarget morph;
      for (const auto& [name, values] :
           {std::pair("POSITION", &morph.positions), std::pair("NORMAL", &morph.normals)}) {
        const auto number = accessor(target, name);
        if (!number) continue;
        *values = vectors(document_.floats(*number, 3, name));
        if (values->size() != block.positions.size())
          document_.fail(target.place + "." + name, std::to_string(values->size()) + " elements",
                         std::to_string(block.positions.size()) + ", as positions");
      }
      block.targets.push_back(std::move(morph));
    }
    return block;
  }

#ifdef NPT_WITH_DRACO
  bool decodes(const Item&) const { return true; }

  struct DracoSource final : Source {
    DracoSource(GltfReader& own, const Item& attributes_, const Item& extension)
        : reader(own),
          attributes(attributes_),
          numbers(own.document_.need(extension, "attributes", Kind::object)),
          mesh(own.document_.view(extension, "bufferView"), own.document_.name(), extension.place) {}
    bool has(const std::string& name) const override {
      return numbers.value->find(name) != nullptr && attributes.value->find(name) != nullptr;
    }
    std::vector<float> floats(const std::string& name, std::size_t components) override {
      const std::uint64_t number = reader.document_.need_whole(numbers, name.c_str());
      reader.document_.spend(mesh.vertex_count() * components, numbers.place);
      std::vector<float> values =
          mesh.attribute(static_cast<std::uint32_t>(std::min<std::uint64_t>(number, 0xFFFFFFFFU)), components);
      const GltfDocument::Accessor a =
          reader.document_.accessor(reader.accessor(attributes, name).value(), components, name);
      // Draco keeps integers as they are; what they mean is the accessor's to say.
      const float most = a.type == 5120 ? 127.0F : a.type == 5121 ? 255.0F : a.type == 5122 ? 32767.0F : 65535.0F;
      for (float& value : values) {
        if (a.normalised) value = std::max(value / most, -1.0F);
        if (!std::isfinite(value))
          reader.document_.fail(numbers.place + "." + name, "a number that is not finite", "finite numbers");
      }
      return values;
    }
    std::vector<std::uint32_t> wholes(const std::string& name) override {
      std::vector<std::uint32_t> result;
      for (const float value : floats(name, 4)) {
        if (!(value >= 0 && value <= 65535))
          reader.document_.fail(numbers.place + "." + name, std::to_string(value), "0 to 65535");
        result.push_back(static_cast<std::uint32_t>(value));
      }
      return result;
    }
    std::size_t colour_components(const std::string& name) const override {
      return reader.components_of(reader.accessor(attributes, name).value());
    }
    GltfReader& reader;
    const Item& attributes;
    Item numbers;
    DracoMesh mesh;
  };

  VertexBlock draco_block(const Item& item, const Item& attributes, const Item& extension, ScenePrimitive& primitive) {
    if (!document_.objects(item, "targets").empty())
      document_.fail(item.place, "morph targets of a mesh that Draco compressed", "one or the other");
    DracoSource source(*this, attributes, extension);
    primitive.triangles = source.mesh.triangles();
    document_.spend(3 * primitive.triangles.size(), extension.place);
    return block_from(item, source);
  }
#else
  /// Some files hold the numbers a second time, for readers without Draco.
  bool decodes(const Item& attributes) const {
    const auto positions = accessor(attributes, "POSITION");
    return !positions || !document_.accessor_has_bytes(*positions);
  }
  VertexBlock draco_block(const Item&, const Item&, const Item& extension, ScenePrimitive&) {
    document_.fail(extension.place, "a mesh that Draco compressed",
                   "one that isn't: this npt was built without libdraco (Debian: libdraco-dev)");
  }
#endif

  // Nodes.

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

  void read_skins() {
    for (const Item& item : document_.objects(document_.root(), "skins")) {
      Skin skin{.name = document_.text(item, "name")};
      for (const Item& joint : document_.items(item, "joints"))
        skin.joints.push_back(document_.index(joint, scene_.nodes.size(), "nodes"));
      if (skin.joints.empty()) document_.fail(item.place, "no joints", "at least one");
      skin.inverse_binds.resize(skin.joints.size());
      if (const auto number = document_.index(item, "inverseBindMatrices", document_.accessor_count(), "accessors")) {
        const std::vector<float> values = document_.floats(*number, 16, "inverse bind matrices");
        if (values.size() / 16 < skin.joints.size())
          document_.fail(item.place, std::to_string(values.size() / 16) + " inverse bind matrices",
                         std::to_string(skin.joints.size()) + ", one for each joint");
        for (std::size_t j = 0; j < skin.joints.size(); ++j)
          skin.inverse_binds[j] =
              affine(&values[16 * j], item.place + ".inverseBindMatrices, joint " + std::to_string(j));
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

  // Clips.

  void read_clips() {
    const std::vector<Item> items = document_.objects(document_.root(), "animations");
    for (std::size_t i = 0; i < items.size(); ++i) {
      Clip clip{document_.text(items[i], "name"), {}};
      if (clip.name.empty()) clip.name = "clip_" + std::to_string(i);
      const std::vector<Item> samplers = document_.objects(items[i], "samplers");
      for (const Item& item : document_.objects(items[i], "channels")) {
        const auto sampler = document_.index(item, "sampler", samplers.size(), "samplers");
        if (!sampler) document_.fail(item.place, "no sampler", "a sampler's number");
        const Item target = document_.need(item, "target", Kind::object);
        const auto node = document_.index(target, "node", scene_.nodes.size(), "nodes");
        const std::string path = document_.text(target, "path");
        if (!node) continue;  // moves something that only an extension knows
        if (auto moving = channel(target, samplers[*sampler], *node, path)) clip.channels.push_back(std::move(*moving));
      }
      scene_.clips.push_back(std::move(clip));
    }
  }

  std::optional<ClipChannel> channel(const Item& target, const Item& sampler, std::size_t node,
                                     const std::string& path) {
    ClipChannel c{.node = node};
    if (path == "rotation")
      c.path = ChannelPath::rotation, c.width = 4;
    else if (path == "scale")
      c.path = ChannelPath::scale;
    else if (path == "weights")
      c.path = ChannelPath::weights, c.width = morph_targets(node);
    else if (path != "translation")
      return std::nullopt;
    if (c.width == 0) document_.fail(target.place, "weights of a node without morph targets", "a node that has some");
    if (c.path != ChannelPath::weights && scene_.nodes[node].matrix)
      document_.fail(target.place, "a node with a matrix", "one with translation, rotation and scale, to be moved");
    const std::string how = document_.text(sampler, "interpolation");
    if (how == "STEP")
      c.interpolation = Interpolation::step;
    else if (how == "CUBICSPLINE")
      c.interpolation = Interpolation::cubic;
    else if (!how.empty() && how != "LINEAR")
      document_.fail(sampler.place, in_quotes(how), "LINEAR, STEP or CUBICSPLINE");
    const auto number = [&](const char* key) {
      const auto a = document_.index(sampler, key, document_.accessor_count(), "accessors");
      if (!a) document_.fail(sampler.place, std::string("no ") + key, "an accessor's number");
      return *a;
    };
    c.times = document_.floats(number("input"), 1, "times");
    for (std::size_t k = 0; k < c.times.size(); ++k)
      if (c.times[k] < (k == 0 ? 0 : c.times[k - 1]))
        document_.fail(sampler.place, "key " + std::to_string(k) + " at " + std::to_string(c.times[k]) + " s",
                       "times from 0 on that ascend");
    const std::size_t width = c.path == ChannelPath::weights ? 1 : c.width;
    c.values = document_.floats(number("output"), width, path);
    const std::size_t expected = c.times.size() * c.width * (c.interpolation == Interpolation::cubic ? 3 : 1);
    if (c.values.size() != expected)
      document_.fail(sampler.place,
                     std::to_string(c.values.size()) + " numbers for " + std::to_string(c.times.size()) + " keys",
                     std::to_string(expected));
    return c;
  }
  std::size_t morph_targets(std::size_t node) const {
    const std::size_t mesh = scene_.nodes[node].mesh;
    return mesh == no_item ? 0 : scene_.meshes[mesh].weights.size();
  }

  static constexpr std::size_t most_sets = 8;

  GltfDocument document_;
  std::optional<std::filesystem::path> folder_;
  Scene scene_;
};

}  // namespace internal

/// A scene from the bytes of a glTF file, binary or text. `name` stands in the messages of errors; `folder`: where
/// files that it names are looked for; nothing: they are refused.
template <bool Draco = internal::with_draco>
Scene parse_gltf(std::string_view file, const std::string& name,
                 const std::optional<std::filesystem::path>& folder = {}) {
  return internal::GltfReader<Draco>(file, name, folder).read();
}

}  // namespace npt::inline NPT_ABI
