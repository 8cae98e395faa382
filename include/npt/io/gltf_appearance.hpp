/// The materials, textures and images of a glTF file, kept as they are. gltf.hpp says what is kept.
/// Errors    npt::Error for indices that lead nowhere and images that can't be read
#pragma once

#include <npt/config.hpp>
#include <npt/io/gltf_document.hpp>
#include <npt/io/gltf_uri.hpp>
#include <npt/mesh/appearance.hpp>

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

namespace internal {

/// folder: where images that the file names are looked for.
class GltfAppearanceReader {
 public:
  GltfAppearanceReader(const GltfDocument& document, const std::optional<std::filesystem::path>& folder)
      : document_(document), folder_(folder) {}

  /// Nothing where a file has no materials.
  std::shared_ptr<const Appearance> read() const {
    const std::vector<Item> materials = document_.objects(document_.root(), "materials");
    if (materials.empty()) return nullptr;
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
    return look;
  }

 private:
  using Kind = JsonValue::Kind;
  using Item = GltfItem;

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
                         : result.bytes.find("ftyp") == 4           ? "image/avif"
                                                                    : "image/ktx2";
    return result;
  }

  /// Indices that would lead nowhere in what is written.
  void check_references(const Appearance& look) const {
    for (const Item& item : document_.objects(document_.root(), "textures")) {
      document_.index(item, "source", look.images.size(), "images");
      document_.index(item, "sampler", look.samplers.size(), "samplers");
      // KTX2, WebP and AVIF pictures are named by extensions.
      const auto extensions = document_.member(item, "extensions", Kind::object);
      for (std::size_t i = 0; extensions && i < extensions->value->items.size(); ++i)
        if (const Item own{&extensions->value->items[i], extensions->place + "." + extensions->value->keys[i]};
            own.value->is(Kind::object))
          document_.index(own, "source", look.images.size(), "images");
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

  const GltfDocument& document_;
  const std::optional<std::filesystem::path>& folder_;
};

}  // namespace internal

}  // namespace npt::inline NPT_ABI
