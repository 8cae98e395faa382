#include <doctest/doctest.h>

#include <npt/base/random.hpp>
#include <npt/io/file.hpp>
#include <npt/nn/train/checkpoint.hpp>
#include <npt/nn/train/slices.hpp>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "nn/train/linear_core.hpp"

namespace fs = std::filesystem;

namespace {

const std::vector<npt::NamedParameter>& parameters() { return support::LinearCore::parameters(); }
constexpr std::size_t buffer_size = support::LinearCore::size;

/// A folder of this test's own, gone at its end.
struct Folder {
  fs::path path;
  explicit Folder(const char* name) : path(fs::temp_directory_path() / (std::string("npt_checkpoint_") + name)) {
    fs::remove_all(path);
    fs::create_directories(path);
  }
  ~Folder() { fs::remove_all(path); }
  fs::path file() const { return path / "c.safetensors"; }
};

npt::Checkpoint<float> example(bool average = true) {
  npt::Checkpoint<float> c;
  npt::Random random(4);
  for (auto* buffer : {&c.parameters, &c.mean, &c.square, &c.average}) {
    if (buffer == &c.average && !average) continue;
    *buffer = npt::AlignedBuffer<float>(buffer_size);
    for (const npt::NamedParameter& p : parameters())
      for (int i = 0; i < p.parameter.size(); ++i)
        (*buffer)[static_cast<std::size_t>(p.parameter.offset + i)] =
            p.parameter.attribute ? 1.1F : static_cast<float>(random.normal() * 1e-12);
  }
  c.step = 9'876'543'210;
  c.seconds = 1.0 / 3;
  c.best_pmd = 2e-3;
  c.options = {{"rate", "0.003"}, {"body", "a \"b\"\n"}};
  return c;
}

bool same(const npt::AlignedBuffer<float>& a, const npt::AlignedBuffer<float>& b) {
  return std::ranges::equal(a.span(), b.span());
}

std::string error_of(const fs::path& file, std::size_t drop = 0) {
  auto list = parameters();
  list.resize(list.size() - drop);
  try {
    npt::load_checkpoint<float>(file, list, buffer_size);
  } catch (const npt::Error& e) {
    const std::string text = e.what();
    CHECK(text.find(file.string()) == 0);
    return text.substr(file.string().size());
  }
  return "no error";
}

/// The example's file with its metadata and tensors changed.
template <class Edit>
void write_edited(const fs::path& path, Edit&& edit) {
  npt::save_checkpoint<float>(path, parameters(), example());
  const auto file = npt::SafetensorsFile::read(path);
  auto metadata = file.metadata();
  auto tensors = file.tensors();
  edit(metadata, tensors);
  npt::write_safetensors(path, tensors, metadata);
}

}  // namespace

TEST_CASE("a checkpoint comes back bit for bit") {
  const Folder folder("roundtrip");
  for (const bool average : {true, false}) {
    const auto c = example(average);
    npt::save_checkpoint<float>(folder.file(), parameters(), c);
    const auto d = npt::load_checkpoint<float>(folder.file(), parameters(), buffer_size);
    CHECK(same(c.parameters, d.parameters));
    CHECK(same(c.average, d.average));
    for (const npt::Slice& s : npt::learned_slices(parameters()))
      for (std::size_t i = s.first; i < s.last; ++i) {
        CHECK(c.mean[i] == d.mean[i]);
        CHECK(c.square[i] == d.square[i]);
      }
    CHECK(c.step == d.step);
    CHECK(c.seconds == d.seconds);
    CHECK(c.best_pmd == d.best_pmd);
    CHECK(c.options == d.options);
    CHECK(npt::checkpoint_options(npt::SafetensorsFile::read(folder.file())) == c.options);
  }
}

TEST_CASE("no validation yet is no best, and the same state is the same file") {
  const Folder folder("best");
  npt::Checkpoint<float> c = example();
  c.best_pmd = std::numeric_limits<double>::infinity();
  npt::save_checkpoint<float>(folder.file(), parameters(), c);
  const std::string bytes = npt::read_file(folder.file());
  const auto d = npt::load_checkpoint<float>(folder.file(), parameters(), buffer_size);
  CHECK(std::isinf(d.best_pmd));
  npt::save_checkpoint<float>(folder.file(), parameters(), d);
  CHECK(npt::read_file(folder.file()) == bytes);
}

TEST_CASE("each kind of damage is named") {
  const Folder folder("damage");
  const auto message = [&](auto&& edit) {
    write_edited(folder.file(), edit);
    return error_of(folder.file());
  };
  using M = npt::Metadata;
  using T = std::vector<npt::FileTensor>;
  CHECK(message([](M&, T&) {}) == "no error");
  CHECK(message([](M& m, T&) { m.erase("kind"); }).find(": metadata kind: found nothing") == 0);
  CHECK(message([](M& m, T&) { m["kind"] = "other"; }).find(": metadata kind: found 'other'") == 0);
  CHECK(message([](M& m, T&) { m["kind"] = "npt training checkpoint 1"; })
            .find(": metadata kind: found 'npt training checkpoint 1', expected 'npt training checkpoint 2': is this a "
                  "checkpoint? Those of other numbers can't be read") == 0);
  CHECK(message([](M& m, T&) { m.erase("step"); }).find(": metadata step: found nothing") == 0);
  CHECK(message([](M& m, T&) { m["step"] = "-1"; }).find(": metadata step: found '-1'") == 0);
  CHECK(message([](M& m, T&) { m["step"] = "12x"; }).find(": metadata step: found '12x'") == 0);
  CHECK(message([](M& m, T&) { m["seconds"] = "nan"; }).find(": metadata seconds: found 'nan'") == 0);
  CHECK(message([](M& m, T&) { m["seconds"] = "-2"; }).find(": metadata seconds: found -2") == 0);
  CHECK(message([](M& m, T&) { m["best_pmd"] = "much"; }).find(": metadata best_pmd: found 'much'") == 0);
  CHECK(message([](M& m, T&) { m.erase("attribute.scale"); }).find(": metadata attribute.scale: found nothing") == 0);
  CHECK(message([](M&, T& t) { t.pop_back(); }).find(": found no tensor 'average.c.bias'") == 0);
  CHECK(message([](M&, T& t) { t.erase(t.begin()); }).find(": found no tensor 'weights.a.weight'") == 0);
  CHECK(message([](M&, T& t) { t[0].shape = {9}; }).find(": tensor 'weights.a.weight': found [9] of F32") == 0);
  CHECK(message([](M&, T& t) { t[2].name = "weights.d.bias"; }).find(": found no tensor 'weights.c.bias'") == 0);
  CHECK(message([](M&, T& t) { t.push_back({.name = "more", .shape = {0}}); }).find(": tensor 'more': found") == 0);
  std::vector<float> values(9, std::numeric_limits<float>::quiet_NaN());
  CHECK(message([&](M&, T& t) {
          t[3].bytes = std::as_bytes(std::span(values));
        }).find(": tensor 'adam.mean.a.weight'") == 0);
  CHECK(error_of(folder.path / "none.safetensors").find(": found no such file") == 0);
  npt::save_checkpoint<float>(folder.file(), parameters(), example());
  CHECK(error_of(folder.file(), 2).find(": tensor 'weights.c.bias': found a tensor that belongs to no layer") == 0);
}

TEST_CASE("every truncation is an error") {
  const Folder folder("truncation");
  npt::save_checkpoint<float>(folder.file(), parameters(), example());
  const std::string bytes = npt::read_file(folder.file());
  for (std::size_t n = 0; n < bytes.size(); n += n < 32 ? 1 : 61) {
    npt::write_file(folder.file(), std::string_view(bytes).substr(0, n));
    CHECK(error_of(folder.file()) != "no error");
  }
}

TEST_CASE("a checkpoint that can't be written leaves the old one; keys of its own are no options") {
  const Folder folder("unwritable");
  npt::save_checkpoint<float>(folder.file(), parameters(), example());
  const std::string before = npt::read_file(folder.file());
  npt::Checkpoint<float> c = example();
  for (const char* key : {"step", "kind", "attribute.x"}) {
    c.options = {{key, "1"}};
    CHECK_THROWS_AS(npt::save_checkpoint<float>(folder.file(), parameters(), c), npt::Error);
  }
  CHECK(npt::read_file(folder.file()) == before);
  CHECK_THROWS_AS(npt::save_checkpoint<float>(folder.path / "no" / "c", parameters(), example()), npt::Error);
}
