/// Confidence of an estimated body: the probability that a mesh is a person and that its pose was estimated rightly,
/// which is that its joints lie within 5 % of the figure's height in the mean.
/// Model     logistic: p = 1 / (1 + exp(-(w x + c))), x: features of an estimate (estimate/residuals.hpp)
/// Learned   by examples/fit_confidence, from estimates whose truth is known; kept in the metadata of the
///           correspondence network ("confidence_weights")
/// Errors    npt::Error that names the file, for metadata that aren't that many finite numbers
#pragma once

#include <npt/base/error.hpp>
#include <npt/base/number_text.hpp>
#include <npt/config.hpp>
#include <npt/estimate/residuals.hpp>
#include <npt/io/safetensors.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <system_error>

namespace npt::inline NPT_ABI {

/// From `least_confidence` on an estimate is used; from `high_confidence` on nothing needs to be said of it.
inline constexpr double least_confidence = 0.6, high_confidence = 0.85;

struct ConfidenceModel {
  static constexpr std::size_t feature_count = EstimateResiduals::feature_count;
  using Features = EstimateResiduals::Features;

  /// Of the features, and the constant: those of the shipped network, for weights that say nothing.
  std::array<double, feature_count + 1> weights{-2.0533, -2.9398, -6.0902, -2.4131, -10.1788};

  double operator()(const Features& x) const {
    double sum = weights[feature_count];
    for (std::size_t i = 0; i < feature_count; ++i) sum += weights[i] * x[i];
    return 1 / (1 + std::exp(-sum));
  }

  /// As the file of a correspondence network says: numbers with a space between them.
  static ConfidenceModel of(const SafetensorsFile& file) {
    ConfidenceModel model;
    const std::string* text = file.find_metadata("confidence_weights");
    if (text == nullptr) return model;
    const char *at = text->data(), *const end = at + text->size();
    for (double& weight : model.weights) {
      while (at != end && *at == ' ') ++at;
      const auto read = number_from_chars(at, end, weight);
      if (read.ec != std::errc() || !std::isfinite(weight)) fail(file, *text);
      at = read.ptr;
    }
    if (at != end) fail(file, *text);
    return model;
  }

 private:
  [[noreturn]] static void fail(const SafetensorsFile& file, const std::string& text) {
    throw Error({.file = file.name(),
                 .place = "metadata confidence_weights",
                 .found = "'" + text + "'",
                 .expected = std::to_string(feature_count + 1) + " numbers, as examples/fit_confidence writes them"});
  }
};

}  // namespace npt::inline NPT_ABI
