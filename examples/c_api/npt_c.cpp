/// The C ABI of npt_c.h over the engine. To compile in other networks, change `networks` at the end of the first namespace.
#include "npt_c.h"

#include <npt/npt.hpp>

#include <array>
#include <cstring>
#include <exception>
#include <memory>
#include <new>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

/// Engines of all networks have one type here: what differs between them lies behind it.
struct npt_network {
  npt::engine::Core<float, npt::DefaultExecutor> engine;
  bool paired;
  npt::TransferOptions options;
  std::string description;
};

namespace {

using Core = npt::engine::Core<float, npt::DefaultExecutor>;

struct Variant {
  int bottleneck;
  std::string order, feature;
  bool operator==(const Variant&) const = default;
};

struct NetworkType {
  Variant variant;
  bool paired;
  Core (*load)(const npt::SafetensorsFile& file, int threads);
  Core (*random)(std::uint64_t seed, int threads);
};

template <int Bottleneck, class Order, class Feature>
NetworkType type_of() {
  using Net = npt::PoseTransferNet<Bottleneck, Order, Feature>;
  return {.variant = {Bottleneck, Order::name, Feature::name},
          .paired = npt::Engine<Net>::pairs_vertices(),
          .load = [](const npt::SafetensorsFile& file, int threads) -> Core {
            npt::Model<Net> model;
            npt::load(model, file);
            return npt::Engine<Net>(model, threads);
          },
          .random = [](std::uint64_t seed, int threads) -> Core {
            npt::Model<Net> model;
            npt::randomise(model, seed);
            return npt::Engine<Net>(model, threads);
          }};
}

template <int... Bottlenecks>
std::vector<NetworkType> types_of() {
  std::vector<NetworkType> list;
  (list.insert(
       list.end(),
       {type_of<Bottlenecks, npt::ConvRelu, npt::PerVertex>(), type_of<Bottlenecks, npt::ConvRelu, npt::Pooled>(),
        type_of<Bottlenecks, npt::ReluConv, npt::PerVertex>(), type_of<Bottlenecks, npt::ReluConv, npt::Pooled>()}),
   ...);
  return list;
}

const std::vector<NetworkType>& networks() {
  static const std::vector<NetworkType> list = types_of<64, 1024>();
  return list;
}

const NetworkType& network_type(const Variant& variant, const std::string& where) {
  for (const NetworkType& type : networks())
    if (type.variant == variant) return type;
  throw npt::Error({.file = where,
                    .found = "bottleneck " + std::to_string(variant.bottleneck) + ", order " + variant.order +
                             ", feature " + variant.feature,
                    .expected = "bottleneck 64 or 1024, conv_relu or relu_conv, per-vertex or pooled"});
}

std::unique_ptr<npt_network> make_network(Core engine, const NetworkType& type, npt::Normalisation normalisation) {
  const Variant& v = type.variant;
  return std::make_unique<npt_network>(
      npt_network{.engine = std::move(engine),
                  .paired = type.paired,
                  .options = {.normalisation = normalisation},
                  .description = "bottleneck " + std::to_string(v.bottleneck) + ", " + v.order + ", " + v.feature});
}

std::string metadata_of(const npt::SafetensorsFile& file, const std::string& key) {
  if (const std::string* value = file.find_metadata(key)) return *value;
  throw npt::Error({.file = file.name(), .place = "metadata " + key, .found = "nothing", .expected = "a value"});
}

std::unique_ptr<npt_network> open_weights(const char* path, int threads) {
  const auto file = npt::SafetensorsFile::read(path);
  const std::string bottleneck = metadata_of(file, "bottleneck");
  Variant variant{0, metadata_of(file, "order"), metadata_of(file, "feature")};
  for (const NetworkType& type : networks())
    if (bottleneck == std::to_string(type.variant.bottleneck)) variant.bottleneck = type.variant.bottleneck;
  if (variant.bottleneck == 0)
    throw npt::Error({.file = file.name(),
                      .place = "metadata bottleneck",
                      .found = "'" + bottleneck + "'",
                      .expected = "64 or 1024, which this library has compiled in"});
  const NetworkType& type = network_type(variant, file.name());
  const std::string* normalisation = file.find_metadata("normalisation");
  return make_network(type.load(file, threads), type,
                      normalisation != nullptr ? npt::parse_normalisation(*normalisation, file.name() + ": metadata")
                                               : npt::Normalisation::centre);
}

/// The caller's triangles, each vertex number checked.
std::vector<npt::Triangle> triangles_of(const std::uint32_t* numbers, std::size_t count, std::size_t vertices) {
  std::vector<npt::Triangle> triangles(count);
  for (std::size_t t = 0; t < count; ++t)
    for (std::size_t corner = 0; corner < 3; ++corner) {
      triangles[t][corner] = numbers[3 * t + corner];
      if (triangles[t][corner] >= vertices)
        throw npt::Error({.file = "pose_triangles",
                          .place = "triangle " + std::to_string(t),
                          .found = "vertex " + std::to_string(triangles[t][corner]),
                          .expected = "a number below " + std::to_string(vertices)});
    }
  return triangles;
}

void transfer(const npt_network& network, std::span<const float> identity, std::span<const float> pose,
              std::span<const npt::Triangle> triangles, float* result) {
  const npt::IdentityInput input = npt::identity_input(identity, network.options);
  const std::size_t count = network.paired ? identity.size() / 3 : 0;
  const std::vector<float> posed = npt::pose_input(pose, triangles, count, network.options);
  std::vector<float> moved(identity.size());
  network.engine(posed, input.coordinates, moved);
  npt::restore(input, moved, {result, identity.size()});
}

// The border: exceptions become a status and a message. A fixed buffer, so that short memory can be reported too.
thread_local std::array<char, 2048> last_error{};

npt_status failed(npt_status status, const char* message) noexcept {
  std::size_t length = std::min(std::strlen(message), last_error.size() - 1);
  // Not through the middle of a character: those that follow a first byte begin with the bits 10.
  if (message[length] != '\0')
    while (length > 0 && (static_cast<unsigned char>(message[length]) & 0xC0U) == 0x80U) --length;
  std::memcpy(last_error.data(), message, length);
  last_error[length] = '\0';
  return status;
}

template <class F>
npt_status guarded(const F& f) noexcept {
  try {
    f();
    return NPT_OK;
  } catch (const npt::Error& error) {
    return failed(NPT_BAD_INPUT, error.what());
  } catch (const std::bad_alloc&) {
    return failed(NPT_NO_MEMORY, "out of memory");
  } catch (const std::exception& error) {
    return failed(NPT_INTERNAL, error.what());
  } catch (...) {
    return failed(NPT_INTERNAL, "unknown exception");
  }
}

constexpr std::size_t most_vertices = std::size_t{1} << 28;

}  // namespace

const char* npt_version(void) { return NPT_VERSION; }
const char* npt_last_error(void) { return last_error.data(); }

npt_status npt_open_weights(const char* path, int threads, npt_network** network) {
  if (path == nullptr || network == nullptr) return failed(NPT_BAD_ARGUMENT, "npt_open_weights: a null pointer");
  if (threads < 0) return failed(NPT_BAD_ARGUMENT, "npt_open_weights: fewer than 0 threads");
  return guarded([&] { *network = open_weights(path, threads).release(); });
}

npt_status npt_open_random(int bottleneck, int pooled, uint64_t seed, int threads, npt_network** network) {
  if (network == nullptr) return failed(NPT_BAD_ARGUMENT, "npt_open_random: a null pointer");
  if (threads < 0) return failed(NPT_BAD_ARGUMENT, "npt_open_random: fewer than 0 threads");
  return guarded([&] {
    const NetworkType& type = network_type(
        {bottleneck, npt::ConvRelu::name, pooled != 0 ? npt::Pooled::name : npt::PerVertex::name}, "network");
    *network = make_network(type.random(seed, threads), type, npt::Normalisation::centre).release();
  });
}

void npt_close(npt_network* network) { delete network; }

const char* npt_describe(const npt_network* network) {
  return network == nullptr ? nullptr : network->description.c_str();
}

npt_status npt_transfer(const npt_network* network, const float* identity, size_t identity_vertices, const float* pose,
                        size_t pose_vertices, const uint32_t* pose_triangles, size_t pose_triangle_count,
                        float* result) {
  if (network == nullptr || identity == nullptr || pose == nullptr || result == nullptr ||
      (pose_triangles == nullptr && pose_triangle_count != 0))
    return failed(NPT_BAD_ARGUMENT, "npt_transfer: a null pointer");
  if (identity_vertices > most_vertices || pose_vertices > most_vertices || pose_triangle_count > most_vertices)
    return failed(NPT_BAD_ARGUMENT, "npt_transfer: more than 2^28 vertices or triangles");
  return guarded([&] {
    transfer(*network, {identity, 3 * identity_vertices}, {pose, 3 * pose_vertices},
             triangles_of(pose_triangles, pose_triangle_count, pose_vertices), result);
  });
}
