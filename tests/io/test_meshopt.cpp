/// Views that meshoptimizer 0.18 compressed, as bytes; libmeshoptimizer's own decoder gave what is expected of them.
#include <doctest/doctest.h>

#include <io/scratch.hpp>
#include <io/small_gltf.hpp>
#include <npt/io/gltf.hpp>
#include <npt/io/meshopt.hpp>
#include <npt/io/meshopt_attributes.hpp>
#include <npt/io/meshopt_filters.hpp>
#include <npt/io/meshopt_indices.hpp>
#include <npt/io/meshopt_input.hpp>
#include <npt/scene/pose.hpp>

#include <bit>
#include <cstdlib>

namespace {

using small_gltf::from_hex;
using small_gltf::packed_file;

const std::string packed_rows = from_hex(
    "a0070002060a0e12161a1e22262a2e32363aff0000003e42464a0006022e666666666666ff000000060606060515d5d5d5060606"
    "d50000000600000000000000000000000000000000000000000000000000000000000700c8");
const std::string packed_triangles =
    from_hex("e1fe1e100e4e1e120effff0f06f600b801ffbd01bc0101007687566778a9866589689801690000");
const std::string packed_indices = from_hex("d10004c18b11050404c78b010a00000000");

std::string decoded_view(const std::string& bytes, const char* mode, const char* filter, std::size_t count,
                         std::size_t stride) {
  return npt::internal::decode_meshopt({bytes, mode, filter, count, stride, "f", "p"});
}
std::string view_error(const std::string& bytes, const char* mode, const char* filter, std::size_t count,
                       std::size_t stride) {
  return scratch::error_of([&] { decoded_view(bytes, mode, filter, count, stride); });
}

template <class T>
std::vector<int> numbers_in(const std::string& bytes) {
  std::vector<int> result;
  for (std::size_t at = 0; at < bytes.size(); at += sizeof(T))
    result.push_back(npt::internal::meshopt_load<T>(bytes, at));
  return result;
}

}  // namespace

TEST_CASE("meshopt: rows are differences, column by column") {
  std::string expected;
  for (int i = 0; i < 20; ++i)
    for (const int value : {i * i, 7, i < 3 ? i : 3 * i, 200 - i % 4}) expected += static_cast<char>(value);
  CHECK(decoded_view(packed_rows, "ATTRIBUTES", "", 20, 4) == expected);

  // The specification's example of 16 differences in 4 bits each, of which two don't fit.
  const std::string example = from_hex("a0175ff0bc77a9210034b5");
  npt::internal::MeshoptInput input(example, "f", "p", 0xA0);
  std::vector<int> differences;
  for (const unsigned d : npt::internal::meshopt_differences(input, 2))
    differences.push_back(static_cast<int>((d & 1U) != 0 ? ~(d >> 1) : d >> 1));
  CHECK(differences == std::vector<int>{-1, -4, -3, 26, -91, 0, -6, 6, -4, -4, 5, -5, 1, -1, 0, 0});
  CHECK_NOTHROW(input.expect_end());
}

TEST_CASE("meshopt: triangles and other indices, of two and of four bytes") {
  const std::vector<int> triangles{0, 1, 3, 3, 1, 4, 4, 1, 2, 4, 2,   5, 3, 4,  6,
                                   6, 4, 7, 7, 4, 5, 7, 5, 8, 8, 100, 4, 5, 99, 98};
  CHECK(numbers_in<std::int16_t>(decoded_view(packed_triangles, "TRIANGLES", "NONE", 30, 2)) == triangles);
  CHECK(numbers_in<std::int32_t>(decoded_view(packed_triangles, "TRIANGLES", "", 30, 4)) == triangles);
  CHECK(numbers_in<std::int32_t>(decoded_view(packed_indices, "INDICES", "", 8, 4)) ==
        std::vector<int>{0, 1, 70000, 70001, 2, 3, 65535, 0});
}

TEST_CASE("meshopt: filters give unit vectors, quaternions and floats") {
  const auto near = [](const std::vector<int>& found, const std::vector<int>& expected) {
    REQUIRE(found.size() == expected.size());
    for (std::size_t i = 0; i < found.size(); ++i) CHECK(std::abs(found[i] - expected[i]) <= 1);
  };
  near(
      numbers_in<std::int8_t>(decoded_view(
          from_hex(
              "a0013c0000006ce0013c00000091a700013c0000007e040000000000000000000000000000000000000000000000000000000000"
              "007f40"),
          "ATTRIBUTES", "OCTAHEDRAL", 3, 4)),
      {0, 0, 127, 64, 76, -102, 0, 127, -46, 61, -102, -127});
  near(
      numbers_in<std::int16_t>(decoded_view(
          from_hex(
              "a0013c000000da29013c0000000611013c000000dc5f013c00000009160000011c0000000401380000007e000000000000000000"
              "00000000000000000000000000000000000000ff070040"),
          "ATTRIBUTES", "OCTAHEDRAL", 3, 8)),
      {0, 0, 32767, 16384, 19653, -26219, 0, 32767, -11785, 15723, -26222, -32767});
  near(
      numbers_in<std::int16_t>(decoded_view(
          from_hex(
              "a0013c000000fcfb013c000000b5b6013c000000fb3b013c000000b472013c000000fbfc013c000000b4b3013000000005000000"
              "00000000000000000000000000000000000000000000000000000000ff7f"),
          "ATTRIBUTES", "QUATERNION", 3, 8)),
      {0, 0, 0, 32767, 16383, -16384, 16384, 16384, 26213, 0, -19660, 0});
  const std::string floats = decoded_view(
      from_hex(
          "a00103f00000ff8a04013ff00000408fcc3b9f0106100000012bf000001025710000000000000000000000000000000000000000"
          "0000000000000000000000f2"),
      "ATTRIBUTES", "EXPONENTIAL", 6, 4);
  const std::vector<float> expected{0, 1, -2.5F, 1000, 0.00100004673F, -9.99978643e-21F};
  for (std::size_t i = 0; i < expected.size(); ++i)
    CHECK(std::bit_cast<float>(npt::internal::little_u32(floats, 4 * i)) == expected[i]);
}

TEST_CASE("meshopt: what isn't whole, or isn't what it says, is an error") {
  const std::string start = "f: p: found ";
  CHECK(view_error(packed_rows, "ATTRIBUTES", "", 20, 4) == "no error");
  for (std::size_t n = 0; n < packed_rows.size(); ++n)
    CHECK(view_error(packed_rows.substr(0, n), "ATTRIBUTES", "", 20, 4).starts_with(start));
  for (std::size_t n = 0; n < packed_triangles.size(); ++n)
    CHECK(view_error(packed_triangles.substr(0, n), "TRIANGLES", "", 30, 4).starts_with(start));
  CHECK(view_error(packed_rows, "TRIANGLES", "", 30, 4) == start + "a first byte 0xa0, expected 0xe1");
  CHECK(view_error(packed_rows + "x", "ATTRIBUTES", "", 20, 4) == start + "1 bytes too many, expected none");
  CHECK(view_error(packed_rows, "VERTICES", "", 20, 4) ==
        start + "mode 'VERTICES', expected ATTRIBUTES, TRIANGLES or INDICES");
  // What only KHR_meshopt_compression has.
  const std::string other = "expected EXT_meshopt_compression, which gltfpack -cc and gltf-transform meshopt write";
  CHECK(view_error(packed_rows, "ATTRIBUTES", "COLOR", 20, 4) ==
        start + "filter 'COLOR' of KHR_meshopt_compression, " + other);
  CHECK(view_error("\xA1" + packed_rows.substr(1), "ATTRIBUTES", "", 20, 4) ==
        start + "a stream of version 1, of KHR_meshopt_compression, " + other);
  CHECK(view_error(packed_rows, "ATTRIBUTES", "QUATERNION", 20, 4) == start + "byteStride 4, expected 8");
  CHECK(view_error(packed_rows, "ATTRIBUTES", "OCTAHEDRAL", 20, 12) == start + "byteStride 12, expected 4 or 8");
  CHECK(view_error(packed_rows, "ATTRIBUTES", "", 20, 6).starts_with(start + "byteStride 6"));
  CHECK(view_error(packed_triangles, "TRIANGLES", "", 29, 4) == start + "count 29, expected three for each triangle");
  CHECK(view_error(packed_triangles, "TRIANGLES", "", 30, 8) == start + "byteStride 8, expected 2 or 4");
  CHECK(view_error(from_hex("d1ffffffffffff00000000"), "INDICES", "", 1, 4) ==
        start + "a number of more than five bytes, expected five at most");
}

TEST_CASE("a GLB whose positions are quantised and whose views are compressed reads as the plain one") {
  const npt::Scene plain = npt::parse_gltf(small_gltf::file(), "x.glb"),
                   packed = npt::parse_gltf(packed_file(), "x.glb");
  CHECK(packed.meshes[0].blocks[0].positions == plain.meshes[0].blocks[0].positions);
  CHECK(packed.meshes[0].primitives[0].triangles == plain.meshes[0].primitives[0].triangles);
  // What is written is compressed no more, and asks for no extension.
  const std::string written = npt::format_gltf(packed, "y.glb");
  CHECK(written.find("EXT_meshopt_compression") == std::string::npos);
  CHECK(npt::parse_gltf(written, "y.glb").meshes[0].blocks[0].positions == plain.meshes[0].blocks[0].positions);

  const auto error_with = [](const std::string& from, const std::string& to) {
    std::string file = packed_file();
    const std::string chunk(npt::internal::read_glb(file, "x.glb").json);
    std::string json = chunk;
    REQUIRE_MESSAGE(json.find(from) != std::string::npos, from);
    json.replace(json.find(from), from.size(), to);
    const std::string data(*npt::internal::read_glb(file, "x.glb").bytes);
    return scratch::error_of([&] { npt::parse_gltf(small_gltf::file(json, data), "x.glb"); });
  };
  // Buffers that hold nothing but numbers for other readers: marked as such, or not.
  CHECK(
      error_with(R"({"byteLength":32})",
                 R"({"byteLength":32,"uri":"none.bin","extensions":{"EXT_meshopt_compression":{"fallback":true}}})") ==
      "no error");
  CHECK(error_with(R"("mode":"ATTRIBUTES","count":3)", R"("mode":"ATTRIBUTES","count":4)") ==
        "x.glb: bufferViews[0].extensions.EXT_meshopt_compression: found 4 elements of 8 bytes, expected 24 bytes, the "
        "view's");
  CHECK(error_with(R"("byteOffset":344,"byteLength":60)", R"("byteOffset":384,"byteLength":60)")
            .find("bufferViews[0].extensions.EXT_meshopt_compression: found bytes 384") != std::string::npos);
  // Under the name that Khronos gave it.
  std::string khronos(npt::internal::read_glb(packed_file(), "x.glb").json);
  for (std::size_t at; (at = khronos.find("EXT_meshopt")) != std::string::npos;) khronos.replace(at, 3, "KHR");
  const npt::Scene same =
      npt::parse_gltf(small_gltf::file(khronos, std::string(*npt::internal::read_glb(packed_file(), "x").bytes)), "x");
  CHECK(same.meshes[0].blocks[0].positions == plain.meshes[0].blocks[0].positions);
}
