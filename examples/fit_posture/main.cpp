// Learns how bodies of a kind stand at rest, by their shape, from rigged ones as they are bound: tensor posture/joints.
// See npt/estimate/posture.hpp.
//
//   npt_fit_posture quadruped.safetensors result.safetensors horse.glb fox.glb cat.fbx ...
//
// Each rig's mesh is estimated as it is bound; both sides count as one. Ridge regression of the angles by the betas.
// Printed is how far the angles of a rig are from what the others say, for several strengths of the ridge: the best one
// is taken.
#include <formats/read.hpp>

#include <npt/base/as_span.hpp>
#include <npt/base/default_executor.hpp>
#include <npt/body/kind_file.hpp>
#include <npt/estimate/body_estimator.hpp>
#include <npt/estimate/correspondence_estimator.hpp>
#include <npt/estimate/posture.hpp>
#include <npt/io/file_tensor.hpp>
#include <npt/io/safetensors.hpp>
#include <npt/lab/rig/rig.hpp>
#include <npt/solve/dense_cholesky.hpp>

#include <CLI/CLI.hpp>

#include <cmath>
#include <cstddef>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace {

/// A rig's shape with a 1 behind it, and its angles at rest.
struct Sample {
  std::string name;
  std::vector<double> inputs, angles;
};

Sample sample_of(const std::string& file, const npt::BodyEstimator& estimator) {
  const npt::Rig rig = npt::make_rig(formats::read_scene(file), file);
  std::vector<float> xyz;
  for (const npt::Vec3f p : rig.positions) xyz.insert(xyz.end(), {p.x, p.y, p.z});
  const npt::BodyEstimate estimate = estimator.read({xyz, npt::as_span(rig.triangles), file});
  Sample sample{.name = std::filesystem::path(file).stem().string(), .inputs = {}, .angles = {}};
  std::printf("%-28s confidence %.2f\n", sample.name.c_str(), estimate.confidence);
  if (estimate.fit.body.axis_angles.empty()) return sample;
  for (const float b : estimate.fit.body.betas) sample.inputs.push_back(std::clamp(static_cast<double>(b), -3.0, 3.0));
  sample.inputs.push_back(1);
  const std::vector<npt::Vec3d> own = npt::angles_without_yaw(estimate);
  const auto& joints = estimator.kind().plan.joints;
  for (std::size_t j = 0; j < own.size(); ++j) {
    const npt::Vec3d other = own[joints[j].mirrored];
    for (const double a : {(own[j].x + other.x) / 2, (own[j].y - other.y) / 2, (own[j].z - other.z) / 2})
      sample.angles.push_back(a);
  }
  return sample;
}

/// [angles][columns] but for the sample that is left out.
std::vector<double> solve(const std::vector<Sample>& samples, double ridge, std::size_t left_out) {
  const std::size_t columns = samples.front().inputs.size(), angles = samples.front().angles.size();
  std::vector<double> matrix(columns * columns), right(angles * columns);
  for (std::size_t s = 0; s < samples.size(); ++s) {
    if (s == left_out) continue;
    const auto& x = samples[s].inputs;
    for (std::size_t i = 0; i < columns; ++i) {
      for (std::size_t k = 0; k <= i; ++k) matrix[i * columns + k] += x[i] * x[k];
      for (std::size_t a = 0; a < angles; ++a) right[a * columns + i] += x[i] * samples[s].angles[a];
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

/// Root mean square of a sample's angles beside what the others say, in radians.
double error_of(const std::vector<Sample>& samples, std::size_t s, double ridge) {
  const std::vector<double> weights = solve(samples, ridge, s);
  const std::size_t columns = samples[s].inputs.size();
  double sum = 0;
  for (std::size_t a = 0; a < samples[s].angles.size(); ++a) {
    double told = 0;
    for (std::size_t i = 0; i < columns; ++i) told += weights[a * columns + i] * samples[s].inputs[i];
    sum += std::pow(told - samples[s].angles[a], 2);
  }
  return std::sqrt(sum / static_cast<double>(samples[s].angles.size()));
}

void run(const std::filesystem::path& weights, const std::filesystem::path& result,
         const std::vector<std::string>& rigs) {
  const npt::SafetensorsFile file = npt::SafetensorsFile::read(weights);
  const std::shared_ptr<const npt::BodyKind> kind = npt::load_body_kind(file);
  if (!kind) throw npt::Error({.file = weights.string(), .found = "no template", .expected = "a kind with a plan"});
  const npt::BodyEstimator estimator(
      npt::CorrespondenceEstimator(npt::correspondence_part(file), npt::DefaultExecutor()), kind);
  std::vector<Sample> samples;
  for (const std::string& rig : rigs) {
    Sample sample = sample_of(rig, estimator);
    if (!sample.angles.empty()) samples.push_back(std::move(sample));
  }
  if (samples.size() < 4)
    throw npt::Error({"rigs", {}, std::to_string(samples.size()) + " that are estimated", "four and more"});
  double least = std::numeric_limits<double>::infinity(), best = 0;
  for (const double ridge : {3.0, 10.0, 30.0, 100.0, 300.0, 1e9}) {
    double sum = 0;
    for (std::size_t s = 0; s < samples.size(); ++s) sum += std::pow(error_of(samples, s, ridge), 2);
    const double rms = std::sqrt(sum / static_cast<double>(samples.size()));
    std::printf("ridge %-8g left out: %.3f radians\n", ridge, rms);
    if (rms < least) least = rms, best = ridge;
  }
  const std::vector<double> learned = solve(samples, best, samples.size());
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
  std::vector<std::string> rigs;
  CLI::App app("Learns how bodies of a kind stand at rest, by their shape");
  app.add_option("WEIGHTS", weights, "With a template and its correspondence network (.safetensors)")->required();
  app.add_option("RESULT", result, "The same with posture/joints (.safetensors)")->required();
  app.add_option("RIG", rigs, "Rigged bodies of the kind")->required();
  CLI11_PARSE(app, count, values);
  run(weights, result, rigs);
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "npt_fit_posture: error: %s\n", error.what());
  return 1;
}
