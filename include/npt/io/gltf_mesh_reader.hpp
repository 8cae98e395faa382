/// The meshes of a glTF file: vertices with what belongs to them, triangles, morph targets; from plain numbers or, with
/// libdraco, from compressed ones.
/// Errors    npt::Error for numbers that don't fit each other, and for vertices out of range
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/config.hpp>
#include <npt/io/gltf_document.hpp>
#include <npt/scene/scene.hpp>

#ifdef NPT_WITH_DRACO
#include <npt/io/draco.hpp>
#endif

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
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
class GltfMeshReader {
 public:
  /// materials: how many the file has
  GltfMeshReader(GltfDocument& document, std::size_t materials) : document_(document), materials_(materials) {}

  std::vector<SceneMesh> read() {
    std::vector<SceneMesh> meshes;
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
      meshes.push_back(std::move(mesh));
    }
    return meshes;
  }

 private:
  using Kind = JsonValue::Kind;
  using Item = GltfItem;

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
    if (materials_ > 0)
      primitive.material = document_.index(item, "material", materials_, "materials").value_or(no_item);
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
    virtual std::vector<VertexAttribute> others() const = 0;  ///< names and widths of what is kept as it is
  };

  /// Attributes of other programs' own, and further colours.
  std::vector<VertexAttribute> others_of(const Item& attributes) const {
    std::vector<VertexAttribute> result;
    for (const std::string& name : attributes.value->keys) {
      if (!is_other_attribute(name)) continue;
      static constexpr std::array<std::string_view, 5> types{"", "SCALAR", "VEC2", "VEC3", "VEC4"};
      const std::string type = document_.accessor_type(accessor(attributes, name).value());
      const auto found = std::find(types.begin() + 1, types.end(), type);
      if (found != types.end()) result.push_back({name, static_cast<std::size_t>(found - types.begin()), {}});
    }
    return result;
  }

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
    block.others = source.others();
    for (VertexAttribute& other : block.others) {
      other.values = source.floats(other.name, other.width);
      expect(other.values.size() / other.width, other.name);
    }
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
    AccessorSource(GltfMeshReader& own, const Item& attributes_) : reader(own), attributes(attributes_) {}
    bool has(const std::string& name) const override { return attributes.value->find(name) != nullptr; }
    std::size_t number(const std::string& name) const { return reader.accessor(attributes, name).value(); }
    std::vector<float> floats(const std::string& name, std::size_t components) override {
      return reader.document_.floats(number(name), components, name);
    }
    std::vector<std::uint32_t> wholes(const std::string& name) override {
      return reader.document_.wholes(number(name), 4, name);
    }
    std::size_t colour_components(const std::string& name) const override { return reader.components_of(number(name)); }
    std::vector<VertexAttribute> others() const override { return reader.others_of(attributes); }
    GltfMeshReader& reader;
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
    DracoSource(GltfMeshReader& own, const Item& attributes_, const Item& extension)
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
    std::vector<VertexAttribute> others() const override {
      std::vector<VertexAttribute> result = reader.others_of(attributes);
      std::erase_if(result, [this](const VertexAttribute& other) { return !has(other.name); });
      return result;
    }
    GltfMeshReader& reader;
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

  static constexpr std::size_t most_sets = 8;

  GltfDocument& document_;
  std::size_t materials_;
};

}  // namespace internal

}  // namespace npt::inline NPT_ABI
