#include <doctest/doctest.h>

#include <io/scratch.hpp>
#include <mesh/zoo.hpp>
#include <npt/io/ply.hpp>
#include <npt/io/ply_header.hpp>
#include <npt/io/ply_reader.hpp>
#include <npt/io/ply_writer.hpp>

#include <cmath>
#include <filesystem>

#include "support/needs.hpp"

namespace {

using npt::Mesh;
using npt::PlyFormat;
using scratch::error_of;

constexpr PlyFormat formats[] = {PlyFormat::ascii, PlyFormat::binary_little_endian, PlyFormat::binary_big_endian};

std::string ply_error(const std::string& text) {
  return error_of([&] { npt::parse_ply(text, "f"); });
}

std::string header(const std::string& elements, const std::string& format = "ascii") {
  return "ply\nformat " + format + " 1.0\n" + elements + "end_header\n";
}

const std::string xyz = "property float x\nproperty float y\nproperty float z\n";

/// An ascii file of three vertices and what is given of faces.
std::string triangle(const std::string& count, const std::string& faces) {
  return header("element vertex 3\n" + xyz + "element face " + count + "\nproperty list uchar int vertex_indices\n") +
         "0 0 0\n1 0 0\n0 1 0\n" + faces;
}

Mesh rich() {
  Mesh mesh = zoo::mixed();
  for (std::size_t v = 0; v < 9; ++v) mesh.normals.push_back({0, 0.1F * static_cast<float>(v), 1});
  const auto values = [](double low, double high) { return std::vector<double>{low, high, 0, 1, 2, 3, 4, 5, 6}; };
  mesh.properties = {{"a", "char", values(-128, 127)},
                     {"red", "uchar", values(0, 255)},
                     {"b", "int16", values(-32768, 32767)},
                     {"c", "ushort", values(0, 65535)},
                     {"d", "int", values(-2147483648.0, 2147483647)},
                     {"e", "uint32", values(0, 4294967295)},
                     {"g", "float", values(double{0.1F}, -1e30F)},
                     {"h", "float64", values(0.1, 1e300)}};
  mesh.tags = {{0, "comment", "made by hand"}, {0, "obj_info", "x = 1"}};
  return mesh;
}

void check_same(const Mesh& a, const Mesh& b) {
  CHECK(a.positions == b.positions);
  CHECK(a.face_start == b.face_start);
  CHECK(a.corners == b.corners);
  CHECK(a.normals == b.normals);
  REQUIRE(a.properties.size() == b.properties.size());
  for (std::size_t p = 0; p < a.properties.size(); ++p) {
    CHECK(a.properties[p].name == b.properties[p].name);
    CHECK(a.properties[p].type == b.properties[p].type);
    CHECK(a.properties[p].values == b.properties[p].values);
  }
  REQUIRE(a.tags.size() == b.tags.size());
  for (std::size_t t = 0; t < a.tags.size(); ++t) CHECK(a.tags[t].value == b.tags[t].value);
}

}  // namespace

TEST_CASE("a mesh with everything survives each format") {
  for (const PlyFormat format : formats) {
    const std::string bytes = npt::format_ply(rich(), "f", format);
    const Mesh back = npt::parse_ply(bytes, "f");
    check_same(back, rich());
    CHECK(npt::format_ply(back, "f", format) == bytes);
  }
}

TEST_CASE("floats keep their bits, also the odd ones") {
  Mesh mesh = zoo::cloud();
  mesh.positions = {{0.1F, -0.0F, 1e-45F}, {3.4028235e38F, -1.17549435e-38F, 16777217.0F}};
  mesh.properties = {{"q", "float", {NAN, INFINITY}}};
  for (const PlyFormat format : formats) {
    const Mesh back = npt::parse_ply(npt::format_ply(mesh, "f", format), "f");
    // NOLINTNEXTLINE(bugprone-suspicious-memory-comparison): it is the bits that are compared
    CHECK(std::memcmp(back.positions.data(), mesh.positions.data(), sizeof(npt::Vec3f) * 2) == 0);
    CHECK(std::isnan(back.properties[0].values[0]));
    CHECK(back.properties[0].values[1] == INFINITY);
  }
}

TEST_CASE("texture coordinates of corners survive, also where a face has none") {
  Mesh mesh = zoo::hard_cube();
  mesh.normals.clear();
  mesh.corner_normal.clear();
  mesh.corner_texcoord[5] = npt::no_index;
  for (const PlyFormat format : formats) {
    const Mesh back = npt::parse_ply(npt::format_ply(mesh, "f", format), "f");
    CHECK(back.texcoord_size == 2);
    for (std::size_t c = 0; c < 24; ++c) {
      const bool in_face_1 = c / 4 == 1;
      CHECK((back.corner_texcoord[c] == npt::no_index) == in_face_1);
      if (!in_face_1) CHECK(back.texcoords[back.corner_texcoord[c]] == mesh.texcoords[mesh.corner_texcoord[c]]);
    }
  }
}

TEST_CASE("normals of corners become their vertices' means") {
  const Mesh back = npt::parse_ply(npt::format_ply(zoo::hard_cube(), "f"), "f");
  REQUIRE(back.normals.size() == 8);
  const float s = 1 / std::sqrt(3.0F);
  CHECK(npt::length(back.normals[7] - npt::Vec3f{s, s, s}) < 1e-6F);
}

TEST_CASE("faces of more than 255 corners are written and read") {
  Mesh mesh;
  mesh.face_start = {0, 300};
  for (std::uint32_t i = 0; i < 300; ++i) {
    mesh.positions.push_back({std::cos(static_cast<float>(i)), std::sin(static_cast<float>(i)), 0});
    mesh.corners.push_back(i);
  }
  for (const PlyFormat format : formats) check_same(npt::parse_ply(npt::format_ply(mesh, "f", format), "f"), mesh);
}

TEST_CASE("what other programs write is understood") {
  // CRLF, aliases of types, double positions, vertex_index, faces before vertices, other elements, lists at vertices,
  // further properties of faces, blank lines, no line end at the end.
  const std::string text =
      "ply\r\nformat ascii 1.0\r\ncomment  VCGLIB generated \r\nelement camera 1\r\nproperty list uint8 float32 "
      "pose\r\n"
      "element face 1\r\nproperty uchar red\r\nproperty list uint8 uint32 vertex_index\r\nproperty float quality\r\n"
      "element vertex 4\r\nproperty list uchar int n\r\nproperty float64 z\r\nproperty int32 y\r\nproperty double x\r\n"
      "element edge 0\r\nproperty int vertex1\r\nend_header\r\n"
      "2 0.5 7\r\n\r\n255 4 0 1 2 3 0.25\r\n0 3 2 1.5\r\n1 9 0 0 0\r\n2 1 2 0 0 1e0\r\n0 +1 1 1";
  const Mesh mesh = npt::parse_ply(text, "f");
  CHECK(mesh.positions == std::vector<npt::Vec3f>{{1.5F, 2, 3}, {0, 0, 0}, {1, 0, 0}, {1, 1, 1}});
  CHECK(mesh.corners == std::vector<std::uint32_t>{0, 1, 2, 3});
  CHECK(mesh.properties.empty());
  CHECK(mesh.tags[0].value == "VCGLIB generated");
  CHECK(npt::parse_ply(header("element vertex 1\n" + xyz) + "1 2 3", "f").face_count() == 0);
  CHECK(npt::parse_ply(triangle("0", ""), "f").face_count() == 0);
  // Two of three normals are just properties.
  CHECK(
      npt::parse_ply(header("element vertex 1\n" + xyz + "property float nx\nproperty float ny\n") + "1 2 3 4 5\n", "f")
          .properties.size() == 2);
}

TEST_CASE("components of a normal without the others are properties, and are written as such") {
  const std::string text =
      header("element vertex 1\n" + xyz + "property float nz\nproperty float ny\n") + "1 2 3 4 5\n";
  const Mesh mesh = npt::parse_ply(text, "f");
  CHECK(mesh.normals.empty());
  check_same(npt::parse_ply(npt::format_ply(mesh, "f"), "f"), mesh);
}

TEST_CASE("shared example meshes survive each format" * support::needs_shared("data/humans/f_heavy/table6_0.ply")) {
  const std::filesystem::path path = NPT_SHARED "/data/humans/f_heavy/table6_0.ply";
  const Mesh mesh = npt::read_ply(path);
  CHECK(mesh.vertex_count() == 6890);
  const scratch::Folder folder;
  for (const PlyFormat format : formats) {
    npt::write_ply(folder / "a.ply", mesh, format);
    check_same(npt::read_ply(folder / "a.ply"), mesh);
  }
}

TEST_CASE("a header tells formats, elements, properties and where the data begin") {
  const std::string text = header("comment c\nelement vertex 3\n" + xyz + "element face 2\nproperty list uchar int i\n",
                                  "binary_big_endian");
  const npt::internal::ply::Header parsed = npt::internal::ply::HeaderReader(text + "data", "f").read();
  CHECK(parsed.format == PlyFormat::binary_big_endian);
  CHECK(std::string(npt::to_string(parsed.format)) == "binary_big_endian");
  CHECK(parsed.bytes == text.size());
  CHECK(parsed.lines == 10);
  CHECK(parsed.comments.size() == 1);
  REQUIRE(parsed.find("vertex") != nullptr);
  CHECK(parsed.find("vertex")->count == 3);
  CHECK(parsed.find("vertex")->find("z") != nullptr);
  CHECK(parsed.find("vertex")->find("w") == nullptr);
  CHECK(parsed.find("face")->properties[0].count_type == npt::internal::ply::Type::u8);
  CHECK(parsed.find("edge") == nullptr);
}

TEST_CASE("wrong headers are errors with their line") {
  CHECK(ply_error("") == "f: line 1: found '', expected ply");
  CHECK(ply_error("v 0 0 0\n") == "f: line 1: found 'v 0 0 0', expected ply");
  CHECK(ply_error(std::string("\0\n", 2)) == "f: line 1: found '\\x00', expected ply");
  CHECK(ply_error("ply") == "f: line 1: found 'ply', expected ply");
  CHECK(ply_error("ply\nformat ascii 1.0\n") == "f: line 3: found the end of the file, expected end_header");
  CHECK(ply_error("ply\nend_header\n").starts_with("f: line 2: found a header without format"));
  CHECK(ply_error("ply\nformat ascii 2.0\n").starts_with("f: line 2: found 'format ascii 2.0'"));
  CHECK(ply_error("ply\nformat text 1.0\n").starts_with("f: line 2: "));
  CHECK(ply_error(header("format ascii 1.0\n")).starts_with("f: line 3: found 'format ascii 1.0'"));
  CHECK(ply_error(header("element vertex\n"))
            .starts_with("f: line 3: found 'element vertex', expected element NAME COUNT"));
  CHECK(ply_error(header("element vertex -3\n")).starts_with("f: line 3: "));
  CHECK(ply_error(header("element vertex 99999999999999999999\n")).starts_with("f: line 3: "));
  CHECK(ply_error(header("element vertex 1\nelement vertex 1\n"))
            .starts_with("f: line 4: found a second element 'vertex'"));
  CHECK(ply_error(header("property float x\n")).starts_with("f: line 3: "));
  CHECK(ply_error(header("element vertex 1\nproperty int64 x\n")).starts_with("f: line 4: found type 'int64'"));
  CHECK(ply_error(header("element vertex 1\nproperty float\n")).starts_with("f: line 4: "));
  CHECK(ply_error(header("element vertex 1\n" + xyz + "property int x\n")).find("a second property 'x'") !=
        std::string::npos);
  CHECK(ply_error(header("element vertex 1\nproperty list float int a\n")).find("a list's length") !=
        std::string::npos);
}

TEST_CASE("lines of a header that aren't PLY's are passed over, with a note") {
  const std::string remarks = "made with a program\n\nsecond remark\n", rows = "element vertex 1\n" + xyz;
  std::vector<std::string> notes;
  const Mesh mesh = npt::parse_ply(header(remarks + rows) + "1 2 3\n", "f", &notes);
  CHECK(mesh.positions == std::vector<npt::Vec3f>{{1, 2, 3}});
  CHECK(notes ==
        std::vector<std::string>{"f: line 3: passed over 'made with a program', which is no line of a PLY header"});
  notes.clear();
  npt::parse_ply(header("comment made with a program\n" + rows) + "1 2 3\n", "f", &notes);
  CHECK(notes.empty());
  CHECK(ply_error(header("nonsense\n")) ==
        "f: header: found no vertices, expected element vertex, with a count of at least 1");
}

TEST_CASE("a header of very many names takes time in proportion") {
  std::string elements = "element vertex 1\n" + xyz, row = "0 0 0", many;
  for (int i = 0; i < 200000; ++i) {  // compared pairwise: minutes
    elements += "property float a_property_with_a_long_name_" + std::to_string(i) + "\n";
    row += " 1";
    many += "element an_element_with_a_long_name_" + std::to_string(i) + " 0\n";
  }
  CHECK(npt::parse_ply(header(elements) + row + "\n", "f").properties.size() == 200000);
  CHECK(ply_error(header(elements + "property float a_property_with_a_long_name_7\n") + row + "\n")
            .find("a second property 'a_property_with_a_long_name_7'") != std::string::npos);
  CHECK(npt::parse_ply(header("element vertex 1\n" + xyz + many) + "0 0 0\n", "f").vertex_count() == 1);
  CHECK(ply_error(header(many + "element an_element_with_a_long_name_7 0\n")).find("a second element") !=
        std::string::npos);
  // The names of one element are free for the next.
  CHECK(ply_error(header("element camera 0\nproperty float x\nelement vertex 1\n" + xyz) + "0 0 0\n") == "no error");
}

TEST_CASE("missing elements and properties are named") {
  CHECK(ply_error(header("")) == "f: header: found no vertices, expected element vertex, with a count of at least 1");
  CHECK(ply_error(header("element vertex 0\n" + xyz)).find("no vertices") != std::string::npos);
  CHECK(ply_error(header("element vertex 1\nproperty float x\nproperty float y\n") + "0 0\n")
            .find("vertices without z") != std::string::npos);
  CHECK(ply_error(header("element vertex 1\nproperty list uchar float x\nproperty float y\nproperty float z\n") +
                  "0 0 0\n")
            .find("vertices without x") != std::string::npos);
  CHECK(ply_error(header("element vertex 1\n" + xyz + "element face 1\nproperty int a\n") + "0 0 0\n1\n")
            .find("faces without vertices") != std::string::npos);
  CHECK(ply_error(header("element vertex 1\n" + xyz + "element face 1\nproperty int vertex_indices\n") + "0 0 0\n1\n")
            .find("a list of whole numbers") != std::string::npos);
  CHECK(ply_error(header("element vertex 1\n" + xyz + "element tristrips 1\nproperty list int int vertex_indices\n") +
                  "0 0 0\n3 0 0 0\n")
            .find("triangle strips") != std::string::npos);
}

TEST_CASE("wrong rows of text are errors with their line") {
  CHECK(ply_error(triangle("1", "3 0 1 2\n")) == "no error");
  CHECK(ply_error(triangle("1", "3 0 1 3\n")) == "f: line 13: found vertex 3 in face 0, expected a vertex from 0 to 2");
  CHECK(ply_error(triangle("1", "3 0 1 -1\n")) ==
        "f: line 13: found vertex -1 in face 0, expected a vertex from 0 to 2");
  CHECK(ply_error(triangle("2", "3 0 1\n3 0 1 2\n")) ==
        "f: line 13: found the end of the line, expected another number, int");
  CHECK(ply_error(triangle("1", "3 0 1 2 2\n")) ==
        "f: line 13: found '2' after the row's last number, expected the end of the line");
  CHECK(ply_error(triangle("1", "2 0 1\n")) == "f: line 13: found face 0 with 2 corners, expected at least 3");
  CHECK(ply_error(triangle("1", "-1 0 1 2\n")).find("'-1', expected a number of type uchar") != std::string::npos);
  CHECK(ply_error(triangle("1", "256 0 1 2\n")).find("'256', expected a number of type uchar") != std::string::npos);
  CHECK(ply_error(triangle("1", "200 0 1 2\n")).find("a list of 200 numbers") != std::string::npos);
  CHECK(ply_error(triangle("1", "3 0 1 1.5\n")).find("'1.5', expected a number of type int") != std::string::npos);
  CHECK(ply_error(triangle("1", "3 0 1 99999999999\n")).find("expected a number of type int") != std::string::npos);
  CHECK(ply_error(triangle("2", "3 0 1 2\n")).starts_with("f: line 13: found the end of the file"));
  CHECK(ply_error(triangle("1", "3 0 1 2\n3 0 1 2\n")) ==
        "f: line 14: found '3 0 1 2' after the last element, expected the end of the file");
  const std::string one = header("element vertex 1\n" + xyz);
  CHECK(ply_error(one + "0 nan 0\n") ==
        "f: line 8: found NaN, expected a finite number that fits into 32-bit floating point");
  CHECK(ply_error(one + "0 inf 0\n").find("infinity") != std::string::npos);
  CHECK(ply_error(one + "0 abc 0\n") == "f: line 8: found 'abc', expected a number of type float");
  CHECK(ply_error(one + "0 1e39 0\n") == "f: line 8: found '1e39', expected a number of type float");
  CHECK(ply_error(one + "0 1e999 0\n") == "f: line 8: found '1e999', expected a number of type float");
  CHECK(ply_error(one + "0 0,5 0\n").find("'0,5'") != std::string::npos);
}

TEST_CASE("counts that the file has no room for are errors before memory is taken") {
  for (const char* format : {"ascii", "binary_little_endian", "binary_big_endian"})
    for (const char* count : {"4000000000", "1000000000000000000"}) {
      CHECK(ply_error(header("element vertex " + std::string(count) + "\n" + xyz, format) + "0 0 0\n")
                .starts_with("f: header: "));
      CHECK(ply_error(header("element vertex 1\n" + xyz + "element face " + count +
                                 "\nproperty list uchar int vertex_indices\n",
                             format) +
                      std::string(24, '0'))
                .starts_with("f: "));
      CHECK(ply_error(header("element x " + std::string(count) + "\nelement vertex 9\n" + xyz, format))
                .starts_with("f: "));
    }
  // A list that announces four billion numbers.
  const std::string list = header(
      "element vertex 1\n" + xyz + "element face 1\nproperty list uint int vertex_indices\n", "binary_little_endian");
  CHECK(ply_error(list + std::string(12, '\0') + "\xFF\xFF\xFF\xFF" + std::string(12, '\0')) ==
        "f: byte " + std::to_string(list.size() + 12) +
            ": found a list of 4294967295 numbers, expected from 0 to 3, what the file has space for");
}

TEST_CASE("wrong bytes are errors with their place") {
  const std::string begin = header(
      "element vertex 1\n" + xyz + "element face 1\nproperty list char char vertex_index\n", "binary_big_endian");
  const std::string good = begin + std::string(12, '\0') + std::string("\x03\0\0\0", 4);
  const auto at = [&](std::size_t byte) { return "f: byte " + std::to_string(begin.size() + byte) + ": "; };
  const auto with = [&](std::size_t byte, const std::string& bytes) {
    return ply_error(std::string(good).replace(begin.size() + byte, bytes.size(), bytes));
  };
  CHECK(ply_error(good) == "no error");
  CHECK(ply_error(good + "\n") == "no error");
  CHECK(ply_error(good + "x") == at(16) + "found 1 bytes after the last element, expected the end of the file");
  CHECK(with(4, "\x7F\xC0").starts_with(at(4) + "found NaN"));
  CHECK(with(8, "\xFF\x80").starts_with(at(8) + "found infinity"));
  CHECK(with(12, "\xFF").starts_with(at(12) + "found a list of -1 numbers"));
  CHECK(with(12, "\x02").starts_with(at(12) + "found face 0 with 2 corners"));
  CHECK(with(14, "\x01").starts_with(at(14) + "found vertex 1 in face 0"));
  CHECK(with(14, "\x80").starts_with(at(14) + "found vertex -128 in face 0"));
}

TEST_CASE("every truncation is an error") {
  for (const PlyFormat format : formats) {
    const std::string whole = npt::format_ply(rich(), "f", format);
    // Without its last line end, an ascii file is still complete; without its last digit it may be another valid file.
    const std::size_t least = format == PlyFormat::ascii ? 2 : 1;
    for (std::size_t size = 0; size + least <= whole.size(); ++size)
      CHECK_MESSAGE(ply_error(whole.substr(0, size)).starts_with("f: "), size);
  }
}

TEST_CASE("texture coordinates that don't fit their face are errors") {
  const std::string begin =
      header("element vertex 3\n" + xyz +
             "element face 1\nproperty list uchar float texcoord\nproperty list uchar int vertex_indices\n") +
      "0 0 0\n1 0 0\n0 1 0\n";
  CHECK(ply_error(begin + "6 0 0 1 0 0 1 3 0 1 2\n") == "no error");
  CHECK(ply_error(begin + "0 3 0 1 2\n") == "no error");
  CHECK(ply_error(begin + "4 0 0 1 0 3 0 1 2\n").find("4 texture coordinates in face 0, expected 6") !=
        std::string::npos);
  CHECK(ply_error(begin + "6 0 0 nan 0 0 1 3 0 1 2\n").find("NaN") != std::string::npos);
}

TEST_CASE("what can't be written as PLY is refused") {
  const auto complaint_with = [](npt::VertexProperty property) {
    Mesh mesh = zoo::cloud();
    property.values.resize(5, property.values.empty() ? 0 : property.values[0]);
    mesh.properties = {std::move(property)};
    return error_of([&] { npt::format_ply(mesh, "f"); });
  };
  CHECK(complaint_with({"q", "float", {}}) == "no error");
  CHECK(complaint_with({"q", "uchar", {256}}).find("found 256") != std::string::npos);
  CHECK(complaint_with({"q", "uchar", {0.5}}) != "no error");
  CHECK(complaint_with({"q", "uchar", {NAN}}) != "no error");
  CHECK(complaint_with({"q", "half", {}}).find("type 'half'") != std::string::npos);
  CHECK(complaint_with({"x", "float", {}}) != "no error");
  CHECK(complaint_with({"q r", "float", {}}) != "no error");
  CHECK(error_of([] { npt::format_ply({}, "f"); }) == "f: found no vertices, expected at least one vertex");
}
