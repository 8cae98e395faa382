/// A glTF document and the files that it names as one GLB. Nothing is decoded: the first buffer becomes the GLB's own,
/// pictures stand behind it; further buffers, and what can't stand there, become data URIs.
/// Errors    npt::Error: no glTF, files outside of the document's folder or missing, buffers that are too short
/// Source    glTF 2.0 specification, sections 3.6.1, 3.9.2 and 4.4
#pragma once

#include <npt/config.hpp>
#include <npt/io/glb.hpp>
#include <npt/io/glb_patch.hpp>
#include <npt/io/gltf_text.hpp>
#include <npt/io/gltf_uri.hpp>
#include <npt/io/json_tree.hpp>
#include <npt/io/text.hpp>

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI::internal {

/// The URIs of a document's buffers and pictures that lead to files, as they stand.
inline std::vector<std::string> named_files(const GltfText& text) {
  std::vector<std::string> uris;
  for (const char* key : {"buffers", "images"})
    for (std::size_t i = 0; i < text.count(text.root(), key); ++i)
      if (const JsonValue* uri = text.item(key, i).find("uri"); uri != nullptr && !uri->text.starts_with("data:"))
        uris.push_back(uri->text);
  return uris;
}

class GltfPacker {
 public:
  /// `document`: JSON text, which has to outlive it.
  GltfPacker(std::string_view document, const std::string& name, std::filesystem::path folder)
      : text_(document, name), folder_(std::move(folder)) {}

  std::string pack() {
    pack_buffers();
    pack_images();
    if (has_chunk_) text_.set_member(text_.item("buffers", 0), "byteLength", std::to_string(bytes_.size()));
    std::string json = text_.changed();
    if (json.starts_with("\xEF\xBB\xBF")) json.erase(0, 3);
    return format_glb(std::move(json), bytes_, text_.name());
  }

 private:
  static std::string place(const char* key, std::size_t i) {
    return std::string(key) + "[" + std::to_string(i) + "].uri";
  }
  UriBytes read(const JsonValue& uri, const std::string& at) const {
    return read_uri(uri.text, folder_, text_.name(), at);
  }
  static std::string data_uri(std::string_view bytes, const std::string& type) {
    return "\"data:" + type + ";base64," + to_base64(bytes) + "\"";
  }

  void pack_buffers() {
    for (std::size_t i = 0; i < text_.count(text_.root(), "buffers"); ++i) {
      const JsonValue& buffer = text_.item("buffers", i);
      const JsonValue *uri = buffer.find("uri"), *length = buffer.find("byteLength");
      if (uri == nullptr) continue;  // one that an extension fills
      const bool inside = uri->text.starts_with("data:");
      if (i > 0 && inside) continue;
      UriBytes file = read(*uri, place("buffers", i));
      const auto size = length == nullptr ? std::nullopt : length->whole();
      if (!size || *size > file.bytes.size())
        text_.fail("buffers[" + std::to_string(i) + "].byteLength", length == nullptr ? "none" : length->text,
                   "at most " + std::to_string(file.bytes.size()) + ", the bytes there");
      file.bytes.resize(static_cast<std::size_t>(*size));
      if (i > 0) {
        text_.set_member(buffer, "uri", data_uri(file.bytes, "application/octet-stream"));
        continue;
      }
      bytes_ = std::move(file.bytes);
      has_chunk_ = true;
      text_.remove_member(buffer, "uri");
    }
  }

  void pack_images() {
    std::size_t views = text_.count(text_.root(), "bufferViews");
    for (std::size_t i = 0; i < text_.count(text_.root(), "images"); ++i) {
      const JsonValue& image = text_.item("images", i);
      const JsonValue* uri = image.find("uri");
      if (uri == nullptr || uri->text.starts_with("data:")) continue;
      const std::string bytes = read(*uri, place("images", i)).bytes, type = picture_type(bytes);
      if (!has_chunk_ || type.empty()) {
        text_.set_member(image, "uri", data_uri(bytes, type.empty() ? "application/octet-stream" : type));
        continue;
      }
      bytes_.append(glb_end(bytes_.size()) - bytes_.size(), '\0');
      text_.add_item(text_.root(), "bufferViews",
                     "{\"buffer\":0,\"byteOffset\":" + std::to_string(bytes_.size()) +
                         ",\"byteLength\":" + std::to_string(bytes.size()) + "}");
      std::string members = "\"bufferView\":" + std::to_string(views++);
      if (image.find("mimeType") == nullptr) members += ",\"mimeType\":\"" + type + "\"";
      text_.replace_member(image, "uri", std::move(members));
      bytes_ += bytes;
    }
  }
  static std::string picture_type(std::string_view bytes) {
    return bytes.starts_with("\x89PNG")                                       ? "image/png"
           : bytes.starts_with("\xFF\xD8\xFF")                                ? "image/jpeg"
           : bytes.starts_with("RIFF") && bytes.substr(8).starts_with("WEBP") ? "image/webp"
           : bytes.starts_with("\xABKTX 20")                                  ? "image/ktx2"
                                                                              : "";
  }

  GltfText text_;
  std::filesystem::path folder_;
  std::string bytes_;
  bool has_chunk_ = false;
};

}  // namespace npt::inline NPT_ABI::internal
