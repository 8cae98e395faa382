/// Named tensors in a file: the safetensors format.
///   u64 little-endian N <= 100 MB | N bytes of JSON, "{...}" padded with blanks | the tensors' bytes, row major
///   JSON: name -> {"dtype", "shape", "data_offsets": [begin, end]}, "__metadata__" -> {string: string}
/// Numerics  bytes are kept as they are; to_float and its siblings convert, each value exactly or rounded once
/// Errors    npt::Error that names the file and the tensor: not this format, truncated, a name twice, sizes that
/// overflow or
///           don't agree with the shape, tensors that overlap or leave a hole, an unknown type; on conversion a value
///           that the type can't hold and, unless allowed, a NaN or infinity
/// Source    https://github.com/huggingface/safetensors, "Format"
#pragma once

#include <npt/config.hpp>
#include <npt/core/error.hpp>
#include <npt/core/sort.hpp>
#include <npt/core/view.hpp>
#include <npt/io/file.hpp>
#include <npt/io/json.hpp>
#include <npt/io/text.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

static_assert(std::endian::native == std::endian::little, "tensors are used as they lie in the file, little-endian");

enum class Dtype { f64, f32, f16, bf16, i64, i32, i16, i8, u64, u32, u16, u8, boolean };

namespace internal {

struct DtypeInfo {
  Dtype dtype;
  const char* name;
  std::size_t size;
};
inline constexpr std::array<DtypeInfo, 13> dtypes = {{{Dtype::f64, "F64", 8},
                                                      {Dtype::f32, "F32", 4},
                                                      {Dtype::f16, "F16", 2},
                                                      {Dtype::bf16, "BF16", 2},
                                                      {Dtype::i64, "I64", 8},
                                                      {Dtype::i32, "I32", 4},
                                                      {Dtype::i16, "I16", 2},
                                                      {Dtype::i8, "I8", 1},
                                                      {Dtype::u64, "U64", 8},
                                                      {Dtype::u32, "U32", 4},
                                                      {Dtype::u16, "U16", 2},
                                                      {Dtype::u8, "U8", 1},
                                                      {Dtype::boolean, "BOOL", 1}}};

}  // namespace internal

constexpr std::size_t size_of(Dtype dtype) noexcept { return internal::dtypes[static_cast<std::size_t>(dtype)].size; }
constexpr const char* to_string(Dtype dtype) noexcept { return internal::dtypes[static_cast<std::size_t>(dtype)].name; }

using TensorShape = std::vector<std::uint64_t>;

/// "[64, 3, 1]"
inline std::string to_string(const TensorShape& shape) {
  std::string text = "[";
  for (const std::uint64_t n : shape) text += (text.size() > 1 ? ", " : "") + std::to_string(n);
  return text + "]";
}

/// One tensor: its description, and its bytes where they lie in memory (row major, without alignment).
struct Tensor {
  std::string name;
  Dtype dtype = Dtype::f32;
  TensorShape shape;                   ///< empty: a single number
  std::span<const std::byte> bytes{};  ///< owned by the SafetensorsFile, or by whoever writes
  std::string file{};                  ///< where it came from, for messages

  std::size_t count() const noexcept { return bytes.size() / size_of(dtype); }
};

namespace internal {

[[noreturn]] inline void bad_tensor(const std::string& file, std::string_view tensor, std::string found,
                                    std::string expected) {
  throw Error({.file = file,
               .place = "tensor " + in_quotes(tensor),
               .found = std::move(found),
               .expected = std::move(expected)});
}

/// Bytes of a tensor of this type and shape; nothing when the number overflows.
inline std::optional<std::uint64_t> byte_count(Dtype dtype, const TensorShape& shape) {
  std::uint64_t product = size_of(dtype);
  bool overflow = false;
  for (const std::uint64_t n : shape) {
    overflow = overflow || (n != 0 && product > std::numeric_limits<std::uint64_t>::max() / n);
    product *= n;
  }
  // A zero among the sizes makes the tensor empty whatever the others are.
  for (const std::uint64_t n : shape)
    if (n == 0) return 0;
  return overflow ? std::nullopt : std::optional(product);
}

/// Of metadata, and of names that may not repeat, whose second text is empty: a std::set beside it would cost compilers more.
using TextMap = std::map<std::string, std::string>;

/// What the header says of one tensor, before it has been checked.
struct TensorEntry {
  std::string name;
  std::string dtype;
  TensorShape shape, offsets;
  bool has_dtype = false, has_shape = false, has_offsets = false;
};

/// Takes the header's JSON event by event. Each either fits the place it stands in or is an error, so nothing nests deeper
/// than the format does, and no name stands twice.
class HeaderReader {
 public:
  HeaderReader(std::string_view header, std::string file) : header_(header), file_(std::move(file)) {}

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
    bad_tensor(file_, name_, std::move(found), std::move(expected));
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
inline Tensor check_entry(const TensorEntry& entry, std::span<const std::byte> data, const std::string& file) {
  if (!entry.has_dtype || !entry.has_shape || !entry.has_offsets)
    bad_tensor(file, entry.name,
               std::string("no ") + (!entry.has_dtype   ? "dtype"
                                     : !entry.has_shape ? "shape"
                                                        : "data_offsets"),
               "dtype, shape and data_offsets");
  const DtypeInfo* type = nullptr;
  for (const DtypeInfo& info : dtypes)
    if (entry.dtype == info.name) type = &info;
  if (type == nullptr)
    bad_tensor(file, entry.name, "dtype " + in_quotes(entry.dtype),
               "F64, F32, F16, BF16, I64, I32, I16, I8, U64, U32, U16, U8 or BOOL");
  const TensorShape& offsets = entry.offsets;
  if (offsets.size() != 2 || offsets[0] > offsets[1])
    bad_tensor(file, entry.name, "data_offsets " + to_string(offsets), "[begin, end]");
  if (offsets[1] > data.size())
    bad_tensor(file, entry.name, "data_offsets " + to_string(offsets),
               "an end of at most " + std::to_string(data.size()) + ", the bytes that follow the header");
  const std::optional<std::uint64_t> size = byte_count(type->dtype, entry.shape);
  if (!size || *size != offsets[1] - offsets[0])
    bad_tensor(file, entry.name, std::to_string(offsets[1] - offsets[0]) + " bytes",
               (size ? std::to_string(*size) : "more than 2^64") + " for shape " + to_string(entry.shape) + " of " +
                   type->name);
  return {.name = entry.name,
          .dtype = type->dtype,
          .shape = entry.shape,
          .bytes = data.subspan(static_cast<std::size_t>(offsets[0]), static_cast<std::size_t>(*size)),
          .file = file};
}

}  // namespace internal

/// A safetensors file in memory. Copies share the bytes, which live as long as one of the copies.
class SafetensorsFile {
 public:
  static constexpr std::uint64_t max_header = 100'000'000;

  static SafetensorsFile read(const std::string& path) { return parse(read_file(path), path); }

  /// The same from bytes in memory. `name` stands in the messages of errors.
  static SafetensorsFile parse(std::string bytes, const std::string& name) {
    SafetensorsFile file;
    file.name_ = name;
    file.bytes_ = std::shared_ptr<const std::string>(new std::string(std::move(bytes)));
    const std::string_view header = header_of(*file.bytes_, name);
    internal::HeaderReader reader(header, name);
    internal::read_json(header, reader);
    file.metadata_ = std::move(reader.metadata);
    file.place_tensors(reader.entries, as_bytes(*file.bytes_).subspan(8 + header.size()));
    return file;
  }

  const std::string& name() const noexcept { return name_; }
  const std::map<std::string, std::string>& metadata() const noexcept { return metadata_; }
  /// In the order in which they lie in the file.
  const std::vector<Tensor>& tensors() const noexcept { return tensors_; }

  /// The tensor of that name, or nullptr.
  const Tensor* find(std::string_view tensor) const {
    for (const Tensor& t : tensors_)  // tens of them: no index
      if (t.name == tensor) return &t;
    return nullptr;
  }
  /// The tensor of that name; throws npt::Error where there is none.
  const Tensor& at(std::string_view tensor) const {
    if (const Tensor* found = find(tensor)) return *found;
    throw Error({.file = name_, .found = "no tensor " + internal::in_quotes(tensor), .expected = "one of that name"});
  }
  /// The metadata of that key, or nullptr.
  const std::string* find_metadata(const std::string& key) const {
    const auto found = metadata_.find(key);
    return found == metadata_.end() ? nullptr : &found->second;
  }

 private:
  SafetensorsFile() = default;

  static std::span<const std::byte> as_bytes(const std::string& text) {
    return {reinterpret_cast<const std::byte*>(text.data()), text.size()};
  }

  static std::string_view header_of(std::string_view bytes, const std::string& name) {
    const auto fail = [&name](std::string place, std::string found, std::string expected) {
      return Error(
          {.file = name, .place = std::move(place), .found = std::move(found), .expected = std::move(expected)});
    };
    if (bytes.size() < 8) throw fail({}, std::to_string(bytes.size()) + " bytes", "a safetensors file");
    std::uint64_t size = 0;
    std::memcpy(&size, bytes.data(), 8);
    if (size > max_header)
      throw fail("byte 0", "a header of " + std::to_string(size) + " bytes",
                 "at most " + std::to_string(max_header) + ": is this a safetensors file?");
    if (size > bytes.size() - 8)
      throw fail("byte 0", "a header of " + std::to_string(size) + " bytes",
                 "at most " + std::to_string(bytes.size() - 8) + ", what the file has left: is it truncated?");
    const std::string_view header = bytes.substr(8, static_cast<std::size_t>(size));
    if (!header.starts_with('{'))
      throw fail("byte 8", header.empty() ? "an empty header" : internal::in_quotes(header.substr(0, 1)), "'{'");
    return header;
  }

  /// Checks that the tensors cover the data one after another, and lists them in that order.
  void place_tensors(const std::vector<internal::TensorEntry>& entries, std::span<const std::byte> data) {
    // By their first byte, empty ones first; a header of max_header bytes has room for fewer than 2^24 of them.
    constexpr int number_bits = 24;
    const auto begin_of = [&](const Tensor& t) { return static_cast<std::size_t>(t.bytes.data() - data.data()); };
    std::vector<Tensor> unordered;
    std::vector<std::uint64_t> keys;
    for (const internal::TensorEntry& entry : entries) {
      const Tensor& tensor = unordered.emplace_back(internal::check_entry(entry, data, name_));
      const std::uint64_t place = 2 * std::uint64_t{begin_of(tensor)} + (tensor.bytes.empty() ? 0 : 1);
      keys.push_back(place << number_bits | keys.size());
    }
    internal::sort_keys(internal::view(keys));
    tensors_.reserve(entries.size());
    for (const std::uint64_t key : keys)
      tensors_.push_back(std::move(unordered[static_cast<std::size_t>(key % (1U << number_bits))]));
    std::size_t end = 0;
    for (const Tensor& tensor : tensors_) {
      if (begin_of(tensor) != end)
        internal::bad_tensor(name_, tensor.name, "data at " + std::to_string(begin_of(tensor)),
                             std::to_string(end) + ", where the tensor before it ends");
      end += tensor.bytes.size();
    }
    if (end != data.size())
      throw Error({.file = name_,
                   .place = "byte " + std::to_string(bytes_->size() - (data.size() - end)),
                   .found = std::to_string(data.size() - end) + " bytes that belong to no tensor",
                   .expected = "the end of the file"});
  }

  std::string name_;
  std::shared_ptr<const std::string> bytes_;
  std::map<std::string, std::string> metadata_;
  std::vector<Tensor> tensors_;
};

/// Whether a conversion accepts NaN and infinity.
enum class NonFinite { refuse, keep };

namespace internal {

/// IEEE binary16 to binary32, exact.
inline float half_to_float(std::uint16_t h) {
  const std::uint32_t sign = (h & 0x8000U) << 16, exponent = (h >> 10) & 31U, mantissa = h & 0x3FFU;
  if (exponent == 31) return std::bit_cast<float>(sign | 0x7F800000U | mantissa << 13);
  if (exponent != 0) return std::bit_cast<float>(sign | (exponent + 112) << 23 | mantissa << 13);
  const float magnitude = static_cast<float>(mantissa) * 0x1p-24F;
  return sign != 0 ? -magnitude : magnitude;
}

/// bfloat16 is the upper half of binary32.
inline float bfloat16_to_float(std::uint16_t b) { return std::bit_cast<float>(std::uint32_t{b} << 16); }

[[noreturn]] inline void bad_value(const Tensor& tensor, std::size_t i, std::string found, std::string expected) {
  throw Error({.file = tensor.file,
               .place = "tensor " + in_quotes(tensor.name) + ", element " + std::to_string(i),
               .found = std::move(found),
               .expected = std::move(expected)});
}

/// One stored value as To. Floating to whole numbers is refused by to_values.
template <class To, class From>
To convert_value(From value, const Tensor& tensor, std::size_t i, NonFinite policy) {
  if constexpr (std::floating_point<From>) {
    if (policy == NonFinite::refuse && !std::isfinite(value))
      bad_value(tensor, i, std::isnan(value) ? "NaN" : "infinity", "a finite number");
    if constexpr (sizeof(To) < sizeof(From))
      if (std::isfinite(value) && !fits_float(value))
        bad_value(tensor, i, std::to_string(value), "a number that fits into 32-bit floating point");
  } else if constexpr (std::integral<To>) {
    if (!std::in_range<To>(value)) bad_value(tensor, i, std::to_string(value), "at most 2^63 - 1");
  }
  return static_cast<To>(value);
}

/// The whole tensor, its stored values read as Stored and decoded.
template <class To, class Stored, class Decode>
std::vector<To> convert_tensor(const Tensor& tensor, NonFinite policy, Decode decode) {
  std::vector<To> values(tensor.count());
  for (std::size_t i = 0; i < values.size(); ++i) {
    Stored stored;
    std::memcpy(&stored, tensor.bytes.data() + i * sizeof(Stored), sizeof(Stored));
    values[i] = convert_value<To>(decode(stored), tensor, i, policy);
  }
  return values;
}

template <class To>
std::vector<To> to_values(const Tensor& tensor, NonFinite policy) {
  const auto as_is = [](auto value) { return value; };
  if constexpr (std::floating_point<To>) {
    switch (tensor.dtype) {
      case Dtype::f64:
        return convert_tensor<To, double>(tensor, policy, as_is);
      case Dtype::f32:
        return convert_tensor<To, float>(tensor, policy, as_is);
      case Dtype::f16:
        return convert_tensor<To, std::uint16_t>(tensor, policy, half_to_float);
      case Dtype::bf16:
        return convert_tensor<To, std::uint16_t>(tensor, policy, bfloat16_to_float);
      default:
        break;
    }
  }
  switch (tensor.dtype) {
    case Dtype::i64:
      return convert_tensor<To, std::int64_t>(tensor, policy, as_is);
    case Dtype::i32:
      return convert_tensor<To, std::int32_t>(tensor, policy, as_is);
    case Dtype::i16:
      return convert_tensor<To, std::int16_t>(tensor, policy, as_is);
    case Dtype::i8:
      return convert_tensor<To, std::int8_t>(tensor, policy, as_is);
    case Dtype::u64:
      return convert_tensor<To, std::uint64_t>(tensor, policy, as_is);
    case Dtype::u32:
      return convert_tensor<To, std::uint32_t>(tensor, policy, as_is);
    case Dtype::u16:
      return convert_tensor<To, std::uint16_t>(tensor, policy, as_is);
    case Dtype::u8:
      return convert_tensor<To, std::uint8_t>(tensor, policy, as_is);
    case Dtype::boolean:
      return convert_tensor<To, std::uint8_t>(tensor, policy, [](std::uint8_t b) { return std::uint8_t{b != 0}; });
    default:
      bad_tensor(tensor.file, tensor.name, to_string(tensor.dtype), "a type of whole numbers");
  }
}

}  // namespace internal

/// The tensor's values, row major, converted from whatever type is stored.
/// Templates, so that only units that convert compile the conversions.
template <class = void>
std::vector<float> to_float(const Tensor& tensor, NonFinite policy = NonFinite::refuse) {
  return internal::to_values<float>(tensor, policy);
}
template <class = void>
std::vector<double> to_double(const Tensor& tensor, NonFinite policy = NonFinite::refuse) {
  return internal::to_values<double>(tensor, policy);
}
/// Only from types of whole numbers.
template <class = void>
std::vector<std::int64_t> to_int64(const Tensor& tensor) {
  return internal::to_values<std::int64_t>(tensor, NonFinite::refuse);
}

namespace internal {

/// The header's JSON, padded so that the data begin at a multiple of 8 bytes.
inline std::string header_json(const std::string& path, std::span<const Tensor> tensors,
                               const std::map<std::string, std::string>& metadata) {
  std::string text = "{";
  const auto add_string = [&](std::string_view value) {
    if (!append_json_string(text, value))
      throw Error({.file = path, .found = "a name or metadata that is no UTF-8", .expected = "text in UTF-8"});
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
  for (const Tensor& tensor : tensors) {
    if (!names.try_emplace(tensor.name).second) bad_tensor(path, tensor.name, "a name in use", "another name");
    const std::optional<std::uint64_t> size = byte_count(tensor.dtype, tensor.shape);
    if (size != tensor.bytes.size())
      bad_tensor(path, tensor.name, std::to_string(tensor.bytes.size()) + " bytes",
                 (size ? std::to_string(*size) : "more than 2^64") + " for shape " + to_string(tensor.shape) + " of " +
                     to_string(tensor.dtype));
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
  if (text.size() > SafetensorsFile::max_header)
    throw Error({.file = path,
                 .found = "a header of " + std::to_string(text.size()) + " bytes",
                 .expected = "at most " + std::to_string(SafetensorsFile::max_header)});
  return text;
}

}  // namespace internal

/// Writes the tensors in the given order. The same input gives the same bytes. The file appears only when complete.
inline void write_safetensors(const std::string& path, std::span<const Tensor> tensors,
                              const std::map<std::string, std::string>& metadata = {}) {
  const std::string header = internal::header_json(path, tensors, metadata);
  AtomicFile file(path);
  const std::uint64_t size = header.size();
  file.write(std::string_view(reinterpret_cast<const char*>(&size), sizeof size));
  file.write(header);
  for (const Tensor& tensor : tensors) file.write(tensor.bytes);
  file.commit();
}

}  // namespace npt::inline NPT_ABI
