/// Buffer views that meshoptimizer compressed (EXT_meshopt_compression), decoded. Its own decoder and not Debian's
/// libmeshoptimizer: that is a shared library alone, which a Python package and a page in a browser can't bring along.
/// KHR_meshopt_compression has the same streams, and others, of version 1 and with the filter COLOR, which are refused.
/// Errors    npt::Error for modes and filters that the extension doesn't have, counts that don't fit them, and bytes
///           that end early or are too many
/// Source    Khronos, EXT_meshopt_compression (ratified)
#pragma once

#include <npt/base/error.hpp>
#include <npt/config.hpp>
#include <npt/io/meshopt_attributes.hpp>
#include <npt/io/meshopt_filters.hpp>
#include <npt/io/meshopt_indices.hpp>
#include <npt/io/meshopt_input.hpp>
#include <npt/io/text.hpp>

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace npt::inline NPT_ABI::internal {

/// A compressed view as its JSON describes it. `place` stands in messages of errors.
struct MeshoptView {
  std::string_view bytes;
  std::string mode, filter;  ///< filter: empty is NONE
  std::size_t count = 0, stride = 0;
  std::string file, place;
};

inline void check_meshopt(const MeshoptView& view) {
  const auto expect = [&](bool good, const std::string& found, const char* expected) {
    if (!good) throw Error({.file = view.file, .place = view.place, .found = found, .expected = expected});
  };
  const bool attributes = view.mode == "ATTRIBUTES", triangles = view.mode == "TRIANGLES";
  const std::string stride = "byteStride " + std::to_string(view.stride);
  expect(attributes || triangles || view.mode == "INDICES", "mode " + in_quotes(view.mode),
         "ATTRIBUTES, TRIANGLES or INDICES");
  expect(view.count > 0 && (!triangles || view.count % 3 == 0), "count " + std::to_string(view.count),
         triangles ? "three for each triangle" : "1 or more");
  if (attributes)
    expect(view.stride > 0 && view.stride % 4 == 0 && view.stride <= 256, stride, "a multiple of 4, at most 256");
  else
    expect(view.stride == 2 || view.stride == 4, stride, "2 or 4");
  const char* const other = "EXT_meshopt_compression, which gltfpack -cc and gltf-transform meshopt write";
  expect(!attributes || view.filter != "COLOR", "filter 'COLOR' of KHR_meshopt_compression", other);
  expect(!attributes || !view.bytes.starts_with('\xA1'), "a stream of version 1, of KHR_meshopt_compression", other);
  const bool none = view.filter.empty() || view.filter == "NONE";
  expect(none || (attributes &&
                  (view.filter == "OCTAHEDRAL" || view.filter == "QUATERNION" || view.filter == "EXPONENTIAL")),
         "filter " + in_quotes(view.filter), "NONE, or OCTAHEDRAL, QUATERNION or EXPONENTIAL of ATTRIBUTES");
  if (view.filter == "OCTAHEDRAL") expect(view.stride == 4 || view.stride == 8, stride, "4 or 8");
  if (view.filter == "QUATERNION") expect(view.stride == 8, stride, "8");
}

/// [count * stride] bytes as the accessors expect them.
inline std::string decode_meshopt(const MeshoptView& view) {
  check_meshopt(view);
  const auto input = [&](std::uint8_t header) { return MeshoptInput(view.bytes, view.file, view.place, header); };
  if (view.mode == "ATTRIBUTES") {
    std::string bytes = decode_meshopt_attributes(input(0xA0), view.count, view.stride);
    if (view.filter == "OCTAHEDRAL" && view.stride == 4) meshopt_octahedral<std::int8_t>(bytes);
    if (view.filter == "OCTAHEDRAL" && view.stride == 8) meshopt_octahedral<std::int16_t>(bytes);
    if (view.filter == "QUATERNION") meshopt_quaternion(bytes);
    if (view.filter == "EXPONENTIAL") meshopt_exponential(bytes);
    return bytes;
  }
  const std::vector<std::uint32_t> numbers = view.mode == "TRIANGLES" ? MeshoptTriangles(input(0xE1)).decode(view.count)
                                                                      : decode_meshopt_indices(input(0xD1), view.count);
  std::string bytes(view.count * view.stride, '\0');
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (view.stride == 4)
      meshopt_store(bytes, 4 * i, numbers[i]);
    else
      meshopt_store(bytes, 2 * i, static_cast<std::uint16_t>(numbers[i]));
  }
  return bytes;
}

}  // namespace npt::inline NPT_ABI::internal
