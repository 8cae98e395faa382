#include "motion_evaluation.hpp"

#include "report.hpp"

#include <formats/motion.hpp>
#include <formats/read.hpp>

#include <npt/base/as_span.hpp>
#include <npt/base/error.hpp>
#include <npt/body/roles/joint_roles.hpp>
#include <npt/lab/motion_evaluation.hpp>
#include <npt/scene/motion_mesh.hpp>
#include <npt/scene/motion_of_scene.hpp>
#include <npt/scene/pose.hpp>
#include <npt/transfer/retarget.hpp>

#include <algorithm>
#include <cstdio>
#include <iostream>
#include <utility>
#include <vector>

namespace program {

namespace {

struct Source {
  npt::Motion motion;
  npt::JointRoles roles;
  npt::BodyShape shape;
};

std::vector<Source> sources_in(const std::filesystem::path& file, const std::optional<std::string>& clip) {
  std::vector<Source> sources;
  if (formats::is_bvh(file)) {
    sources.push_back({formats::read_bvh_motion(file), {}, {}});
    sources.back().roles = npt::joint_roles(sources.back().motion);
    return sources;
  }
  const npt::Scene scene = formats::read_scene(file);
  if (clip) npt::find_clip(scene, *clip, file.string());
  for (const npt::Clip& own : scene.clips) {
    if (clip && own.name != *clip) continue;
    npt::Motion motion = npt::motion_of(scene, &own, file.string());
    npt::JointRoles roles = npt::joint_roles(motion);
    npt::BodyShape shape = npt::body_shape(scene, motion, roles);
    sources.push_back({std::move(motion), std::move(roles), std::move(shape)});
  }
  if (sources.empty()) throw npt::Error({.file = file.string(), .found = "no clip", .expected = "a clip to evaluate"});
  return sources;
}

void print_errors(const std::string& name, const npt::MotionErrors& errors, bool compared) {
  char joints[64] = "          -          -          -";
  if (compared)
    std::snprintf(joints, sizeof joints, "%11.2f%11.2f%11.2f", 100 * errors.joint_median, 100 * errors.joint_p95,
                  100 * errors.truth_drawn_p95);
  std::printf("%-28.28s%s%11.2f%11.2f%9.2f%10.3f%9.2f%10.1e\n", name.c_str(), joints, errors.slide, errors.source_slide,
              errors.sink, errors.penetration, errors.worst_penetration, errors.stretch);
}

Report report_of(const std::string& name, const npt::MotionErrors& errors, bool compared) {
  Report report{{"clip", name},
                {"slide_cm_s", errors.slide},
                {"source_slide_cm_s", errors.source_slide},
                {"contact_seconds", errors.contact_seconds},
                {"sink_cm", errors.sink},
                {"penetration_cm", errors.penetration},
                {"worst_penetration_cm", errors.worst_penetration},
                {"stretch", errors.stretch}};
  if (compared)
    report["joint_median"] = errors.joint_median, report["joint_p95"] = errors.joint_p95,
    report["truth_drawn_p95"] = errors.truth_drawn_p95;
  return report;
}

}  // namespace

void evaluate_motions(const std::filesystem::path& source, const std::filesystem::path& target,
                      const std::optional<std::string>& clip, bool plain, bool json) {
  const std::vector<Source> sources = sources_in(source, clip);
  const npt::Scene scene = formats::read_scene(target);
  const npt::Motion still = npt::motion_of(scene, nullptr, target.string());
  const npt::JointRoles roles = npt::joint_roles(still);
  const npt::MotionMesh mesh = npt::motion_mesh(scene, still);
  npt::RetargetShapes shapes{{}, npt::body_shape(scene, still, roles)};
  const npt::RetargetOptions options = plain ? npt::RetargetOptions::plain() : npt::RetargetOptions{};
  std::vector<npt::MotionErrors> all;
  bool compared = false;
  Report report;
  if (!json)
    std::printf("%-28s%11s%11s%11s%11s%11s%9s%10s%9s%10s\n", "", "joints %", "95th", "drawn 95th", "slide cm/s",
                "source's", "sink cm", "inside cm", "worst", "stretch");
  for (const Source& one : sources) {
    shapes.source = one.shape;
    const npt::Motion made = npt::retarget(one.motion, one.roles, still, roles, options, shapes);
    const auto own = std::find_if(scene.clips.begin(), scene.clips.end(),
                                  [&](const npt::Clip& c) { return c.name == one.motion.clip.name; });
    std::optional<npt::Motion> truth;
    if (own != scene.clips.end()) truth = npt::motion_of(scene, &*own, target.string());
    if (truth && truth->joints.size() != still.joints.size()) truth.reset();  // it moves another skeleton
    const npt::MotionErrors errors =
        npt::evaluate_motion({one.motion, one.roles}, {made, roles}, truth ? &*truth : nullptr, &mesh);
    if (json)
      report["motions"].push_back(report_of(one.motion.clip.name, errors, truth.has_value()));
    else
      print_errors(one.motion.clip.name, errors, truth.has_value());
    compared = compared || truth;
    all.push_back(errors);
  }
  const npt::MotionErrors of_all = npt::pooled_errors(npt::as_span(all));
  if (json)
    report["all"] = report_of("all clips", of_all, compared);
  else if (all.size() > 1)
    print_errors("all clips", of_all, compared);
  if (json) std::cout << report.dump(-1, ' ', false, Report::error_handler_t::replace) << '\n';
}

}  // namespace program
