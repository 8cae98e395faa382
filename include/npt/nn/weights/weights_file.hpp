/// Weights in safetensors files, whole: the checks and conversions behind weights.hpp.
#pragma once

#include <npt/base/error.hpp>
#include <npt/config.hpp>
#include <npt/io/safetensors.hpp>
#include <npt/io/text.hpp>
#include <npt/nn/engine/model.hpp>
#include <npt/nn/weights/weights.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

// Not inlined, as Engine::compiled().
template <class Net>
NPT_NOINLINE Metadata variant_metadata() {
  if constexpr (requires { Net::variant(); })
    return Net::variant();
  else
    return {};
}

/// The shortest text that reads back as the same number.
NPT_INLINE std::string number_text(double value) {
  std::string text;
  append_number(text, value);
  return text;
}

/// The finite number that a file's metadata gives as `text` for `key`; npt::Error that names file and key for other
/// text.
NPT_INLINE double metadata_number(const std::string& text, const std::string& file, const std::string& key) {
  const std::optional<double> value = parse_number<double>(text);
  if (!value || !std::isfinite(*value))
    throw Error({.file = file, .place = "metadata " + key, .found = in_quotes(text), .expected = "a finite number"});
  return *value;
}

/// The shape that a parameter has in a weights file.
NPT_INLINE TensorShape tensor_shape(const Parameter& p) {
  TensorShape shape;
  for (int i = 0; i < p.rank; ++i) shape.push_back(static_cast<std::uint64_t>(p.dims[i]));
  return shape;
}

namespace internal {

/// The value for `key`: the file's, or the one assumed where the file has none. Both must agree.
NPT_INLINE std::string agreed_value(const SafetensorsFile& file, const Metadata& assume, const std::string& key) {
  const std::string* stored = file.find_metadata(key);
  const auto assumed = assume.find(key);
  if (stored == nullptr && assumed == assume.end())
    throw Error({.file = file.name(),
                 .place = "metadata " + key,
                 .found = "nothing",
                 .expected = "a value: files of all variants look alike, so say which this is"});
  if (stored == nullptr) return assumed->second;
  if (assumed != assume.end() && assumed->second != *stored) {
    const auto a = parse_number<double>(*stored), b = parse_number<double>(assumed->second);
    if (!a || !b || *a != *b)  // "2" and "2.0" are one number
      throw Error({.file = file.name(),
                   .place = "metadata " + key,
                   .found = "'" + *stored + "'",
                   .expected = "'" + assumed->second + "', as was asked for"});
  }
  return *stored;
}

/// Everything about the tensors that doesn't fit the network, or nothing.
NPT_INLINE std::vector<std::string> tensor_problems(const std::vector<NamedParameter>& parameters,
                                                    const SafetensorsFile& file) {
  std::vector<std::string> problems;
  for (const auto& [name, parameter] : parameters) {
    if (parameter.attribute) continue;
    const FileTensor* tensor = file.find(name);
    if (tensor == nullptr) {
      problems.push_back(name + " is missing");
      continue;
    }
    if (tensor->shape != tensor_shape(parameter))
      problems.push_back(name + " has shape " + to_string(tensor->shape) + " instead of " +
                         to_string(tensor_shape(parameter)));
    if (tensor->dtype != Dtype::f32 && tensor->dtype != Dtype::f64 && tensor->dtype != Dtype::f16 &&
        tensor->dtype != Dtype::bf16)
      problems.push_back(name + " holds " + to_string(tensor->dtype) + " instead of floating point");
  }
  for (const FileTensor& tensor : file.tensors()) {
    if (tensor.name.find('/') != std::string::npos) continue;  // SafetensorsFile::part: another network's
    bool known = false;                                        // of tens of parameters
    for (const auto& [name, parameter] : parameters) known = known || (!parameter.attribute && name == tensor.name);
    if (!known) problems.push_back(tensor.name + " belongs to no layer");
  }
  return problems;
}

NPT_INLINE std::string variant_text(const Metadata& variant) {
  std::string text;
  for (const auto& [key, value] : variant) text += (text.empty() ? "" : ", ") + key + " " + value;
  return text.empty() ? "the network" : "the network with " + text;
}

/// Throws unless the file's metadata names this variant.
NPT_INLINE void check_variant(const SafetensorsFile& file, const Metadata& variant, const Metadata& assume) {
  for (const auto& [key, value] : variant) {
    // The bottleneck shows in the shapes, so that a file without it can't be mistaken.
    if (key == "bottleneck" && file.find_metadata(key) == nullptr) continue;
    const std::string stored = agreed_value(file, assume, key);
    if (stored != value)
      throw Error({.file = file.name(),
                   .place = "metadata " + key,
                   .found = "'" + stored + "'",
                   .expected = "'" + value + "', which is this network's"});
  }
}

NPT_INLINE void check_tensors(const SafetensorsFile& file, const std::vector<NamedParameter>& parameters,
                              const Metadata& variant) {
  const auto problems = tensor_problems(parameters, file);
  if (problems.empty()) return;
  std::string text;
  for (std::size_t i = 0; i < problems.size() && i < 12; ++i) text += (i == 0 ? "" : "; ") + problems[i];
  if (problems.size() > 12) text += "; and " + std::to_string(problems.size() - 12) + " more";
  throw Error(
      {.file = file.name(), .place = "tensors", .found = text, .expected = "those of " + variant_text(variant)});
}

/// Copies tensors and attributes to their places in a model's buffer.
template <class T>
void read_values(const SafetensorsFile& file, const std::vector<NamedParameter>& parameters, const Metadata& assume,
                 std::span<T> buffer) {
  for (const auto& [name, parameter] : parameters) {
    T* out = buffer.data() + parameter.offset;
    if (parameter.attribute) {
      *out = static_cast<T>(metadata_number(agreed_value(file, assume, name), file.name(), name));
      continue;
    }
    const auto values = to_values<T>(file.at(name), NonFinite::refuse);
    std::copy(values.begin(), values.end(), out);
  }
}

template <class T>
void write_values(const std::filesystem::path& path, const std::vector<NamedParameter>& parameters,
                  std::span<const T> buffer, Metadata metadata) {
  std::vector<FileTensor> tensors;
  for (const auto& [name, parameter] : parameters) {
    const auto values =
        buffer.subspan(static_cast<std::size_t>(parameter.offset), static_cast<std::size_t>(parameter.size()));
    if (parameter.attribute)
      metadata[name] = number_text(static_cast<double>(values[0]));
    else
      tensors.push_back({.name = name,
                         .dtype = std::is_same_v<T, float> ? Dtype::f32 : Dtype::f64,
                         .shape = tensor_shape(parameter),
                         .bytes = std::as_bytes(values)});
  }
  write_safetensors(path, as_span(tensors), metadata);
}

}  // namespace internal

template <class T>
Metadata load_values(const SafetensorsFile& file, const Metadata& variant,
                     const std::vector<NamedParameter>& parameters, std::span<T> buffer, const Metadata& assume) {
  internal::check_variant(file, variant, assume);
  internal::check_tensors(file, parameters, variant);
  std::vector<T> loaded(buffer.begin(), buffer.end());
  internal::read_values(file, parameters, assume, std::span<T>(loaded));
  std::copy(loaded.begin(), loaded.end(), buffer.begin());
  return file.metadata();
}

template <class T>
void save_values(const std::filesystem::path& path, const Metadata& variant,
                 const std::vector<NamedParameter>& parameters, std::span<const T> buffer, Metadata metadata) {
  for (const auto& [key, value] : variant) metadata[key] = value;
  internal::write_values(path, parameters, buffer, std::move(metadata));
}

}  // namespace npt::inline NPT_ABI
