/// Which networks a program has compiled in, whole, and the choice among them by a weights file's metadata.
#pragma once

#include <npt/base/aligned.hpp>
#include <npt/base/error.hpp>
#include <npt/config.hpp>
#include <npt/nets/ablation_nets.hpp>
#include <npt/nets/correspondence_net.hpp>
#include <npt/nets/network_type.hpp>
#include <npt/nets/pose_transfer_net.hpp>
#include <npt/nn/engine/core.hpp>
#include <npt/nn/engine/engine.hpp>
#include <npt/nn/engine/model.hpp>
#include <npt/nn/graph/inputs.hpp>
#include <npt/nn/graph/program.hpp>
#include <npt/nn/weights/weights_file.hpp>

#include <cstddef>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

// Not inlined, as Engine::compiled().
template <class Net, class Exec>
NPT_NOINLINE NetworkType<Exec> network_type() {
  return {.variant = variant_metadata<Net>(),
          .program = &Engine<Net, float, Exec>::program(),
          .parameters = &Model<Net>::parameters(),
          .buffer_size = Model<Net>::buffer_size(),
          .pack = [](std::span<const float> values, Exec executor, Precision precision) -> engine::Core<float, Exec> {
            return Engine<Net, float, Exec>(values, std::move(executor), precision);
          }};
}

/// "pose and identity".
NPT_INLINE std::string input_names(const graph::InputList& inputs) {
  std::string text;
  for (int i = 0; i < inputs.count; ++i)
    text += (i == 0 ? "" : i + 1 == inputs.count ? " and " : ", ") + std::string(inputs[i].name);
  return text;
}

/// The variant in words: "bottleneck 256, conv_relu, per-vertex".
NPT_INLINE std::string variant_name(const Metadata& variant) {
  const auto value = [&variant](const char* key) -> const std::string* {
    const auto found = variant.find(key);
    return found == variant.end() ? nullptr : &found->second;
  };
  const std::string *net = value("net"), *bottleneck = value("bottleneck"), *order = value("order"),
                    *feature = value("feature");
  if (bottleneck == nullptr || order == nullptr || feature == nullptr) {
    std::string text;
    for (const auto& [key, word] : variant) text += (text.empty() ? "" : ", ") + key + " " + word;
    return text.empty() ? "a network of its own" : text;
  }
  return (net == nullptr ? "" : *net + ", ") + "bottleneck " + *bottleneck + ", " + *order + ", " + *feature;
}

namespace internal {

/// What a file says of one key of its variant: its metadata, the caller's assumption, or for the bottleneck the
/// encoder's shape, where it names no other network than the paper's.
NPT_INLINE std::string file_variant(const SafetensorsFile& file, const Metadata& assume, const std::string& key) {
  if (const std::string* stored = file.find_metadata(key)) return *stored;
  if (const auto assumed = assume.find(key); assumed != assume.end()) return assumed->second;
  if (key == "bottleneck" && file.find_metadata("net") == nullptr)
    if (const FileTensor* last = file.find("encoder.conv3.weight"); last != nullptr && !last->shape.empty())
      return std::to_string(last->shape[0]);
  return {};
}

/// "bottleneck 256, 128; feature per-vertex, pooled": what the networks of a list differ in.
NPT_INLINE std::string choices_of(const std::vector<const Metadata*>& variants) {
  std::map<std::string, std::vector<std::string>> values;
  for (const Metadata* variant : variants)
    for (const auto& [key, value] : *variant) {
      std::vector<std::string>& known = values[key];
      bool listed = false;
      for (const std::string& k : known) listed = listed || k == value;
      if (!listed) known.push_back(value);
    }
  std::string text;
  for (const auto& [key, list] : values) {
    text += (text.empty() ? "" : "; ") + key + (key == "net" ? " none," : "");
    for (std::size_t i = 0; i < list.size(); ++i) text += (i == 0 ? " " : ", ") + list[i];
  }
  return text;
}

template <class>
std::size_t find_variant(const SafetensorsFile& file, const Metadata& assume,
                         const std::vector<const Metadata*>& variants) {
  Metadata said;
  const auto ask = [&](const std::string& key) {
    if (std::string text = file_variant(file, assume, key); !text.empty()) said[key] = std::move(text);
  };
  ask("net");
  for (const Metadata* variant : variants)
    for (const auto& [key, value] : *variant) ask(key);
  for (std::size_t i = 0; i < variants.size(); ++i)
    if (*variants[i] == said) return i;
  for (const char* key : {"bottleneck", "order", "feature"})
    if (!variants.empty() && variants.front()->contains(key) && !said.contains(key) && !said.contains("net")) {
      const bool shape = std::string(key) == "bottleneck";
      throw Error({.file = file.name(),
                   .place = shape ? "tensors" : std::string("metadata ") + key,
                   .found = shape ? "no encoder.conv3.weight" : "nothing",
                   .expected = shape ? "weights of a pose transfer network"
                                     : "a value, or to be told: files of all variants look alike"});
    }
  throw Error({.file = file.name(),
               .place = "metadata",
               .found = variant_name(said),
               .expected = "one of the networks that are compiled in: " + choices_of(variants)});
}

}  // namespace internal

/// The entry of the list with this variant, or nullptr.
template <class Networks, class Exec>
const NetworkType<Exec>* find_network(const Metadata& variant) {
  for (const NetworkType<Exec>& type : network_types<Networks, Exec>())
    if (type.variant == variant) return &type;
  return nullptr;
}

/// Throws unless a network `fits`: `expected` says what it should be. `name`: of its weights.
template <class Exec>
void expect_network(bool fits, const NetworkType<Exec>& type, const std::string& name, const char* expected) {
  if (!fits)
    throw Error({.file = name,
                 .found = variant_name(type.variant) + ", a network of " + input_names(type.program->inputs),
                 .expected = expected});
}

/// A network of a list with a file's weights, ready to run, where `fits(its program)`; see expect_network.
/// Errors    npt::Error as find_network's and load_values', and for a network that doesn't fit
template <class Networks, class Exec, class Fits>
engine::Core<float, Exec> open_network(const SafetensorsFile& file, Exec executor, Fits&& fits, const char* expected) {
  const NetworkType<Exec>& type = find_network<Networks, Exec>(file);
  expect_network(fits(*type.program), type, file.name(), expected);
  AlignedBuffer<float> values(type.buffer_size);
  load_values(file, type.variant, *type.parameters, values.span());
  return type.pack(values.span(), std::move(executor), Precision::automatic);
}

}  // namespace npt::inline NPT_ABI
