#include <doctest/doctest.h>

#include <io/scratch.hpp>
#include <mesh/zoo.hpp>
#include <npt/io/mesh_file.hpp>

#include "support/needs.hpp"

using scratch::error_of;

TEST_CASE("the extension decides, in any case") {
  const scratch::Folder folder;
  for (const char* name : {"a.obj", "a.OBJ", "b.ply", "b.Ply", "c.d.ply"}) {
    npt::write_mesh(folder / name, zoo::mixed());
    const npt::Mesh mesh = npt::read_mesh(folder / name);
    CHECK(mesh.positions == zoo::mixed().positions);
    CHECK(mesh.face_start == zoo::mixed().face_start);
    CHECK(mesh.corners == zoo::mixed().corners);
  }
  CHECK(npt::read_file(folder / "a.obj").starts_with("v 0 0 0\n"));
  CHECK(npt::read_file(folder / "b.ply").starts_with("ply\nformat binary_little_endian 1.0\n"));
  npt::write_mesh(folder / "b.ply", zoo::mixed(), npt::PlyFormat::ascii);
  CHECK(npt::read_file(folder / "b.ply").starts_with("ply\nformat ascii 1.0\n"));
}

TEST_CASE("other extensions are errors that name the known ones") {
  CHECK(error_of([] { npt::read_mesh("a.stl"); }) ==
        "a.stl: found extension '.stl', expected a mesh file, .obj, .ply or .glb");
  CHECK(error_of([] { npt::mesh_format("mesh"); }) ==
        "mesh: found no extension, expected a mesh file, .obj, .ply or .glb");
  CHECK(error_of([] { npt::write_mesh("a.obj.gz", zoo::cube()); }).starts_with("a.obj.gz: found extension '.gz'"));
}

TEST_CASE("what other programs read is read, with a note for each file" *
          support::needs_shared("data/awkward/normals_named_but_missing.obj")) {
  const std::filesystem::path folder = NPT_SHARED "/data/awkward";
  for (const char* name : {"normals_named_but_missing.obj", "header_with_a_stray_line.ply"}) {
    std::vector<std::string> notes;
    CHECK(npt::read_mesh(folder / name, &notes).vertex_count() == 741);
    REQUIRE(notes.size() == 1);
    CHECK(notes[0].starts_with((folder / name).string() + ": "));
  }
  std::vector<std::string> notes;
  CHECK(npt::read_mesh(folder / "texture_named_but_missing.obj", &notes).texcoords.empty());
  CHECK(notes.size() == 2);
  notes.clear();
  CHECK(npt::read_mesh(folder / "inverse_bind_last_row_zero.glb", &notes).face_count() > 0);
  CHECK(notes.size() == 1);
}

TEST_CASE("errors of a file name its path") {
  const scratch::Folder folder;
  npt::write_file(folder / "a.obj", "v 0 0 x\n");
  npt::write_file(folder / "a.ply", "plx\n");
  npt::write_file(folder / "empty.obj", "");
  npt::write_file(folder / "empty.ply", "");
  for (const char* name : {"a.obj", "a.ply", "empty.obj", "empty.ply", "none.obj", "none.ply"})
    CHECK(error_of([&] { npt::read_mesh(folder / name); }).starts_with((folder / name).string() + ": "));
}

TEST_CASE("a broken mesh is not written, and an old file stays") {
  const scratch::Folder folder;
  npt::Mesh broken = zoo::cube();
  broken.corners[0] = 8;
  for (const char* name : {"a.obj", "a.ply"}) {
    CHECK(error_of([&] {
            npt::write_mesh(folder / name, broken);
          }).ends_with("face 0: found vertex 8, expected a vertex below 8"));
    CHECK(error_of([&] { npt::write_mesh(folder / "none" / name, zoo::cube()); }) != "no error");
    CHECK(folder.file_count() == 0);
  }
}

TEST_CASE("texture coordinates and normals go from OBJ to PLY and back") {
  const scratch::Folder folder;
  npt::write_mesh(folder / "a.obj", zoo::hard_cube());
  npt::write_mesh(folder / "a.ply", npt::read_mesh(folder / "a.obj"));
  npt::write_mesh(folder / "b.obj", npt::read_mesh(folder / "a.ply"));
  const npt::Mesh mesh = npt::read_mesh(folder / "b.obj"), before = zoo::hard_cube();
  CHECK(mesh.corners == before.corners);
  for (std::size_t c = 0; c < 24; ++c)
    CHECK(mesh.texcoords[mesh.corner_texcoord[c]] == before.texcoords[before.corner_texcoord[c]]);
  CHECK(mesh.normals.size() == 8);
}
