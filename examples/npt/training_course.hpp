/// What a training draws its samples from and is measured on: made from the arguments.
#pragma once

#include "training_arguments.hpp"

#include <npt/lab/evaluation.hpp>
#include <npt/nn/train/sample.hpp>
#include <npt/nn/train/trainer.hpp>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace program {

/// Validation pairs are drawn with this seed; training never draws the same, whatever its seed.
inline constexpr std::uint64_t validation_seed = 20260101;

struct TrainingCourse {
  std::vector<std::unique_ptr<npt::SampleSource>> sources;
  std::vector<npt::TrainingStage> stages;  ///< refer to the sources
  npt::Normalisation normalisation = npt::Normalisation::centre;
  std::string trained_on;  ///< for the weights' metadata
  std::string unit;
  std::string validated_on;
  double distance_loss = 0;     ///< npt::LossOptions::distance
  bool with_negatives = false;  ///< a correspondence network that is shown what isn't a person, too

  /// Sets of about `pairs` pairs in all, of identities and poses that training never shows; none for 0.
  std::vector<npt::EvaluationSet> validation(std::size_t pairs) const {
    return pairs == 0 ? std::vector<npt::EvaluationSet>{} : make_validation(pairs);
  }
  std::function<std::vector<npt::EvaluationSet>(std::size_t)> make_validation;
};

/// `paired`: the network needs meshes of equal vertex counts.
/// Errors    npt::Error for bodies and families that can't be read or don't fit the arguments or the network
TrainingCourse make_training_course(const TrainingArguments& arguments, bool paired);

}  // namespace program
