#include <doctest/doctest.h>

#include <training/group.hpp>
#include <training/log.hpp>

#include <npt/base/error.hpp>
#include <npt/io/file.hpp>

#include <filesystem>
#include <string>
#include <vector>

namespace fs = std::filesystem;

namespace {

/// A folder of this test's own, gone at its end.
struct Folder {
  fs::path path;
  explicit Folder(const char* name) : path(fs::temp_directory_path() / (std::string("npt_training_log_") + name)) {
    fs::remove_all(path);
    fs::create_directories(path);
  }
  ~Folder() { fs::remove_all(path); }
  fs::path file() const { return path / "w.log.csv"; }
};

training::LogRow row(std::uint64_t step) {
  training::LogRow r{.step = step,
                     .seconds = 0.1 * static_cast<double>(step),
                     .progress = 1.0 / 3,
                     .rate = 3e-3,
                     .loss = 1e-300,
                     .reconstruction = 0.25,
                     .edge = 0,
                     .pmd = 1.0 / static_cast<double>(step),
                     .gradient_norm = 7,
                     .batch = 48,
                     .vertices = 120,
                     .data_share = 0.02,
                     .validation_pmd = {}};
  if (step % 20 == 0) r.validation_pmd = 2.0 / static_cast<double>(step);
  return r;
}

std::vector<std::uint64_t> steps_of(const fs::path& path) {
  std::vector<std::uint64_t> steps;
  for (const training::LogRow& r : training::read_log(path)) steps.push_back(r.step);
  return steps;
}

std::string error_of(const fs::path& file) {
  try {
    training::read_log(file);
  } catch (const npt::Error& e) {
    const std::string text = e.what();
    CHECK(text.find(file.string()) == 0);
    return text.substr(file.string().size());
  }
  return "no error";
}

using Steps = std::vector<std::uint64_t>;

}  // namespace

TEST_CASE("rows come back as they were written") {
  const Folder folder("rows");
  training::Log log(folder.file(), {});
  CHECK(training::read_log(folder.file()).empty());
  for (const std::uint64_t step : {10U, 20U, 30U}) log.append(row(step));
  const auto rows = training::read_log(folder.file());
  REQUIRE(rows.size() == 3);
  for (const auto& r : rows) CHECK(r == row(r.step));
  CHECK(rows[1].validation_pmd == 0.1);
  CHECK(!rows[0].validation_pmd);
}

TEST_CASE("a resumed training leaves no row twice, also after its last line was cut off") {
  const Folder folder("resume");
  {
    training::Log log(folder.file(), {});
    for (const std::uint64_t step : {10U, 20U, 30U, 40U}) log.append(row(step));
  }
  npt::write_file(folder.file(), npt::read_file(folder.file()) + "50,1.5,0.");  // killed while it wrote
  training::Log log(folder.file(), 30);
  CHECK(steps_of(folder.file()) == Steps{10, 20, 30});
  log.append(row(40));
  log.append(row(50));
  CHECK(steps_of(folder.file()) == Steps{10, 20, 30, 40, 50});
}

TEST_CASE("a new training begins a new log; one resumed without its log begins one, too") {
  const Folder folder("new");
  training::Log(folder.file(), {}).append(row(10));
  training::Log(folder.file(), {}).append(row(20));
  CHECK(steps_of(folder.file()) == Steps{20});
  fs::remove(folder.file());
  training::Log(folder.file(), 20).append(row(30));
  CHECK(steps_of(folder.file()) == Steps{30});
}

TEST_CASE("what is no log is named with its line, and is not overwritten by a resumed training") {
  const Folder folder("damage");
  npt::write_file(folder.file(), "");
  CHECK(error_of(folder.file()).find(": found no complete line") == 0);
  npt::write_file(folder.file(), "a,b\n1,2\n");
  CHECK(error_of(folder.file()).find(": line 1: found 'a,b'") == 0);
  CHECK_THROWS_AS(training::Log(folder.file(), 5), npt::Error);
  CHECK(npt::read_file(folder.file()) == "a,b\n1,2\n");
  training::Log(folder.file(), {}).append(row(10));
  const std::string good = npt::read_file(folder.file());
  npt::write_file(folder.file(), good + "11,x,3\n");
  CHECK(error_of(folder.file()).find(": line 3: found 'x', expected a number") == 0);
  npt::write_file(folder.file(), good + "11,2\n");
  CHECK(error_of(folder.file()).find(": line 3: found the end of the line") == 0);
  npt::write_file(folder.file(),
                  good + good.substr(good.find('\n') + 1, good.rfind('\n') - good.find('\n') - 1) + ",5\n");
  CHECK(error_of(folder.file()).find(": line 3: found") == 0);
  CHECK_THROWS_AS(training::Log(folder.path / "no" / "log", {}), npt::Error);
}

TEST_CASE("the plot shows any rows, also none") {
  std::vector<training::LogRow> rows;
  CHECK(training::plot_log(rows, "empty").width > 0);
  for (std::uint64_t step = 10; step < 1000; step += 10) rows.push_back(row(step));
  const render::Image image = training::plot_log(rows, "a network");
  std::size_t red = 0, blue = 0;
  for (const render::Pixel& p : image.pixels) {
    red += p.r > 150 && p.g < 80 && p.b < 80 ? 1 : 0;
    blue += p.r < 170 && p.b > 200 ? 1 : 0;
  }
  CHECK(red > 500);
  CHECK(blue > 500);
}

TEST_CASE("a process that nobody started together with others is alone") { CHECK(training::join_group() == nullptr); }
