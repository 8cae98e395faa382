#include <doctest/doctest.h>

#include <io/scratch.hpp>
#include <mesh/zoo.hpp>
#include <npt/base/random.hpp>
#include <npt/io/obj.hpp>
#include <npt/io/obj_reader.hpp>
#include <npt/io/obj_statements.hpp>
#include <npt/io/obj_writer.hpp>

#include <cmath>
#include <cstring>
#include <filesystem>

#include "support/needs.hpp"

namespace {

using npt::Mesh;
using npt::no_index;
using scratch::error_of;

using Indices = std::vector<std::uint32_t>;

Mesh parse(const std::string& text) { return npt::parse_obj(text, "f"); }

std::string obj_error(const std::string& text) {
  return error_of([&] { parse(text); });
}

/// Three vertices, then the given lines, the first of which is line 4.
std::string after_triangle(const std::string& lines) { return "v 0 0 0\nv 1 0 0\nv 0 1 0\n" + lines; }

std::string tag_text(const Mesh& mesh) {
  std::string text;
  for (const npt::MeshTag& tag : mesh.tags)
    text += std::to_string(tag.face) + ' ' + tag.keyword + " [" + tag.value + "] ";
  return text;
}

}  // namespace

TEST_CASE("vertices, faces and attributes are read in their order") {
  const Mesh mesh = parse(
      "# comment\nmtllib a.mtl\no thing\nv 0 0 0\nv 1.5 -2e-1 .5\nv +1 1. 3 # after numbers\nv 0 1 0\nv 2 2 2\n"
      "vt 0 0\nvt 1 0\nvt 1 1\nvn 0 0 1\nvn 0 1 0\n"
      "g left right\nusemtl skin\ns 1\nf 1/1/1 2/2/1 3/3/2 4/1/2\ns off\nf 1//1 2//1 3//2\nf 3 4 5 2 1\ng\n");
  CHECK(mesh.positions == std::vector<npt::Vec3f>{{0, 0, 0}, {1.5F, -0.2F, 0.5F}, {1, 1, 3}, {0, 1, 0}, {2, 2, 2}});
  CHECK(mesh.face_start == std::vector<std::size_t>{0, 4, 7, 12});
  CHECK(mesh.corners == Indices{0, 1, 2, 3, 0, 1, 2, 2, 3, 4, 1, 0});
  CHECK(mesh.corner_texcoord ==
        Indices{0, 1, 2, 0, no_index, no_index, no_index, no_index, no_index, no_index, no_index, no_index});
  CHECK(mesh.corner_normal == Indices{0, 0, 1, 1, 0, 0, 1, no_index, no_index, no_index, no_index, no_index});
  CHECK(mesh.texcoord_size == 2);
  CHECK(tag_text(mesh) == "0 mtllib [a.mtl] 0 o [thing] 0 g [left right] 0 usemtl [skin] 0 s [1] 1 s [off] 3 g [] ");
}

TEST_CASE("line ends, continued lines, blanks and a missing last line end don't matter") {
  const std::string text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\ng a b\nf 1 2 4 3\nf 1 2 3\n";
  const Mesh expected = parse(text);
  const auto replaced = [&](const std::string& with) {
    std::string result;
    for (const char c : text) result += c == '\n' ? with : std::string(1, c);
    return result;
  };
  for (const std::string& variant :
       {replaced("\r\n"), replaced("\r"), replaced("\n\n"), replaced(" \t\n  "), text.substr(0, text.size() - 1),
        "\xEF\xBB\xBF" + text,
        std::string("v 0 0 0\nv 1 0 0\nv\\\n 0 \\\r\n1 0\nv 1 1 0\ng a \\\nb\nf 1 2 \\\n4 3\nf 1 2 3\\")}) {
    const Mesh mesh = parse(variant);
    CHECK(mesh.positions == expected.positions);
    CHECK(mesh.corners == expected.corners);
    CHECK(mesh.face_start == expected.face_start);
    CHECK(mesh.tags.size() == 1);
    CHECK(mesh.tags[0].value.substr(0, 1) == "a");
  }
  // A comment that ends in a backslash doesn't swallow the next line.
  CHECK(parse("# C:\\meshes\\\nv 1 2 3\n").vertex_count() == 1);
}

TEST_CASE("a line is checked before anything reads it") {
  using npt::internal::obj::Statement;
  const std::string file = "f";
  npt::internal::obj::StatementCheck check(file);
  CHECK(check.check("  ", 1) == Statement::none);
  CHECK(check.check("# v 1 2 3", 2) == Statement::none);
  const std::string line = "v 1 -2.5 3e1 # 4";
  CHECK(check.check(line, 3) == Statement::vertex);
  CHECK(std::ranges::equal(check.numbers(), std::vector<double>{1, -2.5, 30}));
  CHECK(std::string(line.data(), check.end()) == "v 1 -2.5 3e1");
  CHECK(check.check("usemtl  a b ", 4) == Statement::kept);
  CHECK(check.keyword() == "usemtl");
  CHECK(check.argument() == "a b");
  CHECK(check.check("f 1 1 1 9", 5) == Statement::face);
  CHECK(check.line_number() == 5);
  CHECK(check.check("l 1/1 2", 6) == Statement::element);
  CHECK(error_of([&] { check.check("f 1 1 1x", 7); }) ==
        "f: line 7: found '1x', expected the number of a vertex, from 1, or negative to count backwards");
}

TEST_CASE("every kind of blank separates, and comments may follow every statement") {
  const Mesh mesh = parse("v\v0\f0 \v0\n\f v 1 0\v0 # a\nv 0 1 0 # 1\nvt 0\f1 # 2\nf\f1\v2/1/ 3 # 4 5\n");
  CHECK(mesh.positions == std::vector<npt::Vec3f>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
  CHECK(mesh.corners == Indices{0, 1, 2});
  CHECK(mesh.corner_texcoord == Indices{no_index, 0, no_index});
}

TEST_CASE("relative indices count back from where they stand; absolute ones may look ahead") {
  const Mesh mesh = parse("v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 1 1 0\nf -3 -2 -1\nf 1 2 5\nv 9 9 9\n");
  CHECK(mesh.corners == Indices{0, 1, 2, 1, 2, 3, 0, 1, 4});
  const Mesh normals = parse(after_triangle("vt 0 0\nvn 0 0 1\nvn 0 0 2\nf 1/-1/-2 2/1/-1 3//-1\n"));
  CHECK(normals.corner_normal == Indices{0, 1, 1});
  CHECK(normals.corner_texcoord == Indices{0, 0, no_index});
}

TEST_CASE("faces of any size stay as they are") {
  std::string text, face = "f";
  for (int i = 0; i < 1000; ++i) {
    text += "v " + std::to_string(std::cos(i * 0.00628)) + " " + std::to_string(std::sin(i * 0.00628)) + " 0\n";
    face += ' ';
    face += std::to_string(i + 1);
  }
  const Mesh mesh = parse(text + face + "\n");
  CHECK(mesh.face_count() == 1);
  CHECK(mesh.corners.size() == 1000);
  CHECK(parse(npt::format_obj(mesh, "f")).corners == mesh.corners);
}

TEST_CASE("colours and weights of vertices are kept") {
  const Mesh mesh = parse("v 0 0 0\nv 1 0 0 0.25 0.5 1\nv 0 1 0\n");
  REQUIRE(mesh.properties.size() == 3);
  CHECK(mesh.properties[0].name == "red");
  CHECK(mesh.properties[0].values == std::vector<double>{1, 0.25, 1});
  CHECK(mesh.properties[2].values == std::vector<double>{1, 1, 1});
  const Mesh back = parse(npt::format_obj(mesh, "f"));
  for (std::size_t p = 0; p < 3; ++p) CHECK(back.properties[p].values == mesh.properties[p].values);
  CHECK(parse("v 0 0 0 2\nv 1 0 0\n").properties[0].values == std::vector<double>{2, 1});
  Mesh bytes = zoo::cloud();
  for (const char* name : {"red", "green", "blue"}) bytes.properties.push_back({name, "uchar", {0, 51, 255, 0, 0}});
  CHECK(parse(npt::format_obj(bytes, "f")).properties[1].values == std::vector<double>{0, double{0.2F}, 1, 0, 0});
}

TEST_CASE("statements without a place in a mesh are passed over") {
  const Mesh mesh = parse(after_triangle("vp 0 1\nl 1 2\np 1\ncstype bezier\nmg 1 2\nlod 3\nvw 1 2 3\nf 1 2 3\n"));
  CHECK(mesh.face_count() == 1);
  CHECK(mesh.corners.size() == 3);
  CHECK(obj_error(after_triangle("l 1 4\nf 1 2 3\n")).find("vertex 4") != std::string::npos);
  CHECK(obj_error(after_triangle("l 1 2/3\nvt 0 0\n")).find("texture coordinate 3") != std::string::npos);
  CHECK(obj_error(after_triangle("p -4\n")).find("vertex -4") != std::string::npos);
  CHECK(obj_error(after_triangle("p x\n")).find("'x'") != std::string::npos);
  CHECK(parse(after_triangle("p\nl # 1\nf 1 2 3\n")).face_count() == 1);
}

TEST_CASE("writing and reading gives back the same mesh and the same text") {
  Mesh mesh = zoo::hard_cube();
  mesh.tags = {{0, "mtllib", "a.mtl"}, {0, "o", "cube"}, {2, "usemtl", "red"}, {2, "s", "off"}, {6, "g", ""}};
  mesh.corner_texcoord[3] = no_index;
  mesh.corner_normal[7] = no_index;
  mesh.corner_texcoord[8] = mesh.corner_normal[8] = no_index;
  mesh.positions[0] = {0.1F, -0.0F, 1e-45F};
  mesh.positions[1] = {3.4028235e38F, 1.17549435e-38F, 16777217.0F};
  const std::string text = npt::format_obj(mesh, "f");
  const Mesh back = parse(text);
  // NOLINTNEXTLINE(bugprone-suspicious-memory-comparison): it is the bits that are compared
  CHECK(std::memcmp(back.positions.data(), mesh.positions.data(), 8 * sizeof(npt::Vec3f)) == 0);
  CHECK(back.normals == mesh.normals);
  CHECK(back.texcoords == mesh.texcoords);
  CHECK(back.face_start == mesh.face_start);
  CHECK(back.corners == mesh.corners);
  CHECK(back.corner_normal == mesh.corner_normal);
  CHECK(back.corner_texcoord == mesh.corner_texcoord);
  CHECK(tag_text(back) == tag_text(mesh));
  CHECK(npt::format_obj(back, "f") == text);
}

TEST_CASE("random floats keep their bits") {
  npt::Random random(9);
  Mesh mesh;
  while (mesh.positions.size() < 20000) {
    const auto number = [&] { return std::bit_cast<float>(random()); };
    const npt::Vec3f p = {number(), number(), number()};
    if (npt::is_finite(p)) mesh.positions.push_back(p);
  }
  const Mesh back = parse(npt::format_obj(mesh, "f"));
  // NOLINTNEXTLINE(bugprone-suspicious-memory-comparison): it is the bits that are compared
  CHECK(std::memcmp(back.positions.data(), mesh.positions.data(), mesh.positions.size() * sizeof(npt::Vec3f)) == 0);
}

TEST_CASE("normals and texture coordinates in all their forms are written as they were") {
  Mesh per_vertex = zoo::cube();
  per_vertex.normals.assign(8, {0, 0, 1});
  CHECK(npt::format_obj(per_vertex, "f").find("f 1//1 3//3 4//4 2//2\n") != std::string::npos);
  // Normals that nothing refers to stay so.
  const std::string loose = after_triangle("vn 0 0 1\nvn 0 0 1\nvn 0 0 1\nf 1 2 3\n");
  CHECK(npt::format_obj(parse(loose), "f") == loose);
  const std::string solid = after_triangle("vt 0 1 0.5\nf 1/1 2/1 3/1\n");
  CHECK(npt::format_obj(parse(solid), "f") == solid);
  const std::string cloud = "v 0 0 0\nvn 0 0 1\n";
  CHECK(npt::format_obj(parse(cloud), "f") == cloud);
  CHECK(parse(after_triangle("vt 0.5\nf 1/1 2/1 3/1\n")).texcoords[0] == npt::Vec3f{0.5F, 0, 0});
  CHECK(parse(after_triangle("f 1/ 2// 3\n")).corner_texcoord.empty());
  // tinyobjloader alone takes the next corner's vertex for what is missing behind a slash.
  const Mesh slashes =
      parse(after_triangle("vt 0 0\nvt 1 0\nvt 1 1\nvn 0 0 1\nvn 0 1 0\nvn 1 0 0\nf 1/ 2//\t3/1/ 1//2\n"));
  CHECK(slashes.corner_texcoord == Indices{no_index, no_index, 0, no_index});
  CHECK(slashes.corner_normal == Indices{no_index, no_index, no_index, 1});
}

TEST_CASE("a tag that ends in a backslash doesn't continue") {
  Mesh mesh = zoo::cube();
  mesh.tags = {{0, "mtllib", "C:\\"}, {0, "g", "a"}};
  CHECK(tag_text(parse(npt::format_obj(mesh, "f"))) == tag_text(mesh));
}

TEST_CASE("wrong numbers are errors with their line") {
  CHECK(obj_error("v 0 0 0\nv abc 0 0\n") ==
        "f: line 2: found 'abc', expected a finite number that fits into 32-bit floating point");
  for (const char* number : {"nan", "inf", "-inf", "1e39", "1e400", "0x10", "1,5", "1.2.3", "1e", "--1", "1d0"})
    CHECK_MESSAGE(
        obj_error(std::string("v 0 ") + number + " 0").starts_with("f: line 1: found '" + std::string(number)), number);
  CHECK(obj_error("v 0 0\n") == "f: line 1: found 2 numbers, expected 3 to 6");
  CHECK(obj_error("v\n") == "f: line 1: found 0 numbers, expected 3 to 6");
  CHECK(obj_error("v 1 2 3 4 5\n").starts_with("f: line 1: found 5 numbers"));
  CHECK(obj_error("v 1 2 3 4 5 6 7\n") == "f: line 1: found 7 numbers, expected 3 to 6");
  CHECK(obj_error("v 0 0 0\nvn 0 1\n") == "f: line 2: found 2 numbers, expected 3");
  CHECK(obj_error("v 0 0 0\nvt\n") == "f: line 2: found 0 numbers, expected 1 to 3");
  CHECK(obj_error("v 0 0 0\nvt 1 nan\n").starts_with("f: line 2: found 'nan'"));
  CHECK(obj_error("v 0 0 0 # 1\nv 0 0 # 0\n") == "f: line 2: found 2 numbers, expected 3 to 6");
  CHECK(obj_error("v 0 0 \\\n0\nv 0 0 x\n").starts_with("f: line 3: "));
  CHECK(obj_error(std::string("v 0 0 0\0", 8)).find("'0\\x00'") != std::string::npos);
}

TEST_CASE("wrong indices are errors with their line") {
  CHECK(obj_error(after_triangle("f 1 2 4\nf 1 2 99\nf 1 2 3\n")) ==
        "f: line 5: found vertex 99, expected at most 3, the number in the file");
  CHECK(obj_error(after_triangle("f -4 -2 -1\n")) ==
        "f: line 4: found vertex -4, expected at least -3, there are only so many before this line");
  CHECK(obj_error("f -1 -1 -1\n" + after_triangle("")).starts_with("f: line 1: found vertex -1"));
  CHECK(obj_error(after_triangle("f 0 1 2\n")) ==
        "f: line 4: found '0', expected the number of a vertex, from 1, or negative to count backwards");
  for (const char* corner :
       {"99999999999", "-2147483648", "1.5", "x", "/1", "1/x", "1//x", "1/0", "1//0", "1/1/1/1", "1///"})
    CHECK_MESSAGE(
        obj_error(after_triangle(std::string("vt 0 0\nvn 0 0 1\nf 1 2 ") + corner)).starts_with("f: line 6: found '"),
        corner);
  CHECK(obj_error(after_triangle("vt 0 0\nf 1/2 2/1 3/1\n")) ==
        "f: line 5: found texture coordinate 2, expected at most 1, the number in the file");
  CHECK(obj_error(after_triangle("vn 0 0 1\nf 1//1 2//2 3//1\n")).find("normal 2, expected at most 1") !=
        std::string::npos);
}

TEST_CASE("normals and texture coordinates that faces name and the file doesn't have are left out, with a note") {
  std::vector<std::string> notes;
  const Mesh normals = npt::parse_obj(after_triangle("f 1//1 2//2 3//3\n"), "f", &notes);
  CHECK(normals.corners == Indices{0, 1, 2});
  CHECK(normals.corner_normal.empty());
  CHECK(notes == std::vector<std::string>{"f: faces refer to normals, and the file has none: read without them"});
  notes.clear();
  const Mesh both = npt::parse_obj(after_triangle("f 1/7/9 2/8/9 3/9/9\n"), "f", &notes);
  CHECK(both.corner_texcoord.empty());
  CHECK(notes.size() == 2);
  CHECK(notes[0] == "f: faces refer to texture coordinates, and the file has none: read without them");
  notes.clear();
  CHECK(parse(npt::format_obj(both, "f")).corners == both.corners);
  npt::parse_obj(after_triangle("f 1 2 3\n"), "f", &notes);
  CHECK(notes.empty());
  CHECK(obj_error(after_triangle("f 1 2 4\n")).find("vertex 4") != std::string::npos);
}

TEST_CASE("comments may hold any bytes") {
  const std::string nul(1, '\0');
  const std::string text = "# a" + nul + "b\nv 0 0 0\nv 1 0 0 # " + nul + "\nv 0 1 0\nf 1 2 3\n# " + nul;
  CHECK(parse(text).face_count() == 1);
}

TEST_CASE("faces of fewer than three corners, and files that are no OBJ, are errors") {
  CHECK(obj_error(after_triangle("f 1 2\n")) == "f: line 4: found a face with 2 corners, expected at least 3");
  CHECK(obj_error(after_triangle("f\n")) == "f: line 4: found a face with 0 corners, expected at least 3");
  CHECK(obj_error("") == "f: found no vertices, expected v statements of an OBJ file");
  CHECK(obj_error("ply\nformat ascii 1.0\n") == "f: found no vertices, expected v statements of an OBJ file");
  CHECK(obj_error("1 2 3\n") == "f: line 1: found '1 2 3', expected an OBJ statement, such as v, vt, vn or f");
  CHECK(obj_error(std::string("\x7F"
                              "ELF\0",
                              5))
            .starts_with("f: line 1: found '\\x7fELF\\x00'"));
}

TEST_CASE("numbers that tinyobjloader misreads are refused, not taken") {
  // Its powers of ten underflow: it reads 0 for 10.
  const std::string number = "0." + std::string(339, '0') + "1e341";
  CHECK(obj_error("v " + number + " 0 0\n") ==
        "f: vertex 1: found (0.000000, 0.000000, 0.000000) read by tinyobjloader, expected (10.000000, 0.000000, "
        "0.000000)");
}

TEST_CASE("every truncation of a file gives a mesh or an error") {
  const std::string text = npt::format_obj(zoo::hard_cube(), "f");
  int meshes = 0;
  for (std::size_t size = 0; size < text.size(); ++size) {
    const std::string message = obj_error(text.substr(0, size));
    CHECK((message == "no error" || message.starts_with("f: ")));
    meshes += message == "no error" ? 1 : 0;
  }
  CHECK(meshes > 0);
}

TEST_CASE("shared example meshes are read, and written again give the same mesh" *
          support::needs_shared("data/other_topology/male1591_m_athletic_tpose.obj")) {
  const std::filesystem::path path = NPT_SHARED "/data/other_topology/male1591_m_athletic_tpose.obj";
  const Mesh mesh = npt::read_obj(path);
  CHECK(mesh.vertex_count() == 1591);
  const scratch::Folder folder;
  npt::write_obj(folder / "a.obj", mesh);
  const Mesh back = npt::read_obj(folder / "a.obj");
  CHECK(back.positions == mesh.positions);
  CHECK(back.corners == mesh.corners);
}
