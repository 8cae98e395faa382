/// A small scene as a GLB file: a triangle under two joints, with a morph target, a clip, a material and an image.
#pragma once

#include <npt/io/glb.hpp>

#include <bit>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <stdexcept>
#include <string>
#include <string_view>

namespace small_gltf {

inline std::string floats(std::initializer_list<float> values) {
  std::string bytes;
  for (const float v : values) npt::internal::append_little_u32(bytes, std::bit_cast<std::uint32_t>(v));
  return bytes;
}

/// Byte 0: positions, 36: moves of the morph target, 72: weights, 120: joints, 132: corners, 140: bind matrices, 268:
/// times, 276: rotations, 308: translations, 332: weights, 340: an image
inline std::string bytes() {
  std::string b = floats({0, 0, 0, 1, 0, 0, 0, 1, 0}) + floats({0, 0, 1, 0, 0, 1, 0, 0, 1});
  b += floats({1, 0, 0, 0, 0.5F, 0.5F, 0, 0, 0, 1, 0, 0});
  b += std::string("\0\0\0\0\0\1\0\0\0\1\0\0", 12);
  b += std::string("\0\0\1\0\2\0\0\0", 8);
  for (int j = 0; j < 2; ++j) b += floats({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1});
  b += floats({0, 1}) + floats({0, 0, 0, 1, 0, 0, 1, 0}) + floats({0, 0, 0, 2, 0, 0}) + floats({0, 1});
  return b + "\x89PNG";
}

inline std::string json() {
  return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0,1]}],)"
         R"("nodes":[{"name":"part","mesh":0,"skin":0},{"name":"root","children":[2]},{"name":"tip"}],)"
         R"("meshes":[{"name":"m","primitives":[{"attributes":{"POSITION":0,"JOINTS_0":3,"WEIGHTS_0":2},"indices":4,)"
         R"("material":0,"targets":[{"POSITION":1}]}],"weights":[0]}],)"
         R"("skins":[{"joints":[1,2],"inverseBindMatrices":5}],)"
         R"("animations":[{"name":"Armature|Wave","samplers":[{"input":6,"output":7},{"input":6,"output":8,)"
         R"("interpolation":"STEP"},{"input":6,"output":9}],)"
         R"("channels":[{"sampler":0,"target":{"node":2,"path":"rotation"}},)"
         R"({"sampler":1,"target":{"node":1,"path":"translation"}})"
         R"(,{"sampler":2,"target":{"node":0,"path":"weights"}}]},)"
         R"({"name":"Rest","samplers":[],"channels":[]}],)"
         R"("materials":[{"name":"skin","pbrMetallicRoughness":{"baseColorTexture":{"index":0}},"extras":{"a":1.50}}],)"
         R"("textures":[{"source":0}],"images":[{"bufferView":9,"mimeType":"image/png"}],)"
         R"("accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},)"
         R"({"bufferView":1,"componentType":5126,"count":3,"type":"VEC3"},)"
         R"({"bufferView":2,"componentType":5126,"count":3,"type":"VEC4"},)"
         R"({"bufferView":3,"componentType":5121,"count":3,"type":"VEC4"},)"
         R"({"bufferView":4,"componentType":5123,"count":3,"type":"SCALAR"},)"
         R"({"bufferView":5,"componentType":5126,"count":2,"type":"MAT4"},)"
         R"({"bufferView":6,"componentType":5126,"count":2,"type":"SCALAR"},)"
         R"({"bufferView":7,"componentType":5126,"count":2,"type":"VEC4"},)"
         R"({"bufferView":8,"componentType":5126,"count":2,"type":"VEC3"},)"
         R"({"bufferView":8,"byteOffset":24,"componentType":5126,"count":2,"type":"SCALAR"}],)"
         R"("bufferViews":[{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":36},)"
         R"({"buffer":0,"byteOffset":72,"byteLength":48},{"buffer":0,"byteOffset":120,"byteLength":12},)"
         R"({"buffer":0,"byteOffset":132,"byteLength":6},{"buffer":0,"byteOffset":140,"byteLength":128},)"
         R"({"buffer":0,"byteOffset":268,"byteLength":8},{"buffer":0,"byteOffset":276,"byteLength":32},)"
         R"({"buffer":0,"byteOffset":308,"byteLength":32},{"buffer":0,"byteOffset":340,"byteLength":4}],)"
         R"("buffers":[{"byteLength":344}]})";
}

inline std::string file(const std::string& json_text = json(), const std::string& data = bytes()) {
  return npt::internal::format_glb(json_text, data, "small");
}

/// The file with `from` in its JSON, which must be there, replaced by `to`.
inline std::string changed(std::string_view from, std::string_view to) {
  std::string text = json();
  const std::size_t at = text.find(from);
  if (at == std::string::npos) throw std::logic_error("small_gltf has no " + std::string(from));
  return file(text.replace(at, from.size(), to));
}
/// The file with other bytes from `at` on.
inline std::string with_bytes(std::size_t at, std::string_view values) {
  return file(json(), bytes().replace(at, values.size(), values));
}

inline std::string from_hex(std::string_view digits) {
  std::string bytes;
  for (std::size_t i = 0; i + 1 < digits.size(); i += 2)
    bytes += static_cast<char>(std::stoi(std::string(digits.substr(i, 2)), nullptr, 16));
  return bytes;
}

/// The file with its positions and corners as meshoptimizer compresses them: positions as normalised 16-bit integers.
inline std::string packed_file() {
  const std::string
      positions = from_hex(
          "a00118000000013c000000fefd0104000000010c000000fe00000000000000000000000000000000000000000000000000000000"
          "0000000000000000"),
      corners = from_hex("e1f0007687566778a9866589689801690000");
  std::string text = json();
  const auto replace = [&text](std::string_view from, std::string_view to) {
    text.replace(text.find(from), from.size(), to);
  };
  replace(R"("bufferViews":[{"buffer":0,"byteLength":36})",
          R"("bufferViews":[{"buffer":1,"byteLength":24,"byteStride":8,"extensions":{"EXT_meshopt_compression":{)"
          R"("buffer":0,"byteOffset":344,"byteLength":60,"byteStride":8,"mode":"ATTRIBUTES","count":3}}})");
  replace(R"({"buffer":0,"byteOffset":132,"byteLength":6})",
          R"({"buffer":1,"byteOffset":24,"byteLength":6,"extensions":{"EXT_meshopt_compression":{"buffer":0,)"
          R"("byteOffset":404,"byteLength":18,"byteStride":2,"mode":"TRIANGLES","count":3}}})");
  replace(R"({"bufferView":0,"componentType":5126)", R"({"bufferView":0,"componentType":5122,"normalized":true)");
  replace(R"("buffers":[{"byteLength":344}])",
          R"("buffers":[{"byteLength":422},{"byteLength":32}],)"
          R"("extensionsUsed":["KHR_mesh_quantization","EXT_meshopt_compression"],)"
          R"("extensionsRequired":["KHR_mesh_quantization","EXT_meshopt_compression"])");
  return file(text, bytes() + positions + corners);
}

}  // namespace small_gltf
