#include <doctest/doctest.h>

#include <npt/base/error.hpp>
#include <npt/nn/weights/weights.hpp>
#include <npt/nn/weights/weights_file.hpp>

#include <filesystem>
#include <fstream>
#include <limits>
#include <string>

#include "support/nets.hpp"

namespace fs = std::filesystem;

namespace {

using Net = npt::PoseTransferNet<16>;

/// A folder of this test's own, gone at its end.
struct Folder {
  fs::path path;
  explicit Folder(const char* name) : path(fs::temp_directory_path() / (std::string("npt_weights_") + name)) {
    fs::remove_all(path);
    fs::create_directories(path);
  }
  ~Folder() { fs::remove_all(path); }
  fs::path operator/(const char* name) const { return path / name; }
};

npt::Model<Net> random_model() {
  npt::Model<Net> model;
  npt::randomise(model, 21);
  support::set_output_scale(model, 1.5);
  return model;
}

/// Writes the model's tensors, changed by `edit(name, tensor)` (false drops the tensor), with the given metadata.
template <class Edit>
void write_edited(const fs::path& path, const npt::Metadata& metadata, Edit&& edit) {
  const auto model = random_model();
  std::vector<npt::FileTensor> tensors;
  model.for_each_tensor([&](const std::string& name, const npt::Parameter& p, std::span<const float> values) {
    npt::FileTensor tensor{.name = name, .dtype = npt::Dtype::f32, .shape = {}, .bytes = std::as_bytes(values)};
    for (int i = 0; i < p.rank; ++i) tensor.shape.push_back(static_cast<std::uint64_t>(p.dims[i]));
    if (edit(tensor)) tensors.push_back(tensor);
  });
  npt::write_safetensors(path, tensors, metadata);
}

const npt::Metadata good_metadata{
    {"order", "conv_relu"}, {"feature", "per-vertex"}, {"bottleneck", "16"}, {"output_scale", "1.5"}};

template <class N = Net>
std::string load_error(const fs::path& path, const npt::Metadata& assume = {}) {
  npt::Model<N> model;
  npt::randomise(model, 1);
  const std::vector<float> before(model.buffer().begin(), model.buffer().end());
  try {
    npt::load(model, path, assume);
  } catch (const npt::Error& e) {
    CHECK(std::equal(before.begin(), before.end(), model.buffer().begin()));  // nothing was changed
    const std::string text = e.what();
    CHECK(text.find(path.string()) == 0);
    return text.substr(path.string().size());
  }
  return "no error";
}

}  // namespace

TEST_CASE("weights survive saving and loading bit for bit, with metadata") {
  const Folder folder("roundtrip");
  const auto model = random_model();
  npt::save(model, folder / "w.safetensors", {{"domain", "human"}, {"normalisation", "centre"}});
  npt::Model<Net> loaded;
  const npt::Metadata metadata = npt::load(loaded, folder / "w.safetensors");
  CHECK(std::equal(model.buffer().begin(), model.buffer().end(), loaded.buffer().begin()));
  CHECK(metadata.at("domain") == "human");
  CHECK(metadata.at("order") == "conv_relu");
  CHECK(metadata.at("feature") == "per-vertex");
  CHECK(metadata.at("bottleneck") == "16");
  CHECK(metadata.at("output_scale") == "1.5");
}

TEST_CASE("names of files may be texts or paths") {
  const Folder folder("names");
  const auto model = random_model();
  npt::Model<Net> loaded;
  const fs::path path = folder / "w.safetensors";
  const std::string text = path.string();
  npt::save(model, text.c_str());
  npt::save(model, text, {{"domain", "human"}});
  npt::load(loaded, text.c_str());
  npt::load(loaded, path, {});
  CHECK(npt::load(loaded, text).at("domain") == "human");
  CHECK(npt::SafetensorsFile::read(text).name() == text);
  CHECK(npt::SafetensorsFile::read(text.c_str()).name() == text);
  CHECK(npt::SafetensorsFile::read(path).name() == text);
  npt::write_safetensors(text, {});
  npt::write_safetensors(text.c_str(), {});
  CHECK(npt::SafetensorsFile::read(path).tensors().empty());
}

TEST_CASE("double weights keep all digits, and floats load into a double model") {
  const Folder folder("double");
  npt::Model<Net, double> model;
  npt::randomise(model, 4);
  npt::save(model, folder / "w.safetensors");
  npt::Model<Net, double> loaded;
  npt::load(loaded, folder / "w.safetensors");
  CHECK(std::equal(model.buffer().begin(), model.buffer().end(), loaded.buffer().begin()));
  npt::save(random_model(), folder / "f.safetensors");
  npt::load(loaded, folder / "f.safetensors");
  CHECK(loaded.buffer()[0] == static_cast<double>(random_model().buffer()[0]));
}

TEST_CASE("weights of another variant are refused although names and shapes are the same") {
  const Folder folder("variant");
  const fs::path path = folder / "w.safetensors";
  npt::save(random_model(), path);
  CHECK(load_error<npt::PoseTransferNet<16, npt::ReluConv>>(path) ==
        ": metadata order: found 'conv_relu', expected 'relu_conv', which is this network's");
  CHECK(load_error<npt::PoseTransferNet<16, npt::ConvRelu, npt::Pooled>>(path) ==
        ": metadata feature: found 'per-vertex', expected 'pooled', which is this network's");
  CHECK(load_error<npt::PoseTransferNet<17>>(path) ==
        ": metadata bottleneck: found '16', expected '17', which is this network's");
  CHECK(load_error(path, {{"order", "relu_conv"}}) ==
        ": metadata order: found 'conv_relu', expected 'relu_conv', as was asked for");
  CHECK(load_error(path, {{"output_scale", "2"}}) ==
        ": metadata output_scale: found '1.5', expected '2', as was asked for");
  CHECK(load_error(path, {{"output_scale", "1.50"}}) == "no error");
}

TEST_CASE("a file without metadata needs an explicit choice") {
  const Folder folder("bare");
  const fs::path path = folder / "w.safetensors";
  write_edited(path, {}, [](npt::FileTensor&) { return true; });
  CHECK(load_error(path).find(": metadata feature: found nothing, expected a value") == 0);
  CHECK(load_error(path, {{"feature", "per-vertex"}}).find(": metadata order: found nothing") == 0);
  CHECK(load_error(path, {{"feature", "per-vertex"}, {"order", "conv_relu"}})
            .find(": metadata output_scale: found nothing") == 0);
  npt::Model<Net> model;
  npt::load(model, path, {{"feature", "per-vertex"}, {"order", "conv_relu"}, {"output_scale", "1.5"}});
  CHECK(std::equal(model.buffer().begin(), model.buffer().end(), random_model().buffer().begin()));
}

TEST_CASE("every tensor that doesn't fit is named at once") {
  const Folder folder("tensors");
  const fs::path path = folder / "w.safetensors";
  std::vector<std::int32_t> whole(64);
  write_edited(path, good_metadata, [&](npt::FileTensor& t) {
    if (t.name == "encoder.conv2.weight") t.shape = {64, 128, 1};
    if (t.name == "encoder.conv1.bias") {
      t.dtype = npt::Dtype::i32;
      t.bytes = std::as_bytes(std::span(whole));
    }
    if (t.name == "decoder.conv3.bias") t.name = "decoder.conv9.bias";
    return t.name != "decoder.conv1.weight";
  });
  const std::string error = load_error(path);
  for (const char* part :
       {": tensors: found ", "encoder.conv1.bias holds I32 instead of floating point",
        "encoder.conv2.weight has shape [64, 128, 1] instead of [128, 64, 1]", "decoder.conv1.weight is missing",
        "decoder.conv3.bias is missing", "decoder.conv9.bias belongs to no layer",
        "expected those of the network with bottleneck 16, feature per-vertex, order conv_relu"}) {
    CAPTURE(part);
    CHECK(error.find(part) != std::string::npos);
  }
}

TEST_CASE("NaN and infinities in weights and odd attributes are refused") {
  const Folder folder("nan");
  const fs::path path = folder / "w.safetensors";
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    std::vector<float> values(64, 1.0F);
    values[5] = bad;
    write_edited(path, good_metadata, [&](npt::FileTensor& t) {
      if (t.name == "encoder.conv1.bias") t.bytes = std::as_bytes(std::span(values));
      return true;
    });
    const std::string error = load_error(path);
    CHECK(error.find("encoder.conv1.bias") != std::string::npos);
    CHECK(error.find("element 5") != std::string::npos);
  }
  for (const char* scale : {"", "two", "nan", "inf", "1e999", "1 "}) {
    npt::Metadata metadata = good_metadata;
    metadata["output_scale"] = scale;
    write_edited(path, metadata, [](npt::FileTensor&) { return true; });
    CAPTURE(scale);
    CHECK(load_error(path).find(": metadata output_scale: found '") == 0);
  }
}

TEST_CASE("truncated, empty and missing files are errors") {
  const Folder folder("truncated");
  const fs::path path = folder / "w.safetensors";
  npt::save(random_model(), path);
  const auto size = fs::file_size(path);
  for (const std::uintmax_t keep : {std::uintmax_t{0}, std::uintmax_t{7}, std::uintmax_t{8}, size / 2, size - 1}) {
    npt::save(random_model(), path);
    fs::resize_file(path, keep);
    CAPTURE(keep);
    CHECK(load_error(path) != "no error");
  }
  fs::remove(path);
  CHECK(load_error(path) != "no error");
}

TEST_CASE("an unwritable place is an error and leaves nothing") {
  const Folder folder("unwritable");
  CHECK_THROWS_AS(npt::save(random_model(), folder.path / "no_such_folder" / "w.safetensors"), npt::Error);
  CHECK(fs::is_empty(folder.path));
}
