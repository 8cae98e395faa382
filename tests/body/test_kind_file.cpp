#include <doctest/doctest.h>

#include <npt/base/error.hpp>
#include <npt/body/body_file.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/kind_file.hpp>
#include <npt/io/safetensors.hpp>

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "io/scratch.hpp"
#include "small_body.hpp"

namespace {

constexpr const char* plan_of_worms =
    "plan worm\n"
    "joint back   -      back   trunk root  middle 1 1\n"
    "joint middle back   middle trunk spine front  1 1\n"
    "joint front  middle front  skull head  front  1 1\n"
    "proportion size 0.2 0.8 1.25\n"
    "grows size all back middle front\n";

/// A weights file of a kind, each part to be changed or taken out before writing.
struct KindFile {
  struct Numbers {
    npt::TensorShape shape;
    std::vector<float> values;
  };

  KindFile() {
    prior["mean"] = {{3, 3}, {0, 0, 0, 0.1F, 0.2F, 0.3F, 0.4F, 0.5F, 0.6F}};
    prior["covariance"] = {{6, 6}, std::vector<float>(36, 0.0F)};
    for (std::size_t i = 0; i < 6; ++i) prior["covariance"].values[7 * i] = static_cast<float>(i + 1);
    prior["poses"] = {{4, 9}, {}};
    for (std::size_t i = 0; i < 36; ++i) prior["poses"].values.push_back(static_cast<float>(i));
  }

  npt::SafetensorsFile written() const {
    std::vector<npt::FileTensor> tensors;
    std::map<std::string, std::string> metadata{{"domain", "worm"}};
    npt::save_body(npt::BodyModel(small_body()), folder / "body.safetensors");
    const npt::SafetensorsFile body = npt::SafetensorsFile::read(folder / "body.safetensors");
    if (has_body) {
      tensors = body.tensors();
      for (npt::FileTensor& tensor : tensors) tensor.name = "body/" + tensor.name;
      if (!plan.empty()) metadata["body/plan"] = plan;
    }
    for (const auto& [name, numbers] : prior)
      tensors.push_back({.name = "pose_prior/" + name,
                         .dtype = npt::Dtype::f32,
                         .shape = numbers.shape,
                         .bytes = std::as_bytes(std::span(numbers.values))});
    npt::write_safetensors(folder / "kind.safetensors", tensors, metadata);
    return npt::SafetensorsFile::read(folder / "kind.safetensors");
  }
  std::shared_ptr<const npt::BodyKind> read() const { return npt::load_body_kind(written()); }
  /// Names the file, too.
  std::string message() const {
    try {
      read();
    } catch (const npt::Error& error) {
      const std::string text = error.what();
      CHECK(text.find("kind.safetensors") != std::string::npos);
      return text;
    }
    return "no error";
  }

  scratch::Folder folder;
  std::string plan = plan_of_worms;
  bool has_body = true;
  std::map<std::string, Numbers> prior;
};

void says(const std::string& text, const std::string& part) {
  INFO("wanted: ", part, ", found: ", text);
  CHECK(text.find(part) != std::string::npos);
}

}  // namespace

TEST_CASE("a kind is read with its plan, body, proportions and natural poses") {
  const KindFile file;
  const std::shared_ptr<const npt::BodyKind> kind = file.read();
  REQUIRE(kind != nullptr);
  CHECK(kind->plan.name == "worm");
  CHECK(kind->joint_count() == 3);
  CHECK(kind->skeleton_names == std::vector<std::string>{"back", "middle", "front"});
  CHECK(kind->body->tables().v_template == small_body().v_template);
  CHECK(kind->body->shape_count() == 4);  // the body's own three and the size
  CHECK_FALSE(kind->hands.has_value());
  CHECK_FALSE(kind->has_own_rest);
  REQUIRE(kind->moments.mean.size() == 3);
  CHECK(length(kind->moments.mean[2] - npt::Vec3d{0.4, 0.5, 0.6}) < 1e-6);
  CHECK(kind->moments.covariance[7 * 4] == 5);
  // The poses are those of the file, in the same order whenever it is read.
  std::vector<std::vector<float>> poses = kind->poses;
  CHECK(poses == file.read()->poses);
  std::ranges::sort(poses);
  REQUIRE(poses.size() == 4);
  for (std::size_t i = 0; i < 4; ++i) {
    CHECK(poses[i].size() == 9);
    CHECK(poses[i].front() == static_cast<float>(9 * i));
    CHECK(poses[i].back() == static_cast<float>(9 * i + 8));
  }
}

TEST_CASE("without a pose prior each joint stands by itself; without a template there is no kind") {
  KindFile file;
  file.prior.clear();
  const std::shared_ptr<const npt::BodyKind> kind = file.read();
  REQUIRE(kind != nullptr);
  CHECK(kind->moments.mean.empty());
  CHECK(kind->poses.empty());
  KindFile network;
  network.has_body = false;
  CHECK(network.read() == nullptr);
}

TEST_CASE("a template without its plan, or with another's, is refused") {
  KindFile file;
  file.plan.clear();
  says(file.message(), "no 'plan'");
  file.plan = "plan short\njoint back - back trunk root back 1 1\n";
  CHECK_THROWS_AS(file.read(), npt::Error);
  file.plan = "plan worm\njoint back - back\n";
  says(file.message(), "plan");
}

TEST_CASE("tensors of poses that don't fit the plan are named, with their shape and the expected one") {
  const std::pair<const char*, const char*> wanted[]{
      {"mean", "[3, 3]"}, {"covariance", "[6, 6]"}, {"poses", "[any, 9]"}};
  for (const auto& [name, shape] : wanted) {
    KindFile file;
    file.prior[name] = {{2, 2}, std::vector<float>(4, 0.0F)};
    const std::string text = file.message();
    says(text, "tensor '" + std::string(name) + "'");
    says(text, "[2, 2]");
    says(text, shape);
    KindFile missing;
    missing.prior.erase(name);
    says(missing.message(), "no tensor '" + std::string(name) + "'");
  }
}
