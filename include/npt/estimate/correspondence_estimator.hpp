/// Reads meshes: for points of a surface, where on the resting template body each belongs (canonical coordinates).
/// A network errs between left and right, front and back, so it reads the points turned in several directions about the
/// vertical axis. Their median is one more reading, and how much they differ says how sure a point is.
///   const auto reader = npt::CorrespondenceEstimator::open("reader.safetensors");
///   std::vector<npt::Correspondences> readings = reader.read(samples);
/// Shapes    samples: [n] points with normals, drawn by area (mesh/sampled_surface.hpp), 1000 to 2000 of them; any
///           place, any unit
/// Threads   all members are const and may be called by any number of threads at a time
/// Numerics  the same bits for any number of threads
/// Errors    npt::Error for weights of another network, no points, points in one place or not finite
#pragma once

#include <npt/base/default_executor.hpp>
#include <npt/base/error.hpp>
#include <npt/base/matrix3.hpp>
#include <npt/base/sort.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/kinematics.hpp>
#include <npt/config.hpp>
#include <npt/estimate/canonical_frame.hpp>
#include <npt/estimate/confidence.hpp>
#include <npt/estimate/correspondence_fit.hpp>
#include <npt/estimate/robust_distance.hpp>
#include <npt/io/safetensors.hpp>
#include <npt/mesh/sampled_surface.hpp>
#include <npt/nets/correspondence_net.hpp>
#include <npt/nets/network_list.hpp>
#include <npt/nn/engine/core.hpp>
#include <npt/nn/engine/engine.hpp>
#include <npt/nn/engine/model.hpp>
#include <npt/nn/engine/network_call.hpp>
#include <npt/nn/graph/program.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <numbers>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// The correspondence network in a weights file that holds it beside others, under "correspondence/"; the file itself
/// where it holds no other.
NPT_INLINE SafetensorsFile correspondence_part(const SafetensorsFile& file) {
  SafetensorsFile part = file.part("correspondence/");
  return part.tensors().empty() ? file : part;
}

/// Directions about the vertical axis in which a mesh is read.
inline constexpr int usual_turns = 8;

struct CorrespondenceEstimatorOptions {
  int turns = usual_turns;
  Matrix3 upright = Matrix3::identity();  ///< turns the mesh first: for meshes whose vertical axis isn't y
};

template <class Exec = DefaultExecutor>
class BasicCorrespondenceEstimator {
 public:
  static BasicCorrespondenceEstimator open(const std::filesystem::path& weights, int threads = 0) {
    return {correspondence_part(SafetensorsFile::read(weights)), Exec(threads)};
  }
  /// Weights of any network that takes points and normals.
  BasicCorrespondenceEstimator(const SafetensorsFile& file, Exec executor)
      : engine_(open_network<CorrespondenceNetworks>(
            file, std::move(executor),
            [](const graph::Program& p) {
              return p.inputs.are({{"points", 3}, {"normals", 3}});
            },
            "a correspondence network, of points and normals")),
        confidence_(ConfidenceModel::of(file)) {}
  template <int Width>
  BasicCorrespondenceEstimator(const Model<CorrespondenceNet<Width>>& model, Exec executor)
      : engine_(Engine<CorrespondenceNet<Width>, float, Exec>(model, std::move(executor))) {}

  /// The median of all readings, and then each of them: turns + 1 readings, or one for a single turn.
  std::vector<Correspondences> read(std::span<const SampledSurface::Sample> samples,
                                    const CorrespondenceEstimatorOptions& options = {}) const {
    const std::vector<std::vector<Vec3f>> places = places_of(samples, options);
    std::vector<Correspondences> readings;
    if (places.size() > 1) readings.push_back(median_of(samples, places));
    for (const std::vector<Vec3f>& own : places) {
      Correspondences& reading = readings.emplace_back();
      for (std::size_t i = 0; i < samples.size(); ++i) {
        const double spread = places.size() > 1 ? readings.front()[i].spread : usual_error;
        reading.push_back({samples[i].point, samples[i].normal, own[i].as<double>(), spread});
      }
    }
    return readings;
  }

  const engine::Core<float, Exec>& engine() const noexcept { return engine_; }
  /// What tells from an estimate that was made by these weights whether it is right.
  const ConfidenceModel& confidence() const noexcept { return confidence_; }

 private:
  /// [turns][n] in metres.
  std::vector<std::vector<Vec3f>> places_of(std::span<const SampledSurface::Sample> samples,
                                            const CorrespondenceEstimatorOptions& options) const {
    if (samples.empty()) throw Error({.file = "reading", .found = "no points", .expected = "points of a surface"});
    if (options.turns < 1)
      throw Error({.file = "turns", .found = std::to_string(options.turns), .expected = "at least 1"});
    const NormalisingTransform frame =
        canonical_frame(samples.size(), [samples](std::size_t i) { return samples[i].point; });
    if (!std::isfinite(frame.scale))
      throw Error(
          {.file = "reading", .found = "points in one place, or not finite", .expected = "points of a surface"});
    // The sum is three times the volume of a closed surface, negative where its faces are turned inwards.
    double volume = 0;
    for (const auto& s : samples) volume += dot(frame.apply(s.point), s.normal);
    const double outward = volume < 0 ? -1 : 1;
    const auto turns = static_cast<std::size_t>(options.turns);
    std::vector<std::vector<float>> points(turns), normals(turns), results(turns);
    std::vector<NetworkCall<float>> calls;
    for (std::size_t t = 0; t < turns; ++t) {
      const double angle = 2 * std::numbers::pi * static_cast<double>(t) / static_cast<double>(turns);
      const Matrix3 turn = rotation_matrix({0, angle, 0}) * options.upright;
      for (const auto& s : samples) {
        const Vec3f p = (turn * frame.apply(s.point)).template as<float>();
        const Vec3f q = (turn * s.normal * outward).template as<float>();
        points[t].insert(points[t].end(), {p.x, p.y, p.z});
        normals[t].insert(normals[t].end(), {q.x, q.y, q.z});
      }
      results[t].resize(points[t].size());
      calls.push_back({.inputs = {as_span(points[t]), as_span(normals[t])}, .result = as_span(results[t])});
    }
    engine_.run(calls);
    std::vector<std::vector<Vec3f>> places(turns);
    for (std::size_t t = 0; t < turns; ++t)
      for (std::size_t i = 0; i < results[t].size(); i += 3)
        places[t].push_back(Vec3f{results[t][i], results[t][i + 1], results[t][i + 2]} * 2.0F);
    return places;
  }

  /// For each point the reading with the least sum of distances from the others, and half the median distance from it
  /// (at least 1 cm) for its spread.
  static Correspondences median_of(std::span<const SampledSurface::Sample> samples,
                                   const std::vector<std::vector<Vec3f>>& places) {
    Correspondences reading;
    std::vector<float> distances;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      std::size_t best = 0;
      float least = 0;
      for (std::size_t a = 0; a < places.size(); ++a) {
        float sum = 0;
        for (const auto& other : places) sum += length(places[a][i] - other[i]);
        if (a == 0 || sum < least) best = a, least = sum;
      }
      distances.clear();
      for (const auto& other : places) distances.push_back(length(places[best][i] - other[i]));
      const double spread = std::max(usual_error / 5, static_cast<double>(median(std::span(distances))));
      reading.push_back({samples[i].point, samples[i].normal, places[best][i].as<double>(), spread});
    }
    return reading;
  }

  engine::Core<float, Exec> engine_;
  ConfidenceModel confidence_{};
};

using CorrespondenceEstimator = BasicCorrespondenceEstimator<>;

}  // namespace npt::inline NPT_ABI
