#include "networks.hpp"

#include "network_list.hpp"

#include <npt/engine/engine.hpp>
#include <npt/graph/explain.hpp>

#include <algorithm>

namespace program {

namespace {

template <class Net>
Network network() {
  Network n;
  n.variant = variant_of<Net>();
  n.program = &npt::graph::program_of<Net>;
  for (const npt::NamedParameter& p : npt::Model<Net>::parameters())
    if (!p.parameter.attribute) n.parameters += static_cast<std::size_t>(p.parameter.size());
  n.metadata = npt::variant_metadata<Net>();
  n.list = [] { return npt::Model<Net>::parameters(); };
  n.buffer_size = static_cast<std::size_t>(npt::parameter_buffer_size(npt::Model<Net>::network()));
  n.explain = &npt::explain<Net>;
  n.from_file = [](const npt::SafetensorsFile& file, const npt::Metadata& assume, int threads) -> FloatEngine {
    npt::Model<Net> model;
    npt::load(model, file, assume);
    return npt::Engine<Net>(model, threads);
  };
  n.from_values = [](std::span<const float> values, int threads) -> FloatEngine {
    npt::Model<Net> model;
    std::ranges::copy(values, model.buffer().begin());
    return npt::Engine<Net>(model, threads);
  };
  n.from_seed = [](std::uint64_t seed, int threads, npt::Precision precision) -> FloatEngine {
    npt::Model<Net> model;
    npt::randomise(model, seed);
    return npt::Engine<Net>(model, threads, precision);
  };
  n.double_from_seed = [](std::uint64_t seed, int threads) -> DoubleEngine {
    npt::Model<Net> floats;
    npt::randomise(floats, seed);
    npt::Model<Net, double> model;
    std::ranges::copy(floats.buffer(), model.buffer().begin());
    return npt::Engine<Net, double>(model, threads);
  };
  return n;
}

}  // namespace

const std::vector<Network>& networks() {
  static const std::vector<Network> list = [] {
    std::vector<Network> all;
    for_each_network([&all]<class Net>() { all.push_back(network<Net>()); });
    return all;
  }();
  return list;
}

const Network* find_network(const Variant& variant) {
  const auto found = std::ranges::find(networks(), variant, &Network::variant);
  return found == networks().end() ? nullptr : &*found;
}

}  // namespace program
