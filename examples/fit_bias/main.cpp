// Learns what fits of other people's bodies are off by, from body models whose joints are known, and puts it into a
// reader's file, beside its weights: tensor fit_bias/joints. See npt/estimate/angle_correction.hpp.
//
//   npt_fit_bias --body human_6890.safetensors --body human_13380.safetensors
//     examples/weights/human.safetensors result.safetensors
//
// Half of the poses are natural ones, three in ten the paper's, the others wide; each is fitted in two random shapes,
// and counts once more as its mirror image. Least squares, with a constant: what is the same in all poses and shapes is
// no fault of a transfer between them, but tells how people at rest are fitted. Shapes have a ridge of their own, which
// holds at 0 what these bodies hardly vary in: with that of angles, two people whom no body model made had a PMD of
// 8.6e-4 in each other's poses, with this one 5.9e-4.
#include <npt/base/sort.hpp>
#include <npt/body/body_file.hpp>
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/body/mannequin/shape.hpp>
#include <npt/body/people_kind.hpp>
#include <npt/body/pose_sampler.hpp>
#include <npt/body/proportions.hpp>
#include <npt/body/skeleton.hpp>
#include <npt/estimate/angle_correction.hpp>
#include <npt/estimate/body_estimator.hpp>
#include <npt/estimate/correspondence_estimator.hpp>
#include <npt/io/safetensors.hpp>
#include <npt/solve/dense_cholesky.hpp>

#include <CLI/CLI.hpp>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <memory>
#include <progress.hpp>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace {

constexpr std::size_t joints = npt::smpl_joint_count, rows = 3 * joints, angles = rows - 3,
                      columns = angles + npt::anatomy::mannequin_shape_count + npt::body_proportion_count;

struct Arguments {
  std::filesystem::path reader, result;
  std::vector<std::string> bodies;
  std::size_t poses = 400;  // of each body
  std::uint64_t seed = 1;
  double ridge = 5, shape_ridge = 1500;
};

/// A fit: its angles and shape, and log(R_fit^-1 R_true) of all joints.
struct Sample {
  std::array<double, columns + 1> inputs{};  // and a 1
  std::array<double, rows> off{};

  /// Left and right changed.
  Sample mirrored() const {
    constexpr auto& other = npt::smpl_mirrored_joints;
    constexpr std::array<double, 3> sign{1, -1, -1};
    Sample result;
    result.inputs = inputs;  // shapes are symmetric
    for (std::size_t j = 0; j < joints; ++j)
      for (std::size_t k = 0; k < 3; ++k) {
        if (j > 0) result.inputs[3 * j - 3 + k] = sign[k] * inputs[3 * other[j] - 3 + k];
        result.off[3 * j + k] = sign[k] * off[3 * other[j] + k];
      }
    return result;
  }
};

/// Adds a mesh's sample, unless its pose was estimated wrongly.
void add(const npt::BodyEstimator& estimator, const npt::BodyModel& body, std::span<const float> betas,
         std::span<const float> pose, std::vector<Sample>& samples) {
  constexpr double high = 0.85, wrong = 0.7;  // radians
  std::vector<float> xyz(3 * body.vertex_count());
  body.posed(betas, pose, xyz);
  const npt::BodyEstimate reading = estimator.read({.xyz = xyz, .triangles = body.triangles(), .name = "body"});
  if (reading.confidence < high) return;
  const npt::BodyFit& fit = reading.fit.body;
  const auto fitted = estimator.body().bone_motions(fit.betas, fit.axis_angles), real = body.bone_motions(betas, pose);
  Sample sample;
  std::ranges::copy(npt::AngleCorrection::inputs(fit), sample.inputs.begin());
  sample.inputs[columns] = 1;
  for (std::size_t j = 0; j < joints; ++j) {
    const npt::Vec3d off = npt::axis_angle(fitted[j].rotation.transposed() * real[j].rotation);
    if (length(off) > wrong) return;
    sample.off[3 * j] = off.x, sample.off[3 * j + 1] = off.y, sample.off[3 * j + 2] = off.z;
  }
  samples.push_back(sample);
  samples.push_back(sample.mirrored());
}

std::vector<Sample> measure(const Arguments& arguments, const npt::BodyEstimator& estimator) {
  std::vector<Sample> samples;
  program::Progress progress("poses", arguments.poses * arguments.bodies.size());
  for (const std::string& file : arguments.bodies) {
    const std::shared_ptr<const npt::BodyModel> body =
        file == "mannequin" ? npt::borrowed(npt::mannequin())
                            : std::make_shared<const npt::BodyModel>(npt::load_body(file));
    npt::Random random(arguments.seed);
    for (std::size_t i = 0; i < arguments.poses; ++i, progress.advance()) {
      const double kind = random.uniform();
      const auto pose = npt::sample_pose(random, kind < 0.3   ? npt::PoseDistribution::paper
                                                 : kind < 0.5 ? npt::PoseDistribution::wide
                                                              : npt::PoseDistribution::natural);
      for (int shape = 0; shape < 2; ++shape)
        add(estimator, *body, npt::sample_shape(random, body->shape_count()), pose, samples);
    }
  }
  return samples;
}

/// [rows][columns + 1] in least squares; samples with large residuals of a first solution count less.
std::vector<std::array<double, columns + 1>> learn(const std::vector<Sample>& samples, const Arguments& arguments) {
  std::vector<std::array<double, columns + 1>> b(rows);
  std::vector<double> weights(samples.size(), 1.0), squares(samples.size());
  for (int round = 0; round < 3; ++round) {
    constexpr std::size_t n = columns + 1;
    std::vector<double> matrix(n * n);
    for (std::size_t i = 0; i < columns; ++i) matrix[i * n + i] = i < angles ? arguments.ridge : arguments.shape_ridge;
    for (auto& row : b) row.fill(0);
    for (std::size_t s = 0; s < samples.size(); ++s)
      for (std::size_t i = 0; i < n; ++i) {
        const double factor = weights[s] * samples[s].inputs[i];
        for (std::size_t k = 0; k <= i; ++k) matrix[i * n + k] += factor * samples[s].inputs[k];
        for (std::size_t r = 0; r < rows; ++r) b[r][i] += factor * samples[s].off[r];
      }
    const npt::DenseCholesky factor(n, std::move(matrix));
    for (auto& row : b) {
      factor.solve_lower(row);
      factor.solve_upper(row);
    }
    for (std::size_t s = 0; s < samples.size(); ++s) {
      squares[s] = 0;
      for (std::size_t r = 0; r < rows; ++r) {
        double left = samples[s].off[r];
        for (std::size_t i = 0; i < n; ++i) left -= b[r][i] * samples[s].inputs[i];
        squares[s] += left * left;
      }
    }
    std::vector<double> sorted = squares;
    const double usual = 3 * npt::median(std::span(sorted));
    for (std::size_t s = 0; s < samples.size(); ++s) weights[s] = usual / (usual + squares[s]);
  }
  return b;
}

void run(const Arguments& arguments) {
  const npt::SafetensorsFile file = npt::SafetensorsFile::read(arguments.reader);
  const npt::BodyEstimator estimator(
      npt::CorrespondenceEstimator(npt::correspondence_part(file), npt::DefaultExecutor(0)), npt::people_kind());
  const std::vector<Sample> samples = measure(arguments, estimator);
  if (samples.size() < 2)
    throw npt::Error({.file = "bodies", .found = "no mesh that is recognised as a person", .expected = "at least one"});
  const auto b = learn(samples, arguments);
  std::vector<float> values;
  for (const auto& row : b)
    for (const double x : row) values.push_back(static_cast<float>(x));
  const std::string name = std::string("fit_bias/") + npt::AngleCorrection::tensor;
  std::vector<npt::FileTensor> tensors;
  for (const npt::FileTensor& tensor : file.tensors())
    if (tensor.name != name) tensors.push_back(tensor);
  tensors.push_back({.name = name,
                     .shape = npt::AngleCorrection::shape(*npt::people_kind()),
                     .bytes = std::as_bytes(std::span(values))});
  npt::write_safetensors(arguments.result, tensors, file.metadata());
  std::printf("%s: learned from %zu fits\n", arguments.result.string().c_str(), samples.size() / 2);
}

}  // namespace

int main(int count, char** values) try {
  Arguments arguments;
  CLI::App app("Learns what fits of other people's bodies are off by, and puts it into a weights file");
  app.add_option("WEIGHTS", arguments.reader, "Weights with a correspondence network (.safetensors)")->required();
  app.add_option("RESULT", arguments.result, "The same with fit_bias/joints (.safetensors)")->required();
  app.add_option("--body", arguments.bodies,
                 "Body model in SMPL's layout (.safetensors; repeated), or mannequin: for trying it out")
      ->required();
  app.add_option("--poses", arguments.poses, "Of each body")->capture_default_str()->check(CLI::Range(1, 1000000));
  app.add_option("--seed", arguments.seed, "Of poses and shapes")->capture_default_str();
  app.add_option("--ridge", arguments.ridge, "Square radians that hold each number of angles at 0")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  app.add_option("--shape-ridge", arguments.shape_ridge, "The same for those of the shape")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  CLI11_PARSE(app, count, values);
  run(arguments);
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "npt_fit_bias: error: %s\n", error.what());
  return 1;
}
