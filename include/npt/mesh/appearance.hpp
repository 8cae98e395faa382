/// How a mesh looks, as glTF says it: materials, textures, samplers and images. It rides along with a mesh untouched,
/// so that what is written in another pose looks as what was read.
#pragma once

#include <npt/config.hpp>

#include <string>
#include <vector>

namespace npt::inline NPT_ABI {

/// A picture as its file holds it, never decoded.
struct AppearanceImage {
  std::string name, mime_type, bytes;
};

/// A glTF material: `json` is its object as it came; empty: a dull grey one. The mesh's tags "usemtl" name it
/// by `label`, one line that no other material has.
struct AppearanceMaterial {
  std::string label, json;
};

/// Indices within the JSON texts (a material's textures, a texture's source and sampler) count these lists.
struct Appearance {
  std::vector<AppearanceMaterial> materials;
  std::vector<std::string> textures, samplers;  ///< JSON objects
  std::vector<AppearanceImage> images;
  std::vector<std::string> extensions_used, extensions_required;  ///< those that the JSON texts name
};

}  // namespace npt::inline NPT_ABI
