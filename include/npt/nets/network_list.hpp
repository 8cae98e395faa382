/// Which networks a program has compiled in, and the choice among them by a weights file's metadata.
#pragma once

#include <npt/base/aligned.hpp>
#include <npt/base/default_executor.hpp>
#include <npt/base/error.hpp>
#include <npt/config.hpp>
#include <npt/nets/ablation_nets.hpp>
#include <npt/nets/correspondence_net.hpp>
#include <npt/nets/pose_transfer_net.hpp>
#include <npt/nn/engine/core.hpp>
#include <npt/nn/engine/engine.hpp>
#include <npt/nn/engine/model.hpp>
#include <npt/nn/engine/packed_program.hpp>
#include <npt/nn/graph/graph.hpp>
#include <npt/nn/graph/program.hpp>
#include <npt/nn/layer/parameter.hpp>
#include <npt/nn/weights/weights_file.hpp>

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// Network types as a type. A host that needs few of them names its own list:
/// PoseTransfer::open<NetworkList<...>>(...).
template <class... Nets>
struct NetworkList {
  /// Calls `f.template operator()<Net>()` for each.
  template <class F>
  static void for_each(F&& f) {
    (f.template operator()<Nets>(), ...);
  }
};

namespace internal {

template <class... Lists>
struct JoinedLists;
template <class... Nets>
struct JoinedLists<NetworkList<Nets...>> {
  using type = NetworkList<Nets...>;
};
template <class... A, class... B, class... Rest>
struct JoinedLists<NetworkList<A...>, NetworkList<B...>, Rest...> : JoinedLists<NetworkList<A..., B...>, Rest...> {};

/// The paper's network in both unit orders and with both features, and its ablations.
template <int Bottleneck>
using NetworksOfBottleneck =
    NetworkList<PoseTransferNet<Bottleneck, ConvRelu, PerVertex>, PoseTransferNet<Bottleneck, ConvRelu, Pooled>,
                PoseTransferNet<Bottleneck, ReluConv, PerVertex>, PoseTransferNet<Bottleneck, ReluConv, Pooled>,
                PlainNet<Bottleneck>, ConcatNet<Bottleneck>>;

}  // namespace internal

/// Correspondence networks (estimate/correspondence_estimator.hpp).
using CorrespondenceNetworks = NetworkList<CorrespondenceNet<>>;

/// Every network that npt ships weights for or trains: those that transfer poses, of five bottlenecks, both layer
/// orders, both features, with the ablations; and the correspondence network.
using AllNetworks =
    typename internal::JoinedLists<internal::NetworksOfBottleneck<1024>, internal::NetworksOfBottleneck<512>,
                                   internal::NetworksOfBottleneck<256>, internal::NetworksOfBottleneck<128>,
                                   internal::NetworksOfBottleneck<64>, CorrespondenceNetworks>::type;

/// A network behind functions: what differs between the types of a list.
template <class Exec>
struct NetworkType {
  Metadata variant;                                    ///< what names it in weights files
  const graph::Program* program = nullptr;             ///< what runs
  const std::vector<NamedParameter>* parameters = {};  ///< its tensors and attributes
  std::size_t buffer_size = 0;                         ///< elements of a buffer laid out as Model::buffer()
  /// An engine on these values, a buffer laid out as Model::buffer().
  engine::Core<float, Exec> (*pack)(std::span<const float> values, Exec executor, Precision precision) = nullptr;
};

/// A network type's entry.
template <class Net, class Exec>
NetworkType<Exec> network_type() {
  return {.variant = variant_metadata<Net>(),
          .program = &Engine<Net, float, Exec>::program(),
          .parameters = &Model<Net>::parameters(),
          .buffer_size = static_cast<std::size_t>(parameter_buffer_size(Model<Net>::network())),
          .pack = [](std::span<const float> values, Exec executor, Precision precision) -> engine::Core<float, Exec> {
            return Engine<Net, float, Exec>(values, std::move(executor), precision);
          }};
}

/// The entries of a list of networks, in its order.
template <class Networks, class Exec>
const std::vector<NetworkType<Exec>>& network_types() {
  static const std::vector<NetworkType<Exec>> list = [] {
    std::vector<NetworkType<Exec>> types;
    Networks::for_each([&types]<class Net>() { types.push_back(network_type<Net, Exec>()); });
    return types;
  }();
  return list;
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

/// The number of the variant that the file is of.
/// Errors    npt::Error that names what the file says and what the list has
NPT_INLINE std::size_t find_variant(const SafetensorsFile& file, const Metadata& assume,
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

/// The entry of the list that a weights file is of. `assume`: what the file doesn't say of itself.
/// Errors    npt::Error that names what the file says and what the list has
template <class Networks, class Exec>
const NetworkType<Exec>& find_network(const SafetensorsFile& file, const Metadata& assume = {}) {
  const std::vector<NetworkType<Exec>>& types = network_types<Networks, Exec>();
  std::vector<const Metadata*> variants;
  variants.reserve(types.size());
  for (const NetworkType<Exec>& type : types) variants.push_back(&type.variant);
  return types[internal::find_variant(file, assume, variants)];
}

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

#ifdef NPT_PREBUILT
extern template const std::vector<NetworkType<DefaultExecutor>>& network_types<AllNetworks, DefaultExecutor>();
#endif

}  // namespace npt::inline NPT_ABI
