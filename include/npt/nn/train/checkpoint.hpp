/// What a training is between two steps, in one file: enough to go on as if it had never stopped.
/// Layout    safetensors: for each learned tensor NAME "weights.NAME"; "adam.mean.NAME" and "adam.square.NAME", or for
///           the hidden matrices, where Muon moves these, "muon.momentum.NAME"; where a moving average is kept,
///           "average.NAME". Metadata: kind, step, seconds, best_pmd, attribute.NAME for each attribute, and the
///           trainer's options under keys of their own
/// Numerics  every number comes back bit for bit
/// Errors    npt::Error naming the file and what is missing, misshapen, not finite or of another network; writing
///           replaces the file as a whole or leaves it as it was
#pragma once

#include <npt/base/aligned.hpp>
#include <npt/base/error.hpp>
#include <npt/config.hpp>
#include <npt/io/safetensors.hpp>
#include <npt/nn/layer/parameter.hpp>
#include <npt/nn/train/muon.hpp>
#include <npt/nn/weights/weights_file.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <type_traits>
#include <vector>

namespace npt::inline NPT_ABI {

/// The buffers are laid out as Model::buffer().
template <class T = float>
struct Checkpoint {
  AlignedBuffer<T> parameters;
  AlignedBuffer<T> mean, square;                              ///< Adam's, of what it moves
  AlignedBuffer<T> momentum;                                  ///< Muon's, of hidden matrices; empty: Adam moves them
  AlignedBuffer<T> average;                                   ///< of the weights; empty: none is kept
  std::uint64_t step = 0;                                     ///< steps taken
  double seconds = 0;                                         ///< training time spent
  double best_pmd = std::numeric_limits<double>::infinity();  ///< least validation PMD so far
  Metadata options;                                           ///< whatever the trainer's owner needs to go on
};

namespace train::internal {

inline constexpr std::string_view checkpoint_kind = "npt training checkpoint 2";
/// Keys of the metadata that aren't the owner's.
inline constexpr std::string_view own_keys[] = {"kind", "step", "seconds", "best_pmd"};
inline constexpr std::string_view attribute_prefix = "attribute.";

inline std::uint64_t whole_number_of(const std::string& text, const std::string& file, const std::string& key) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size())
    throw Error({.file = file, .place = "metadata " + key, .found = "'" + text + "'", .expected = "a whole number"});
  return value;
}

inline const std::string& metadata_of(const SafetensorsFile& file, const std::string& key) {
  if (const std::string* value = file.find_metadata(key)) return *value;
  throw Error({.file = file.name(), .place = "metadata " + key, .found = "nothing", .expected = "a value"});
}

inline void expect_checkpoint(const SafetensorsFile& file) {
  const std::string* kind = file.find_metadata("kind");
  if (kind != nullptr && *kind == checkpoint_kind) return;
  throw Error({.file = file.name(),
               .place = "metadata kind",
               .found = kind != nullptr ? "'" + *kind + "'" : "nothing",
               .expected = "'" + std::string(checkpoint_kind) +
                           "': is this a checkpoint? Those of other numbers can't be read"});
}

inline constexpr std::string_view momentum_prefix = "muon.momentum.";

/// The tensors that a prefix stands before. `muon`: it moves the hidden matrices.
inline bool has_tensor(std::string_view prefix, const Parameter& p, bool muon) {
  if (prefix.starts_with("adam.")) return !muon || !is_hidden_matrix(p);
  return prefix != momentum_prefix || is_hidden_matrix(p);
}

inline bool is_own_key(std::string_view key) {
  return std::ranges::find(own_keys, key) != std::end(own_keys) || key.starts_with(attribute_prefix);
}

}  // namespace train::internal

/// Errors    also npt::Error for option keys that the checkpoint itself uses
template <class T>
void save_checkpoint(const std::filesystem::path& path, std::span<const NamedParameter> parameters,
                     const Checkpoint<T>& checkpoint) {
  namespace in = train::internal;
  Metadata metadata = checkpoint.options;
  for (const auto& [key, value] : metadata)
    if (in::is_own_key(key))
      throw Error({.file = path.string(), .found = "an option '" + key + "'", .expected = "a key of its own"});
  metadata["kind"] = in::checkpoint_kind;
  metadata["step"] = std::to_string(checkpoint.step);
  metadata["seconds"] = number_text(checkpoint.seconds);
  if (std::isfinite(checkpoint.best_pmd)) metadata["best_pmd"] = number_text(checkpoint.best_pmd);
  std::vector<FileTensor> tensors;
  const bool muon = !checkpoint.momentum.empty();
  const auto add = [&](std::string_view prefix, std::span<const T> buffer) {
    for (const auto& [name, parameter] : parameters) {
      const auto values =
          buffer.subspan(static_cast<std::size_t>(parameter.offset), static_cast<std::size_t>(parameter.size()));
      if (!parameter.attribute && in::has_tensor(prefix, parameter, muon))
        tensors.push_back({.name = std::string(prefix) + name,
                           .dtype = std::is_same_v<T, float> ? Dtype::f32 : Dtype::f64,
                           .shape = tensor_shape(parameter),
                           .bytes = std::as_bytes(values)});
      if (parameter.attribute && buffer.data() == checkpoint.parameters.data())
        metadata[std::string(in::attribute_prefix) + name] = number_text(static_cast<double>(values[0]));
    }
  };
  add("weights.", checkpoint.parameters.span());
  add("adam.mean.", checkpoint.mean.span());
  add("adam.square.", checkpoint.square.span());
  if (muon) add(in::momentum_prefix, checkpoint.momentum.span());
  if (!checkpoint.average.empty()) add("average.", checkpoint.average.span());
  write_safetensors(path, tensors, metadata);
}

/// The owner's options in a checkpoint, without its tensors: what has to be known to build the network that they belong
/// to.
inline Metadata checkpoint_options(const SafetensorsFile& file) {
  train::internal::expect_checkpoint(file);
  Metadata options = file.metadata();
  std::erase_if(options, [](const auto& entry) { return train::internal::is_own_key(entry.first); });
  return options;
}

/// `parameters` and `buffer_size`: those of the network that the checkpoint is to be for.
template <class T = float>
Checkpoint<T> load_checkpoint(const SafetensorsFile& file, std::span<const NamedParameter> parameters,
                              std::size_t buffer_size) {
  namespace in = train::internal;
  Checkpoint<T> checkpoint;
  checkpoint.options = checkpoint_options(file);
  checkpoint.step = in::whole_number_of(in::metadata_of(file, "step"), file.name(), "step");
  checkpoint.seconds = metadata_number(in::metadata_of(file, "seconds"), file.name(), "seconds");
  if (checkpoint.seconds < 0)
    throw Error({.file = file.name(),
                 .place = "metadata seconds",
                 .found = number_text(checkpoint.seconds),
                 .expected = "a number from 0"});
  if (const std::string* best = file.find_metadata("best_pmd"))
    checkpoint.best_pmd = metadata_number(*best, file.name(), "best_pmd");
  std::set<std::string, std::less<>> known;
  const auto any = [&file](std::string_view prefix) {
    return std::ranges::any_of(file.tensors(), [prefix](const FileTensor& t) { return t.name.starts_with(prefix); });
  };
  const bool muon = any(in::momentum_prefix);
  const auto read = [&](std::string_view prefix) {
    AlignedBuffer<T> buffer(buffer_size);
    for (const auto& [name, parameter] : parameters) {
      T* out = buffer.data() + parameter.offset;
      if (!in::has_tensor(prefix, parameter, muon)) continue;
      if (parameter.attribute) {
        const std::string key = std::string(in::attribute_prefix) + name;
        *out = static_cast<T>(metadata_number(in::metadata_of(file, key), file.name(), key));
        continue;
      }
      const FileTensor& tensor = file.at(*known.insert(std::string(prefix) + name).first);
      const Dtype dtype = std::is_same_v<T, float> ? Dtype::f32 : Dtype::f64;
      if (tensor.shape != tensor_shape(parameter) || tensor.dtype != dtype)
        invalid_tensor(file.name(), tensor.name, to_string(tensor.shape) + " of " + to_string(tensor.dtype),
                       to_string(tensor_shape(parameter)) + " of " + to_string(dtype) + ", as this network has it");
      if constexpr (std::is_same_v<T, float>)
        std::ranges::copy(to_float(tensor), out);
      else
        std::ranges::copy(to_double(tensor), out);
    }
    return buffer;
  };
  checkpoint.parameters = read("weights.");
  checkpoint.mean = read("adam.mean.");
  checkpoint.square = read("adam.square.");
  if (muon) checkpoint.momentum = read(in::momentum_prefix);
  if (any("average.")) checkpoint.average = read("average.");
  for (const FileTensor& tensor : file.tensors())
    if (!known.contains(tensor.name))
      invalid_tensor(file.name(), tensor.name, "a tensor that belongs to no layer", "those of the network only");
  return checkpoint;
}

template <class T = float>
Checkpoint<T> load_checkpoint(const std::filesystem::path& path, std::span<const NamedParameter> parameters,
                              std::size_t buffer_size) {
  return load_checkpoint<T>(SafetensorsFile::read(path), parameters, buffer_size);
}

}  // namespace npt::inline NPT_ABI
