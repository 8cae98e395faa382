/// What a weights file says of how meshes are to be transferred with it, and which options go together. Metadata keys:
/// normalisation (sphere, centre or none), unit ("metre"), refine_radius.
#pragma once

#include <npt/base/error.hpp>
#include <npt/config.hpp>
#include <npt/mesh/normalise.hpp>
#include <npt/nn/weights/weights_file.hpp>
#include <npt/transfer/options.hpp>
#include <npt/transfer/refinement.hpp>

#include <string>

namespace npt::inline NPT_ABI {

namespace internal {

/// The value of a key, or nullptr.
inline const std::string* find_value(const Metadata& metadata, const char* key) {
  const auto found = metadata.find(key);
  return found == metadata.end() ? nullptr : &found->second;
}

}  // namespace internal

/// The options with what `metadata` says for those that were left open. `name`: of the weights' file, for messages.
/// Errors    npt::Error that names the file and the key, for a value that can't be
NPT_INLINE TransferOptions complete_options(TransferOptions options, const Metadata& metadata,
                                            const std::string& name) {
  if (!options.network.normalisation) {
    const std::string* stored = internal::find_value(metadata, "normalisation");
    options.network.normalisation =
        stored == nullptr ? Normalisation::centre : parse_normalisation(*stored, name + ": metadata normalisation");
  }
  if (const std::string* radius = internal::find_value(metadata, "refine_radius"); radius && !options.refine_radius) {
    options.refine_radius = metadata_number(*radius, name, "refine_radius");
    if (!(*options.refine_radius > 0) || !(*options.refine_radius <= 10))
      throw Error({.file = name,
                   .place = "metadata refine_radius",
                   .found = "'" + *radius + "'",
                   .expected = "a number above 0, at most 10"});
  }
  if (!options.refine_radius) options.refine_radius = default_refine_radius;
  return options;
}

/// Whether the weights were trained on meshes in metres.
inline bool names_metres(const Metadata& metadata) {
  const std::string* unit = internal::find_value(metadata, "unit");
  return unit != nullptr && *unit == "metre";
}

/// Throws npt::Error for options that can't be. `paired`: whether the network pairs vertices.
NPT_INLINE void check_options(const TransferOptions& options, bool paired) {
  if (options.network.pairings < 1)
    throw Error({.file = "pairings", .found = std::to_string(options.network.pairings), .expected = "at least 1"});
  if (paired && options.network.pairing == Pairing::as_given && options.network.pairings > 1)
    throw Error({.file = "pairings",
                 .found = std::to_string(options.network.pairings) + " with vertices paired as given",
                 .expected = "1: only random pairings differ"});
  if (options.import.unit && (!(*options.import.unit > 0) || !(*options.import.unit <= 1e6)))
    throw Error(
        {.file = "unit", .found = std::to_string(*options.import.unit), .expected = "metres, above 0, at most 1e6"});
}

}  // namespace npt::inline NPT_ABI
