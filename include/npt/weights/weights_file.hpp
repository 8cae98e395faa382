/// Weights in safetensors files, under the names of the public state dict.
///
/// The variants of the network have tensors of identical names and shapes, so a wrong pairing would load silently and
/// give wrong meshes. The file's metadata therefore names the variant (order, feature, bottleneck, output_scale), and
/// loading checks it against the network. A file without these keys needs an explicit choice. Further keys that
/// programs read: normalisation (sphere, centre or none), domain, unit. Errors  npt::Error naming the file and every
/// missing, misshapen, unknown or non-finite tensor at once; nothing is changed then
#pragma once

#include <npt/config.hpp>
#include <npt/core/error.hpp>
#include <npt/engine/model.hpp>
#include <npt/io/safetensors.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <map>
#include <span>
#include <string>
#include <system_error>
#include <type_traits>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

using Metadata = std::map<std::string, std::string>;

/// The metadata that names a network's variant: what its static variant() says, or nothing.
template <class Net>
Metadata variant_metadata() {
  if constexpr (requires { Net::variant(); })
    return Net::variant();
  else
    return {};
}

/// The shortest text that reads back as the same number.
inline std::string number_text(double value) {
  char buffer[32];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, value).ptr;
  return std::string(buffer, end);
}

namespace internal {

inline double number_of(const std::string& text, const std::string& file, const std::string& key) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value))
    throw Error({.file = file, .place = "metadata " + key, .found = "'" + text + "'", .expected = "a finite number"});
  return value;
}

/// The value for `key`: the file's, or the one assumed where the file has none. Both must agree.
inline std::string agreed_value(const SafetensorsFile& file, const Metadata& assume, const std::string& key) {
  const std::string* stored = file.find_metadata(key);
  const auto assumed = assume.find(key);
  if (stored == nullptr && assumed == assume.end())
    throw Error({.file = file.name(),
                 .place = "metadata " + key,
                 .found = "nothing",
                 .expected = "a value: files of all variants look alike, so say which this is"});
  if (stored == nullptr) return assumed->second;
  if (assumed != assume.end() && assumed->second != *stored) {
    double a = 0, b = 0;  // "2" and "2.0" are one number
    const auto number = [](const std::string& text, double& value) {
      const auto result = std::from_chars(text.data(), text.data() + text.size(), value);
      return result.ec == std::errc() && result.ptr == text.data() + text.size();
    };
    if (!(number(*stored, a) && number(assumed->second, b) && a == b))
      throw Error({.file = file.name(),
                   .place = "metadata " + key,
                   .found = "'" + *stored + "'",
                   .expected = "'" + assumed->second + "', as was asked for"});
  }
  return *stored;
}

inline TensorShape shape_of(const Parameter& p) {
  TensorShape shape;
  for (int i = 0; i < p.rank; ++i) shape.push_back(static_cast<std::uint64_t>(p.dims[i]));
  return shape;
}

/// Everything about the tensors that doesn't fit the network, or nothing.
inline std::vector<std::string> tensor_problems(const std::vector<NamedParameter>& parameters,
                                                const SafetensorsFile& file) {
  std::vector<std::string> problems;
  for (const auto& [name, parameter] : parameters) {
    if (parameter.attribute) continue;
    const Tensor* tensor = file.find(name);
    if (tensor == nullptr) {
      problems.push_back(name + " is missing");
      continue;
    }
    if (tensor->shape != shape_of(parameter))
      problems.push_back(name + " has shape " + to_string(tensor->shape) + " instead of " +
                         to_string(shape_of(parameter)));
    if (tensor->dtype != Dtype::f32 && tensor->dtype != Dtype::f64 && tensor->dtype != Dtype::f16 &&
        tensor->dtype != Dtype::bf16)
      problems.push_back(name + " holds " + to_string(tensor->dtype) + " instead of floating point");
  }
  for (const Tensor& tensor : file.tensors()) {
    bool known = false;  // of tens of parameters
    for (const auto& [name, parameter] : parameters) known = known || (!parameter.attribute && name == tensor.name);
    if (!known) problems.push_back(tensor.name + " belongs to no layer");
  }
  return problems;
}

inline std::string variant_text(const Metadata& variant) {
  std::string text;
  for (const auto& [key, value] : variant) text += (text.empty() ? "" : ", ") + key + " " + value;
  return text.empty() ? "the network" : "the network with " + text;
}

}  // namespace internal

namespace internal {

/// Throws unless the file's metadata names this variant.
inline void check_variant(const SafetensorsFile& file, const Metadata& variant, const Metadata& assume) {
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

inline void check_tensors(const SafetensorsFile& file, const std::vector<NamedParameter>& parameters,
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
      *out = static_cast<T>(number_of(agreed_value(file, assume, name), file.name(), name));
      continue;
    }
    const auto values = internal::to_values<T>(file.at(name), NonFinite::refuse);
    std::copy(values.begin(), values.end(), out);
  }
}

template <class T>
void write_values(const std::string& path, const std::vector<NamedParameter>& parameters, std::span<const T> buffer,
                  Metadata metadata) {
  std::vector<Tensor> tensors;
  for (const auto& [name, parameter] : parameters) {
    const auto values =
        buffer.subspan(static_cast<std::size_t>(parameter.offset), static_cast<std::size_t>(parameter.size()));
    if (parameter.attribute)
      metadata[name] = number_text(static_cast<double>(values[0]));
    else
      tensors.push_back({.name = name,
                         .dtype = std::is_same_v<T, float> ? Dtype::f32 : Dtype::f64,
                         .shape = shape_of(parameter),
                         .bytes = std::as_bytes(values)});
  }
  write_safetensors(path, tensors, metadata);
}

}  // namespace internal

/// Fills the model from a file and returns the file's metadata. `assume` gives values for keys that the file lacks; where it has
/// them, they must agree.
template <class Net, class T>
Metadata load(Model<Net, T>& model, const SafetensorsFile& file, const Metadata& assume = {}) {
  const Metadata variant = variant_metadata<Net>();
  internal::check_variant(file, variant, assume);
  internal::check_tensors(file, model.parameters(), variant);
  Model<Net, T> loaded;
  internal::read_values(file, model.parameters(), assume, loaded.buffer());
  model = std::move(loaded);
  return file.metadata();
}

/// The same for whoever knows a network only by its variant's metadata and its list of parameters. `buffer` is laid out as
/// Model::buffer() and unchanged after an error.
template <class T>
Metadata load_values(const SafetensorsFile& file, const Metadata& variant,
                     const std::vector<NamedParameter>& parameters, std::span<T> buffer, const Metadata& assume = {}) {
  internal::check_variant(file, variant, assume);
  internal::check_tensors(file, parameters, variant);
  std::vector<T> loaded(buffer.begin(), buffer.end());
  internal::read_values(file, parameters, assume, std::span<T>(loaded));
  std::copy(loaded.begin(), loaded.end(), buffer.begin());
  return file.metadata();
}

template <class Net, class T>
Metadata load(Model<Net, T>& model, const std::string& path, const Metadata& assume = {}) {
  return load(model, SafetensorsFile::read(path), assume);
}

/// Writes the values of a buffer that is laid out as Model::buffer(), with the variant and whatever else `metadata` says.
template <class T>
void save_values(const std::string& path, const Metadata& variant, const std::vector<NamedParameter>& parameters,
                 std::span<const T> buffer, Metadata metadata = {}) {
  for (const auto& [key, value] : variant) metadata[key] = value;
  internal::write_values(path, parameters, buffer, std::move(metadata));
}

/// Writes the model, with its variant and attributes and whatever else `metadata` says. The file appears only when
/// complete.
template <class Net, class T>
void save(const Model<Net, T>& model, const std::string& path, Metadata metadata = {}) {
  for (const auto& [key, value] : variant_metadata<Net>()) metadata[key] = value;
  internal::write_values(path, model.parameters(), model.buffer(), std::move(metadata));
}

}  // namespace npt::inline NPT_ABI
