// Learns how bodies of a kind stand at rest, from rigged ones: tensors under posture/. See npt/estimate/posture.hpp.
//
//   npt_fit_posture quadruped.safetensors result.safetensors horse.glb fox.glb cat.fbx ...
//
// A rig's angles at rest are those that are estimated as its scene stands, both sides as one; its shape is the mean of
// those that are estimated in frames of its clips, which differ a little; what they do there beyond the rest is motion.
// The covariance of rests is that of the rigs about their mean, half of what is off its diagonal left out (a dozen rigs
// tell little of 105 angles together), times a factor: the rigs that there are were no draw from all animals. Printed
// is how far rests are off that are told without a rig's own, and with it, for several factors and odds of another
// animal; those are taken whose sum of squares is least.
#include <formats/read.hpp>

#include <npt/base/affine.hpp>
#include <npt/base/as_span.hpp>
#include <npt/base/default_executor.hpp>
#include <npt/base/matrix3.hpp>
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
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace {

/// A rig at rest and in frames of its clips.
struct Samples {
  std::vector<double> rest;  ///< [3 J]
  std::vector<npt::BodyEstimate> frames;
};

/// Of both sides.
std::vector<double> angles_of(const npt::BodyEstimate& estimate, const npt::BodyPlan& plan) {
  std::vector<double> angles;
  const std::vector<npt::Vec3d> own = estimate.angles_without_direction();
  for (std::size_t j = 0; j < own.size(); ++j) {
    const npt::Vec3d even = (own[j] + npt::mirrored(own[plan.joints[j].mirrored])) / 2;
    angles.insert(angles.end(), {even.x, even.y, even.z});
  }
  return angles;
}

/// Empty where the rig isn't recognised at rest.
Samples samples_of(const std::string& file, std::size_t frames, const std::vector<std::string>& held_out,
                   const npt::BodyEstimator& estimator) {
  const npt::Rig rig = npt::make_rig(formats::read_scene(file), file);
  std::vector<const npt::Clip*> clips;
  for (const npt::Clip& clip : rig.scene.clips)
    if (std::ranges::none_of(held_out, [&](const std::string& name) { return clip.name.ends_with(name); }))
      clips.push_back(&clip);
  Samples samples;
  npt::Random random(1);
  for (std::size_t f = 0; f <= (clips.empty() ? 0 : frames); ++f) {
    const npt::Clip* clip = f == 0 ? nullptr : clips[random.below(static_cast<std::uint32_t>(clips.size()))];
    const std::vector<npt::Affine> motions = rig.motions(clip, clip == nullptr ? 0 : random.uniform() * clip->length());
    const std::vector<float> xyz = rig.posed(npt::as_span(motions));
    npt::BodyEstimate estimate = estimator.read({xyz, npt::as_span(rig.triangles), file});
    if (estimate.confidence < npt::least_confidence) continue;
    if (f == 0) samples.rest = angles_of(estimate, estimator.kind().plan);
    samples.frames.push_back(std::move(estimate));
  }
  std::printf("%-28s %zu frames%s\n", std::filesystem::path(file).stem().string().c_str(), samples.frames.size(),
              samples.rest.empty() ? ", not recognised at rest: left out" : "");
  return samples;
}

/// [J] From one posture to another, each joint in its own axes.
std::vector<npt::Vec3d> beyond(std::span<const double> rest, std::span<const npt::Vec3d> angles) {
  std::vector<npt::Vec3d> result;
  for (std::size_t j = 0; j < angles.size(); ++j) {
    const npt::Vec3d from{rest[3 * j], rest[3 * j + 1], rest[3 * j + 2]};
    result.push_back(npt::axis_angle(npt::rotation_matrix(from).transposed() * npt::rotation_matrix(angles[j])));
  }
  return result;
}

/// Adds x x^T, and the same of its mirror image.
void add_square(std::span<const npt::Vec3d> x, const npt::BodyPlan& plan, double weight, std::span<double> sum) {
  const std::size_t n = 3 * x.size();
  std::vector<double> own, other;
  for (std::size_t j = 0; j < x.size(); ++j) {
    const npt::Vec3d m = npt::mirrored(x[plan.joints[j].mirrored]);
    own.insert(own.end(), {x[j].x, x[j].y, x[j].z});
    other.insert(other.end(), {m.x, m.y, m.z});
  }
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t k = 0; k < n; ++k) sum[i * n + k] += weight / 2 * (own[i] * own[k] + other[i] * other[k]);
}

/// Leaves out a share of what is off the diagonal.
void shrink(std::span<double> covariance, double share) {
  const auto n = static_cast<std::size_t>(std::sqrt(static_cast<double>(covariance.size())));
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t k = 0; k < n; ++k) covariance[i * n + k] *= i == k ? 1 : 1 - share;
  // Square radians: joints that no clip moves are known to 0.01.
  for (std::size_t i = 0; i < n; ++i) covariance[i * n + i] += 1e-4;
}

struct Choice {
  double factor = 1, other_odds = 0;
};

npt::PostureModel learn(const std::vector<Samples>& rigs, std::size_t left_out, const npt::BodyKind& kind,
                        Choice choice) {
  const std::size_t n = 3 * kind.joint_count(), shapes = kind.body->shape_count();
  npt::PostureModel model;
  model.other_odds = choice.other_odds;
  model.shape_variances.assign(shapes, 1e-3);
  model.rest_covariance.assign(n * n, 0), model.motion_covariance.assign(n * n, 0);
  const auto count = static_cast<double>(rigs.size() - (left_out < rigs.size() ? 1 : 0));
  std::vector<double> mean(n);
  for (std::size_t r = 0; r < rigs.size(); ++r)
    for (std::size_t i = 0; r != left_out && i < n; ++i) mean[i] += rigs[r].rest[i] / count;
  for (std::size_t r = 0; r < rigs.size(); ++r) {
    if (r == left_out) continue;
    const auto frames = static_cast<double>(rigs[r].frames.size());
    std::vector<double> shape(shapes);
    for (const npt::BodyEstimate& frame : rigs[r].frames)
      for (std::size_t b = 0; b < shapes; ++b) shape[b] += static_cast<double>(frame.fit.body.betas[b]) / frames;
    for (const npt::BodyEstimate& frame : rigs[r].frames) {
      for (std::size_t b = 0; b < shapes; ++b)
        model.shape_variances[b] +=
            std::pow(static_cast<double>(frame.fit.body.betas[b]) - shape[b], 2) / frames / count;
      add_square(beyond(rigs[r].rest, frame.angles_without_direction()), kind.plan, 1 / frames / count,
                 model.motion_covariance);
    }
    std::vector<npt::Vec3d> rest;
    for (std::size_t i = 0; i < n; i += 3) rest.push_back({rigs[r].rest[i], rigs[r].rest[i + 1], rigs[r].rest[i + 2]});
    add_square(beyond(mean, rest), kind.plan, choice.factor / (count - 1), model.rest_covariance);
    model.shapes.insert(model.shapes.end(), shape.begin(), shape.end());
    model.angles.insert(model.angles.end(), rigs[r].rest.begin(), rigs[r].rest.end());
  }
  shrink(model.rest_covariance, 0.5), shrink(model.motion_covariance, 0.1);
  return model;
}

/// Root mean square of what rests are off, in radians a joint, all rigs alike.
double error_of(const std::vector<Samples>& rigs, const npt::BodyKind& kind, Choice choice, bool known) {
  double sum = 0;
  for (std::size_t r = 0; r < rigs.size(); ++r) {
    const npt::Posture posture(learn(rigs, known ? rigs.size() : r, kind, choice), kind);
    double square = 0, count = 0;
    for (const npt::BodyEstimate& frame : rigs[r].frames)
      for (const npt::Vec3d off : beyond(rigs[r].rest, posture.rest(frame, true)))
        square += npt::dot(off, off), ++count;
    sum += std::sqrt(square / count);
  }
  return sum / static_cast<double>(rigs.size());
}

npt::FileTensor tensor_of(const char* name, const std::vector<float>& values, npt::TensorShape shape) {
  return {.name = std::string("posture/") + name,
          .dtype = npt::Dtype::f32,
          .shape = std::move(shape),
          .bytes = std::as_bytes(std::span(values))};
}

void write(const npt::SafetensorsFile& file, const npt::PostureModel& model, const std::filesystem::path& result) {
  const auto floats = [](const std::vector<double>& x) { return std::vector<float>(x.begin(), x.end()); };
  const std::uint64_t rigs = model.rig_count(), n = model.angles.size() / rigs;
  const std::vector<float> shapes = floats(model.shapes), variances = floats(model.shape_variances),
                           angles = floats(model.angles), odds{static_cast<float>(model.other_odds)},
                           rest = floats(model.rest_covariance), motion = floats(model.motion_covariance);
  std::vector<npt::FileTensor> tensors;
  for (const npt::FileTensor& other : file.tensors())
    if (!other.name.starts_with("posture/")) tensors.push_back(other);
  tensors.push_back(tensor_of("shapes", shapes, {rigs, variances.size()}));
  tensors.push_back(tensor_of("shape_variances", variances, {variances.size()}));
  tensors.push_back(tensor_of("angles", angles, {rigs, n}));
  tensors.push_back(tensor_of("other_odds", odds, {1}));
  tensors.push_back(tensor_of("rest_covariance", rest, {n, n}));
  tensors.push_back(tensor_of("motion_covariance", motion, {n, n}));
  npt::write_safetensors(result, tensors, file.metadata());
}

void run(const std::filesystem::path& weights, const std::filesystem::path& result,
         const std::vector<std::string>& rigs, std::size_t frames, const std::vector<std::string>& held_out) {
  const npt::SafetensorsFile file = npt::SafetensorsFile::read(weights);
  const std::shared_ptr<const npt::BodyKind> kind = npt::load_body_kind(file);
  if (!kind) throw npt::Error({.file = weights.string(), .found = "no template", .expected = "a kind with a plan"});
  const npt::BodyEstimator estimator(
      npt::CorrespondenceEstimator(npt::correspondence_part(file), npt::DefaultExecutor()), kind);
  std::vector<Samples> samples;
  for (const std::string& rig : rigs)
    if (Samples own = samples_of(rig, frames, held_out, estimator); !own.rest.empty())
      samples.push_back(std::move(own));
  if (samples.size() < 4) throw npt::Error({"rigs", {}, "fewer than four that are recognised", "four and more"});
  double least = std::numeric_limits<double>::infinity();
  Choice best;
  for (const double factor : {1.0, 2.0, 4.0, 8.0})
    for (const double odds : {0.0, 10.0, 20.0, 40.0, 80.0}) {
      const Choice choice{factor, odds};
      const double without = error_of(samples, *kind, choice, false), with = error_of(samples, *kind, choice, true);
      std::printf("factor %g, odds exp(%g): off by %.3f radians without the rig, by %.3f with it\n", factor, odds,
                  without, with);
      if (const double sum = std::hypot(without, with); sum < least) least = sum, best = choice;
    }
  write(file, learn(samples, samples.size(), *kind, best), result);
}

}  // namespace

int main(int count, char** values) try {
  std::filesystem::path weights, result;
  std::vector<std::string> rigs, held_out;
  std::size_t frames = 24;
  CLI::App app("Learns how bodies of a kind stand at rest");
  app.add_option("WEIGHTS", weights, "With a template and its correspondence network (.safetensors)")->required();
  app.add_option("RESULT", result, "The same with tensors under posture/ (.safetensors)")->required();
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
