// Gathers natural poses of four-legged animals from the clips of rigged ones, as a plan's joint angles: tensors
// pose_prior/mean, pose_prior/covariance and pose_prior/poses (training/gathered_poses.hpp). Prints how well the bodies
// that are made of the rigs follow these in their own clips.
//
//   npt_pose_data --body quadruped.safetensors --leave-out Zebra --leave-out Death --out poses.safetensors *.glb
//
// Without --plan the plan is the one in the body's metadata.
#include <npt/body/body_file.hpp>
#include <npt/body/body_plan.hpp>
#include <npt/io/file.hpp>
#include <npt/lab/rig/rig.hpp>

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <formats/read.hpp>
#include <string>
#include <training/gathered_poses.hpp>
#include <training/rig_agreement.hpp>
#include <training/rigged_quadruped.hpp>
#include <vector>

namespace {

struct Arguments {
  std::filesystem::path body, plan, out;
  std::vector<std::string> rigs, left_out;
  std::size_t most = 1500;
  double frame_rate = 15;
};

npt::BodyPlan plan_of(const Arguments& a, const npt::BodyModel& body) {
  if (!a.plan.empty()) return npt::read_body_plan(npt::read_file(a.plan), a.plan.string());
  const auto& metadata = body.tables().metadata;
  const auto text = metadata.find("plan");
  if (text == metadata.end()) throw npt::Error({a.body.string(), "metadata", "no 'plan'", "a plan, or --plan FILE"});
  return npt::read_body_plan(text->second, a.body.string());
}

bool is_left_out(const Arguments& a, const std::string& name) {
  return std::ranges::any_of(a.left_out, [&](const std::string& word) { return name.find(word) != std::string::npos; });
}

/// The frames of a rig's clips; prints a line of the table, or why the rig is none.
std::vector<npt::PlanPose> frames_of(const Arguments& a, const std::string& file, const npt::BodyModel& body,
                                     const npt::BodyPlan& plan) {
  std::vector<npt::PlanPose> frames;
  try {
    const npt::Rig rig = npt::make_rig(formats::read_scene(file), file);
    const npt::PlannedBody made = npt::rigged_quadruped(rig, body, plan, {.frame_rate = a.frame_rate});
    const npt::RigAgreement agreement = npt::rig_agreement(rig, made, a.frame_rate);
    std::printf("%-28s %5zu joints %4zu frames  mean %5.2f %%  worst %5.2f %%\n",
                std::filesystem::path(file).stem().string().c_str(), rig.joint_count(), agreement.frames,
                100 * agreement.mean, 100 * agreement.worst);
    for (std::size_t c = 0; c < made.clips.size(); ++c)
      if (!is_left_out(a, made.clip_names[c])) frames.insert(frames.end(), made.clips[c].begin(), made.clips[c].end());
  } catch (const npt::Error& error) {
    std::printf("refused: %s\n", error.what());
  }
  return frames;
}

int gather(const Arguments& a) {
  const npt::BodyModel body = npt::load_body(a.body);
  const npt::BodyPlan plan = plan_of(a, body);
  std::vector<npt::PlanPose> frames;
  for (const std::string& file : a.rigs) {
    if (is_left_out(a, std::filesystem::path(file).stem().string())) continue;
    const std::vector<npt::PlanPose> own = frames_of(a, file, body, plan);
    frames.insert(frames.end(), own.begin(), own.end());
  }
  const std::vector<npt::PlanPose> distinct = npt::distinct_poses(frames, a.most);
  std::printf("%zu frames, %zu of them distinct\n", frames.size(), distinct.size());
  if (!a.out.empty()) npt::save_poses(plan, distinct, a.out, {{"plan", plan.name}});
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  Arguments a;
  CLI::App app{"Gather natural poses of four-legged animals from rigs"};
  app.add_option("RIG", a.rigs, "Rigged animals with clips")->required();
  app.add_option("--body", a.body, "The template, with the plan's joints")->required();
  app.add_option("--plan", a.plan, "The plan (default: the one in the body's metadata)");
  app.add_option("--leave-out", a.left_out, "Leave out clips, and files, whose names have this in them");
  app.add_option("--most", a.most, "Keep no more than this many poses (default: 1500)");
  app.add_option("--frame-rate", a.frame_rate, "Frames of clips in a second (default: 15)")->check(CLI::PositiveNumber);
  app.add_option("--out", a.out, "Write the tensors here");
  try {
    app.parse(argc, argv);
    return gather(a);
  } catch (const CLI::ParseError& error) {
    return app.exit(error);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return 1;
  }
}
