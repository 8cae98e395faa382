#include <doctest/doctest.h>

#include <io/scratch.hpp>
#include <npt/io/safetensors.hpp>
#include <npt/io/safetensors_class.hpp>
#include <npt/io/safetensors_header.hpp>

#include <array>
#include <cmath>
#include <limits>

#include "support/needs.hpp"

namespace {

using npt::Dtype;
using npt::FileTensor;
using npt::SafetensorsFile;
using scratch::error_of;

std::string file_of(const std::string& header, const std::string& data = {}) {
  const std::uint64_t size = header.size();
  std::string bytes(8, '\0');
  std::memcpy(bytes.data(), &size, 8);
  return bytes + header + data;
}

/// A file with one tensor "t".
SafetensorsFile one(const char* dtype, const std::string& data) {
  const std::size_t size = data.size();
  std::size_t element = 1;
  for (const auto& info : npt::internal::dtypes)
    if (std::string(dtype) == info.name) element = info.size;
  return SafetensorsFile::parse(
      file_of(R"({"t":{"dtype":")" + std::string(dtype) + R"(","shape":[)" + std::to_string(size / element) +
                  R"(],"data_offsets":[0,)" + std::to_string(size) + "]}}",
              data),
      "f");
}

std::string safetensors_error(const std::string& header, const std::string& data = {}) {
  return error_of([&] { SafetensorsFile::parse(file_of(header, data), "f"); });
}

}  // namespace

TEST_CASE("tensors are written and read back, in order, with metadata") {
  const scratch::Folder folder;
  const std::array<float, 6> a = {1, -2, 3.5F, 0, 1e-45F, 3e38F};
  const std::array<std::int32_t, 2> b = {-1, 7};
  const std::vector<FileTensor> tensors = {
      {.name = "layer.weight", .dtype = Dtype::f32, .shape = {2, 3, 1}, .bytes = std::as_bytes(std::span(a))},
      {.name = "empty", .dtype = Dtype::f64, .shape = {0, 4}, .bytes = {}},
      {.name = "a \"quoted\" näme", .dtype = Dtype::i32, .shape = {2}, .bytes = std::as_bytes(std::span(b))},
      {.name = "scalar", .dtype = Dtype::f32, .shape = {}, .bytes = std::as_bytes(std::span(a)).first(4)}};
  npt::write_safetensors(folder / "w.safetensors", tensors, {{"order", "conv_relu"}, {"z", ""}});
  const SafetensorsFile file = SafetensorsFile::read(folder / "w.safetensors");
  REQUIRE(file.tensors().size() == 4);
  for (std::size_t i = 0; i < 4; ++i) {
    CHECK(file.tensors()[i].name == tensors[i].name);
    CHECK(file.tensors()[i].dtype == tensors[i].dtype);
    CHECK(file.tensors()[i].shape == tensors[i].shape);
    CHECK(std::ranges::equal(file.tensors()[i].bytes, tensors[i].bytes));
  }
  CHECK(npt::to_float(file.at("layer.weight")) == std::vector<float>(a.begin(), a.end()));
  CHECK(npt::to_int64(file.at("a \"quoted\" näme")) == std::vector<std::int64_t>{-1, 7});
  CHECK(file.metadata() == std::map<std::string, std::string>{{"order", "conv_relu"}, {"z", ""}});
  CHECK(*file.find_metadata("order") == "conv_relu");
  CHECK(file.find_metadata("none") == nullptr);
  CHECK(file.find("none") == nullptr);
  CHECK(error_of([&] { (void)file.at("none"); }).ends_with("found no tensor 'none', expected one of that name"));
}

TEST_CASE("the same tensors give the same bytes, and data begin at a multiple of eight") {
  const scratch::Folder folder;
  const std::array<float, 1> a = {1};
  const std::vector<FileTensor> tensors = {{.name = "a", .shape = {1}, .bytes = std::as_bytes(std::span(a))}};
  npt::write_safetensors(folder / "1", tensors, {{"k", "v"}});
  npt::write_safetensors(folder / "2", tensors, {{"k", "v"}});
  const std::string bytes = npt::read_file(folder / "1");
  CHECK(bytes == npt::read_file(folder / "2"));
  CHECK((bytes.size() - 4) % 8 == 0);
}

TEST_CASE("metadata are read without the tensors") {
  const scratch::Folder folder;
  const auto path = folder / "m.safetensors";
  const std::string header =
      R"({"__metadata__":{"domain":"human"},"t":{"dtype":"U8","shape":[3],"data_offsets":[0,3]}})";
  npt::write_file(path, file_of(header, "abc"));
  CHECK(SafetensorsFile::read_metadata(path) == SafetensorsFile::read(path).metadata());
  CHECK(SafetensorsFile::read_metadata(path).at("domain") == "human");
  npt::write_file(path, file_of(header));  // the header says all
  CHECK(SafetensorsFile::read_metadata(path).at("domain") == "human");
  npt::write_file(path, file_of(header).substr(0, 40));
  CHECK(error_of([&] { (void)SafetensorsFile::read_metadata(path); }).find("is it truncated?") != std::string::npos);
  CHECK(error_of([&] { (void)SafetensorsFile::read_metadata(folder / "none"); }).find("no such file") !=
        std::string::npos);
}

TEST_CASE("copies of a file share its bytes and outlive it") {
  SafetensorsFile copy = one("U8", "abc");
  { copy = SafetensorsFile(one("U8", "xyz")); }
  CHECK(npt::to_int64(copy.at("t")) == std::vector<std::int64_t>{'x', 'y', 'z'});
}

TEST_CASE("a part of a file is a file of its own: names without the prefix, the same memory, metadata too") {
  const SafetensorsFile part = [] {
    const SafetensorsFile file = SafetensorsFile::parse(
        file_of(R"({"__metadata__":{"net":"a","b/net":"c"},"b/t":{"dtype":"U8","shape":[1],"data_offsets":[0,1]},)"
                R"("t":{"dtype":"U8","shape":[1],"data_offsets":[1,2]}})",
                "xy"),
        "f");
    CHECK(file.part("z/").tensors().empty());
    return file.part("b/");
  }();
  REQUIRE(part.tensors().size() == 1);
  CHECK(part.at("t").bytes[0] == std::byte{'x'});
  CHECK(part.metadata() == std::map<std::string, std::string>{{"net", "c"}});
  CHECK(part.name() == "f, b/");
}

TEST_CASE("golden files are read, and written again give the same tensors" * support::needs_shared("golden")) {
  const std::filesystem::path golden = NPT_SHARED "/golden";
  const scratch::Folder folder;
  for (const auto& entry : std::filesystem::directory_iterator(golden)) {
    if (entry.path().extension() != ".safetensors") continue;
    const SafetensorsFile file = SafetensorsFile::read(entry.path());
    CHECK(file.tensors().size() > 10);
    CHECK_FALSE(file.metadata().empty());
    npt::write_safetensors(folder / "copy", file.tensors(), file.metadata());
    const SafetensorsFile copy = SafetensorsFile::read(folder / "copy");
    REQUIRE(copy.tensors().size() == file.tensors().size());
    CHECK(copy.metadata() == file.metadata());
    for (std::size_t i = 0; i < file.tensors().size(); ++i) {
      CHECK(copy.tensors()[i].name == file.tensors()[i].name);
      CHECK(copy.tensors()[i].shape == file.tensors()[i].shape);
      CHECK(std::ranges::equal(copy.tensors()[i].bytes, file.tensors()[i].bytes));
    }
  }
}

TEST_CASE("the frame of the file is checked") {
  CHECK(error_of([] { SafetensorsFile::parse("", "f"); }) == "f: found 0 bytes, expected a safetensors file");
  CHECK(error_of([] { SafetensorsFile::parse("1234567", "f"); }).starts_with("f: found 7 bytes"));
  CHECK(error_of([] {
          SafetensorsFile::parse(std::string("\x01\0\0\0\0\0\0\0", 8), "f");
        }).ends_with("is it truncated?"));
  CHECK(
      error_of([] { SafetensorsFile::parse("PK\x03\x04 a zip file", "f"); }).ends_with("is this a safetensors file?"));
  CHECK(safetensors_error("") == "f: byte 8: found an empty header, expected '{'");
  CHECK(safetensors_error(" {}") == "f: byte 8: found ' ', expected '{'");
  CHECK(safetensors_error("{}   ") == "no error");
  CHECK(safetensors_error("{} x").starts_with("f: byte "));
  CHECK(safetensors_error("{").starts_with("f: byte "));
  CHECK(safetensors_error("{\"a\":}").starts_with("f: byte "));
  CHECK(safetensors_error("{\"\xFF\":1}").starts_with("f: byte "));
  CHECK(safetensors_error("{}", "x") ==
        "f: byte 10: found 1 bytes that belong to no tensor, expected the end of the file");
}

TEST_CASE("a header is written as it is read") {
  const std::array<std::byte, 6> bytes{};
  const std::vector<FileTensor> tensors = {
      {.name = "a", .dtype = Dtype::u8, .shape = {2}, .bytes = std::span(bytes).first(2)},
      {.name = "b", .dtype = Dtype::f16, .shape = {1, 2}, .bytes = std::span(bytes).last(4)}};
  CHECK(npt::internal::safetensors_header("f", tensors, {{"k", "v"}}) ==
        R"({"__metadata__":{"k":"v"},"a":{"dtype":"U8","shape":[2],"data_offsets":[0,2]},)"
        R"("b":{"dtype":"F16","shape":[1,2],"data_offsets":[2,6]}}   )");
}

TEST_CASE("the header's structure is checked") {
  const auto tensor = [](const std::string& inside) {
    return safetensors_error("{\"t\":{" + inside + "}}", "12345678");
  };
  const std::string good = R"("dtype":"F32","shape":[2],"data_offsets":[0,8])";
  CHECK(tensor(good) == "no error");
  CHECK(tensor(R"("dtype":"F32","shape":[2])") ==
        "f: tensor 't': found no data_offsets, expected dtype, shape and data_offsets");
  CHECK(tensor("").find("no dtype") != std::string::npos);
  CHECK(tensor(good + R"(,"x":1)").find("the entry 'x'") != std::string::npos);
  CHECK(tensor(good + R"(,"shape":[2])").find("a second entry 'shape'") != std::string::npos);
  CHECK(safetensors_error("{\"t\":{" + good + "},\"t\":{" + good + "}}", "12345678") ==
        "f: header: found a second entry 't', expected each name once");
  CHECK(tensor(R"("dtype":"F33","shape":[2],"data_offsets":[0,8])").starts_with("f: tensor 't': found dtype 'F33'"));
  CHECK(tensor(R"("dtype":4)") == "f: tensor 't': found 4 for dtype, expected the name of a type");
  CHECK(tensor(R"("dtype":["F32"])").find("found a list for dtype") != std::string::npos);
  CHECK(tensor(R"("shape":2)") == "f: tensor 't': found 2 for shape, expected a list of whole numbers");
  CHECK(tensor(R"("shape":[-2])") == "f: tensor 't': found -2 in shape, expected whole numbers from 0 to 2^64 - 1");
  CHECK(tensor(R"("shape":[2.5])").find("found 2.5 in shape") != std::string::npos);
  CHECK(tensor(R"("shape":[99999999999999999999])").find("99999999999999999999 in shape") != std::string::npos);
  CHECK(tensor(R"("shape":[[2]])").find("found a list in shape") != std::string::npos);
  CHECK(tensor(R"("shape":[null])").find("found null in shape") != std::string::npos);
  CHECK(tensor(R"("shape":{})").find("an object") != std::string::npos);
  CHECK(safetensors_error(R"({"t":1})") == "f: header: found 1 for 't', expected a tensor's description");
  CHECK(safetensors_error(R"({"t":[1]})").find("a list for 't'") != std::string::npos);
  CHECK(safetensors_error(R"({"__metadata__":{"a":1}})") == "f: __metadata__: found 1, expected a text for each name");
  CHECK(safetensors_error(R"({"__metadata__":{"a":{}}})").starts_with("f: __metadata__: found an object"));
  CHECK(safetensors_error(R"({"__metadata__":{"a":"1","a":"2"}})") ==
        "f: __metadata__: found a second entry 'a', expected each name once");
  CHECK(safetensors_error(R"({"__metadata__":{}})") == "no error");
}

TEST_CASE("deep nesting is refused at its third level, however deep it goes") {
  std::string deep = "{\"t\":";
  for (int i = 0; i < 1000000; ++i) deep += '[';
  CHECK(safetensors_error(deep).find("a list for 't'") != std::string::npos);
  deep = "{\"t\":";
  for (int i = 0; i < 100000; ++i) deep += "{\"shape\":";
  CHECK(safetensors_error(deep).find("an object") != std::string::npos);
}

TEST_CASE("offsets and sizes must agree") {
  const auto with = [](const std::string& shape, const std::string& offsets, const std::string& dtype = "F32") {
    return safetensors_error(
        "{\"t\":{\"dtype\":\"" + dtype + "\",\"shape\":" + shape + ",\"data_offsets\":" + offsets + "}}", "12345678");
  };
  CHECK(with("[2]", "[0,8]") == "no error");
  CHECK(with("[]", "[0,8]", "F64") == "no error");
  CHECK(with("[3]", "[0,8]") == "f: tensor 't': found 8 bytes, expected 12 for shape [3] of F32");
  CHECK(with("[2]", "[0,9]").find("an end of at most 8") != std::string::npos);
  CHECK(with("[2]", "[0]").find("found data_offsets [0], expected [begin, end]") != std::string::npos);
  CHECK(with("[2]", "[8,0]").find("expected [begin, end]") != std::string::npos);
  CHECK(with("[2]", "[0,18446744073709551615]").find("an end of at most 8") != std::string::npos);
  CHECK(with("[4611686018427387904]", "[0,8]").find("more than 2^64") != std::string::npos);
  CHECK(with("[4294967296,4294967296]", "[0,0]").find("more than 2^64") != std::string::npos);
  CHECK(with("[4294967296,4294967296,0]", "[0,0]").find("8 bytes that belong to no tensor") != std::string::npos);
}

TEST_CASE("tensors lie one after another, in any order of the header") {
  const auto two = [](const std::string& a, const std::string& b) {
    const std::string begin = R"(:{"dtype":"U8","shape":[4],"data_offsets":)";
    return "{\"a\"" + begin + a + "},\"b\"" + begin + b + "}}";
  };
  CHECK(safetensors_error(two("[0,4]", "[4,8]"), "12345678") == "no error");
  CHECK(safetensors_error(two("[4,8]", "[0,4]"), "12345678") == "no error");
  CHECK(SafetensorsFile::parse(file_of(two("[4,8]", "[0,4]"), "12345678"), "f").tensors()[0].name == "b");
  CHECK(safetensors_error(two("[0,4]", "[3,7]"), "12345678") ==
        "f: tensor 'b': found data at 3, expected 4, where the tensor before it ends");
  CHECK(safetensors_error(two("[0,4]", "[5,9]"), "123456789").find("found data at 5") != std::string::npos);
  CHECK(safetensors_error(two("[0,4]", "[0,4]"), "1234").find("found data at 0, expected 4") != std::string::npos);
}

TEST_CASE("every truncation of a file is an error") {
  const std::string whole =
      file_of(R"({"__metadata__":{"k":"v"},"t":{"dtype":"F32","shape":[2],"data_offsets":[0,8]}})", "12345678");
  CHECK(error_of([&] { SafetensorsFile::parse(whole, "f"); }) == "no error");
  for (std::size_t size = 0; size < whole.size(); ++size)
    CHECK(error_of([&] { SafetensorsFile::parse(whole.substr(0, size), "f"); }).starts_with("f: "));
}

TEST_CASE("what can't be written as safetensors is refused and leaves no file") {
  const scratch::Folder folder;
  const std::array<float, 2> a = {1, 2};
  const auto bytes = std::as_bytes(std::span(a));
  const auto complaint_on_write = [&](const std::vector<FileTensor>& tensors,
                                      const std::map<std::string, std::string>& metadata = {}) {
    return error_of([&] { npt::write_safetensors(folder / "w", tensors, metadata); });
  };
  CHECK(complaint_on_write({{.name = "a", .shape = {3}, .bytes = bytes}})
            .ends_with("tensor 'a': found 8 bytes, expected 12 for shape [3] of F32"));
  CHECK(complaint_on_write({{.name = "a", .shape = {2}, .bytes = bytes}, {.name = "a", .shape = {2}, .bytes = bytes}})
            .ends_with("tensor 'a': found a name in use, expected another name"));
  CHECK(complaint_on_write({{.name = "__metadata__", .shape = {2}, .bytes = bytes}}) != "no error");
  CHECK(complaint_on_write({{.name = "\xFF", .shape = {2}, .bytes = bytes}}).find("UTF-8") != std::string::npos);
  CHECK(complaint_on_write({}, {{"k", "\xC3"}}).find("UTF-8") != std::string::npos);
  CHECK(folder.file_count() == 0);
  CHECK(complaint_on_write({}) == "no error");
  CHECK(SafetensorsFile::read(folder / "w").tensors().empty());
}
