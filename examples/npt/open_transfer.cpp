#include "open_transfer.hpp"

#include "arguments.hpp"
#include "shipped_weights.hpp"

#include <formats/read.hpp>
#include <refining/refinement.hpp>

#include <npt/base/error.hpp>
#include <npt/io/safetensors.hpp>
#include <npt/transfer/animation.hpp>

#include <array>
#include <cmath>
#include <iostream>
#include <utility>

namespace program {

namespace {

constexpr std::array<std::pair<const char*, double>, 5> units{
    {{"metre", 1}, {"centimetre", 0.01}, {"millimetre", 0.001}, {"inch", 0.0254}, {"foot", 0.3048}}};

/// Metres in a unit that is named, or given as a number.
double unit_from(const std::string& text) {
  for (const auto& [name, metres] : units)
    if (text == name) return metres;
  const std::vector<float> numbers = parse_numbers(text, "--unit");
  if (numbers.size() != 1)
    throw npt::Error({"--unit", {}, "'" + text + "'", "metre, centimetre, millimetre, inch, foot, or metres"});
  return static_cast<double>(numbers[0]);
}

npt::TransferOptions options_of(const TransferArguments& arguments) {
  npt::TransferOptions options = arguments.options;
  npt::NetworkOptions& network = options.network;
  network.assume = arguments.network.assume();
  network.resample = arguments.resample == "auto";
  network.pairing = arguments.pairing == "random" ? npt::Pairing::random : npt::Pairing::as_given;
  if (arguments.normalise) network.normalisation = npt::parse_normalisation(*arguments.normalise, "--normalise");
  if (arguments.unit) options.import.unit = unit_from(*arguments.unit);
  options.method = arguments.method == "body"      ? npt::Method::body
                   : arguments.method == "network" ? npt::Method::network
                                                   : npt::Method::automatic;
  options.body.quality = arguments.quality == "fast"   ? npt::Quality::fast
                         : arguments.quality == "best" ? npt::Quality::best
                                                       : npt::Quality::balanced;
  // Vertices are paired by number to see what the network itself does.
  if (arguments.pairing == "as-given" && options.method == npt::Method::automatic)
    options.method = npt::Method::network;
  if (arguments.refine) options.refinement = refining::refinement();
  return options;
}

PoseTransfer random_transfer(const TransferArguments& arguments, const npt::TransferOptions& options) {
  Variant variant{.bottleneck = 256};
  if (arguments.network.order) variant.order = *arguments.network.order;
  if (arguments.network.feature) variant.feature = *arguments.network.feature;
  std::cerr << "npt: note: random weights (seed " << options.seed << "): the result is not a pose transfer\n";
  return PoseTransfer::random(*npt::find_network<npt::AllNetworks, npt::DefaultExecutor>(variant.metadata()),
                              options.seed, options, npt::DefaultExecutor(arguments.threads));
}

}  // namespace

PoseTransfer open_transfer(const TransferArguments& arguments) {
  const npt::TransferOptions options = options_of(arguments);
  if (arguments.random_weights) return random_transfer(arguments, options);
  const auto weights = arguments.network.weights ? *arguments.network.weights
                                                 : shipped_weights(arguments.network.feature.value_or("per-vertex"));
  auto transfer =
      PoseTransfer::open(npt::SafetensorsFile::read(weights), options, npt::DefaultExecutor(arguments.threads));
  if (options.network.pairings > 1 && !transfer.pairs_vertices())
    std::cerr << "npt: note: --pairings changes nothing: the pooled feature pairs no vertices\n";
  return transfer;
}

double metres_in(const PoseTransfer& transfer, const npt::MeshView& identity, const std::filesystem::path& file,
                 const std::filesystem::path& out, std::string& note) {
  if (extension_of(out) != ".glb") return 1;
  const double unit = npt::output_unit(transfer, identity, formats::is_scene(file));
  const bool given = transfer.options().import.unit.has_value();
  if (unit != 1)
    note = file.string() + " is taken to be in " + npt::unit_name(unit) +
           (given ? "" : ", by its size (--unit says another one)") + ": " + out.string() +
           " is in metres, as GLB files are";
  return unit;
}

}  // namespace program
