/// Tensors that are collected one after another and written to a safetensors file.
#pragma once

#include <npt/base/error.hpp>
#include <npt/config.hpp>
#include <npt/io/file_tensor.hpp>
#include <npt/io/safetensors.hpp>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

NPT_INLINE_CLASS(class, TensorList);
/// Keeps copies of what is added.
template <class>
class BasicTensorList {
 public:
  /// T: float, double, std::int64_t or std::uint32_t
  template <class T>
  void add(std::string name, std::span<const T> values, TensorShape shape) {
    std::unique_ptr<std::vector<std::byte>>& bytes = bytes_.emplace_back(std::make_unique<std::vector<std::byte>>());
    const std::span<const std::byte> own = std::as_bytes(values);
    bytes->assign(own.begin(), own.end());
    tensors_.push_back(
        {.name = std::move(name), .dtype = dtype_of<T>(), .shape = std::move(shape), .bytes = as_span(*bytes)});
  }
  /// One after another: shape [n].
  template <class T>
  void add(std::string name, const std::vector<T>& values) {
    add(std::move(name), as_span(values), {values.size()});
  }
  void add_text(const std::string& key, std::string text) { metadata_[key] = std::move(text); }

  void write(const std::filesystem::path& path) const { write_safetensors(path, as_span(tensors_), metadata_); }

 private:
  template <class T>
  static constexpr Dtype dtype_of() {
    static_assert(std::is_same_v<T, float> || std::is_same_v<T, double> || std::is_same_v<T, std::int64_t> ||
                  std::is_same_v<T, std::uint32_t>);
    return std::is_same_v<T, float>          ? Dtype::f32
           : std::is_same_v<T, double>       ? Dtype::f64
           : std::is_same_v<T, std::int64_t> ? Dtype::i64
                                             : Dtype::u32;
  }

  std::vector<FileTensor> tensors_;
  std::vector<std::unique_ptr<std::vector<std::byte>>> bytes_;
  std::map<std::string, std::string> metadata_;
};

}  // namespace npt::inline NPT_ABI
