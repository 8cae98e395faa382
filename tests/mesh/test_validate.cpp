#include <doctest/doctest.h>

#include <mesh/zoo.hpp>
#include <npt/mesh/validate.hpp>

#include <limits>
#include <string>

namespace {

/// The message of the error for this mesh; empty: it is valid.
std::string complaint(const npt::Mesh& mesh) {
  try {
    npt::validate(mesh, "m");
    return {};
  } catch (const npt::Error& error) {
    return error.what();
  }
}

template <class Change>
std::string complaint_after(npt::Mesh mesh, Change change) {
  change(mesh);
  return complaint(mesh);
}

constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();
constexpr float inf = std::numeric_limits<float>::infinity();

}  // namespace

TEST_CASE("the zoo's meshes are valid") {
  for (const npt::Mesh& mesh : {zoo::cube(), zoo::hard_cube(), zoo::mixed(), zoo::cloud()})
    CHECK(complaint(mesh) == "");
}

TEST_CASE("each broken invariant is named with its place") {
  using npt::Mesh;
  const Mesh cube = zoo::hard_cube();
  CHECK(complaint({}) == "m: found no vertices, expected at least one vertex");
  CHECK(complaint_after(cube, [](Mesh& m) {
          m.positions[3].y = not_a_number;
        }).starts_with("m: vertex 3: found (1.000000, "));
  CHECK(complaint_after(cube, [](Mesh& m) { m.positions[7].z = -inf; }).starts_with("m: vertex 7: "));
  CHECK(complaint_after(cube, [](Mesh& m) { m.normals[1].x = inf; }).starts_with("m: normal 1: "));
  CHECK(
      complaint_after(cube, [](Mesh& m) { m.texcoords[2].x = not_a_number; }).starts_with("m: texture coordinate 2: "));
  CHECK(complaint_after(cube, [](Mesh& m) { m.corners[5] = 8; }) ==
        "m: face 1: found vertex 8, expected a vertex below 8");
  CHECK(complaint_after(cube, [](Mesh& m) {
          m.corners[5] = npt::no_index;
        }).starts_with("m: face 1: found vertex 42949"));
  CHECK(complaint_after(cube, [](Mesh& m) { m.face_start[2] = 6; }) ==
        "m: face 1: found 2 corners, expected at least 3");
  CHECK(complaint_after(cube, [](Mesh& m) { m.face_start[2] = 99; }).starts_with("m: face 1: found corners 4 to 99"));
  CHECK(complaint_after(cube, [](Mesh& m) { m.face_start.back() = 23; }).starts_with("m: face_start: "));
  CHECK(complaint_after(cube, [](Mesh& m) { m.face_start.front() = 1; }).starts_with("m: face_start: "));
  CHECK(complaint_after(cube, [](Mesh& m) { m.face_start.clear(); }).starts_with("m: corners: "));
}

TEST_CASE("attributes have the right number of entries and point to what is there") {
  using npt::Mesh;
  const Mesh cube = zoo::hard_cube();
  CHECK(complaint_after(cube, [](Mesh& m) { m.corner_normal.pop_back(); }).starts_with("m: corners' normals: "));
  CHECK(complaint_after(cube, [](Mesh& m) { m.corner_normal[4] = 6; }) ==
        "m: face 1: found normal 6, expected a number below 6");
  CHECK(complaint_after(cube, [](Mesh& m) { m.corner_normal[4] = npt::no_index; }) == "");
  CHECK(complaint_after(cube, [](Mesh& m) { m.corner_texcoord[23] = 4; }).starts_with("m: face 5: "));
  CHECK(complaint_after(cube, [](Mesh& m) { m.texcoord_size = 1; }).starts_with("m: texture coordinates: "));
  CHECK(complaint_after(zoo::cube(), [](Mesh& m) { m.texcoord_size = 2; }).starts_with("m: texture coordinates: "));
  CHECK(complaint_after(zoo::cube(), [](Mesh& m) { m.normals.resize(7); }).starts_with("m: normals: found 7"));
  CHECK(complaint_after(zoo::cube(), [](Mesh& m) { m.normals.resize(8); }) == "");
  CHECK(complaint_after(cube, [](Mesh& m) {
          m.properties = {{"q", "float", {1, 2}}};
        }).starts_with("m: vertex property 'q': found 2 values"));
}

TEST_CASE("tags stand in order, between the faces, and fit on a line") {
  const auto with = [](std::vector<npt::MeshTag> tags) {
    npt::Mesh mesh = zoo::cube();
    mesh.tags = std::move(tags);
    return complaint(mesh);
  };
  CHECK(with({{0, "g", "a b"}, {0, "s", "off"}, {6, "g", ""}}) == "");
  CHECK(with({{1, "g", "a"}, {0, "g", "b"}}).starts_with("m: tag 'g': found face 0"));
  CHECK(with({{7, "g", "a"}}).starts_with("m: tag 'g': found face 7"));
  CHECK(with({{0, "g", "a\nv 1 2 3"}}).starts_with("m: tag 'g': "));
  CHECK(with({{0, "g x", "a"}}).starts_with("m: tag 'g x': "));
  CHECK(with({{0, "", "a"}}).starts_with("m: tag '': "));
}
