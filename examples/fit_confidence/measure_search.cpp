// Whether the energy or the search is to blame for wrong estimates: beside each answer a fit from true correspondences.
//
//   npt_measure_search --rig knight.glb=chibi --rig orc.glb=monsters examples/weights/human.safetensors table.csv
//
// Each rig is brought to the mannequin's joints, as for training (training/rigged_body.hpp), and measured at rest and
// in frames of its clips, in any direction about the vertical axis. The truth's correspondences take the place of the
// network's, and from then on all is the same: fit, residuals, energy. Where the fit from the truth is right and the
// answer is wrong, the search missed it if its energy is the lesser one, else the energy prefers what is wrong.
// Columns   name, family; of the answer error, energy and its residuals; the same of the fit from the truth, truth_...
//           Errors as npt_measure_estimates has them
// Printed   how many are of each kind, all meshes alike, and the share by families
#include <formats/read.hpp>
#include <progress.hpp>
#include <training/rigged_body.hpp>

#include <npt/base/default_executor.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/people_kind.hpp>
#include <npt/body/people_plan.hpp>
#include <npt/estimate/body_estimator.hpp>
#include <npt/estimate/correspondence_estimator.hpp>
#include <npt/estimate/correspondence_fit.hpp>
#include <npt/estimate/correspondence_views.hpp>
#include <npt/estimate/estimate_search.hpp>
#include <npt/estimate/limb_search.hpp>
#include <npt/io/file.hpp>
#include <npt/io/safetensors.hpp>
#include <npt/lab/rig/rig.hpp>
#include <npt/mesh/closest_point.hpp>
#include <npt/mesh/points.hpp>

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "measured_case.hpp"

namespace {

struct Arguments {
  std::filesystem::path weights, table;
  std::vector<std::string> rigs;
  std::size_t frames = 4;  // of each rig's clips
  std::uint64_t seed = 1;
  int threads = 0;
};

/// A rig in a pose, and where each of its vertices belongs on the resting template.
struct PosedRig {
  std::string name, family;
  std::shared_ptr<const npt::RiggedBody> rig;
  std::vector<float> pose;

  measured::Case mesh() const {
    measured::Case made = measured::posed_body(*rig->body, npt::people_plan(), {}, pose);
    made.name = name, made.family = family;
    return made;
  }
};

/// A fit; without one its error is 1.
struct Fitted {
  bool is = false;
  double error = 1;
  npt::EstimateResiduals residuals{};

  bool is_right() const { return error < 0.05; }  // of the height, as for the confidence
};

struct Outcome {
  Fitted answer, truth;

  bool truth_has_less() const {
    return truth.is && (!answer.is || truth.residuals.energy() < answer.residuals.energy());
  }
  const char* kind() const {
    if (answer.is_right()) return truth_has_less() ? "right, though the truth has less" : "right, of least energy";
    if (!truth.is_right()) return "wrong, as is the fit from the truth";
    return truth_has_less() ? "wrong: the search missed the truth" : "wrong: the energy prefers it";
  }
};

void add_rig(const std::string& argument, const Arguments& arguments, std::vector<PosedRig>& cases) {
  const auto [file, family] = measured::file_and_family(argument);
  const std::string name = std::filesystem::path(file).stem().string();
  std::shared_ptr<const npt::RiggedBody> rig;
  try {
    rig = std::make_shared<const npt::RiggedBody>(
        npt::rigged_body(npt::make_rig(formats::read_scene(file), file), {.longest_edge = 0.04, .frame_rate = 15}));
  } catch (const npt::Error& error) {  // its joints' places aren't known
    std::fprintf(stderr, "npt_measure_search: note: left out: %s\n", error.what());
    return;
  }
  const auto moments =
      measured::moments_of(rig->clips, npt::people_plan().joint_count(), arguments.frames, arguments.seed);
  for (const measured::Moment& moment : moments) {
    const bool rests = &moment == &moments.front();
    const std::string at = rests ? "" : " " + std::to_string(moment.clip) + " " + std::to_string(moment.frame);
    cases.push_back({name + at, family, rig, moment.pose});
  }
}

/// Of samples of a surface in the body's coordinates, by the nearest corner of the triangle that each lies on.
npt::Correspondences true_correspondences(const PosedRig& of, std::span<const npt::SampledSurface::Sample> samples,
                                          std::span<const npt::Vec3d> points) {
  constexpr double spread = 0.01;  // in metres: the least that readings have
  const npt::BoxTree<3> surface(points, of.rig->body->triangles());
  npt::Correspondences seen;
  for (const auto& sample : samples) {
    const npt::ClosestPoint at = surface.closest(sample.point);
    const auto corner = static_cast<std::size_t>(std::ranges::max_element(at.weights) - at.weights.begin());
    const std::size_t v = of.rig->body->triangles()[at.triangle][corner];
    seen.push_back({sample.point, sample.normal, npt::point_at(of.rig->canonical, v), spread});
  }
  return seen;
}

class SearchMeasurement {
 public:
  explicit SearchMeasurement(const npt::SafetensorsFile& file)
      : executor_(1),
        reader_(npt::correspondence_part(file), executor_),
        estimator_(npt::CorrespondenceEstimator(npt::correspondence_part(file), executor_), npt::people_kind()),
        fitter_(npt::people_kind(), npt::BodyEstimatorOptions().candidates),
        limbs_(npt::people_kind()) {}

  Outcome operator()(const PosedRig& of) const {
    const measured::Case made = of.mesh();
    const npt::MeshView mesh{made.xyz, made.triangles, made.name};
    const npt::BodyEstimate answer = estimator_.read(mesh);
    Outcome outcome{.answer = fitted(made, answer), .truth = {}};
    npt::BodyEstimate nothing = answer;
    nothing.fit = {};
    nothing.fit.part_distances.resize(npt::people_plan().joint_count());
    nothing.figure.clear();
    const auto all = nothing.surface->samples();
    const auto samples = all.first(std::min(npt::BodyEstimatorOptions().read_points, all.size()));
    const npt::CorrespondenceViews<npt::DefaultExecutor> views(reader_, fitter_.correspondence_template(), {});
    const std::vector<npt::Vec3d> points = nothing.points_of(mesh);
    const npt::BodyView truth(fitter_.correspondence_template(), true_correspondences(of, samples, points));
    npt::EstimateSearch<npt::DefaultExecutor> search(views, fitter_, limbs_, executor_, mesh, samples, nothing);
    search.propose(std::span(&truth, 1));
    search.repair_swaps();
    outcome.truth = fitted(made, search.best());
    return outcome;
  }

 private:
  Fitted fitted(const measured::Case& made, const npt::BodyEstimate& estimate) const {
    if (estimate.fit.body.axis_angles.empty()) return {};
    return {true, measured::mean(measured::joint_errors(made, estimator_.body(), estimate)), estimate.residuals};
  }

  npt::DefaultExecutor executor_;
  npt::CorrespondenceEstimator reader_;
  npt::BodyEstimator estimator_;
  npt::CorrespondenceFitter fitter_;
  npt::LimbSearch limbs_;
};

std::string table_of(const std::vector<PosedRig>& cases, const std::vector<Outcome>& outcomes) {
  std::string table = "name,family";
  for (const char* of : {"", "truth_"})
    for (const char* what : {"error", "energy", "correspondences", "surface", "pose", "shape", "torn"})
      table += std::string(",") + of + what;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    table += "\n" + cases[i].name + "," + cases[i].family;
    for (const Fitted& f : {outcomes[i].answer, outcomes[i].truth}) {
      const npt::EstimateResiduals& r = f.residuals;
      for (const double x : {f.error, f.is ? r.energy() : 0, r.correspondences, r.surface, r.pose, r.shape, r.torn}) {
        char number[32];
        std::snprintf(number, sizeof number, ",%.6g", x);
        table += number;
      }
    }
  }
  return table + "\n";
}

void print_summary(const std::vector<PosedRig>& cases, const std::vector<Outcome>& outcomes) {
  std::map<std::string, std::map<std::string, double>> shares;  // of a kind, in each family
  std::map<std::string, double> counts, sizes;
  for (const PosedRig& c : cases) ++sizes[c.family];
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const char* kind = outcomes[i].kind();
    ++counts[kind];
    shares[kind][cases[i].family] += 1 / sizes[cases[i].family];
  }
  for (const auto& [kind, count] : counts) {
    double share = 0;
    for (const auto& [family, own] : shares[kind]) share += own / static_cast<double>(sizes.size());
    std::printf("%-36s %4.0f of %zu meshes, %.3f by families\n", kind.c_str(), count, cases.size(), share);
  }
}

void run(const Arguments& arguments) {
  std::vector<PosedRig> cases;
  for (const std::string& rig : arguments.rigs) add_rig(rig, arguments, cases);
  if (cases.empty()) throw npt::Error({.file = "--rig", .found = "no rig to measure", .expected = "at least one"});
  const SearchMeasurement measurement(npt::SafetensorsFile::read(arguments.weights));
  std::vector<Outcome> outcomes(cases.size());
  program::Progress progress("meshes", cases.size());
  std::mutex mutex;
  npt::DefaultExecutor(arguments.threads).for_each(static_cast<int>(cases.size()), [&](int i, int) {
    outcomes[static_cast<std::size_t>(i)] = measurement(cases[static_cast<std::size_t>(i)]);
    const std::lock_guard lock(mutex);
    progress.advance();
  });
  npt::write_file(arguments.table, table_of(cases, outcomes));
  print_summary(cases, outcomes);
}

}  // namespace

int main(int count, char** values) try {
  Arguments arguments;
  CLI::App app("Measures whether the energy or the search is to blame for wrong estimates");
  app.add_option("WEIGHTS", arguments.weights, "Weights with a correspondence network (.safetensors)")->required();
  app.add_option("TABLE", arguments.table, "A row for each mesh (.csv)")->required();
  app.add_option("--rig", arguments.rigs, "Rigged person, FILE=FAMILY (repeated)")->required();
  app.add_option("--frames", arguments.frames, "Of each rig's clips")->capture_default_str();
  app.add_option("--seed", arguments.seed, "Of frames and directions")->capture_default_str();
  app.add_option("--threads", arguments.threads, "0: all")->capture_default_str();
  CLI11_PARSE(app, count, values);
  run(arguments);
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "npt_measure_search: error: %s\n", error.what());
  return 1;
}
