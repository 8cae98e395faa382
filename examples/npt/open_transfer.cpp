#include "open_transfer.hpp"

#include "arguments.hpp"
#include "remedies.hpp"
#include "shipped_weights.hpp"

#include <formats/read.hpp>
#include <refining/refinement.hpp>

#include <npt/base/error.hpp>
#include <npt/base/length_unit.hpp>
#include <npt/transfer/animation.hpp>

#include <cmath>
#include <filesystem>
#include <iostream>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace program {

namespace {

/// Metres in a unit that is named, or given as a number.
double unit_from(const std::string& text) {
  for (const npt::LengthUnit& unit : npt::length_units)
    if (text == unit.one) return unit.metres;
  double metres = 0;
  const auto result = npt::number_from_chars(text.data(), text.data() + text.size(), metres);
  const bool is_number = result.ec == std::errc() && result.ptr == text.data() + text.size();
  if (!is_number || !(metres > 0) || !std::isfinite(metres))
    throw npt::Error(
        {"--unit", {}, "'" + text + "'", "metre, centimetre, millimetre, inch, foot, or a number of metres above 0"});
  return metres;
}

/// Says which options of the arguments change nothing about the results.
void note_idle_options(const TransferArguments& arguments, const PoseTransfer& transfer) {
  const npt::TransferOptions& options = transfer.options();
  const auto note = [](const std::string& text) { std::cerr << "npt: note: " + text + '\n'; };
  if (options.network.pairings > 1 && !transfer.pairs_vertices())
    note("--pairings changes nothing: the pooled feature pairs no vertices");
  if (arguments.method == "network" && arguments.quality != "balanced")
    note("--quality changes nothing: --method network estimates no bodies");
  if (!transfer.has_body()) return;
  std::string idle;
  for (const auto& [name, given] :
       {std::pair("--pairings", options.network.pairings > 1 && transfer.pairs_vertices()),
        std::pair("--mirror", options.network.mirror), std::pair("--normalise", arguments.normalise.has_value()),
        std::pair("--output-scale", arguments.network.output_scale.has_value())})
    if (given) idle += (idle.empty() ? "" : ", ") + std::string(name);
  if (!idle.empty())
    note(idle + ": only results of the network change, not those of body estimation (--method network uses it alone)");
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
  std::vector<std::filesystem::path> files;
  if (arguments.network.weights) {
    files.emplace_back(*arguments.network.weights);
  } else {
    const std::string feature = arguments.network.feature.value_or("per-vertex");
    files.push_back(shipped_weights(feature, arguments.can_be_random));
    // Animals' network is asked for by its file's name alone: it takes meshes of another size than people's.
    const bool by_network =
        options.method == npt::Method::network || arguments.network.order || arguments.network.feature;
    if (const auto animals = find_shipped("quadruped.safetensors"); animals && !by_network) files.push_back(*animals);
  }
  auto transfer = PoseTransfer::open(std::span<const std::filesystem::path>(files), options,
                                     npt::DefaultExecutor(arguments.threads));
  note_idle_options(arguments, transfer);
  return transfer;
}

double metres_in(const PoseTransfer& transfer, const npt::Character& identity, const std::filesystem::path& file,
                 const std::filesystem::path& out, std::string& note) {
  if (extension_of(out) != ".glb") return 1;
  const double unit = npt::output_unit(transfer, identity, formats::is_scene(file));
  const bool given = transfer.options().import.unit.has_value();
  if (unit != 1)
    note = file.string() + " is taken to be in " + npt::unit_name(unit) +
           (given ? "" : ", by its size (--unit says another one)") + ": " + out.string() +
           " is in metres, as GLB files are" + (given ? "" : guide_text(entry_of(npt::WarningCode::unit_assumed)));
  return unit;
}

}  // namespace program
