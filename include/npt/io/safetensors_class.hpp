/// Named tensors in a file: the safetensors format.
///   u64 little-endian N <= 100 MB | N bytes of JSON, "{...}" padded with blanks | the tensors' bytes, row major
///   JSON: name -> {"dtype", "shape", "data_offsets": [begin, end]}, "__metadata__" -> {string: string}
/// Numerics  bytes are kept as they are; tensor_values.hpp converts them
/// Errors    npt::Error that names the file and the tensor: not this format, truncated, a name twice, sizes that
///           overflow or don't agree with the shape, tensors that overlap or leave a hole, an unknown type
/// Source    https://github.com/huggingface/safetensors, "Format"
#pragma once

#include <npt/config.hpp>
#include <npt/io/file_tensor.hpp>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace npt::inline NPT_ABI {

namespace internal {
struct TensorEntry;
}  // namespace internal

NPT_INLINE_CLASS(class, SafetensorsFile);
/// A safetensors file in memory. Copies share the bytes, which live as long as one of the copies.
template <class>
class BasicSafetensorsFile {
 public:
  /// Bytes of JSON in a header; the format allows no more.
  static constexpr std::uint64_t max_header = internal::max_safetensors_header;

  static SafetensorsFile read(const std::filesystem::path& path);

  /// A file's bytes, already in memory. `name` stands in the messages of errors.
  static SafetensorsFile parse(std::string bytes, const std::string& name);

  /// The metadata of a file, of which no more than its header is read.
  static std::map<std::string, std::string> read_metadata(const std::filesystem::path& path);

  const std::string& name() const noexcept { return name_; }
  const std::map<std::string, std::string>& metadata() const noexcept { return metadata_; }
  /// In the order in which they lie in the file.
  const std::vector<FileTensor>& tensors() const noexcept { return tensors_; }

  /// The tensor of that name, or nullptr.
  const FileTensor* find(std::string_view tensor) const;
  /// The tensor of that name; throws npt::Error where there is none.
  const FileTensor& at(std::string_view tensor) const;
  /// The metadata of that key, or nullptr.
  const std::string* find_metadata(const std::string& key) const;

  /// The tensors and texts whose names begin with `prefix`, without it: a network that lies in a file beside another.
  /// Of the same memory.
  SafetensorsFile part(std::string_view prefix) const;

 private:
  BasicSafetensorsFile() = default;

  static std::string_view header_of(std::string_view bytes, const std::string& name);

  /// Checks that the tensors cover the data one after another, and lists them in that order.
  void place_tensors(const std::vector<internal::TensorEntry>& entries, std::span<const std::byte> data);

  std::string name_;
  std::shared_ptr<const std::string> bytes_;
  std::map<std::string, std::string> metadata_;
  std::vector<FileTensor> tensors_;
};

#ifdef NPT_COMPILED
extern template class BasicSafetensorsFile<>;
#endif

}  // namespace npt::inline NPT_ABI
