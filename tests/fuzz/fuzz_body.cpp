/// Any bytes to the body reader give a body that can be posed, or an npt::Error.
#include <npt/body/body_file.hpp>
#include <npt/io/safetensors.hpp>

#include <fuzz/seeds.hpp>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>

namespace {

struct Entry {
  const char* name;
  const char* type;
  const char* shape;
  std::string bytes;
};

template <class T, std::size_t N>
std::string bytes_of(const std::array<T, N>& values) {
  std::string bytes(sizeof(values), '\0');
  std::memcpy(bytes.data(), values.data(), bytes.size());
  return bytes;
}

/// A body of three vertices, two joints, one triangle and one shape direction.
std::string body_file(bool corrected) {
  std::vector<Entry> entries{{"v_template", "F32", "[3,3]", bytes_of(std::array<float, 9>{0, 0, 0, 1, 0, 0, 0, 1, 0})},
                             {"shapedirs", "F32", "[3,3,1]", bytes_of(std::array<float, 9>{0, 0, 1, 0, 0, 1, 0, 0, 1})},
                             {"J_regressor", "F32", "[2,3]", bytes_of(std::array<float, 6>{1, 0, 0, 0, 0.5F, 0.5F})},
                             {"weights", "F32", "[3,2]", bytes_of(std::array<float, 6>{1, 0, 0.5F, 0.5F, 0, 1})},
                             {"f", "I32", "[1,3]", bytes_of(std::array<std::int32_t, 3>{0, 1, 2})},
                             {"parents", "I32", "[2]", bytes_of(std::array<std::int32_t, 2>{-1, 0})}};
  if (corrected) entries.push_back({"posedirs", "F32", "[3,3,9]", bytes_of(std::array<float, 81>{})});
  std::string header = R"({"__metadata__":{"joint_names":"root tip"})", data;
  for (const Entry& entry : entries) {
    header += std::string(",\"") + entry.name + R"(":{"dtype":")" + entry.type + R"(","shape":)" + entry.shape +
              R"(,"data_offsets":[)" + std::to_string(data.size()) + "," +
              std::to_string(data.size() + entry.bytes.size()) + "]}";
    data += entry.bytes;
  }
  header += "}";
  const std::uint64_t size = header.size();
  return std::string(reinterpret_cast<const char*>(&size), 8) + header + data;
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  fuzz::write_seeds_if_asked(*argc, *argv, {body_file(false), body_file(true)});
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  try {
    const npt::BodyModel body =
        npt::load_body(npt::SafetensorsFile::parse({reinterpret_cast<const char*>(data), size}, "input"));
    const std::vector<float> pose(3 * body.joint_count(), 0.1F);
    const npt::Mesh mesh = npt::to_mesh(body, {}, pose);
    fuzz::expect(mesh.vertex_count() > 0, "a body has vertices");
    for (const std::uint32_t corner : mesh.corners) fuzz::expect(corner < mesh.vertex_count(), "corners are vertices");
  } catch (const npt::Error&) {
  }
  return 0;
}
