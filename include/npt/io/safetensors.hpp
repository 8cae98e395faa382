/// The safetensors format, whole: its reader, which safetensors_class.hpp declares, and its writer.
#pragma once

#include <npt/base/as_span.hpp>
#include <npt/base/error.hpp>
#include <npt/base/platform.hpp>
#include <npt/base/sort.hpp>
#include <npt/config.hpp>
#include <npt/io/file.hpp>
#include <npt/io/file_tensor.hpp>
#include <npt/io/json.hpp>
#include <npt/io/safetensors_class.hpp>
#include <npt/io/safetensors_header.hpp>
#include <npt/io/tensor_values.hpp>
#include <npt/io/text.hpp>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

template <class X>
SafetensorsFile BasicSafetensorsFile<X>::read(const std::filesystem::path& path) {
  return parse(read_file(path), path.string());
}

template <class X>
SafetensorsFile BasicSafetensorsFile<X>::parse(std::string bytes, const std::string& name) {
  SafetensorsFile file;
  file.name_ = name;
  file.bytes_ = std::shared_ptr<const std::string>(new std::string(std::move(bytes)));
  const std::string_view header = header_of(*file.bytes_, name);
  internal::SafetensorsHeaderEvents<> events(header, name);
  internal::read_json(header, events);
  file.metadata_ = std::move(events.metadata);
  file.place_tensors(events.entries, std::as_bytes(std::span(*file.bytes_)).subspan(8 + header.size()));
  return file;
}

template <class X>
std::map<std::string, std::string> BasicSafetensorsFile<X>::read_metadata(const std::filesystem::path& path) {
  std::error_code code;
  std::uint64_t size = 0;
  std::string header;
  if (std::filesystem::is_regular_file(path, code)) {
    const internal::FileHandle file(platform::open_file(path, "rb"));
    const bool sized = file && std::fread(&size, 1, sizeof size, file.get()) == sizeof size;
    if (sized && size <= max_header && size <= std::filesystem::file_size(path, code)) {
      header.resize(static_cast<std::size_t>(size));
      header.resize(std::fread(header.data(), 1, header.size(), file.get()));
    }
  }
  if (header.size() != size || !header.starts_with('{')) return read(path).metadata();  // which says what is wrong
  internal::SafetensorsHeaderEvents<> events(header, path.string());
  internal::read_json(header, events);
  return std::move(events.metadata);
}

template <class X>
const FileTensor* BasicSafetensorsFile<X>::find(std::string_view tensor) const {
  for (const FileTensor& t : tensors_)  // tens of them: no index
    if (t.name == tensor) return &t;
  return nullptr;
}

template <class X>
const FileTensor& BasicSafetensorsFile<X>::at(std::string_view tensor) const {
  if (const FileTensor* found = find(tensor)) return *found;
  throw Error({.file = name_, .found = "no tensor " + in_quotes(tensor), .expected = "one of that name"});
}

template <class X>
const std::string* BasicSafetensorsFile<X>::find_metadata(const std::string& key) const {
  const auto found = metadata_.find(key);
  return found == metadata_.end() ? nullptr : &found->second;
}

template <class X>
SafetensorsFile BasicSafetensorsFile<X>::part(std::string_view prefix) const {
  SafetensorsFile file;
  file.name_ = name_ + ", " + std::string(prefix);
  file.bytes_ = bytes_;
  for (const auto& [key, text] : metadata_)
    if (key.starts_with(prefix)) file.metadata_.emplace(key.substr(prefix.size()), text);
  for (const FileTensor& tensor : tensors_) {
    if (!tensor.name.starts_with(prefix)) continue;
    file.tensors_.push_back(tensor);
    file.tensors_.back().name.erase(0, prefix.size());
  }
  return file;
}

template <class X>
std::string_view BasicSafetensorsFile<X>::header_of(std::string_view bytes, const std::string& name) {
  const auto fail = [&name](std::string place, std::string found, std::string expected) {
    return Error({.file = name, .place = std::move(place), .found = std::move(found), .expected = std::move(expected)});
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
    throw fail("byte 8", header.empty() ? "an empty header" : in_quotes(header.substr(0, 1)), "'{'");
  return header;
}

template <class X>
void BasicSafetensorsFile<X>::place_tensors(const std::vector<internal::TensorEntry>& entries,
                                            std::span<const std::byte> data) {
  // By their first byte, empty ones first; a header of max_header bytes has space for fewer than 2^24 of them.
  constexpr int number_bits = 24;
  const auto begin_of = [&](const FileTensor& t) { return static_cast<std::size_t>(t.bytes.data() - data.data()); };
  std::vector<FileTensor> unordered;
  std::vector<std::uint64_t> keys;
  for (const internal::TensorEntry& entry : entries) {
    const FileTensor& tensor = unordered.emplace_back(internal::check_entry(entry, data, name_));
    const std::uint64_t place = 2 * std::uint64_t{begin_of(tensor)} + (tensor.bytes.empty() ? 0 : 1);
    keys.push_back(place << number_bits | keys.size());
  }
  sort_keys(as_span(keys));
  tensors_.reserve(entries.size());
  for (const std::uint64_t key : keys)
    tensors_.push_back(std::move(unordered[static_cast<std::size_t>(key % (1U << number_bits))]));
  std::size_t end = 0;
  for (const FileTensor& tensor : tensors_) {
    if (begin_of(tensor) != end)
      invalid_tensor(name_, tensor.name, "data at " + std::to_string(begin_of(tensor)),
                     std::to_string(end) + ", where the tensor before it ends");
    end += tensor.bytes.size();
  }
  if (end != data.size())
    throw Error({.file = name_,
                 .place = "byte " + std::to_string(bytes_->size() - (data.size() - end)),
                 .found = std::to_string(data.size() - end) + " bytes that belong to no tensor",
                 .expected = "the end of the file"});
}

/// Writes the tensors in the given order. The same input gives the same bytes. The file appears only when complete.
NPT_INLINE void write_safetensors(const std::filesystem::path& path, std::span<const FileTensor> tensors,
                                  const std::map<std::string, std::string>& metadata = {}) {
  const std::string header = internal::safetensors_header(path.string(), tensors, metadata);
  AtomicFile file(path);
  const std::uint64_t size = header.size();
  file.write(std::string_view(reinterpret_cast<const char*>(&size), sizeof size));
  file.write(header);
  for (const FileTensor& tensor : tensors) file.write(tensor.bytes);
  file.commit();
}

}  // namespace npt::inline NPT_ABI
