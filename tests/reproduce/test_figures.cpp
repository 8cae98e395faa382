#include <doctest/doctest.h>

#include <npt/base/error.hpp>
#include <npt/io/file.hpp>
#include <npt/io/mesh_file.hpp>
#include <npt/io/words.hpp>
#include <npt/mesh/metrics.hpp>
#include <reproduce/figures.hpp>
#include <reproduce/systems.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace {

namespace fs = std::filesystem;

/// A folder that goes away, with weights of no content for every network.
struct Folder {
  fs::path path;

  explicit Folder(const char* name) : path(fs::temp_directory_path() / (std::string("npt_figures_") + name)) {
    fs::remove_all(path);
    fs::create_directories(path);
  }
  ~Folder() {
    std::error_code ignored;
    fs::remove_all(path, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  reproduce::FigureSources sources() const {
    reproduce::FigureSources sources;
    for (const reproduce::System& system : reproduce::systems()) {
      if (system.kind != reproduce::Kind::network) continue;
      sources.weights[system.id] = path / (system.id + ".safetensors");
      npt::write_file(sources.weights[system.id], system.id);
    }
    return sources;
  }
};

std::string option(const std::vector<std::string>& arguments, const std::string& name) {
  const auto found = std::ranges::find(arguments, name);
  return found == arguments.end() ? std::string() : *(found + 1);
}

/// Stands for the program: a transfer gives the identity, a deformation its target, a picture the text of its command.
struct Program {
  std::map<std::string, int> calls;
  std::set<std::string> transfers;  ///< outputs of networks

  void operator()(const std::vector<std::string>& arguments) {
    ++calls[arguments.front()];
    const auto copy = [](const fs::path& from, const fs::path& to) {
      REQUIRE_FALSE(fs::exists(to));
      fs::copy_file(from, to);
    };
    if (arguments.front() == "deform") copy(option(arguments, "--target"), option(arguments, "--out"));
    if (arguments.front() == "skeleton") copy(option(arguments, "--identity"), option(arguments, "--out"));
    if (arguments.front() == "transfer") {
      const std::string weights = option(arguments, "--weights");
      REQUIRE((weights.empty() || fs::exists(weights)));
      if (weights.empty()) ++calls["body estimation"];
      const std::string list = npt::read_file(option(arguments, "--pairs"));
      for (std::size_t at = 0; at < list.size();) {
        const std::size_t end = list.find('\n', at);
        const auto words = npt::list_words(std::string_view(list).substr(at, end - at));
        REQUIRE(words->size() == 3);
        CHECK(fs::exists((*words)[1]));
        copy((*words)[0], (*words)[2]);
        transfers.insert((*words)[2]);
        at = end + 1;
      }
    }
    if (arguments.front() == "render") {
      for (std::size_t i = 1; arguments[i] != "--out"; ++i) CHECK((arguments[i] == "-" || fs::exists(arguments[i])));
      npt::write_file(option(arguments, "--out"), "picture");
    }
  }
  reproduce::RunCommand command() {
    return [this](const std::vector<std::string>& arguments) { (*this)(arguments); };
  }
};

/// Two species in four labels.
void make_family(const fs::path& folder) {
  for (const char* species : {"Cat", "Dog"}) {
    fs::create_directories(folder / species);
    for (const char* label : {"Run_00", "Run_01", "Sit_00", "Sit_01"})
      npt::write_file((folder / species / (std::string(label) + ".obj")).string(),
                      "v 0 0 0\nv 1 0 0\nv 0 " + std::string(label).substr(4) + "5 0\nv 0 0 1\nf 1 2 3\nf 1 4 2\n");
  }
}

}  // namespace

TEST_CASE("lists of numbers hold numbers and ranges") {
  CHECK(reproduce::parse_numbers({"6..8", "12", "7"}, "--figure") == std::vector{6, 7, 8, 12});
  CHECK(reproduce::parse_numbers({}, "--figure").empty());
  for (const char* bad : {"", "six", "8..6", "6..", "..8", "6-8", "-6", "6..9999999999"})
    CHECK_THROWS_WITH_AS(reproduce::parse_numbers({bad}, "--figure"), doctest::Contains("--figure: found '"),
                         npt::Error);
}

TEST_CASE("figures 6 to 20 name systems that exist") {
  for (int number = 6; number <= 20; ++number)
    for (const std::string& system : reproduce::figure_of(number).systems)
      CHECK(reproduce::system_of(system).id == system);
  CHECK(reproduce::figures().size() == 15);
  CHECK_THROWS_AS(reproduce::figure_of(5), npt::Error);
}

TEST_CASE("every figure is a full grid of meshes, drawn once") {
  const Folder folder("all");
  make_family(folder.path / "family");
  reproduce::FigureSources sources = folder.sources();
  sources.family = (folder.path / "family").string();
  Program program;
  {
    reproduce::MeshStore store(sources, folder.path / "meshes", program.command());
    for (const reproduce::Figure& figure : reproduce::figures()) {
      CAPTURE(figure.number);
      const reproduce::Plate plate = reproduce::plate_of(figure.number, store);
      CHECK(plate.panels.size() == plate.columns.size() * plate.rows.size());
      CHECK(reproduce::draw_figure(figure.number, store, folder.path / "figures", program.command()) ==
            reproduce::Outcome::drawn);
    }
  }
  CHECK(program.calls["render"] == 15);
  CHECK(program.calls["skeleton"] == 3);
  CHECK(program.calls["body estimation"] == 1);
  CHECK(fs::exists(folder.path / "figures" / "figure_06.png"));
  const auto before = program.calls;
  const auto draw_all = [&](reproduce::Outcome expected) {
    reproduce::MeshStore store(sources, folder.path / "meshes", program.command());
    for (const reproduce::Figure& figure : reproduce::figures())
      CHECK(reproduce::draw_figure(figure.number, store, folder.path / "figures", program.command()) == expected);
  };
  draw_all(reproduce::Outcome::kept);
  CHECK(program.calls == before);
  // At another size from the same meshes.
  sources.panel_height = 100;
  draw_all(reproduce::Outcome::drawn);
  CHECK(program.calls["transfer"] == before.at("transfer"));
  CHECK(program.calls["render"] == 30);
}

TEST_CASE("other weights make other meshes, and only those") {
  const Folder folder("weights");
  const reproduce::FigureSources sources = folder.sources();
  Program program;
  const auto draw = [&] {
    reproduce::MeshStore store(sources, folder.path / "meshes", program.command());
    return reproduce::draw_figure(9, store, folder.path / "figures", program.command());
  };
  CHECK(draw() == reproduce::Outcome::drawn);
  CHECK(program.calls["transfer"] == 4);
  npt::write_file((folder.path / "concat1.safetensors").string(), "trained longer");
  CHECK(draw() == reproduce::Outcome::drawn);
  CHECK(program.calls["transfer"] == 5);
  CHECK(program.transfers.size() == 5 * 3);
}

TEST_CASE("noise and orders do what their captions say") {
  const Folder folder("variants");
  Program program;
  reproduce::MeshStore store(folder.sources(), folder.path / "meshes", program.command());
  const reproduce::MeshFile pose = store.pose(reproduce::PairSet::unseen, 3);
  const npt::Mesh own = npt::read_mesh(pose.path), noisy = npt::read_mesh(store.with_noise(pose, 0.01).path);
  float low = own.positions[0].y, high = low;
  for (const npt::Vec3f p : own.positions) low = std::min(low, p.y), high = std::max(high, p.y);
  const double sigma = 0.01 * static_cast<double>(high - low);
  CHECK(npt::pmd_per_coordinate(noisy.coordinates(), own.coordinates()) ==
        doctest::Approx(sigma * sigma).epsilon(0.05));
  CHECK(store.with_noise(pose, 0).path == pose.path);
  CHECK(store.in_order(pose, 0).path == pose.path);
  const npt::Mesh shuffled = npt::read_mesh(store.in_order(pose, 1).path);
  CHECK(npt::pmd(shuffled.coordinates(), own.coordinates()) > 0.01);
  const auto places = [](const npt::Mesh& mesh) {
    std::multiset<float> heights;
    for (const npt::Vec3f p : mesh.positions) heights.insert(p.y);
    return heights;
  };
  CHECK(places(shuffled) == places(own));
}

TEST_CASE("meshes of other makers stand in for the mannequin") {
  const Folder folder("foreign");
  reproduce::FigureSources sources = folder.sources();
  Program program;
  const fs::path mesh = folder.path / "my 'own' scan.obj";
  npt::write_file(mesh, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  sources.identities = {mesh.string()};
  {
    reproduce::MeshStore store(sources, folder.path / "meshes", program.command());
    CHECK(store.foreign_identities().size() == 1);
    CHECK(store.foreign_poses().size() == 3);
    const reproduce::Plate plate = reproduce::plate_of(17, store);
    CHECK(plate.rows == std::vector<std::string>{"pose", "my  own  scan"});
    CHECK(reproduce::draw_figure(17, store, folder.path / "figures", program.command()) == reproduce::Outcome::drawn);
  }
  npt::write_file(mesh, "v 0 0 0\nv 1 0 0\nv 0 1 0\n");
  CHECK_THROWS_AS(reproduce::MeshStore(sources, folder.path / "meshes", program.command()), npt::Error);
  sources.identities = {"none.ply"};
  CHECK_THROWS_AS(reproduce::MeshStore(sources, folder.path / "meshes", program.command()), npt::Error);
}

TEST_CASE("a figure that fails is named, and may be drawn later") {
  const Folder folder("failure");
  Program program;
  bool broken = true;
  const reproduce::RunCommand run = [&](const std::vector<std::string>& arguments) {
    if (broken && arguments.front() == "transfer") throw npt::Error({.file = "npt transfer", .found = "exit status 1"});
    program(arguments);
  };
  reproduce::MeshStore store(folder.sources(), folder.path / "meshes", run);
  CHECK_THROWS_WITH_AS(reproduce::draw_figure(8, store, folder.path / "figures", run),
                       doctest::Contains("figure 8: npt transfer: found exit status 1"), npt::Error);
  CHECK_FALSE(fs::exists(folder.path / "figures" / "figure_08.png"));
  broken = false;
  CHECK(reproduce::draw_figure(8, store, folder.path / "figures", run) == reproduce::Outcome::drawn);
}

TEST_CASE("without a family figure 14 is left out, with a reason") {
  const Folder folder("family");
  Program program;
  reproduce::MeshStore store(folder.sources(), folder.path / "meshes", program.command());
  CHECK(reproduce::draw_figure(14, store, folder.path / "figures", program.command()) == reproduce::Outcome::left_out);
  CHECK(reproduce::left_out_because(14, store.sources()).find("--family") != std::string::npos);
  CHECK(reproduce::left_out_because(6, store.sources()).empty());
}

TEST_CASE("labels held out are shared ones, and some are left") {
  const Folder folder("labels");
  make_family(folder.path);
  CHECK(reproduce::held_out_labels(folder.path.string()) == std::vector<std::string>{"run_01", "sit_01"});
  const std::vector<std::string> arguments = reproduce::family_training_arguments(folder.path.string());
  CHECK(option(arguments, "--held-out") == "run_01");
  CHECK(option(arguments, "--stage") == "0:24x4");
}
