#include <doctest/doctest.h>

#include <npt/base/error.hpp>
#include <npt/io/safetensors.hpp>
#include <npt/io/tensor_list.hpp>
#include <npt/transfer/character.hpp>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "io/scratch.hpp"
#include "transfer/shipped.hpp"

namespace {

std::vector<float> positions_of(const npt::Character& character) {
  return shipped::numbers(shipped::human().apply(character, shipped::pose()).mesh.coordinates());
}

std::string bytes_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}
void write(const std::filesystem::path& file, std::string_view bytes) {
  std::ofstream(file, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

}  // namespace

TEST_CASE("a character says what was estimated for it") {
  const npt::Character& hero = shipped::character();
  CHECK(hero.vertex_count() == npt::mannequin().vertex_count());
  CHECK(hero.domain() == "human");
  CHECK(hero.recognised());
  CHECK(hero.confidence().value() > 0.85);
  CHECK(hero.warnings().empty());
  CHECK(hero.unit() == 1);
  CHECK(shipped::numbers(hero.positions()) == shipped::numbers(shipped::person(0.1F).coordinates()));
  REQUIRE(hero.joints());
  CHECK(hero.joints()->axis_angles.size() == 72);
  CHECK(hero.joints()->leg > 0.6);
  CHECK(hero.joints()->leg < 1);
  REQUIRE(hero.skeleton());
  CHECK(hero.skeleton()->start.size() == hero.vertex_count() + 1);
  CHECK(npt::Character().vertex_count() == 0);
  CHECK_FALSE(npt::Character().recognised());
}

TEST_CASE("a saved character is loaded with the same bits: results, skeleton, confidence") {
  const scratch::Folder folder;
  const npt::Character& hero = shipped::character();
  hero.save(folder / "hero.npt");
  const npt::Character again = shipped::human().load_character(folder / "hero.npt");
  CHECK(positions_of(again) == positions_of(hero));
  CHECK(again.domain() == hero.domain());
  CHECK(again.recognised());
  CHECK(again.confidence() == hero.confidence());
  CHECK(again.warnings().size() == hero.warnings().size());
  CHECK(again.joints()->axis_angles == hero.joints()->axis_angles);
  CHECK(again.joints()->root == hero.joints()->root);
  CHECK(again.joints()->leg == hero.joints()->leg);
  const npt::SkinnedSkeleton a = *hero.skeleton(), b = *again.skeleton();
  CHECK(a.names == b.names);
  CHECK(a.parents == b.parents);
  CHECK(a.joints == b.joints);
  CHECK(a.start == b.start);
  REQUIRE(a.influences.size() == b.influences.size());
  for (std::size_t i = 0; i < a.influences.size(); ++i)
    REQUIRE((a.influences[i].joint == b.influences[i].joint && a.influences[i].weight == b.influences[i].weight));
  // Saved again, it is the same file.
  again.save(folder / "again.npt");
  CHECK(bytes_of(folder / "again.npt") == bytes_of(folder / "hero.npt"));
}

TEST_CASE("a truncated or damaged file is an error that names it") {
  const scratch::Folder folder;
  const auto file = folder / "hero.npt";
  shipped::character().save(file);
  const std::string bytes = bytes_of(file);
  const auto load = [&file] { return shipped::error_of([&file] { (void)shipped::human().load_character(file); }); };
  for (const std::size_t size : {std::size_t{0}, std::size_t{7}, std::size_t{500}, bytes.size() - 1}) {
    CAPTURE(size);
    write(file, std::string_view(bytes).substr(0, size));
    CHECK(load().file.find("hero.npt") != std::string::npos);
  }
  // Another tensor's name, and corners of vertices that aren't there.
  std::string damaged = bytes;
  damaged.replace(damaged.find("\"hands\""), 7, "\"hends\"");
  write(file, damaged);
  CHECK(load().file.find("hero.npt") != std::string::npos);
  damaged = bytes;
  damaged.replace(damaged.find("npt character 2"), 15, "npt character 9");
  write(file, damaged);
  CHECK(load().found == "the format 'npt character 9'");
  CHECK(shipped::error_of([&] { (void)shipped::human().load_character(folder / "none.npt"); }).file.find("none.npt") !=
        std::string::npos);
  CHECK(shipped::error_of([&] { (void)shipped::human().load_character(shipped::weights()); }).found == "no format");
}

TEST_CASE("a character of another domain, or without body estimation, is refused") {
  const scratch::Folder folder;
  shipped::character().save(folder / "hero.npt");
  const auto animals = npt::PoseTransfer::open(shipped::weights("quadruped.safetensors"), {}, 1);
  const npt::ErrorParts error = shipped::error_of([&] { (void)animals.load_character(folder / "hero.npt"); });
  CHECK(error.code == npt::ErrorCode::domains_differ);
  CHECK(error.found == "a character of the domain 'human'");
}

TEST_CASE("what isn't recognised, or isn't prepared, isn't saved") {
  const scratch::Folder folder;
  const npt::Character ball = shipped::human().character(shipped::ball());
  CHECK_FALSE(ball.recognised());
  CHECK_FALSE(ball.joints());
  CHECK_FALSE(ball.skeleton());
  CHECK(ball.warnings().contains(npt::WarningCode::not_recognised));
  CHECK(shipped::error_of([&] { ball.expect_recognised(); }).found.find("not recognised as a person (confidence") !=
        std::string::npos);
  CHECK(shipped::error_of([&] { npt::Character().expect_recognised(); }).code == npt::ErrorCode::not_recognised);
  const auto code_of = [&](const npt::Character& character) {
    return shipped::error_of([&] { character.save(folder / "no.npt"); }).code;
  };
  CHECK(code_of(ball) == npt::ErrorCode::needs_recognition);
  CHECK(code_of({}) == npt::ErrorCode::needs_recognition);
  CHECK(folder.file_count() == 0);
}
