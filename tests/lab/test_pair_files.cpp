#include <doctest/doctest.h>

#include <npt/lab/pair_files.hpp>

#include <functional>
#include <string>

#include "io/scratch.hpp"

namespace {

void write_meshes(const scratch::Folder& folder) {
  npt::write_file(folder / "a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  npt::write_file(folder / "b c.obj", "v 0 0 1\nv 2 0 0\nv 0 2 0\nv 2 2 2\nf 1 2 4 3\n");
  npt::write_file(folder / "t.obj", "v 5 0 0\nv 6 0 0\nv 5 1 0\n");
}

}  // namespace

TEST_CASE("a list of files is a set of pairs, relative to the list") {
  const scratch::Folder folder;
  write_meshes(folder);
  npt::write_file(folder / "list.txt", "# identity pose truth\n\na.obj 'b c.obj' t.obj # far\r\na.obj a.obj a.obj");
  const npt::EvaluationSet set = npt::file_pairs(folder / "list.txt");
  CHECK(set.name == "list.txt");
  REQUIRE(set.count == 2);
  const npt::EvaluationPair pair = set.pair(0);
  CHECK(pair.name == "a.obj as b c.obj");
  CHECK(pair.identity == std::vector<float>{0, 0, 0, 1, 0, 0, 0, 1, 0});
  CHECK(pair.truth == std::vector<float>{5, 0, 0, 6, 0, 0, 5, 1, 0});
  CHECK(pair.pose.size() == 12);
  CHECK(pair.pose_triangles.size() == 2);
  CHECK(pair.edges.size() == 3);
  CHECK(npt::pair_errors(pair, pair.identity).pmd == 0);
}

TEST_CASE("lists that can't be used are refused, with the line") {
  const scratch::Folder folder;
  write_meshes(folder);
  const auto refused = [&](const char* text, const char* says) {
    npt::write_file(folder / "list.txt", text);
    const std::string message = scratch::error_of([&] { npt::file_pairs(folder / "list.txt").pair(0); });
    INFO("wanted: ", says, ", found: ", message);
    CHECK(message.find(says) != std::string::npos);
  };
  refused("", "list.txt: found no pairs");
  refused("# a\n", "list.txt: found no pairs");
  refused("a.obj a.obj\n", "list.txt: line 1: found 2 names");
  refused("\na.obj\n", "list.txt: line 2: found 1 name,");
  refused("a.obj 'a.obj t.obj\n", "line 1: found a quotation mark that is not closed");
  refused("a.obj a.obj none.obj\n", "none.obj'");
  refused("a.obj a.obj list.txt\n", "expected a mesh file");
  refused("a.obj a.obj 'b c.obj'\n", "b c.obj: found 4 vertices, expected 3, as many as");
  CHECK(scratch::error_of([&] { npt::file_pairs(folder / "nothing.txt"); }).find("nothing.txt: found no such file") !=
        std::string::npos);
}
