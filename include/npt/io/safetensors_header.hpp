/// The header of a safetensors file: its JSON to the tensors' places, and back.
#pragma once

#include <npt/base/error.hpp>
#include <npt/config.hpp>
#include <npt/io/file_tensor.hpp>
#include <npt/io/json.hpp>
#include <npt/io/text.hpp>

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI::internal {

/// Metadata; also names that may not repeat, whose second text is empty: a std::set beside it costs compilers more.
using TextMap = std::map<std::string, std::string>;

/// What the header says of one tensor, before it has been checked.
struct TensorEntry {
  std::string name;
  std::string dtype;
  TensorShape shape, offsets;
  bool has_dtype = false, has_shape = false, has_offsets = false;
};

/// Takes the header's JSON event by event. Each either fits the place it stands in or is an error, so nothing nests
/// deeper than the format does, and no name stands twice. A template, as is all that follows, so that only units that
/// read a file compile it.
template <class = void>
class SafetensorsHeaderEvents {
 public:
  SafetensorsHeaderEvents(std::string_view header, std::string file) : header_(header), file_(std::move(file)) {}

  std::vector<TensorEntry> entries;
  std::map<std::string, std::string> metadata;

  void null() { unexpected("null"); }
  void boolean(bool value) { unexpected(value ? "true" : "false"); }
  void number(std::string_view text) {
    const std::optional<std::uint64_t> value = parse_number<std::uint64_t>(text);
    if (place_ != Place::numbers || !value) unexpected(std::string(text));
    numbers_->push_back(*value);
  }
  void string(std::string value) {
    if (place_ == Place::metadata) {
      metadata[key_] = std::move(value);
    } else if (place_ == Place::tensor && key_ == "dtype") {
      entries.back().dtype = std::move(value);
      entries.back().has_dtype = true;
    } else {
      unexpected("the text " + in_quotes(value));
    }
  }
  void start_object() {
    switch (place_) {
      case Place::start:
        place_ = Place::root;
        break;
      case Place::root:
        place_ = name_ == "__metadata__" ? Place::metadata : Place::tensor;
        if (place_ == Place::tensor) entries.emplace_back().name = name_;
        keys_.clear();
        break;
      default:
        unexpected("an object");
    }
    key_.clear();
  }
  void end_object() { place_ = place_ == Place::root ? Place::end : Place::root; }
  void key(std::string value) {
    if (!(place_ == Place::root ? names_ : keys_).try_emplace(value).second)
      fail("a second entry " + in_quotes(value), "each name once");
    if (place_ == Place::tensor && value != "dtype" && value != "shape" && value != "data_offsets")
      fail("the entry " + in_quotes(value), "dtype, shape and data_offsets");
    (place_ == Place::root ? name_ : key_) = std::move(value);
  }
  void start_array() {
    if (place_ != Place::tensor || key_ == "dtype") unexpected("a list");
    place_ = Place::numbers;
    TensorEntry& entry = entries.back();
    const bool shape = key_ == "shape";
    (shape ? entry.has_shape : entry.has_offsets) = true;
    numbers_ = shape ? &entry.shape : &entry.offsets;
  }
  void end_array() { place_ = Place::tensor; }
  [[noreturn]] void syntax_error(std::size_t position) const {
    const std::string_view rest = header_.substr(position, 20);
    throw Error({.file = file_,
                 .place = "byte " + std::to_string(8 + position),
                 .found = rest.empty() ? "the end of the header" : "no JSON at " + in_quotes(rest),
                 .expected = "a safetensors header"});
  }

 private:
  enum class Place { start, root, metadata, tensor, numbers, end };

  [[noreturn]] void fail(std::string found, std::string expected) const {
    if (place_ == Place::start || place_ == Place::root || place_ == Place::end)
      throw Error({.file = file_, .place = "header", .found = std::move(found), .expected = std::move(expected)});
    if (place_ == Place::metadata)
      throw Error({.file = file_, .place = "__metadata__", .found = std::move(found), .expected = std::move(expected)});
    invalid_tensor(file_, name_, std::move(found), std::move(expected));
  }
  [[noreturn]] void unexpected(std::string found) const {
    switch (place_) {
      case Place::metadata:
        fail(std::move(found), "a text for each name");
      case Place::tensor:
        fail(std::move(found) + (key_.empty() ? "" : " for " + key_),
             key_ == "dtype" ? "the name of a type" : "a list of whole numbers");
      case Place::numbers:
        fail(std::move(found) + " in " + key_, "whole numbers from 0 to 2^64 - 1");
      case Place::root:
        fail(std::move(found) + " for " + in_quotes(name_), "a tensor's description");
      default:
        fail(std::move(found), "one JSON object");
    }
  }

  std::string_view header_;
  std::string file_;
  Place place_ = Place::start;
  std::string name_, key_;  ///< the keys on the way to this place: tensor (or __metadata__), and entry in it
  TextMap names_, keys_;
  TensorShape* numbers_ = nullptr;
};

/// Checks one entry of the header against itself and the size of the data.
NPT_INLINE FileTensor check_entry(const TensorEntry& entry, std::span<const std::byte> data, const std::string& file) {
  if (!entry.has_dtype || !entry.has_shape || !entry.has_offsets)
    invalid_tensor(file, entry.name,
                   std::string("no ") + (!entry.has_dtype   ? "dtype"
                                         : !entry.has_shape ? "shape"
                                                            : "data_offsets"),
                   "dtype, shape and data_offsets");
  const DtypeInfo* type = nullptr;
  for (const DtypeInfo& info : dtypes)
    if (entry.dtype == info.name) type = &info;
  if (type == nullptr)
    invalid_tensor(file, entry.name, "dtype " + in_quotes(entry.dtype),
                   "F64, F32, F16, BF16, I64, I32, I16, I8, U64, U32, U16, U8 or BOOL");
  const TensorShape& offsets = entry.offsets;
  if (offsets.size() != 2 || offsets[0] > offsets[1])
    invalid_tensor(file, entry.name, "data_offsets " + to_string(offsets), "[begin, end]");
  if (offsets[1] > data.size())
    invalid_tensor(file, entry.name, "data_offsets " + to_string(offsets),
                   "an end of at most " + std::to_string(data.size()) + ", the bytes that follow the header");
  const std::optional<std::uint64_t> size = byte_count(type->dtype, entry.shape);
  if (!size || *size != offsets[1] - offsets[0])
    invalid_tensor(file, entry.name, std::to_string(offsets[1] - offsets[0]) + " bytes",
                   (size ? std::to_string(*size) : "more than 2^64") + " for shape " + to_string(entry.shape) + " of " +
                       type->name);
  return {.name = entry.name,
          .dtype = type->dtype,
          .shape = entry.shape,
          .bytes = data.subspan(static_cast<std::size_t>(offsets[0]), static_cast<std::size_t>(*size)),
          .file = file};
}

/// The header's JSON, padded so that the data begin at a multiple of 8 bytes.
NPT_INLINE std::string safetensors_header(const std::string& file, std::span<const FileTensor> tensors,
                                          const std::map<std::string, std::string>& metadata) {
  std::string text = "{";
  const auto add_string = [&](std::string_view value) {
    if (!append_json_string(text, value))
      throw Error({.file = file, .found = "a name or metadata that is no UTF-8", .expected = "text in UTF-8"});
  };
  const auto add_name = [&](std::string_view name) {
    if (text.back() != '{') text += ',';
    add_string(name);
    text += ':';
  };
  if (!metadata.empty()) {
    add_name("__metadata__");
    text += '{';
    for (const auto& [key, value] : metadata) {
      add_name(key);
      add_string(value);
    }
    text += '}';
  }
  std::uint64_t begin = 0;
  TextMap names{{"__metadata__", {}}};
  for (const FileTensor& tensor : tensors) {
    if (!names.try_emplace(tensor.name).second) invalid_tensor(file, tensor.name, "a name in use", "another name");
    const std::optional<std::uint64_t> size = byte_count(tensor.dtype, tensor.shape);
    if (size != tensor.bytes.size())
      invalid_tensor(file, tensor.name, std::to_string(tensor.bytes.size()) + " bytes",
                     (size ? std::to_string(*size) : "more than 2^64") + " for shape " + to_string(tensor.shape) +
                         " of " + to_string(tensor.dtype));
    add_name(tensor.name);
    text += std::string(R"({"dtype":")") + to_string(tensor.dtype) + R"(","shape":[)";
    for (std::size_t i = 0; i < tensor.shape.size(); ++i) {
      if (i != 0) text += ',';
      text += std::to_string(tensor.shape[i]);
    }
    text += R"(],"data_offsets":[)" + std::to_string(begin) + "," + std::to_string(begin + tensor.bytes.size()) + "]}";
    begin += tensor.bytes.size();
  }
  text += '}';
  text.append((8 - text.size() % 8) % 8, ' ');
  if (text.size() > max_safetensors_header)
    throw Error({.file = file,
                 .found = "a header of " + std::to_string(text.size()) + " bytes",
                 .expected = "at most " + std::to_string(max_safetensors_header)});
  return text;
}

}  // namespace npt::inline NPT_ABI::internal
