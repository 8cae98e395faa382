#include <formats/read.hpp>

#include <npt/base/error.hpp>
#include <npt/io/file.hpp>
#include <npt/io/text.hpp>
#include <npt/mesh/triangles.hpp>

#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <assimp/Importer.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

namespace formats {

namespace {

namespace fs = std::filesystem;

/// From assimp's scene, which it keeps, to npt's.
class ForeignScene {
 public:
  /// `notes`: of what was repaired, or nullptr
  ForeignScene(const fs::path& path, std::vector<std::string>* notes)
      : path_(path), name_(path.string()), notes_(notes) {
    extension_ = npt::lower_case(path.extension().string());
  }

  npt::Scene read() {
    const std::string bytes = npt::read_file(path_);  // for the errors of what isn't there or can't be read
    check_whole(bytes);
    importer_.SetPropertyBool(AI_CONFIG_IMPORT_FBX_READ_CAMERAS, false);
    importer_.SetPropertyBool(AI_CONFIG_IMPORT_FBX_READ_LIGHTS, false);
    importer_.SetPropertyBool(AI_CONFIG_IMPORT_NO_SKELETON_MESHES, true);
    source_ = importer_.ReadFile(name_, aiProcess_ValidateDataStructure);
    if (source_ == nullptr) fail("", "what assimp refuses (" + one_line(importer_.GetErrorString()) + ")", kind());
    triangulate();
    // A file of clips has a skeleton and no mesh; assimp calls such a scene incomplete.
    if (source_->mRootNode == nullptr || (source_->mNumMeshes == 0 && source_->mNumAnimations == 0))
      fail("", "no mesh", "one at least");
    read_materials();
    scene_.nodes.push_back({.name = "scene", .matrix = to_metres()});
    add_node(*source_->mRootNode, 0);
    for (const auto& [node, number] : meshes_of_) add_mesh(*node, number);
    for (unsigned i = 0; i < source_->mNumAnimations; ++i) add_clip(*source_->mAnimations[i], i);
    return std::move(scene_);
  }

  /// What of the file isn't in the scene. Called after read().
  std::vector<std::string> lost() const {
    std::vector<std::string> result = lost_pictures_;
    const auto add = [&](std::size_t count, const std::string& what) {
      if (count > 0) result.push_back(what);
    };
    add(source_->mNumCameras + source_->mNumLights, "cameras and lights");
    std::size_t maps = 0, clear = 0, glowing = 0, colours = 0, curves = 0;
    for (unsigned i = 0; i < source_->mNumMaterials; ++i) {
      const aiMaterial& material = *source_->mMaterials[i];
      for (int type = aiTextureType_NONE + 1; type <= AI_TEXTURE_TYPE_MAX; ++type)
        if (type != aiTextureType_DIFFUSE && type != aiTextureType_BASE_COLOR)
          maps += material.GetTextureCount(static_cast<aiTextureType>(type));
      ai_real opacity = 1;
      aiColor3D glow(0, 0, 0);
      if (material.Get(AI_MATKEY_OPACITY, opacity) == AI_SUCCESS && opacity < 1) ++clear;
      if (material.Get(AI_MATKEY_COLOR_EMISSIVE, glow) == AI_SUCCESS && !glow.IsBlack()) ++glowing;
    }
    for (unsigned i = 0; i < source_->mNumMeshes; ++i)
      colours += source_->mMeshes[i]->GetNumColorChannels() > 1 ? 1U : 0U;
    for (unsigned i = 0; i < source_->mNumAnimations; ++i)
      curves += source_->mAnimations[i]->mNumMorphMeshChannels + source_->mAnimations[i]->mNumMeshChannels;
    add(maps, "materials' pictures of normals, shine, glow and transparency: " + std::to_string(maps));
    add(clear, "transparency of materials: " + std::to_string(clear));
    add(glowing, "glow of materials: " + std::to_string(glowing));
    add(colours, "second and further vertex colours of meshes: " + std::to_string(colours));
    add(curves, "curves of blend shapes: " + std::to_string(curves));
    result.emplace_back("polygons, as triangles; shine of materials; custom properties; constraints");
    return result;
  }

 private:
  [[noreturn]] void fail(const std::string& place, const std::string& found, const std::string& expected) const {
    throw npt::Error({name_, place, found, expected});
  }
  static std::string one_line(std::string text) {
    for (char& c : text)
      if (static_cast<unsigned char>(c) < 0x20) c = ' ';
    return text;
  }
  std::string kind() const {
    return "a whole " + extension_ + " file" + (is_soup() ? "" : ", or a GLB that Blender makes of it");
  }
  bool is_soup() const { return extension_ == ".stl"; }

  /// Names are kept as UTF-8, as glTF wants them.
  static std::string text(const aiString& string) {
    const nlohmann::json json = std::string(string.C_Str());
    return one_line(
        nlohmann::json::parse(json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace)).get<std::string>());
  }

  /// assimp reads FBX from version 7.1 on, that of 2011, and so does Blender.
  void check_version(const std::string& bytes) const {
    constexpr std::uint32_t least = 7100;
    std::uint32_t version = least;
    if (bytes.starts_with("Kaydara FBX Binary") && bytes.size() >= 27) {
      version = 0;
      for (std::size_t i = 4; i-- > 0;) version = version << 8 | static_cast<unsigned char>(bytes[23 + i]);
    } else if (const std::size_t at = bytes.find("FBXVersion:"); at != std::string::npos) {
      std::string_view rest = std::string_view(bytes).substr(at + 11);
      version = npt::parse_number<std::uint32_t>(npt::next_word(rest)).value_or(least);
    }
    if (version >= least) return;
    const std::string digit = std::to_string(version / 100 % 10);
    fail("", "an FBX of version " + std::to_string(version / 1000) + "." + digit,
         "7.1 (2011) or later: FBX2glTF makes a GLB of it, Autodesk's FBX Converter an FBX of 2013");
  }

  /// assimp takes an ASCII STL that ends early for one of fewer triangles.
  void check_whole(const std::string& bytes) const {
    if (extension_ == ".fbx") check_version(bytes);
    if (extension_ != ".stl" || !bytes.starts_with("solid")) return;
    if (bytes.size() >= 84) {  // binary files may begin so too
      std::uint32_t count = 0;
      for (std::size_t i = 4; i-- > 0;) count = count << 8 | static_cast<unsigned char>(bytes[80 + i]);
      if (84 + std::uint64_t{50} * count == bytes.size()) return;
    }
    if (bytes.rfind("endsolid") == std::string::npos || bytes.rfind("endsolid") < bytes.rfind("facet"))
      fail("the end", "no 'endsolid'", kind());
  }

  // Polygons.

  /// Corners of more than four, which no other face has.
  using Polygons = std::vector<std::vector<unsigned>>;

  /// assimp cuts polygons at their ears. One that crosses itself may have none: it is left out in part, and vertices
  /// would be lost. Such polygons become fans.
  void triangulate() {
    std::vector<Polygons> polygons;
    for (unsigned m = 0; m < source_->mNumMeshes; ++m) polygons.push_back(polygons_of(*source_->mMeshes[m]));
    source_ = importer_.ApplyPostProcessing(aiProcess_Triangulate);
    if (source_ == nullptr) fail("", "polygons that assimp can't cut", kind());
    std::size_t count = 0;
    for (unsigned m = 0; m < source_->mNumMeshes && m < polygons.size(); ++m)
      count += make_fans(*source_->mMeshes[m], polygons[m]);
    if (count > 0 && notes_ != nullptr)
      notes_->push_back(name_ + ": " + std::to_string(count) +
                        (count == 1 ? " polygon that crosses itself" : " polygons that cross themselves") +
                        ": cut into triangles from the first corner");
  }

  static Polygons polygons_of(const aiMesh& mesh) {
    std::vector<unsigned> uses(mesh.mNumVertices);
    Polygons result;
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      const aiFace& face = mesh.mFaces[f];
      const std::span corners(face.mIndices, face.mNumIndices);
      for (const unsigned v : corners)
        if (v < uses.size()) ++uses[v];
      if (corners.size() > 4) result.emplace_back(corners.begin(), corners.end());
    }
    const auto alone = [&](unsigned v) { return v < uses.size() && uses[v] == 1; };
    std::erase_if(result, [&](const auto& corners) { return !std::ranges::all_of(corners, alone); });
    return result;
  }

  /// Writes down the triangles of a mesh where assimp left out some of its polygons' ones. Returns how many polygons.
  std::size_t make_fans(const aiMesh& mesh, const Polygons& polygons) {
    if (polygons.empty()) return 0;
    std::vector<std::size_t> polygon_of(mesh.mNumVertices, npt::no_item), found(polygons.size());
    for (std::size_t p = 0; p < polygons.size(); ++p)
      for (const unsigned v : polygons[p]) polygon_of[v] = p;
    std::vector<npt::Triangle> triangles = triangles_of(mesh);
    const auto polygon = [&](const npt::Triangle& t) {
      return t[0] < polygon_of.size() ? polygon_of[t[0]] : npt::no_item;
    };
    for (const npt::Triangle& t : triangles)
      if (const std::size_t p = polygon(t); p != npt::no_item) ++found[p];
    const auto torn = [&](std::size_t p) { return p != npt::no_item && found[p] + 2 < polygons[p].size(); };
    std::erase_if(triangles, [&](const npt::Triangle& t) { return torn(polygon(t)); });
    std::size_t count = 0;
    for (std::size_t p = 0; p < polygons.size(); ++p) {
      if (!torn(p)) continue;
      ++count;
      for (std::size_t c = 2; c < polygons[p].size(); ++c)
        triangles.push_back({polygons[p][0], polygons[p][c - 1], polygons[p][c]});
    }
    if (count > 0) repaired_[&mesh] = std::move(triangles);
    return count;
  }

  /// Points and lines are left out.
  std::vector<npt::Triangle> triangles_of(const aiMesh& mesh) const {
    if (const auto repaired = repaired_.find(&mesh); repaired != repaired_.end()) return repaired->second;
    std::vector<npt::Triangle> result;
    for (unsigned f = 0; f < mesh.mNumFaces; ++f)
      if (const aiFace& face = mesh.mFaces[f]; face.mNumIndices == 3)
        result.push_back({face.mIndices[0], face.mIndices[1], face.mIndices[2]});
    return result;
  }

  // Materials: a name, a colour, and a picture.

  void read_materials() {
    if (is_soup()) return;
    auto look = std::make_shared<npt::Appearance>();
    std::set<std::string> labels;
    for (unsigned i = 0; i < source_->mNumMaterials; ++i) {
      const aiMaterial& material = *source_->mMaterials[i];
      aiString own;
      std::string label = material.Get(AI_MATKEY_NAME, own) == AI_SUCCESS ? text(own) : std::string();
      if (label.empty()) label = "material_" + std::to_string(i);
      const std::string stem = label;
      for (int n = 1; !labels.insert(label).second; ++n) label = stem + "." + std::to_string(n);
      aiColor4D colour(0.8F, 0.8F, 0.8F, 1);
      material.Get(AI_MATKEY_COLOR_DIFFUSE, colour);
      const auto clamped = [](float c) { return c > 0 ? std::min(c, 1.0F) : 0.0F; };
      nlohmann::json pbr{{"metallicFactor", 0}, {"roughnessFactor", 0.8}};
      if (const auto texture = texture_of(material, *look)) {
        pbr["baseColorTexture"]["index"] = *texture;
        colour = aiColor4D(1, 1, 1, 1);
      }
      pbr["baseColorFactor"] = {clamped(colour.r), clamped(colour.g), clamped(colour.b), 1};
      look->materials.push_back({label, nlohmann::json{{"name", label}, {"pbrMetallicRoughness", pbr}}.dump()});
    }
    scene_.appearance = std::move(look);
  }

  /// The number of the texture with the material's picture: in the file, or beside it. Nothing where there is none, or
  /// none that glTF may hold.
  std::optional<std::size_t> texture_of(const aiMaterial& material, npt::Appearance& look) {
    aiString where;
    if (material.GetTexture(aiTextureType_DIFFUSE, 0, &where) != AI_SUCCESS &&
        material.GetTexture(aiTextureType_BASE_COLOR, 0, &where) != AI_SUCCESS)
      return std::nullopt;
    const std::string file = text(where);
    if (const auto known = textures_.find(file); known != textures_.end()) return known->second;
    std::string bytes;
    if (const aiTexture* own = source_->GetEmbeddedTexture(where.C_Str())) {
      if (own->mHeight == 0) bytes.assign(reinterpret_cast<const char*>(own->pcData), own->mWidth);
    } else {
      // Authors' absolute paths and their backslashes: the name alone says which file it is.
      std::string plain = file;
      std::ranges::replace(plain, '\\', '/');
      const fs::path beside = path_.parent_path() / fs::path(plain).filename();
      std::error_code code;
      if (!fs::path(plain).filename().empty() && fs::is_regular_file(beside, code)) bytes = npt::read_file(beside);
    }
    const bool png = bytes.starts_with("\x89PNG"), jpeg = bytes.starts_with("\xFF\xD8\xFF");
    if (!png && !jpeg) {
      const std::string why = bytes.empty() ? "isn't in the file or beside it" : "is neither PNG nor JPEG";
      if (missing_.insert(file).second) lost_pictures_.push_back("the picture '" + file + "', which " + why);
      return std::nullopt;
    }
    look.images.push_back({fs::path(file).filename().string(), png ? "image/png" : "image/jpeg", std::move(bytes)});
    look.textures.push_back(nlohmann::json{{"source", look.images.size() - 1}}.dump());
    return textures_[file] = look.textures.size() - 1;
  }

  // Nodes.

  npt::Affine affine(const aiMatrix4x4& m, const std::string& place) const {
    const auto row = [](float x, float y, float z) { return npt::Vec3f{x, y, z}.as<double>(); };
    const npt::Affine result{{{row(m.a1, m.a2, m.a3), row(m.b1, m.b2, m.b3), row(m.c1, m.c2, m.c3)}},
                             row(m.a4, m.b4, m.c4)};
    for (const npt::Vec3d v : {result.linear.rows[0], result.linear.rows[1], result.linear.rows[2], result.shift})
      if (!npt::is_finite(v)) fail(place, "a matrix with a number that is not finite", "finite numbers");
    return result;
  }

  void add_node(const aiNode& node, std::size_t parent) {
    const std::size_t number = scene_.nodes.size();
    const std::string own = text(node.mName);
    scene_.nodes.push_back(
        {.name = own, .parent = parent, .matrix = affine(node.mTransformation, "node '" + own + "'")});
    // Bones and clips name nodes: of several with one name a joint is meant rather than a mesh.
    const auto [known, fresh] = numbers_.emplace(node.mName.C_Str(), number);
    const bool mesh_before = !fresh && std::ranges::find(meshes_of_, known->second,
                                                         [](const auto& m) { return m.second; }) != meshes_of_.end();
    if (mesh_before && node.mNumMeshes == 0) known->second = number;
    if (node.mNumMeshes > 0) meshes_of_.emplace_back(&node, number);
    for (unsigned i = 0; i < node.mNumChildren; ++i) add_node(*node.mChildren[i], number);
  }

  /// FBX says what its numbers mean and assimp leaves them; of Collada it makes metres with y up; the others don't say.
  npt::Affine to_metres() const {
    if (extension_ != ".fbx" || source_->mMetaData == nullptr) return {};
    const auto number = [&](const char* name, std::int32_t otherwise) {
      source_->mMetaData->Get(name, otherwise);
      return otherwise;
    };
    double centimetres = 1;
    float as_float = 0;
    if (!source_->mMetaData->Get("UnitScaleFactor", centimetres) &&
        source_->mMetaData->Get("UnitScaleFactor", as_float))
      centimetres = static_cast<double>(as_float);
    if (!(centimetres > 0 && std::isfinite(centimetres))) centimetres = 1;
    const auto axis = [&](const char* name, const char* sign, std::int32_t otherwise) {
      const std::int32_t n = number(name, otherwise);
      const double d = number(sign, 1) < 0 ? -1 : 1;
      return npt::Vec3d{n == 0 ? d : 0, n == 1 ? d : 0, n == 2 ? d : 0};
    };
    npt::Vec3d up = axis("UpAxis", "UpAxisSign", 1), front = axis("FrontAxis", "FrontAxisSign", 2);
    if (dot(up, up) != 1 || dot(front, front) != 1 || dot(up, front) != 0) up = {0, 1, 0}, front = {0, 0, 1};
    const double metres = 0.01 * centimetres;
    return {{{cross(up, front) * metres, up * metres, front * metres}}, {}};
  }

  // Meshes.

  /// The joints of a node's skin: a bone has a matrix for each mesh.
  std::uint16_t joint(npt::Skin& skin, std::size_t node, const npt::Affine& inverse_bind) const {
    for (std::size_t j = 0; j < skin.joints.size(); ++j)
      if (skin.joints[j] == node && skin.inverse_binds[j] == inverse_bind) return static_cast<std::uint16_t>(j);
    if (skin.joints.size() >= 0xFFFF) fail("", "more than 65535 joints", "fewer");
    skin.joints.push_back(node);
    skin.inverse_binds.push_back(inverse_bind);
    return static_cast<std::uint16_t>(skin.joints.size() - 1);
  }

  struct Influence {
    std::uint16_t joint = 0;
    float weight = 0;
  };

  /// [V] The joints of each vertex; empty where the mesh has no bones.
  std::vector<std::vector<Influence>> influences_of(const aiMesh& mesh, std::size_t node, npt::Skin& skin) const {
    std::vector<std::vector<Influence>> influences;
    for (unsigned b = 0; b < mesh.mNumBones; ++b) {
      const aiBone& bone = *mesh.mBones[b];
      if (bone.mNumWeights == 0) continue;
      const auto found = numbers_.find(bone.mName.C_Str());
      const std::string place = "bone '" + text(bone.mName) + "'";
      if (found == numbers_.end()) fail(place, "no node of its name", "one");
      influences.resize(mesh.mNumVertices);
      const std::uint16_t own = joint(skin, found->second, affine(bone.mOffsetMatrix, place));
      for (unsigned w = 0; w < bone.mNumWeights; ++w) {
        const aiVertexWeight& weight = bone.mWeights[w];
        if (weight.mVertexId >= mesh.mNumVertices)
          fail(place, "vertex " + std::to_string(weight.mVertexId), "below " + std::to_string(mesh.mNumVertices));
        if (!(weight.mWeight >= 0 && std::isfinite(weight.mWeight)))
          fail(place, "weight " + std::to_string(weight.mWeight), "one that is not negative");
        if (weight.mWeight > 0) influences[weight.mVertexId].push_back({own, weight.mWeight});
      }
    }
    // What no bone moves, its node does.
    for (auto& own : influences)
      if (own.empty()) own.push_back({joint(skin, node, {}), 1});
    return influences;
  }

  void add_mesh(const aiNode& node, std::size_t number) {
    npt::SceneMesh made{.name = scene_.nodes[number].name};
    npt::Skin skin{.name = made.name, .joints = {}, .inverse_binds = {}};
    for (unsigned i = 0; i < node.mNumMeshes; ++i) add_part(*source_->mMeshes[node.mMeshes[i]], number, made, skin);
    if (std::ranges::any_of(made.primitives, [](const npt::ScenePrimitive& p) { return !p.triangles.empty(); })) {
      std::vector<npt::ScenePrimitive> kept;  // points and lines beside surfaces are left out
      std::vector<npt::VertexBlock> blocks;
      for (npt::ScenePrimitive& p : made.primitives) {
        if (p.triangles.empty()) continue;
        blocks.push_back(std::move(made.blocks[p.block]));
        p.block = blocks.size() - 1;
        kept.push_back(std::move(p));
      }
      made.primitives = std::move(kept);
      made.blocks = std::move(blocks);
    }
    even_out_shapes(made);
    scene_.nodes[number].mesh = scene_.meshes.size();
    scene_.shown.push_back(number);
    scene_.meshes.push_back(std::move(made));
    if (skin.joints.empty()) return;
    scene_.nodes[number].skin = scene_.skins.size();
    scene_.skins.push_back(std::move(skin));
  }

  /// Corners of faces have vertices of their own in these files, or in what assimp makes of them: those that are the
  /// same in all that they have become one, in the order in which the file has them first. STL only knows places.
  void add_part(const aiMesh& mesh, std::size_t node, npt::SceneMesh& made, npt::Skin& skin) {
    if ((total_ += mesh.mNumVertices) > most_vertices)
      fail("", "more than " + std::to_string(most_vertices) + " vertices", "fewer");
    const auto influences = influences_of(mesh, node, skin);
    const bool plain = is_soup();
    std::size_t sets = 0;
    while (!plain && sets < AI_MAX_NUMBER_OF_TEXTURECOORDS && mesh.HasTextureCoords(static_cast<unsigned>(sets)))
      ++sets;
    const bool with_normals = !plain && mesh.HasNormals(), with_colours = mesh.HasVertexColors(0);

    npt::VertexBlock block;
    block.texcoords.resize(sets);
    std::size_t most = 0;
    for (const auto& own : influences) most = std::max(most, own.size());
    block.influences = (most + 3) / 4 * 4;
    if (!plain) block.targets.resize(mesh.mNumAnimMeshes);
    std::unordered_map<std::string, std::uint32_t> known;
    std::vector<std::uint32_t> place(mesh.mNumVertices, npt::no_index);
    std::string key;
    const auto add = [&key](float value) {
      const float plus_zero = value + 0.0F;
      key.append(reinterpret_cast<const char*>(&plus_zero), sizeof plus_zero);
    };
    const auto number_of = [&](unsigned v) {
      if (place[v] != npt::no_index) return place[v];
      key.clear();
      const aiVector3D& p = mesh.mVertices[v];
      for (const float x : {p.x, p.y, p.z}) {
        if (!std::isfinite(x)) fail("vertex " + std::to_string(v), std::to_string(x), "a finite number");
        add(x);
      }
      aiVector3D n = with_normals ? mesh.mNormals[v] : aiVector3D();
      if (!std::isfinite(n.x) || !std::isfinite(n.y) || !std::isfinite(n.z)) n = {};
      for (const float x : {n.x, n.y, n.z}) add(x);
      for (unsigned s = 0; s < sets; ++s) add(mesh.mTextureCoords[s][v].x), add(mesh.mTextureCoords[s][v].y);
      const aiColor4D colour = with_colours ? mesh.mColors[0][v] : aiColor4D(1, 1, 1, 1);
      for (const float x : {colour.r, colour.g, colour.b, colour.a}) add(x);
      if (!influences.empty())
        for (const Influence& i : influences[v]) add(static_cast<float>(i.joint)), add(i.weight);
      for (std::size_t t = 0; t < block.targets.size(); ++t) {
        const npt::Vec3f move = shape_move(mesh, t, v);
        for (const float x : {move.x, move.y, move.z}) add(x);
      }
      const auto [found, fresh] = known.emplace(key, static_cast<std::uint32_t>(block.positions.size()));
      place[v] = found->second;
      if (!fresh) return place[v];
      block.positions.push_back({p.x, p.y, p.z});
      if (with_normals) block.normals.push_back({n.x, n.y, n.z});
      for (unsigned s = 0; s < sets; ++s) {
        const aiVector3D& t = mesh.mTextureCoords[s][v];
        const bool good = std::isfinite(t.x) && std::isfinite(t.y);
        block.texcoords[s].push_back({good ? t.x : 0, good ? 1 - t.y : 0});  // counts from the bottom there
      }
      if (with_colours) {
        block.colours.push_back({colour.r, colour.g, colour.b, colour.a});
        for (float& c : block.colours.back()) c = c > 0 ? std::min(c, 1.0F) : 0.0F;
        block.with_alpha = block.with_alpha || block.colours.back()[3] < 1;
      }
      if (!influences.empty()) add_influences(influences[v], block);
      for (std::size_t t = 0; t < block.targets.size(); ++t)
        block.targets[t].positions.push_back(shape_move(mesh, t, v));
      return place[v];
    };
    npt::ScenePrimitive primitive{.block = made.blocks.size()};
    if (scene_.appearance != nullptr && mesh.mMaterialIndex < scene_.appearance->materials.size())
      primitive.material = mesh.mMaterialIndex;
    for (npt::Triangle triangle : triangles_of(mesh)) {
      for (std::uint32_t& corner : triangle) {
        if (corner >= mesh.mNumVertices)
          fail("triangle " + std::to_string(primitive.triangles.size()), "vertex " + std::to_string(corner),
               "below " + std::to_string(mesh.mNumVertices));
        corner = number_of(corner);
      }
      primitive.triangles.push_back(triangle);
    }
    if (mesh.mNumFaces == 0 || primitive.triangles.empty())
      for (unsigned v = 0; v < mesh.mNumVertices; ++v) number_of(v);
    made.blocks.push_back(std::move(block));
    made.primitives.push_back(std::move(primitive));
  }

  /// How far a blend shape takes a vertex.
  npt::Vec3f shape_move(const aiMesh& mesh, std::size_t number, unsigned vertex) const {
    const aiAnimMesh& shape = *mesh.mAnimMeshes[number];
    if (shape.mVertices == nullptr || vertex >= shape.mNumVertices) return {};
    const aiVector3D move = shape.mVertices[vertex] - mesh.mVertices[vertex];
    if (!std::isfinite(move.x) || !std::isfinite(move.y) || !std::isfinite(move.z))
      fail("blend shape " + std::to_string(number), "a number that is not finite", "finite numbers");
    return {move.x, move.y, move.z};
  }
  /// A mesh's blocks have the same blend shapes: what one lacks doesn't move it.
  static void even_out_shapes(npt::SceneMesh& mesh) {
    std::size_t most = 0;
    for (const npt::VertexBlock& block : mesh.blocks) most = std::max(most, block.targets.size());
    for (npt::VertexBlock& block : mesh.blocks) {
      block.targets.resize(most);
      for (npt::MorphTarget& target : block.targets) target.positions.resize(block.positions.size());
    }
    mesh.weights.assign(most, 0);
  }

  static void add_influences(const std::vector<Influence>& own, npt::VertexBlock& block) {
    double sum = 0;
    for (const Influence& i : own) sum += static_cast<double>(i.weight);
    for (std::size_t i = 0; i < block.influences; ++i) {
      block.joints.push_back(i < own.size() ? own[i].joint : std::uint16_t{0});
      block.weights.push_back(i < own.size() ? static_cast<float>(static_cast<double>(own[i].weight) / sum) : 0.0F);
    }
  }

  // Clips. They begin with their first key.

  void add_clip(const aiAnimation& animation, unsigned number) {
    npt::Clip clip{text(animation.mName), {}};
    if (clip.name.empty()) clip.name = "clip_" + std::to_string(number);
    const double ticks = animation.mTicksPerSecond > 0 ? animation.mTicksPerSecond : 25;
    double begin = std::numeric_limits<double>::infinity();
    const auto earliest = [&](const auto* keys, unsigned count) {
      for (unsigned i = 0; i < count; ++i) begin = std::min(begin, keys[i].mTime);
    };
    for (unsigned c = 0; c < animation.mNumChannels; ++c) {
      const aiNodeAnim& own = *animation.mChannels[c];
      earliest(own.mPositionKeys, own.mNumPositionKeys);
      earliest(own.mRotationKeys, own.mNumRotationKeys);
      earliest(own.mScalingKeys, own.mNumScalingKeys);
    }
    for (unsigned c = 0; c < animation.mNumChannels; ++c) {
      const aiNodeAnim& own = *animation.mChannels[c];
      const auto found = numbers_.find(own.mNodeName.C_Str());
      if (found == numbers_.end()) continue;
      const std::size_t node = found->second;
      make_place(node);
      const std::string place = "clip '" + clip.name + "', node '" + text(own.mNodeName) + "'";
      const auto channel = [&](npt::ChannelPath path, const auto* keys, unsigned count, auto&& values) {
        if (count == 0) return;
        npt::ClipChannel made{node,
                              path,
                              npt::Interpolation::linear,
                              path == npt::ChannelPath::rotation ? std::size_t{4} : std::size_t{3},
                              {},
                              {}};
        for (unsigned k = 0; k < count; ++k) {
          const auto time = static_cast<float>((keys[k].mTime - begin) / ticks);
          if (!std::isfinite(time) || (k > 0 && time < made.times.back()))
            fail(place, "key times that descend or are not finite", "ascending ones");
          made.times.push_back(time);
          values(keys[k], made.values);
        }
        for (const float v : made.values)
          if (!std::isfinite(v)) fail(place, "a value that is not finite", "finite ones");
        clip.channels.push_back(std::move(made));
      };
      const auto vector = [](const aiVectorKey& key, std::vector<float>& values) {
        values.insert(values.end(), {key.mValue.x, key.mValue.y, key.mValue.z});
      };
      channel(npt::ChannelPath::translation, own.mPositionKeys, own.mNumPositionKeys, vector);
      channel(npt::ChannelPath::rotation, own.mRotationKeys, own.mNumRotationKeys,
              [](const aiQuatKey& key, std::vector<float>& values) {
                values.insert(values.end(), {key.mValue.x, key.mValue.y, key.mValue.z, key.mValue.w});
              });
      channel(npt::ChannelPath::scale, own.mScalingKeys, own.mNumScalingKeys, vector);
    }
    if (!clip.channels.empty()) scene_.clips.push_back(std::move(clip));
  }

  /// A node that moves has a place instead of a matrix.
  void make_place(std::size_t number) {
    npt::SceneNode& node = scene_.nodes[number];
    if (!node.matrix) return;
    const npt::Matrix3 columns = node.matrix->linear.transposed();
    npt::Vec3d size{npt::length(columns.rows[0]), npt::length(columns.rows[1]), npt::length(columns.rows[2])};
    if (node.matrix->linear.determinant() < 0) size.x = -size.x;
    npt::Matrix3 turn = columns;
    turn.rows[0] = turn.rows[0] / (size.x != 0 ? size.x : 1);
    turn.rows[1] = turn.rows[1] / (size.y != 0 ? size.y : 1);
    turn.rows[2] = turn.rows[2] / (size.z != 0 ? size.z : 1);
    node.place = {node.matrix->shift, npt::quaternion_of(turn.transposed()), size};
    node.matrix.reset();
  }

  static constexpr std::size_t most_vertices = 100'000'000;

  fs::path path_;
  std::string name_, extension_;
  std::vector<std::string>* notes_;
  Assimp::Importer importer_;
  const aiScene* source_ = nullptr;
  npt::Scene scene_;
  std::map<std::string, std::size_t> numbers_;  ///< of nodes, by their name as it stands in the file
  std::map<std::string, std::size_t> textures_;
  std::set<std::string> missing_;
  std::vector<std::string> lost_pictures_;
  std::vector<std::pair<const aiNode*, std::size_t>> meshes_of_;
  std::map<const aiMesh*, std::vector<npt::Triangle>> repaired_;  ///< instead of the mesh's own
  std::size_t total_ = 0;
};

}  // namespace

bool reads_foreign() { return true; }

npt::Scene read_foreign(const std::filesystem::path& path, std::vector<std::string>* lost,
                        std::vector<std::string>* notes) {
  ForeignScene source(path, notes);
  npt::Scene scene = source.read();
  if (lost != nullptr) *lost = source.lost();
  return scene;
}

}  // namespace formats
