// The four-legged template: a closed symmetric surface with a skeleton inside, weights, shapes and poses.
#include <doctest/doctest.h>
#include <npt/base/error.hpp>
#include <npt/body/body_file.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/body_plan.hpp>
#include <npt/body/plan_poses.hpp>
#include <npt/body/plan_proportions.hpp>
#include <npt/io/file.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <numbers>
#include <sculpt/quadruped/anatomy.hpp>
#include <sculpt/quadruped/grown.hpp>
#include <sculpt/quadruped/quadruped.hpp>
#include <sculpt/quadruped/shape.hpp>
#include <sculpt/quadruped/skin.hpp>
#include <sculpt/quadruped/surface.hpp>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace {

using npt::Vec3d;
using npt::Vec3f;

const std::string tables = std::string(NPT_SOURCE_DIR) + "/examples/sculpt/quadruped";

const npt::BodyModel& body() {
  static const npt::BodyModel model =
      sculpt::quadruped::make_body(npt::read_file(tables + ".plan"), npt::read_file(tables + ".poses"));
  return model;
}
const npt::BodyPlan& plan() {
  static const npt::BodyPlan p = npt::read_body_plan(body().tables().metadata.at("plan"), "plan");
  return p;
}
Vec3d place(std::size_t v) {
  const std::vector<float>& t = body().tables().v_template;
  return Vec3f{t[3 * v], t[3 * v + 1], t[3 * v + 2]}.as<double>();
}

/// [V] the vertex at (-x, y, z), by its place.
std::vector<std::size_t> mirror_images() {
  std::map<std::vector<float>, std::size_t> at;
  const std::vector<float>& t = body().tables().v_template;
  for (std::size_t v = 0; v < body().vertex_count(); ++v) at[{t[3 * v], t[3 * v + 1], t[3 * v + 2]}] = v;
  std::vector<std::size_t> result;
  for (std::size_t v = 0; v < body().vertex_count(); ++v) {
    const auto twin = at.find({t[3 * v] == 0 ? t[3 * v] : -t[3 * v], t[3 * v + 1], t[3 * v + 2]});
    REQUIRE(twin != at.end());
    result.push_back(twin->second);
  }
  return result;
}

double enclosed_volume(const npt::Mesh& mesh, std::span<const npt::Triangle> triangles) {
  double volume = 0;
  for (const npt::Triangle& t : triangles)
    volume += dot(mesh.positions[t[0]].as<double>(),
                  cross(mesh.positions[t[1]].as<double>(), mesh.positions[t[2]].as<double>())) /
              6;
  return volume;
}

}  // namespace

TEST_CASE("the template is one closed surface of even triangles, looking to +z, soles at 0") {
  const auto triangles = body().triangles();
  CHECK(body().vertex_count() == sculpt::quadruped::vertex_count);
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  double longest = 0, shortest = 1;
  for (const npt::Triangle& t : triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      ++edges[{t[k], t[(k + 1) % 3]}];
      const double n = length(place(t[k]) - place(t[(k + 1) % 3]));
      longest = std::max(longest, n), shortest = std::min(shortest, n);
    }
  for (const auto& [edge, count] : edges) {
    REQUIRE(count == 1);
    REQUIRE(edges.contains({edge.second, edge.first}));
  }
  CHECK(body().vertex_count() + triangles.size() == edges.size() / 2 + 2);  // Euler's formula of a sphere
  CHECK(longest < 0.06);
  CHECK(shortest > 0.001);
  Vec3d low{9, 9, 9}, high{-9, -9, -9};
  for (std::size_t v = 0; v < body().vertex_count(); ++v) {
    const Vec3d p = place(v);
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  CHECK(std::abs(low.y) < 0.002);
  CHECK(std::abs(low.z + high.z) < 0.1);
  CHECK(high.y < 1.1);
  CHECK(high.z < 1.1);
  CHECK(body().joints({})[plan().joint("head")].z > body().joints({})[plan().joint("pelvis")].z);
}

TEST_CASE("left and right are mirror images: vertices, weights and joints") {
  const std::vector<std::size_t> twin = mirror_images();
  const std::vector<float> weights = body().tables().weights.to_dense();
  const std::size_t joints = body().joint_count();
  for (std::size_t v = 0; v < twin.size(); ++v)
    for (std::size_t j = 0; j < joints; ++j)
      REQUIRE(weights[v * joints + j] == weights[twin[v] * joints + plan().joints[j].mirrored]);
  const std::vector<Vec3d> at = body().joints({});
  for (std::size_t j = 0; j < joints; ++j) {
    const Vec3d other = at[plan().joints[j].mirrored];
    CHECK(length(at[j] - Vec3d{-other.x, other.y, other.z}) < 1e-12);
  }
}

TEST_CASE("joints stand where the anatomy's table says, by few vertices each") {
  const std::vector<Vec3d> at = body().joints({});
  for (const sculpt::quadruped::JointPlace& joint : sculpt::quadruped::joint_places) {
    CAPTURE(joint.joint);
    const std::size_t j = plan().joint(joint.joint);
    REQUIRE(j != npt::BodyPlan::no_joint);
    CHECK(length(at[j] - (joint.position - sculpt::quadruped::origin)) < 1e-5);
    CHECK(body().tables().J_regressor.columns_of(j).size() < 900);
  }
}

TEST_CASE("weights are sums of few neighbouring joints, and no leg's skin follows another leg") {
  const npt::SparseMatrix& weights = body().tables().weights;
  for (std::size_t v = 0; v < weights.rows; ++v) {
    REQUIRE(weights.row_sum(v) == doctest::Approx(1).epsilon(1e-6));
    REQUIRE(weights.columns_of(v).size() <= 5);
    for (const std::uint32_t j : weights.columns_of(v)) {
      const int side = plan().side(j);
      if (side != 0) REQUIRE(side * place(v).x > 0);
    }
    if (place(v).y > 0.3) continue;
    std::set<std::size_t> limbs;
    for (const std::uint32_t j : weights.columns_of(v)) limbs.insert(plan().joints[j].limb);
    REQUIRE(limbs.size() == 1);
  }
}

TEST_CASE("every proportion and shape is a body with an inside, and so are named poses") {
  const npt::BodyModel all = npt::with_proportions(body(), plan());
  CHECK(all.shape_count() == sculpt::quadruped::shape_count + plan().proportions.size());
  const double rest = enclosed_volume(npt::to_mesh(body()), body().triangles());
  CHECK(rest > 0.04);
  for (std::size_t s = 0; s < all.shape_count(); ++s)
    for (const float by : {-2.0F, 2.0F}) {
      CAPTURE(s);
      std::vector<float> betas(all.shape_count(), 0.0F);
      betas[s] = by;
      const double volume = enclosed_volume(npt::to_mesh(all, betas), all.triangles());
      CHECK(volume > 0.15 * rest);
      CHECK(volume < 4 * rest);
    }
  const npt::PlanPoses poses(plan(), body().tables().metadata.at("poses"), "poses");
  for (const npt::NamedPose& pose : poses.poses()) {
    CAPTURE(pose.name);
    const double volume = enclosed_volume(npt::to_mesh(body(), {}, poses.axis_angles(pose.angles)), body().triangles());
    CHECK(volume == doctest::Approx(rest).epsilon(0.12));
  }
}

TEST_CASE("joints follow proportions") {
  const npt::BodyModel all = npt::with_proportions(body(), plan());
  std::vector<float> betas(all.shape_count(), 0.0F);
  std::size_t k = 0;
  while (plan().proportions[k].name != "neck_length") ++k;
  betas[body().shape_count() + k] = static_cast<float>(1 / plan().proportions[k].deviation);  // twice as long
  const auto before = body().joints({}), after = all.joints(betas);
  const auto bone = [](const std::vector<Vec3d>& at, const char* a, const char* b) {
    return length(at[plan().joint(a)] - at[plan().joint(b)]);
  };
  CHECK(bone(after, "neck1", "head") / bone(before, "neck1", "head") == doctest::Approx(2).epsilon(0.1));
  CHECK(bone(after, "l_elbow", "l_wrist") == doctest::Approx(bone(before, "l_elbow", "l_wrist")).epsilon(1e-3));
}

TEST_CASE("the file is the body, and sculpting it again gives the same") {
  const std::filesystem::path path = std::filesystem::temp_directory_path() / "npt_test_quadruped.safetensors";
  npt::save_body(body(), path);
  const npt::BodyModel read = npt::load_body(path);
  std::filesystem::remove(path);
  const npt::BodyModel again =
      sculpt::quadruped::make_body(npt::read_file(tables + ".plan"), npt::read_file(tables + ".poses"));
  for (const npt::BodyModel* other : {&read, &again}) {
    CHECK(other->tables().v_template == body().tables().v_template);
    CHECK(other->tables().weights == body().tables().weights);
    CHECK(other->tables().shapedirs == body().tables().shapedirs);
    CHECK(other->tables().J_regressor == body().tables().J_regressor);
  }
  CHECK(read.tables().joint_names == body().tables().joint_names);
  CHECK(npt::read_body_plan(read.tables().metadata.at("plan"), "file").joint_count() == 35);
}

TEST_CASE("the same surface with other proportions is another template, which stands on its feet") {
  const npt::BodyModel grown = sculpt::quadruped::grown(body(), plan(), {{"leg_length", 1.5}, {"ear_size", 0.5}});
  const auto span_of = [](const npt::BodyModel& model, const char* from, const char* to) {
    const std::vector<Vec3d> joints = model.joints({});
    return length(joints[plan().joint(from)] - joints[plan().joint(to)]);
  };
  CHECK(span_of(grown, "l_hip", "l_knee") == doctest::Approx(1.5 * span_of(body(), "l_hip", "l_knee")).epsilon(0.02));
  CHECK(span_of(grown, "spine1", "chest") == doctest::Approx(span_of(body(), "spine1", "chest")).epsilon(0.02));
  float lowest = 1;
  for (std::size_t v = 0; v < grown.vertex_count(); ++v)
    lowest = std::min(lowest, grown.tables().v_template[3 * v + 1]);
  CHECK(lowest == 0);
  CHECK_THROWS_WITH_AS(
      sculpt::quadruped::grown(body(), plan(), {{"wings", 2}}),
      "plan four-legged animal: found proportion 'wings' with the factor 2.000000, expected one of the "
      "plan, and a factor above 0",
      npt::Error);
}

TEST_CASE("the dinosaur's tables make a template whose forelegs end above the floor") {
  const std::string path = std::string(NPT_SOURCE_DIR) + "/examples/sculpt/theropod",
                    text = npt::read_file(path + ".plan");
  const npt::BodyPlan own = npt::read_body_plan(text, path);
  const npt::BodyModel grown =
      sculpt::quadruped::grown(sculpt::quadruped::make_body(text, npt::read_file(path + ".poses")), own,
                               {{"foreleg_length", 0.42}, {"hindleg_length", 1.15}});
  const std::vector<Vec3d> joints = grown.joints({});
  CHECK(joints[own.joint("l_forefoot")].y > 0.25);
  CHECK(joints[own.joint("l_hindfoot")].y < 0.1);
  CHECK(grown.tables().metadata.at("plan") == text);
}
