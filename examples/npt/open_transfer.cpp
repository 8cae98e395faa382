#include "open_transfer.hpp"

#include "arguments.hpp"
#include "shipped_weights.hpp"

#include <formats/read.hpp>
#include <refining/body_method.hpp>
#include <refining/refinement.hpp>

#include <npt/base/error.hpp>
#include <npt/io/safetensors.hpp>

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
  options.assume = arguments.network.assume();
  options.resample = arguments.resample == "auto";
  options.pairing = arguments.pairing == "random" ? npt::Pairing::random : npt::Pairing::as_given;
  if (arguments.normalise) options.normalisation = npt::parse_normalisation(*arguments.normalise, "--normalise");
  if (arguments.unit) options.unit = unit_from(*arguments.unit);
  options.method = arguments.method == "body"      ? npt::Method::body
                   : arguments.method == "network" ? npt::Method::network
                                                   : npt::Method::automatic;
  // Vertices are paired by number to see what the network itself does.
  if (arguments.pairing == "as-given" && options.method == npt::Method::automatic)
    options.method = npt::Method::network;
  options.body = refining::body_method(options.method);
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
  if (options.pairings > 1 && !transfer.pairs_vertices())
    std::cerr << "npt: note: --pairings changes nothing: the pooled feature pairs no vertices\n";
  return transfer;
}

namespace {

std::string unit_name(double unit) {
  for (const auto& [text, metres] : units)
    if (metres == unit)
      return text == std::string("foot") ? "feet" : text == std::string("inch") ? "inches" : text + std::string("s");
  return "units of " + std::to_string(unit) + " metres";
}

}  // namespace

double metres_in(const PoseTransfer& transfer, const npt::MeshView& identity, const std::filesystem::path& file,
                 const std::filesystem::path& out, std::string& note) {
  if (extension_of(out) != ".glb" || formats::is_scene(file)) return 1;
  double unit = 1;
  try {
    unit = transfer.options().unit ? *transfer.options().unit : transfer.unit_of(identity);
  } catch (const npt::Error&) {  // no person's size
  }
  if (unit != 1)
    note = file.string() + " is taken to be in " + unit_name(unit) +
           (transfer.options().unit ? "" : ", by its size (--unit says otherwise)") + ": " + out.string() +
           " is in metres, as GLB files are";
  return unit;
}

npt::Mesh scaled(npt::Mesh mesh, double factor) {
  if (factor == 1) return mesh;
  for (float& x : mesh.coordinates()) x = static_cast<float>(static_cast<double>(x) * factor);
  return mesh;
}

std::string unit_note(const PoseTransfer& transfer, const npt::MeshView& mesh) {
  if (transfer.options().unit) return {};
  const double unit = transfer.unit_of(mesh);
  if (unit == 1) return {};
  return std::string(mesh.name) + " is taken to be in " + unit_name(unit) + ", by its size (--unit says otherwise)";
}

}  // namespace program
