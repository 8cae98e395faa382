#include <doctest/doctest.h>

#include <npt/body/body_file.hpp>
#include <npt/io/safetensors.hpp>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "small_body.hpp"
#include "support/needs.hpp"

namespace {

/// A file that disappears with the test.
struct TemporaryFile {
  explicit TemporaryFile(const std::string& name)
      : path(std::filesystem::temp_directory_path() / ("npt-test-body-" + name)) {}
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  ~TemporaryFile() {
    std::error_code ignored;
    std::filesystem::remove(path, ignored);
  }
  std::filesystem::path path;
};

/// The tensors of a body file, each to be changed or taken out before writing.
struct Draft {
  struct Entry {
    npt::Dtype dtype;
    npt::TensorShape shape;
    std::vector<float> floats;
    std::vector<std::int32_t> integers;
  };
  std::map<std::string, Entry> entries;
  std::map<std::string, std::string> metadata;

  Draft() {
    const npt::BodyTables body = small_body();
    const std::vector<float> regressor = body.J_regressor.to_dense(), weights = body.weights.to_dense();
    entries["v_template"] = {npt::Dtype::f32, {6, 3}, body.v_template, {}};
    entries["shapedirs"] = {npt::Dtype::f32, {6, 3, 3}, body.shapedirs, {}};
    entries["J_regressor"] = {npt::Dtype::f32, {3, 6}, regressor, {}};
    entries["weights"] = {npt::Dtype::f32, {6, 3}, weights, {}};
    entries["f"] = {npt::Dtype::i32, {3, 3}, {}, {0, 2, 1, 2, 4, 5, 3, 4, 5}};
    entries["parents"] = {npt::Dtype::i32, {3}, {}, {-1, 0, 1}};
  }

  void write(const std::filesystem::path& path) const {
    std::vector<npt::FileTensor> tensors;
    for (const auto& [name, e] : entries) {
      tensors.push_back({.name = name,
                         .dtype = e.dtype,
                         .shape = e.shape,
                         .bytes = e.dtype == npt::Dtype::f32 ? std::as_bytes(std::span(e.floats))
                                                             : std::as_bytes(std::span(e.integers))});
    }
    npt::write_safetensors(path, tensors, metadata);
  }
};

std::string message_of(const Draft& draft) {
  const TemporaryFile file("bad.safetensors");
  draft.write(file.path);
  try {
    npt::load_body(file.path);
  } catch (const npt::Error& error) {
    const std::string text = error.what();
    CHECK(text.find(file.path.string()) != std::string::npos);
    return text;
  }
  return "no error";
}

}  // namespace

TEST_CASE("a saved body loads as it was") {
  npt::BodyTables tables = small_body();
  tables.joint_names = {"root", "middle", "tip"};
  tables.metadata = {{"unit", "metre"}, {"licence", "none"}};
  for (const bool corrected : {false, true}) {
    if (corrected) tables.posedirs.assign(6 * 3 * 18, 0.25F);
    const TemporaryFile file("round-trip.safetensors");
    npt::save_body(npt::BodyModel(tables), file.path);
    const npt::BodyTables back = npt::load_body(file.path).tables();
    CHECK(back.v_template == tables.v_template);
    CHECK(back.shapedirs == tables.shapedirs);
    CHECK(back.posedirs == tables.posedirs);
    CHECK(back.J_regressor == tables.J_regressor);
    CHECK(back.weights == tables.weights);
    CHECK(back.triangles == tables.triangles);
    CHECK(back.parents == tables.parents);
    CHECK(back.joint_names == tables.joint_names);
    CHECK(back.metadata == tables.metadata);
  }
}

TEST_CASE("every missing or misshapen tensor is named at once") {
  Draft draft;
  draft.entries.erase("f");
  draft.entries.erase("weights");
  draft.entries["J_regressor"].shape = {6, 3};
  const std::string text = message_of(draft);
  INFO(text);
  CHECK(text.find("no tensor 'f' of shape [any, 3]") != std::string::npos);
  CHECK(text.find("no tensor 'weights' of shape [6, 3]") != std::string::npos);
  CHECK(text.find("tensor 'J_regressor' of shape [6, 3] instead of [3, 6]") != std::string::npos);
}

TEST_CASE("each kind of damage gets its message") {
  const struct {
    const char* says;
    std::function<void(Draft&)> spoil;
  } cases[] = {
      {"no tensor 'v_template' of shape [any, 3]", [](Draft& d) { d.entries.erase("v_template"); }},
      {"no tensor 'parents'", [](Draft& d) { d.entries.erase("parents"); }},
      {"no tensor 'shapedirs' of shape [6, 3, any]", [](Draft& d) { d.entries.erase("shapedirs"); }},
      {"'v_template' of shape [9, 2]",
       [](Draft& d) {
         d.entries["v_template"].shape = {9, 2};
       }},
      {"'shapedirs' of shape [54]", [](Draft& d) { d.entries["shapedirs"].shape = {54}; }},
      {"'posedirs' of shape [1]",
       [](Draft& d) {
         d.entries["posedirs"] = {npt::Dtype::f32, {1}, {0.0F}, {}};
       }},
      {"'f' of shape [9]", [](Draft& d) { d.entries["f"].shape = {9}; }},
      {"at least one vertex",
       [](Draft& d) {
         d.entries["v_template"] = {npt::Dtype::f32, {0, 3}, {}, {}};
         d.entries["shapedirs"] = {npt::Dtype::f32, {0, 3, 3}, {}, {}};
         d.entries["J_regressor"] = {npt::Dtype::f32, {3, 0}, {}, {}};
         d.entries["weights"] = {npt::Dtype::f32, {0, 3}, {}, {}};
       }},
      {"v_template', element 7",
       [](Draft& d) { d.entries["v_template"].floats[7] = std::numeric_limits<float>::quiet_NaN(); }},
      {"weights", [](Draft& d) { d.entries["weights"].floats[0] = std::numeric_limits<float>::infinity(); }},
      {"weights', row 0", [](Draft& d) { d.entries["weights"].floats[0] = 0.5F; }},
      {"J_regressor', row 1", [](Draft& d) { d.entries["J_regressor"].floats[6] = 0.5F; }},
      {"found vertex 6", [](Draft& d) { d.entries["f"].integers[4] = 6; }},
      {"element 4: found -1", [](Draft& d) { d.entries["f"].integers[4] = -1; }},
      {"'parents', joint 1: found 2", [](Draft& d) { d.entries["parents"].integers[1] = 2; }},
      {"'parents', element 2: found -7", [](Draft& d) { d.entries["parents"].integers[2] = -7; }},
      {"whole numbers",
       [](Draft& d) {
         d.entries["parents"] = {npt::Dtype::f32, {3}, {-1.0F, 0.0F, 1.0F}, {}};
       }},
      {"joint_names: found 2 names", [](Draft& d) { d.metadata["joint_names"] = "a b"; }},
  };
  for (const auto& c : cases) {
    Draft draft;
    c.spoil(draft);
    const std::string text = message_of(draft);
    INFO("wanted: ", c.says, ", found: ", text);
    CHECK(text.find(c.says) != std::string::npos);
  }
  CHECK(message_of(Draft()) == "no error");
}

TEST_CASE("a missing file is an error that names it") {
  CHECK_THROWS_WITH_AS(npt::load_body("nowhere/body.safetensors"), doctest::Contains("nowhere/body.safetensors"),
                       npt::Error);
  CHECK_THROWS_AS(npt::save_body(npt::BodyModel(small_body()), "nowhere/body.safetensors"), npt::Error);
}

namespace {

void check_shared_body(const std::string& name) {
  const npt::BodyModel body = npt::load_body(std::filesystem::path(NPT_SHARED) / "data" / name);
  CHECK(body.joint_count() == 24);
  CHECK(body.shape_count() == 10);
  CHECK(body.tables().joint_names.size() == 24);
  CHECK(body.tables().metadata.at("up") == "y");
  const npt::Mesh mesh = npt::to_mesh(body);
  for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
    REQUIRE(std::abs(mesh.positions[v].y - body.tables().v_template[3 * v + 1]) < 1e-5F);
  }
}

}  // namespace

TEST_CASE("a shared body loads" * support::needs_shared("data/human_6890.safetensors")) {
  check_shared_body("human_6890.safetensors");
}

TEST_CASE("a larger shared body loads" * support::needs_shared("data/human_13380.safetensors")) {
  check_shared_body("human_13380.safetensors");
}
