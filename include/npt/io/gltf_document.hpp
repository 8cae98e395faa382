/// A glTF document as its JSON and buffers, with every look at it checked: kinds of values, indices, byte ranges.
/// Places in messages read "nodes[3].mesh".
/// Errors    npt::Error that names file, place, what was found and what was expected
/// Source    glTF 2.0 specification, section 3.6; KHR_mesh_quantization; EXT_meshopt_compression
#pragma once

#include <npt/base/error.hpp>
#include <npt/config.hpp>
#include <npt/io/glb.hpp>
#include <npt/io/gltf_uri.hpp>
#include <npt/io/json_tree.hpp>
#include <npt/io/meshopt.hpp>
#include <npt/io/text.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <deque>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI::internal {

/// A value of the document and where it stands.
struct GltfItem {
  const JsonValue* value = nullptr;
  std::string place;
};

class GltfDocument {
 public:
  /// `folder`: of the document's files; nothing: they are refused.
  GltfDocument(std::string_view file, std::string name, std::optional<std::filesystem::path> folder)
      : name_(std::move(name)), folder_(std::move(folder)) {
    GlbChunks chunks{file, {}};
    if (is_glb(file)) chunks = read_glb(file, name_);
    if (chunks.json.starts_with("\xEF\xBB\xBF")) chunks.json.remove_prefix(3);
    own_bytes_ = chunks.bytes;
    // What a small file may make of itself: sparse accessors and instances need few bytes for many numbers.
    budget_ = (std::uint64_t{1} << 22) + 64 * std::uint64_t{file.size()};
    root_ = read_json_tree(chunks.json, name_);
    check_asset();
    read_buffers();
  }
  GltfDocument(const GltfDocument&) = delete;  // views look into its own bytes
  GltfDocument& operator=(const GltfDocument&) = delete;

  const std::string& name() const noexcept { return name_; }
  GltfItem root() const { return {&root_, ""}; }

  [[noreturn]] void fail(const std::string& place, std::string found, std::string expected) const {
    throw Error({.file = name_, .place = place, .found = std::move(found), .expected = std::move(expected)});
  }

  // Members of objects. `kind`: what they must be; nothing where they are missing.

  std::optional<GltfItem> member(const GltfItem& object, const char* key, JsonValue::Kind kind) const {
    const JsonValue* value = object.value->find(key);
    if (value == nullptr) return std::nullopt;
    GltfItem item{value, object.place.empty() ? key : object.place + "." + key};
    if (!value->is(kind)) fail(item.place, "another kind of value", kind_name(kind));
    return item;
  }
  GltfItem need(const GltfItem& object, const char* key, JsonValue::Kind kind) const {
    auto item = member(object, key, kind);
    if (!item) fail(object.place, std::string("no ") + key, kind_name(kind));
    return std::move(*item);
  }
  /// The objects of an array; none where it is missing.
  std::vector<GltfItem> objects(const GltfItem& object, const char* key) const {
    std::vector<GltfItem> result;
    for (GltfItem& item : items(object, key)) {
      if (!item.value->is(JsonValue::Kind::object)) fail(item.place, "another kind of value", "an object");
      result.push_back(std::move(item));
    }
    return result;
  }
  std::vector<GltfItem> items(const GltfItem& object, const char* key) const {
    std::vector<GltfItem> result;
    const auto array = member(object, key, JsonValue::Kind::array);
    if (!array) return result;
    result.reserve(array->value->items.size());
    for (std::size_t i = 0; i < array->value->items.size(); ++i)
      result.push_back({&array->value->items[i], array->place + "[" + std::to_string(i) + "]"});
    return result;
  }
  std::string text(const GltfItem& object, const char* key) const {
    const auto item = member(object, key, JsonValue::Kind::string);
    return item ? item->value->text : std::string();
  }
  std::uint64_t whole(const GltfItem& item) const {
    const auto number = item.value->whole();
    if (!number) fail(item.place, in_quotes(item.value->text), "a whole number, not negative");
    return *number;
  }
  std::optional<std::uint64_t> whole(const GltfItem& object, const char* key) const {
    const auto item = member(object, key, JsonValue::Kind::number);
    return item ? std::optional(whole(*item)) : std::nullopt;
  }
  std::uint64_t need_whole(const GltfItem& object, const char* key) const {
    return whole(need(object, key, JsonValue::Kind::number));
  }
  /// An index below `count`.
  std::size_t index(const GltfItem& item, std::size_t count, const char* of) const {
    const std::uint64_t i = whole(item);
    if (i >= count) fail(item.place, std::to_string(i), std::string("one of ") + std::to_string(count) + " " + of);
    return static_cast<std::size_t>(i);
  }
  std::optional<std::size_t> index(const GltfItem& object, const char* key, std::size_t count, const char* of) const {
    const auto item = member(object, key, JsonValue::Kind::number);
    return item ? std::optional(index(*item, count, of)) : std::nullopt;
  }
  double real(const GltfItem& item) const {
    const auto number = item.value->is(JsonValue::Kind::number) ? parse_number<double>(item.value->text) : std::nullopt;
    if (!number || !std::isfinite(*number)) fail(item.place, in_quotes(item.value->text), "a finite number");
    return *number;
  }
  /// A list of numbers; empty where it is missing. count 0: any.
  std::vector<double> reals(const GltfItem& object, const char* key, std::size_t count) const {
    std::vector<double> result;
    const std::vector<GltfItem> all = items(object, key);
    result.reserve(all.size());
    for (const GltfItem& item : all) result.push_back(real(item));
    if (count != 0 && !result.empty() && result.size() != count)
      fail(all[0].place, std::to_string(result.size()) + " numbers", std::to_string(count));
    return result;
  }

  // Bytes.

  /// The bytes of a buffer view.
  std::string_view view(const GltfItem& object, const char* key) const {
    return views_.at(need_view(object, key)).bytes;
  }

  /// A description of an accessor, checked.
  struct Accessor {
    std::string place;
    std::size_t count = 0, components = 1;
    int type = 0;                            ///< componentType
    bool normalised = false, empty = false;  ///< empty: no bytes of its own
    std::size_t stride = 0;
    std::string_view bytes{};
  };

  std::size_t accessor_count() const noexcept { return accessors_.size(); }

  /// "VEC3" and the like, as it stands.
  std::string accessor_type(std::size_t number) const { return text(accessors_[number], "type"); }
  /// Whether an accessor has bytes of its own.
  bool accessor_has_bytes(std::size_t number) const { return accessors_[number].value->find("bufferView") != nullptr; }

  /// An accessor's description. `components`: how many it must have; 16: a matrix of 4 x 4.
  Accessor accessor(std::size_t number, std::size_t components, const std::string& user) const {
    const GltfItem& item = accessors_[number];
    Accessor a{.place = item.place};
    const std::string type = text(item, "type");
    a.components = type == "SCALAR" ? 1
                   : type == "VEC2" ? 2
                   : type == "VEC3" ? 3
                   : type == "VEC4" ? 4
                   : type == "MAT4" ? 16
                                    : 0;
    if (a.components != components)
      fail(item.place, "type " + in_quotes(type) + " for " + user,
           components == 1    ? "SCALAR"
           : components == 16 ? "MAT4"
                              : "VEC" + std::to_string(components));
    const std::uint64_t kind = need_whole(item, "componentType");
    if (kind < 5120 || kind > 5126 || kind == 5124)
      fail(item.place, "componentType " + std::to_string(kind), "5120, 5121, 5122, 5123, 5125 or 5126");
    a.type = static_cast<int>(kind);
    if (const auto flag = member(item, "normalized", JsonValue::Kind::boolean))
      a.normalised = flag->value->text == "true" && a.type != 5126;
    const std::uint64_t count = need_whole(item, "count");
    if (count == 0 || count > 0xFFFFFFFEU) fail(item.place, "count " + std::to_string(count), "1 or more");
    a.count = static_cast<std::size_t>(count);
    const std::size_t size = a.components * size_of(a.type);
    a.stride = size;
    a.empty = item.value->find("bufferView") == nullptr;
    if (a.empty) return a;
    const View& v = views_.at(need_view(item, "bufferView"));
    if (v.stride != 0) a.stride = v.stride;
    if (a.stride < size)
      fail(item.place, "a stride of " + std::to_string(a.stride) + " bytes", "at least " + std::to_string(size));
    a.bytes = range(v.bytes, whole(item, "byteOffset").value_or(0), a.count, a.stride, size, item.place);
    return a;
  }

  /// All numbers of an accessor, sparse ones put in. Normalised integers become -1 to 1 or 0 to 1.
  std::vector<float> floats(std::size_t number, std::size_t components, const std::string& user) {
    const Accessor a = accessor(number, components, user);
    spend(a.count * a.components, a.place);
    std::vector<float> values(a.count * a.components);
    if (!a.empty) decode(a, values.data());
    put_sparse(a, accessors_[number], [&](std::size_t to, const Accessor& from, std::size_t row) {
      decode_row(from, row, &values[to * a.components]);
    });
    for (std::size_t i = 0; i < values.size(); ++i)
      if (!std::isfinite(values[i]))
        fail(a.place, std::to_string(values[i]) + " in element " + std::to_string(i / a.components), "finite numbers");
    return values;
  }

  /// All numbers of an accessor of unsigned integers.
  std::vector<std::uint32_t> wholes(std::size_t number, std::size_t components, const std::string& user) {
    const Accessor a = accessor(number, components, user);
    if (a.type != 5121 && a.type != 5123 && a.type != 5125)
      fail(a.place, "componentType " + std::to_string(a.type) + " for " + user, "5121, 5123 or 5125");
    spend(a.count * a.components, a.place);
    std::vector<std::uint32_t> values(a.count * a.components);
    for (std::size_t i = 0; i < a.count && !a.empty; ++i)
      for (std::size_t c = 0; c < a.components; ++c) values[i * a.components + c] = unsigned_at(a, i, c);
    put_sparse(a, accessors_[number], [&](std::size_t to, const Accessor& from, std::size_t row) {
      for (std::size_t c = 0; c < a.components; ++c) values[to * a.components + c] = unsigned_at(from, row, c);
    });
    return values;
  }

  /// Counts numbers that are made; a document that makes far more of them than it has bytes is refused.
  void spend(std::uint64_t numbers, const std::string& place) {
    if (numbers > budget_)
      fail(place, "more numbers than a file of this size should hold", "fewer instances or sparse accessors");
    budget_ -= numbers;
  }

 private:
  struct View {
    std::string_view bytes;
    std::size_t stride = 0;
  };

  static const char* kind_name(JsonValue::Kind kind) {
    static constexpr const char* names[] = {"null", "true or false", "a number", "a text", "a list", "an object"};
    return names[static_cast<std::size_t>(kind)];
  }
  static std::size_t size_of(int type) {
    return type == 5120 || type == 5121 ? 1 : type == 5122 || type == 5123 ? 2 : 4;
  }

  void check_asset() const {
    if (!root_.is(JsonValue::Kind::object)) fail("", "JSON that is no object", "a glTF document");
    const GltfItem asset = need(root(), "asset", JsonValue::Kind::object);
    const std::string version = text(asset, "version");
    if (!version.starts_with("2.")) fail("asset.version", in_quotes(version), "2.0");
  }

  void read_buffers() {
    const bool meshopt = uses("EXT_meshopt_compression") || uses("KHR_meshopt_compression");
    for (const GltfItem& item : objects(root(), "buffers")) {
      const std::uint64_t length = need_whole(item, "byteLength");
      const bool fallback = is_fallback(item);
      const auto uri = fallback ? std::nullopt : member(item, "uri", JsonValue::Kind::string);
      std::string_view bytes;
      bool there = true;
      if (uri) {
        bytes = loaded_.emplace_back(read_uri(uri->value->text, folder_, name_, uri->place).bytes);
      } else if (buffers_.empty() && own_bytes_) {
        bytes = *own_bytes_;
      } else {
        there = false;
        if (!fallback && !meshopt)
          fail(item.place, "no uri", buffers_.empty() ? "a uri, or a GLB with a chunk of bytes" : "a uri");
      }
      if (there && length > bytes.size())
        fail(item.place, "byteLength " + std::to_string(length),
             "at most " + std::to_string(bytes.size()) + ", the bytes there");
      buffers_.push_back(bytes.substr(0, static_cast<std::size_t>(std::min<std::uint64_t>(length, bytes.size()))));
    }
    for (const GltfItem& item : objects(root(), "bufferViews")) {
      const auto compressed = meshopt_of(item);
      const std::string_view bytes = compressed ? decoded(item, *compressed) : buffer_range(item);
      const std::uint64_t stride = whole(item, "byteStride").value_or(0);
      if (stride != 0 && (stride < 4 || stride > 252))
        fail(item.place, "byteStride " + std::to_string(stride), "4 to 252");
      views_.push_back({bytes, static_cast<std::size_t>(stride)});
    }
    accessors_ = objects(root(), "accessors");
  }

  bool uses(std::string_view extension) const {
    const std::vector<GltfItem> names = items(root(), "extensionsUsed");
    return std::any_of(names.begin(), names.end(), [&](const GltfItem& n) { return n.value->text == extension; });
  }
  /// A buffer for readers that don't know the compression.
  bool is_fallback(const GltfItem& item) const {
    const auto meshopt = meshopt_of(item);
    const JsonValue* fallback = meshopt ? meshopt->value->find("fallback") : nullptr;
    return fallback != nullptr && fallback->text == "true";
  }
  /// What meshoptimizer's extension says of a buffer or a view. Khronos' name for it allows more kinds of streams.
  std::optional<GltfItem> meshopt_of(const GltfItem& item) const {
    const auto extensions = member(item, "extensions", JsonValue::Kind::object);
    if (!extensions) return std::nullopt;
    auto found = member(*extensions, "EXT_meshopt_compression", JsonValue::Kind::object);
    return found ? found : member(*extensions, "KHR_meshopt_compression", JsonValue::Kind::object);
  }

  /// The range of a buffer that a view is, or its compressed bytes.
  std::string_view buffer_range(const GltfItem& item) const {
    const auto buffer = index(item, "buffer", buffers_.size(), "buffers");
    if (!buffer) fail(item.place, "no buffer", "a buffer's number");
    const std::uint64_t offset = whole(item, "byteOffset").value_or(0), length = need_whole(item, "byteLength");
    const std::uint64_t held = buffers_[*buffer].size();
    if (offset > held || length > held - offset)
      fail(item.place,
           "bytes " + std::to_string(offset) + " to " + std::to_string(offset) + " + " + std::to_string(length),
           "a range within " + std::to_string(held) + " bytes");
    return buffers_[*buffer].substr(static_cast<std::size_t>(offset), static_cast<std::size_t>(length));
  }
  /// The bytes of a view that meshoptimizer compressed.
  std::string_view decoded(const GltfItem& item, const GltfItem& meshopt) {
    const std::uint64_t count = need_whole(meshopt, "count"), stride = need_whole(meshopt, "byteStride"),
                        length = need_whole(item, "byteLength");
    if (stride > 256 || count > length || count * stride != length)
      fail(meshopt.place, std::to_string(count) + " elements of " + std::to_string(stride) + " bytes",
           std::to_string(length) + " bytes, the view's");
    spend(length / 4, meshopt.place);
    return loaded_.emplace_back(
        decode_meshopt({buffer_range(meshopt), text(meshopt, "mode"), text(meshopt, "filter"),
                        static_cast<std::size_t>(count), static_cast<std::size_t>(stride), name_, meshopt.place}));
  }

  std::size_t need_view(const GltfItem& object, const char* key) const {
    const auto view = index(object, key, views_.size(), "buffer views");
    if (!view) fail(object.place, std::string("no ") + key, "a buffer view's number");
    return *view;
  }
  /// `count` elements of `size` bytes, `stride` apart, from `offset` on.
  std::string_view range(std::string_view bytes, std::uint64_t offset, std::uint64_t count, std::uint64_t stride,
                         std::uint64_t size, const std::string& place) const {
    if (offset > bytes.size() || size > bytes.size() - offset || (count - 1) > (bytes.size() - offset - size) / stride)
      fail(place,
           std::to_string(count) + " elements, " + std::to_string(stride) + " bytes apart, from byte " +
               std::to_string(offset),
           "elements within the " + std::to_string(bytes.size()) + " bytes of the buffer view");
    return bytes.substr(static_cast<std::size_t>(offset));
  }

  template <class T>
  static T load(const Accessor& a, std::size_t row, std::size_t c) {
    std::array<char, sizeof(T)> raw;
    std::memcpy(raw.data(), a.bytes.data() + row * a.stride + c * sizeof(T), sizeof(T));
    if constexpr (std::endian::native == std::endian::big) std::reverse(raw.begin(), raw.end());
    return std::bit_cast<T>(raw);
  }
  template <class T>
  static float number_at(const Accessor& a, std::size_t row, std::size_t c) {
    const auto value = static_cast<float>(load<T>(a, row, c));
    if constexpr (std::is_same_v<T, float>) return value;
    return a.normalised ? std::max(value / static_cast<float>(std::numeric_limits<T>::max()), -1.0F) : value;
  }
  template <class T>
  static void decode_rows(const Accessor& a, std::size_t first, std::size_t count, float* to) {
    for (std::size_t i = 0; i < count; ++i)
      for (std::size_t c = 0; c < a.components; ++c) *to++ = number_at<T>(a, first + i, c);
  }
  static void decode_some(const Accessor& a, std::size_t first, std::size_t count, float* to) {
    switch (a.type) {
      case 5120:
        return decode_rows<std::int8_t>(a, first, count, to);
      case 5121:
        return decode_rows<std::uint8_t>(a, first, count, to);
      case 5122:
        return decode_rows<std::int16_t>(a, first, count, to);
      case 5123:
        return decode_rows<std::uint16_t>(a, first, count, to);
      case 5125:
        return decode_rows<std::uint32_t>(a, first, count, to);
      default:
        return decode_rows<float>(a, first, count, to);
    }
  }
  static void decode(const Accessor& a, float* to) { decode_some(a, 0, a.count, to); }
  static void decode_row(const Accessor& a, std::size_t row, float* to) { decode_some(a, row, 1, to); }
  static std::uint32_t unsigned_at(const Accessor& a, std::size_t row, std::size_t c) {
    return a.type == 5121   ? load<std::uint8_t>(a, row, c)
           : a.type == 5123 ? load<std::uint16_t>(a, row, c)
                            : load<std::uint32_t>(a, row, c);
  }

  /// Calls put(element, values, row) for each element that a sparse accessor replaces.
  template <class Put>
  void put_sparse(const Accessor& a, const GltfItem& item, Put&& put) {
    const auto sparse = member(item, "sparse", JsonValue::Kind::object);
    if (!sparse) return;
    const GltfItem indices = need(*sparse, "indices", JsonValue::Kind::object),
                   values = need(*sparse, "values", JsonValue::Kind::object);
    const std::uint64_t count = need_whole(*sparse, "count");
    if (count == 0 || count > a.count)
      fail(sparse->place, "count " + std::to_string(count), "1 to " + std::to_string(a.count));
    const std::uint64_t kind = need_whole(indices, "componentType");
    if (kind != 5121 && kind != 5123 && kind != 5125)
      fail(indices.place, "componentType " + std::to_string(kind), "5121, 5123 or 5125");
    Accessor at{.place = indices.place, .count = static_cast<std::size_t>(count), .type = static_cast<int>(kind)};
    at.stride = size_of(at.type);
    at.bytes = range(view(indices, "bufferView"), whole(indices, "byteOffset").value_or(0), count, at.stride, at.stride,
                     indices.place);
    Accessor from = a;
    from.stride = a.components * size_of(a.type);
    from.bytes = range(view(values, "bufferView"), whole(values, "byteOffset").value_or(0), count, from.stride,
                       from.stride, values.place);
    std::uint64_t next = 0;
    for (std::size_t i = 0; i < at.count; ++i) {
      const std::uint32_t to = unsigned_at(at, i, 0);
      if (to < next || to >= a.count)
        fail(indices.place, "index " + std::to_string(to), "ascending numbers below " + std::to_string(a.count));
      next = std::uint64_t{to} + 1;
      put(to, from, i);
    }
  }

  std::string name_;
  std::optional<std::filesystem::path> folder_;
  std::optional<std::string_view> own_bytes_;
  JsonValue root_;
  std::deque<std::string> loaded_;  ///< files' bytes and decoded views; they stay where they are
  std::vector<std::string_view> buffers_;
  std::vector<View> views_;
  std::vector<GltfItem> accessors_;
  std::uint64_t budget_ = 0;
};

}  // namespace npt::inline NPT_ABI::internal
