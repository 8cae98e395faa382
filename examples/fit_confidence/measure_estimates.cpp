// Measures how right estimates are, for meshes whose joints are known and for things that are no person: a row of a
// table for each. fit_confidence.py learns from it how the features of an estimate tell whether it is right.
//
//   npt_measure_estimates --rig knight.glb=chibi --rig robot.glb=robots --body mannequin=bodies
//     --thing chair.obj=furniture examples/weights/human.safetensors table.csv
//
// Each file is followed by its family: files of one artist, base mesh or kind, which count as one. A rig is measured as
// it is bound and in frames of its clips, a body in natural and in wide poses, half of them pointing anywhere, a thing
// as it is and in frames of its clips. The kind of body is the weights file's: people, or another one, whose rigs are
// measured as bodies with its plan's joints (training/rigged_quadruped.hpp), looking anywhere along the ground.
// Columns   name, family, person (1: of the kind, 0: a thing), error and worst_error: mean and largest distance of the
//           joints of limbs and where the neck begins, by the longest side of the figure as it is bound; features of
//           the estimate; confidence; seconds
// With --joints FILE, a row for each of these joints, too: its error, what the correspondences about it say against it,
// and its own confidence.
#include <formats/read.hpp>
#include <progress.hpp>
#include <training/rigged_quadruped.hpp>

#include <npt/base/as_span.hpp>
#include <npt/base/default_executor.hpp>
#include <npt/base/random.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_file.hpp>
#include <npt/body/body_kind.hpp>
#include <npt/body/body_plan.hpp>
#include <npt/body/kind_file.hpp>
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/body/people_kind.hpp>
#include <npt/body/pose_sampler.hpp>
#include <npt/estimate/body_estimator.hpp>
#include <npt/estimate/correspondence_estimator.hpp>
#include <npt/estimate/residuals.hpp>
#include <npt/io/file.hpp>
#include <npt/io/safetensors.hpp>
#include <npt/lab/rig/humanoid_joints.hpp>
#include <npt/lab/rig/rig.hpp>
#include <npt/mesh/points.hpp>
#include <npt/mesh/triangles.hpp>

#include <CLI/CLI.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "measured_case.hpp"

namespace {

struct Arguments {
  std::filesystem::path weights, table, joints;
  std::vector<std::string> rigs, bodies, things;
  std::size_t frames = 6;  // of each rig, beside its bind pose; of each body
  std::uint64_t seed = 1;
  int threads = 0;
};

using measured::Case, measured::file_and_family, measured::posed_body;
using CaseMaker = std::function<Case()>;

Case posed_rig(const npt::Rig& rig, const npt::Clip* clip, double time, const npt::HumanoidJoints* joints,
               const npt::BodyPlan& plan) {
  Case made;
  const std::vector<npt::Affine> motions = rig.motions(clip, time);
  made.xyz = rig.posed(npt::as_span(motions));
  made.triangles = rig.triangles;
  // Of the figure as it is bound, in the scene's unit.
  std::vector<float> bound;
  for (const npt::Vec3f p : rig.positions) bound.insert(bound.end(), {p.x, p.y, p.z});
  const double grown = std::cbrt(std::abs(motions.front().linear.determinant()));
  made.height = grown * npt::bounding_box(bound).longest_side();
  if (joints == nullptr) return made;
  made.joints.resize(plan.joint_count());
  for (const std::size_t j : measured::joints_of(plan))
    if (const std::size_t own = (*joints)[j]; own != npt::no_item) made.joints[j] = motions[own](rig.joint_place(own));
  return made;
}

/// A rig of a kind that has a plan of its own: as it is bound, and in frames of its clips.
void add_planned_rig(const std::string& argument, const npt::BodyKind& kind, const Arguments& arguments,
                     std::vector<CaseMaker>& cases) {
  const auto [file, family] = file_and_family(argument);
  const std::string name = std::filesystem::path(file).stem().string();
  const auto made = std::make_shared<const npt::PlannedBody>(
      npt::rigged_quadruped(npt::make_rig(formats::read_scene(file), file), *kind.body, kind.plan, {.frame_rate = 15}));
  const auto moments = measured::moments_of(made->clips, kind.joint_count(), arguments.frames, arguments.seed);
  for (const measured::Moment& moment : moments) {
    const bool rests = &moment == &moments.front();
    const std::string clip = rests ? "" : " " + made->clip_names[moment.clip] + " " + std::to_string(moment.frame);
    cases.emplace_back([=, &kind, family = family, pose = moment.pose] {
      Case posed = posed_body(*made->body, kind.plan, {}, pose);
      posed.name = name + clip;
      posed.family = family;
      return posed;
    });
  }
}

void add_rig(const std::string& argument, bool person, const npt::BodyKind& kind, const Arguments& arguments,
             std::vector<CaseMaker>& cases) {
  if (person && &kind != npt::people_kind().get()) return add_planned_rig(argument, kind, arguments, cases);
  const auto [file, family] = file_and_family(argument);
  const std::string name = std::filesystem::path(file).stem().string();
  const auto rig = std::make_shared<const npt::Rig>(npt::make_rig(formats::read_scene(file), file));
  std::shared_ptr<const npt::HumanoidJoints> joints;
  if (person) joints = std::make_shared<const npt::HumanoidJoints>(npt::humanoid_joints(*rig));
  npt::Random random(arguments.seed);
  for (std::size_t f = 0; f <= arguments.frames; ++f) {
    const auto& clips = rig->scene.clips;
    if (f > 0 && clips.empty()) return;
    const npt::Clip* clip = f == 0 ? nullptr : &clips[random.below(static_cast<std::uint32_t>(clips.size()))];
    const double time = clip == nullptr ? 0 : random.uniform() * clip->length();
    cases.emplace_back([=, &kind, family = family] {
      Case made = posed_rig(*rig, clip, time, joints.get(), kind.plan);
      made.name = name + (clip == nullptr ? "" : " " + clip->name + " " + std::to_string(time));
      made.family = family;
      made.person = person;
      return made;
    });
  }
}

/// Poses as often beyond what is natural as not; half of them point anywhere.
void add_body(const std::string& argument, const npt::BodyKind& kind, const Arguments& arguments,
              std::vector<CaseMaker>& cases) {
  const auto [file, family] = file_and_family(argument);
  const std::shared_ptr<const npt::BodyModel> body = file == "mannequin"
                                                         ? npt::borrowed(npt::mannequin())
                                                         : std::make_shared<const npt::BodyModel>(npt::load_body(file));
  npt::Random random(arguments.seed);
  for (std::size_t f = 0; f < arguments.frames; ++f) {
    const auto shape = npt::sample_shape(random, body->shape_count());
    auto pose = npt::sample_pose(random, f % 2 == 1 ? npt::PoseDistribution::wide : npt::PoseDistribution::natural);
    if (f % 4 >= 2)  // pointing anywhere
      for (std::size_t i = 0; i < 3; ++i) pose[i] = static_cast<float>(random.uniform(-2, 2));
    cases.emplace_back(
        [=, &kind, name = std::filesystem::path(file).stem().string() + " " + std::to_string(f), family = family] {
          Case made = posed_body(*body, kind.plan, shape, pose);
          made.name = name, made.family = family;
          return made;
        });
  }
}

void add_thing(const std::string& argument, const npt::BodyKind& kind, const Arguments& arguments,
               std::vector<CaseMaker>& cases) {
  const auto [file, family] = file_and_family(argument);
  if (formats::is_scene(file)) try {
      return add_rig(argument, false, kind, arguments, cases);
    } catch (const npt::Error&) {  // no rig
    }
  cases.emplace_back([file = file, family = family] {
    const npt::Mesh mesh = formats::read_mesh(file);
    Case made{.name = std::filesystem::path(file).stem().string(), .family = family, .person = false};
    made.xyz.assign(mesh.coordinates().begin(), mesh.coordinates().end());
    made.triangles = npt::triangulate(mesh);
    return made;
  });
}

/// A row of the table, and those of its joints.
std::pair<std::string, std::string> rows_of(const Case& of, const npt::BodyEstimator& estimator) {
  std::string name = of.name;
  std::ranges::replace(name, ',', ';');
  const std::string begin = name + "," + of.family;
  const auto add = [](std::string& row, double x) {
    char text[32];
    std::snprintf(text, sizeof text, ",%.6g", x);
    row += text;
  };
  const auto start = std::chrono::steady_clock::now();
  const npt::BodyEstimate estimate = estimator.read({of.xyz, of.triangles, of.name});
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  const bool has_body = !estimate.fit.body.axis_angles.empty();
  double error = 1, worst = 1;
  std::string joints;
  if (of.person && has_body) {
    const auto errors = measured::joint_errors(of, estimator.body(), estimate);
    error = measured::mean(errors), worst = 0;
    for (std::size_t j = 0; j < errors.size(); ++j)
      if (errors[j]) {
        worst = std::max(worst, *errors[j]);
        joints += begin + "," + std::to_string(j);
        add(joints, *errors[j]);
        for (const double feature : estimate.residuals.joint_features(j)) add(joints, feature);
        add(joints, estimate.joint_confidence[j]);
        joints += '\n';
      }
  }
  std::string row = begin + (of.person ? ",1" : ",0");
  add(row, error), add(row, worst);
  for (const double feature : estimate.residuals.features()) add(row, feature);
  add(row, has_body ? 1 : 0), add(row, estimate.confidence), add(row, seconds.count());
  return {row + '\n', joints};
}

void run(const Arguments& arguments) {
  const npt::SafetensorsFile file = npt::SafetensorsFile::read(arguments.weights);
  const std::shared_ptr<const npt::BodyKind> own = npt::load_body_kind(file), kind = own ? own : npt::people_kind();
  if (own && !arguments.bodies.empty())
    throw npt::Error(
        {.file = arguments.weights.string(), .found = "a kind of its own", .expected = "people's, for --body"});
  std::vector<CaseMaker> cases;
  for (const std::string& rig : arguments.rigs) add_rig(rig, true, *kind, arguments, cases);
  for (const std::string& body : arguments.bodies) add_body(body, *kind, arguments, cases);
  for (const std::string& thing : arguments.things) add_thing(thing, *kind, arguments, cases);
  const npt::BodyEstimator estimator(
      npt::CorrespondenceEstimator(npt::correspondence_part(file), npt::DefaultExecutor(1)), kind);
  std::vector<std::pair<std::string, std::string>> rows(cases.size());
  program::Progress progress("meshes", cases.size());
  std::mutex mutex;
  npt::DefaultExecutor(arguments.threads).for_each(static_cast<int>(cases.size()), [&](int i, int) {
    rows[static_cast<std::size_t>(i)] = rows_of(cases[static_cast<std::size_t>(i)](), estimator);
    const std::lock_guard lock(mutex);
    progress.advance();
  });
  std::string table = "name,family,person,error,worst_error";
  for (const char* name : npt::EstimateResiduals::names) table += std::string(",") + name;
  table += ",has_body,confidence,seconds\n";
  std::string joints = "name,family,joint,error,correspondences,surface,confidence\n";
  for (const auto& [row, of_joints] : rows) table += row, joints += of_joints;
  npt::write_file(arguments.table, table);
  if (!arguments.joints.empty()) npt::write_file(arguments.joints, joints);
}

}  // namespace

int main(int count, char** values) try {
  Arguments arguments;
  CLI::App app("Measures how right estimates are, for fit_confidence.py");
  app.add_option("WEIGHTS", arguments.weights, "Weights with a correspondence network (.safetensors)")->required();
  app.add_option("TABLE", arguments.table, "A row for each mesh (.csv)")->required();
  app.add_option("--rig", arguments.rigs, "Rigged one of the kind, FILE=FAMILY (repeated)");
  app.add_option("--body", arguments.bodies, "Body model in SMPL's layout or mannequin, FILE=FAMILY (repeated)");
  app.add_option("--thing", arguments.things, "What is none of the kind: a mesh or a rig, FILE=FAMILY (repeated)");
  app.add_option("--joints", arguments.joints, "A row for each joint, too (.csv)");
  app.add_option("--frames", arguments.frames, "Of each rig and body")->capture_default_str();
  app.add_option("--seed", arguments.seed, "Of frames, poses and shapes")->capture_default_str();
  app.add_option("--threads", arguments.threads, "0: all")->capture_default_str();
  CLI11_PARSE(app, count, values);
  run(arguments);
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "npt_measure_estimates: error: %s\n", error.what());
  return 1;
}
