/// A scene of a mesh: a node for each part (tag "o"), a primitive for each material in it. What glTF can't say is said
/// as it can: corners with texture coordinates or normals of their own become vertices, polygons become fans.
/// Numerics  texture coordinates that count from the bottom become 1 - v; colours of type uchar are divided by 255
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/config.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/normals.hpp>
#include <npt/mesh/validate.hpp>
#include <npt/scene/scene.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// A scene and where its vertices came from. Node i shows mesh i, whose one block is made of the mesh's vertices
/// vertex_of[i]; corner_of[i] is the first corner of the mesh that each stands for, no_index where no face has it.
struct MeshScene {
  Scene scene;
  std::vector<std::vector<std::uint32_t>> vertex_of, corner_of;
};

/// The unit normals of a part's vertices, of the mesh that the scene was made of or of the same mesh in another pose.
inline std::vector<Vec3f> part_normals(const MeshScene& made, std::size_t part, const Mesh& mesh,
                                       std::span<const Vec3f> vertex_normals) {
  std::vector<Vec3f> normals;
  const std::vector<std::uint32_t>&vertices = made.vertex_of[part], &corners = made.corner_of[part];
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    Vec3f normal = vertex_normals[vertices[i]];
    const std::uint32_t n =
        mesh.corner_normal.empty() || corners[i] == no_index ? no_index : mesh.corner_normal[corners[i]];
    if (n != no_index)
      normal = mesh.normals[n];
    else if (mesh.corner_normal.empty() && mesh.normals.size() == mesh.vertex_count())
      normal = mesh.normals[vertices[i]];
    const Vec3d unit = normalised(normal.as<double>());
    normals.push_back(unit == Vec3d{} || !is_finite(unit) ? Vec3f{0, 1, 0} : unit.as<float>());
  }
  return normals;
}

namespace internal {

class SceneFromMesh {
 public:
  SceneFromMesh(const Mesh& mesh, const std::string& name) : mesh_(mesh), name_(name) {
    read_tags();
    vertices_by_part();
  }

  MeshScene make() {
    MeshScene result;
    look_ = mesh_.appearance != nullptr ? mesh_.appearance : plain_look();
    result.scene.appearance = look_;
    const std::vector<Vec3f> normals = vertex_normals(mesh_);
    for (std::size_t part = 0; part < parts_.size(); ++part) {
      result.corner_of.emplace_back(parts_[part].vertices.size(), no_index);
      result.scene.meshes.push_back(mesh_of(part, result.corner_of.back()));
      result.scene.nodes.push_back({.name = parts_[part].name, .mesh = part});
      result.scene.shown.push_back(part);
      result.vertex_of.emplace_back();
      for (const Corner& corner : parts_[part].vertices) result.vertex_of.back().push_back(corner.v);
      if (!mesh_.corners.empty())
        result.scene.meshes.back().blocks.front().normals = part_normals(result, part, mesh_, normals);
    }
    return result;
  }

 private:
  /// What makes a corner a vertex of its own.
  struct Corner {
    std::uint32_t v = 0, texcoord = no_index, normal = no_index;
    friend constexpr auto operator<=>(const Corner&, const Corner&) = default;  // NOLINT(modernize-use-nullptr)
  };
  struct Part {
    std::string name;
    std::vector<std::pair<std::string, std::vector<std::size_t>>> faces{};  ///< by material, in order of appearance
    std::vector<Corner> vertices{};                                         ///< ascending
  };

  /// Parts whose tags stand alone, without faces, are left out.
  void read_tags() {
    std::size_t tag = 0;
    std::string part = name_, material;
    bool fresh = true;
    for (std::size_t f = 0; f < mesh_.face_count(); ++f) {
      for (; tag < mesh_.tags.size() && mesh_.tags[tag].face <= f; ++tag) {
        const MeshTag& t = mesh_.tags[tag];
        if (t.keyword == "usemtl") material = t.value;
        if (t.keyword == "o") part = t.value.empty() ? name_ : t.value, fresh = true;
      }
      if (fresh) parts_.push_back({part, {}, {}});
      fresh = false;
      auto& groups = parts_.back().faces;
      auto group = std::ranges::find(groups, material, &decltype(Part::faces)::value_type::first);
      if (group == groups.end()) group = groups.insert(groups.end(), {material, {}});
      group->second.push_back(f);
    }
    if (parts_.empty()) parts_.push_back({name_, {}, {}});
  }

  Corner corner(std::size_t c) const {
    const auto at = [c](const std::vector<std::uint32_t>& indices) { return indices.empty() ? no_index : indices[c]; };
    return {mesh_.corners[c], at(mesh_.corner_texcoord), at(mesh_.corner_normal)};
  }

  /// A vertex that no face has stays with the part of the vertex before it.
  void vertices_by_part() {
    std::vector<std::size_t> part_of(mesh_.vertex_count(), no_item);
    for (std::size_t p = 0; p < parts_.size(); ++p) {
      std::vector<Corner>& vertices = parts_[p].vertices;
      for (const auto& group : parts_[p].faces)
        for (const std::size_t f : group.second)
          for (std::size_t c = mesh_.face_start[f]; c < mesh_.face_start[f + 1]; ++c) {
            vertices.push_back(corner(c));
            part_of[mesh_.corners[c]] = p;
          }
    }
    std::size_t last = 0;
    for (std::uint32_t v = 0; v < part_of.size(); ++v) {
      if (part_of[v] == no_item)
        parts_[last].vertices.push_back({v, no_index, no_index});
      else
        last = part_of[v];
    }
    for (Part& part : parts_) {
      std::ranges::sort(part.vertices);
      part.vertices.erase(std::unique(part.vertices.begin(), part.vertices.end()), part.vertices.end());
    }
  }

  SceneMesh mesh_of(std::size_t p, std::vector<std::uint32_t>& corner_of) const {
    const Part& part = parts_[p];
    SceneMesh result{.name = part.name, .blocks = {block_of(part)}, .primitives = {}, .weights = {}};
    for (const auto& [material, faces] : part.faces) {
      ScenePrimitive primitive{.material = material_number(material)};
      const auto number = [&](std::size_t c) {
        const auto i =
            static_cast<std::uint32_t>(std::ranges::lower_bound(part.vertices, corner(c)) - part.vertices.begin());
        if (corner_of[i] == no_index) corner_of[i] = static_cast<std::uint32_t>(c);
        return i;
      };
      for (const std::size_t f : faces)
        for (std::size_t c = mesh_.face_start[f] + 1; c + 1 < mesh_.face_start[f + 1]; ++c)
          primitive.triangles.push_back({number(mesh_.face_start[f]), number(c), number(c + 1)});
      result.primitives.push_back(std::move(primitive));
    }
    if (result.primitives.empty()) result.primitives.push_back({});  // points
    return result;
  }

  /// A material for each name that a mesh without materials of its own uses.
  std::shared_ptr<const Appearance> plain_look() const {
    auto look = std::make_shared<Appearance>();
    for (const Part& part : parts_)
      for (const auto& group : part.faces) {
        const std::string& label = group.first;
        if (std::ranges::find(look->materials, label, &AppearanceMaterial::label) != look->materials.end()) continue;
        look->materials.push_back({label, {}});
      }
    return look;
  }

  std::size_t material_number(const std::string& label) const {
    const auto& materials = look_->materials;
    const auto found = std::ranges::find(materials, label, &AppearanceMaterial::label);
    return found == materials.end() ? no_item : static_cast<std::size_t>(found - materials.begin());
  }

  const VertexProperty* property(const std::string& name) const {
    const auto found = std::ranges::find(mesh_.properties, name, &VertexProperty::name);
    return found == mesh_.properties.end() ? nullptr : &*found;
  }

  VertexBlock block_of(const Part& part) const {
    VertexBlock block;
    for (const Corner& corner : part.vertices) block.positions.push_back(mesh_.positions[corner.v]);
    const auto with_texcoord = [](const Corner& c) { return c.texcoord != no_index; };
    if (std::ranges::any_of(part.vertices, with_texcoord)) add_texcoords(part, block);
    add_colours(part, block);
    add_others(part, block);
    return block;
  }

  void add_texcoords(const Part& part, VertexBlock& block) const {
    block.texcoords.emplace_back();
    for (const Corner& corner : part.vertices) {
      const Vec3f t = corner.texcoord == no_index ? Vec3f{} : mesh_.texcoords[corner.texcoord];
      block.texcoords[0].push_back({t.x, mesh_.texcoords_from_top || corner.texcoord == no_index ? t.y : 1 - t.y});
    }
    for (std::size_t set = 1;; ++set) {
      const std::string name = "texcoord" + std::to_string(set);
      const VertexProperty *u = property(name + "_u"), *v = property(name + "_v");
      if (u == nullptr || v == nullptr) return;
      block.texcoords.emplace_back();
      for (const Corner& corner : part.vertices)
        block.texcoords.back().push_back(
            {static_cast<float>(u->values[corner.v]), static_cast<float>(v->values[corner.v])});
    }
  }

  void add_colours(const Part& part, VertexBlock& block) const {
    const VertexProperty *red = property("red"), *green = property("green"), *blue = property("blue");
    const VertexProperty* alpha = property("alpha");
    if (red == nullptr || green == nullptr || blue == nullptr) return;
    block.with_alpha = alpha != nullptr;
    for (const Corner& corner : part.vertices) {
      std::array<float, 4> colour{1, 1, 1, 1};
      const std::array<const VertexProperty*, 4> all{red, green, blue, alpha};
      for (std::size_t c = 0; c < 4; ++c) {
        if (all[c] == nullptr) continue;
        const bool bytes = all[c]->type == "uchar" || all[c]->type == "uint8";
        const double value = bytes ? all[c]->values[corner.v] / 255 : all[c]->values[corner.v];
        colour[c] = static_cast<float>(value > 0 ? std::min(value, 1.0) : 0.0);  // NaN: 0
      }
      block.colours.push_back(colour);
    }
  }

  /// What glTF lets programs keep at vertices: properties "_NAME", or "_NAME.x" and so on.
  void add_others(const Part& part, VertexBlock& block) const {
    for (const VertexProperty& p : mesh_.properties) {
      const std::size_t dot = p.name.size() < 2 ? 0 : p.name.size() - 2;
      const bool several = p.name.substr(dot) == ".x";
      const std::string name = several ? p.name.substr(0, dot) : p.name;
      if (!is_other_attribute(name) || (!several && p.name[dot] == '.')) continue;
      std::vector<const VertexProperty*> columns{&p};
      for (const char* next : {".y", ".z", ".w"}) {
        const VertexProperty* column = several ? property(name + next) : nullptr;
        if (column == nullptr) break;
        columns.push_back(column);
      }
      VertexAttribute other{name, columns.size(), {}};
      for (const Corner& corner : part.vertices)
        for (const VertexProperty* column : columns) {
          const auto value = static_cast<float>(column->values[corner.v]);
          other.values.push_back(std::isfinite(value) ? value : 0);  // glTF has no others
        }
      block.others.push_back(std::move(other));
    }
  }

  const Mesh& mesh_;
  const std::string& name_;
  std::vector<Part> parts_;
  std::shared_ptr<const Appearance> look_;
};

}  // namespace internal

/// Throws what validate() throws. `name`: of parts that have none.
inline MeshScene scene_from(const Mesh& mesh, const std::string& name = "mesh") {
  validate(mesh, name);
  return internal::SceneFromMesh(mesh, name).make();
}

}  // namespace npt::inline NPT_ABI
