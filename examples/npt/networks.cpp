#include "networks.hpp"

#include <npt/base/aligned.hpp>
#include <npt/nn/engine/engine.hpp>
#include <npt/nn/graph/explain.hpp>

#include <algorithm>
#include <map>
#include <span>

namespace program {

namespace {

/// What only the program asks of a network's type.
struct Extras {
  std::string (*explain)() = nullptr;
  DoubleEngine (*pack)(std::span<const double> values, int threads) = nullptr;
};

const Extras& extras_of(const NetworkType& network) {
  static const std::map<const npt::graph::Program*, Extras> list = [] {
    std::map<const npt::graph::Program*, Extras> all;
    const auto add = [&all]<class Net>() {
      all[&npt::graph::program_of<Net>] = {
          &npt::explain<Net>, [](std::span<const double> values, int threads) -> DoubleEngine {
            return npt::Engine<Net, double, npt::DefaultExecutor>(values, npt::DefaultExecutor(threads));
          }};
    };
    npt::AllNetworks::for_each(add);
    return all;
  }();
  return list.at(network.program);
}

npt::AlignedBuffer<float> random_values(const NetworkType& network, std::uint64_t seed) {
  npt::AlignedBuffer<float> values(network.buffer_size);
  npt::set_attributes(*network.parameters, values.span());
  npt::randomise_values(*network.parameters, values.span(), seed);
  return values;
}

}  // namespace

const NetworkType* find_network(const Variant& variant) {
  return npt::find_network<npt::AllNetworks, npt::DefaultExecutor>(variant.metadata());
}

FloatEngine random_engine(const NetworkType& network, std::uint64_t seed, int threads, npt::Precision precision) {
  const npt::AlignedBuffer<float> values = random_values(network, seed);
  return network.pack(values.span(), npt::DefaultExecutor(threads), precision);
}

DoubleEngine random_double_engine(const NetworkType& network, std::uint64_t seed, int threads) {
  const npt::AlignedBuffer<float> floats = random_values(network, seed);
  npt::AlignedBuffer<double> values(network.buffer_size);
  std::ranges::copy(floats.span(), values.span().begin());
  return extras_of(network).pack(std::as_const(values).span(), threads);
}

std::string explain(const NetworkType& network) { return extras_of(network).explain(); }

std::size_t parameter_count(const NetworkType& network) {
  std::size_t count = 0;
  for (const npt::NamedParameter& p : *network.parameters)
    if (!p.parameter.attribute) count += static_cast<std::size_t>(p.parameter.size());
  return count;
}

}  // namespace program
