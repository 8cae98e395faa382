/// Confidence of an estimated body: the probability that a mesh is a person and that its pose was estimated rightly,
/// which is that its joints lie within 5 % of the figure's height in the mean; and of each joint, that it does.
/// Model     logistic: p = 1 / (1 + exp(-(w x + c))), x: features (estimate/residuals.hpp)
/// Learned   by examples/fit_confidence, from estimates whose truth is known; kept in the metadata of the
///           correspondence network ("confidence_weights", "confidence_joint_weights")
/// Errors    npt::Error that names the file, for metadata that aren't that many finite numbers
#pragma once

#include <npt/base/error.hpp>
#include <npt/config.hpp>
#include <npt/estimate/residuals.hpp>
#include <npt/io/safetensors.hpp>
#include <npt/io/text.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace npt::inline NPT_ABI {

template <std::size_t Features>
struct LogisticModel {
  std::array<double, Features + 1> weights{};  ///< of the features, and the constant

  /// The logarithm of the odds.
  double odds(const std::array<double, Features>& x) const {
    double sum = weights[Features];
    for (std::size_t i = 0; i < Features; ++i) sum += weights[i] * x[i];
    return sum;
  }
  double operator()(const std::array<double, Features>& x) const { return 1 / (1 + std::exp(-odds(x))); }

  /// Takes what a file says under `key`: numbers with a space between them. Nothing changes where it says nothing.
  void read(const SafetensorsFile& file, const char* key) {
    const std::string* text = file.find_metadata(key);
    if (text == nullptr) return;
    std::string_view rest = *text;
    bool good = true;
    for (double& weight : weights) {
      const std::optional<double> number = parse_number<double>(next_word(rest));
      good = good && number && std::isfinite(*number);
      weight = number.value_or(0);
    }
    if (!good || !next_word(rest).empty())
      throw Error({.file = file.name(),
                   .place = std::string("metadata ") + key,
                   .found = "'" + *text + "'",
                   .expected = std::to_string(Features + 1) + " numbers, as examples/fit_confidence writes them"});
  }
};

struct ConfidenceModel {
  /// Those of the shipped network, for weights that say nothing.
  LogisticModel<EstimateResiduals::feature_count> estimate{
      {-4.5576, -6.4263, -4.6335, -0.5794, -31.0527}};  // learned by examples/fit_confidence
  LogisticModel<EstimateResiduals::joint_feature_count + 1> joint{
      {-1.6529, -1.2504, 0.0224, -7.1347}};  // learned by examples/fit_confidence

  static ConfidenceModel of(const SafetensorsFile& file) {
    ConfidenceModel model;
    model.estimate.read(file, "confidence_weights");
    model.joint.read(file, "confidence_joint_weights");
    return model;
  }

  double operator()(const EstimateResiduals& residuals) const { return estimate(residuals.features()); }
  /// Whether a joint is rather wrong than right.
  bool doubts_joint(const EstimateResiduals& residuals) const {
    return std::ranges::any_of(of_joints(residuals), [](double one) { return one < 0.5; });
  }
  /// That of a joint: by its features, and by the odds of the whole.
  std::vector<double> of_joints(const EstimateResiduals& residuals) const {
    std::vector<double> all(residuals.joints.size());
    const double odds = estimate.odds(residuals.features());
    for (std::size_t j = 0; j < all.size(); ++j) {
      const auto [correspondences, surface] = residuals.joint_features(j);
      all[j] = joint({correspondences, surface, odds});
    }
    return all;
  }
};

}  // namespace npt::inline NPT_ABI
