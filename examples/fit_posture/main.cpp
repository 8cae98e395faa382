// Learns how bodies of a kind stand at rest, by their shape, from rigged ones: tensor posture/joints.
// See npt/estimate/posture.hpp.
//
//   npt_fit_posture quadruped.safetensors result.safetensors horse.glb fox.glb cat.fbx ...
//
// A rig's angles are those that are estimated as its scene stands; its shapes those in frames of its clips, too, since
// the shape of one animal comes out a little otherwise in each pose. Both sides count as one. Ridge regression.
// Printed is how far a rig's angles are from what the others say, for several strengths of the ridge. The weakest is
// taken that is no more than 3 % worse than the best: shapes that are known are told better by it.
#include <formats/read.hpp>

#include <npt/base/affine.hpp>
#include <npt/base/as_span.hpp>
#include <npt/base/default_executor.hpp>
#include <npt/base/random.hpp>
#include <npt/base/rotation.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/kind_file.hpp>
#include <npt/estimate/body_estimator.hpp>
#include <npt/estimate/correspondence_estimator.hpp>
#include <npt/estimate/posture.hpp>
#include <npt/io/file_tensor.hpp>
#include <npt/io/safetensors.hpp>
#include <npt/lab/rig/rig.hpp>
#include <npt/solve/dense_cholesky.hpp>

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <limits>
#include <memory>
#include <numeric>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace {

/// A shape with a 1 behind it, and the angles at rest of the rig that has it.
struct Sample {
  std::size_t rig = 0;
  std::vector<double> inputs, angles;
};

std::vector<double> inputs_of(const npt::BodyEstimate& estimate) {
  std::vector<double> inputs;
  for (const float b : estimate.fit.body.betas) inputs.push_back(npt::Posture::limited(b));
  inputs.push_back(1);
  return inputs;
}

/// Of both sides.
std::vector<double> angles_of(const npt::BodyEstimate& estimate, const npt::BodyPlan& plan) {
  std::vector<double> angles;
  const std::vector<npt::Vec3d> own = estimate.angles_without_yaw();
  for (std::size_t j = 0; j < own.size(); ++j) {
    const npt::Vec3d both = (own[j] + npt::mirrored(own[plan.joints[j].mirrored])) / 2;
    angles.insert(angles.end(), {both.x, both.y, both.z});
  }
  return angles;
}

void add_rig(const std::string& file, std::size_t frames, const std::vector<std::string>& held_out,
             const npt::BodyEstimator& estimator, std::vector<Sample>& samples) {
  const npt::Rig rig = npt::make_rig(formats::read_scene(file), file);
  std::vector<const npt::Clip*> clips;
  for (const npt::Clip& clip : rig.scene.clips)
    if (std::ranges::none_of(held_out, [&](const std::string& name) { return clip.name.ends_with(name); }))
      clips.push_back(&clip);
  const std::size_t number = samples.empty() ? 0 : samples.back().rig + 1;
  std::vector<double> angles;
  npt::Random random(1);
  std::size_t used = 0;
  for (std::size_t f = 0; f <= (clips.empty() ? 0 : frames); ++f) {
    const npt::Clip* clip = f == 0 ? nullptr : clips[random.below(static_cast<std::uint32_t>(clips.size()))];
    const std::vector<npt::Affine> motions = rig.motions(clip, clip == nullptr ? 0 : random.uniform() * clip->length());
    const std::vector<float> xyz = rig.posed(npt::as_span(motions));
    const npt::BodyEstimate estimate = estimator.read({xyz, npt::as_span(rig.triangles), file});
    if (estimate.confidence < npt::least_confidence && f > 0) continue;
    if (estimate.fit.body.axis_angles.empty()) return;
    if (f == 0) angles = angles_of(estimate, estimator.kind().plan);
    samples.push_back({number, inputs_of(estimate), angles});
    ++used;
  }
  std::printf("%-28s %zu frames\n", std::filesystem::path(file).stem().string().c_str(), used);
}

/// [angles][columns] but for the rig that is left out.
std::vector<double> solve(const std::vector<Sample>& samples, double ridge, std::size_t left_out) {
  const std::size_t columns = samples.front().inputs.size(), angles = samples.front().angles.size();
  std::vector<double> matrix(columns * columns), right(angles * columns);
  for (const Sample& sample : samples) {
    if (sample.rig == left_out) continue;
    const std::vector<double>& x = sample.inputs;
    for (std::size_t i = 0; i < columns; ++i) {
      for (std::size_t k = 0; k <= i; ++k) matrix[i * columns + k] += x[i] * x[k];
      for (std::size_t a = 0; a < angles; ++a) right[a * columns + i] += x[i] * sample.angles[a];
    }
  }
  for (std::size_t i = 0; i < columns; ++i) matrix[i * columns + i] += i + 1 < columns ? ridge : 1e-6;
  const npt::DenseCholesky factor(columns, std::move(matrix));
  for (std::size_t a = 0; a < angles; ++a) {
    const std::span<double> row = std::span(right).subspan(a * columns, columns);
    factor.solve_lower(row);
    factor.solve_upper(row);
  }
  return right;
}

/// Root mean square of the angles beside what the other rigs say, in radians.
double error_of(const std::vector<Sample>& samples, double ridge) {
  double sum = 0, count = 0;
  for (std::size_t rig = 0; rig <= samples.back().rig; ++rig) {
    const std::vector<double> weights = solve(samples, ridge, rig);
    for (const Sample& s : samples) {
      if (s.rig != rig) continue;
      for (std::size_t a = 0; a < s.angles.size(); ++a) {
        const std::span<const double> row = std::span(weights).subspan(a * s.inputs.size(), s.inputs.size());
        sum += std::pow(std::inner_product(row.begin(), row.end(), s.inputs.begin(), -s.angles[a]), 2), ++count;
      }
    }
  }
  return std::sqrt(sum / count);
}

void run(const std::filesystem::path& weights, const std::filesystem::path& result,
         const std::vector<std::string>& rigs, std::size_t frames, const std::vector<std::string>& held_out) {
  const npt::SafetensorsFile file = npt::SafetensorsFile::read(weights);
  const std::shared_ptr<const npt::BodyKind> kind = npt::load_body_kind(file);
  if (!kind) throw npt::Error({.file = weights.string(), .found = "no template", .expected = "a kind with a plan"});
  const npt::BodyEstimator estimator(
      npt::CorrespondenceEstimator(npt::correspondence_part(file), npt::DefaultExecutor()), kind);
  std::vector<Sample> samples;
  for (const std::string& rig : rigs) add_rig(rig, frames, held_out, estimator, samples);
  if (samples.empty() || samples.back().rig < 3)
    throw npt::Error({"rigs", {}, "fewer than four that are estimated", "four and more"});
  double least = std::numeric_limits<double>::infinity(), best = 0;
  for (const double ridge : {1e9, 300.0, 100.0, 30.0, 10.0, 3.0, 1.0}) {  // the first: their mean
    const double rms = error_of(samples, ridge);
    std::printf("ridge %-8g left out: %.3f radians\n", ridge, rms);
    least = std::min(least, rms);
    if (rms < 1.03 * least) best = ridge;
  }
  const std::vector<double> learned = solve(samples, best, rigs.size());
  const std::vector<float> values(learned.begin(), learned.end());
  const std::size_t columns = samples.front().inputs.size();
  const npt::FileTensor tensor{.name = "posture/joints",
                               .dtype = npt::Dtype::f32,
                               .shape = {learned.size() / columns, columns},
                               .bytes = std::as_bytes(std::span(values))};
  std::vector<npt::FileTensor> tensors;
  for (const npt::FileTensor& other : file.tensors())
    if (other.name != tensor.name) tensors.push_back(other);
  tensors.push_back(tensor);
  npt::write_safetensors(result, tensors, file.metadata());
}

}  // namespace

int main(int count, char** values) try {
  std::filesystem::path weights, result;
  std::vector<std::string> rigs, held_out;
  std::size_t frames = 12;
  CLI::App app("Learns how bodies of a kind stand at rest, by their shape");
  app.add_option("WEIGHTS", weights, "With a template and its correspondence network (.safetensors)")->required();
  app.add_option("RESULT", result, "The same with posture/joints (.safetensors)")->required();
  app.add_option("RIG", rigs, "Rigged bodies of the kind, whose scenes stand at rest")->required();
  app.add_option("--held-out", held_out, "Leave out clips whose names end so (repeated)");
  app.add_option("--frames", frames, "Of each rig's clips")->capture_default_str();
  CLI11_PARSE(app, count, values);
  run(weights, result, rigs, frames, held_out);
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "npt_fit_posture: error: %s\n", error.what());
  return 1;
}
