#include <doctest/doctest.h>

#include <npt/base/random.hpp>
#include <npt/body/body_model.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <string>

#include "small_body.hpp"

namespace {

using Matrix4 = std::array<std::array<double, 4>, 4>;

Matrix4 multiplied(const Matrix4& a, const Matrix4& b) {
  Matrix4 c{};
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t j = 0; j < 4; ++j) {
      for (std::size_t k = 0; k < 4; ++k) c[i][j] += a[i][k] * b[k][j];
    }
  }
  return c;
}

/// SMPL's formulas as its paper writes them, with dense matrices: the oracle.
std::vector<npt::Vec3d> reference(const npt::BodyTables& b, const std::vector<float>& betas,
                                  const std::vector<float>& pose) {
  const std::size_t v_count = b.vertex_count(), j_count = b.joint_count(), s_count = b.shape_count();
  std::vector<npt::Vec3d> shaped(v_count), joints(j_count), out(v_count);
  const auto at = [](npt::Vec3d& p, std::size_t k) -> double& { return k == 0 ? p.x : k == 1 ? p.y : p.z; };
  for (std::size_t v = 0; v < v_count; ++v) {
    for (std::size_t k = 0; k < 3; ++k) {
      at(shaped[v], k) = static_cast<double>(b.v_template[3 * v + k]);
      for (std::size_t s = 0; s < betas.size(); ++s) {
        at(shaped[v], k) += static_cast<double>(b.shapedirs[(3 * v + k) * s_count + s]) * static_cast<double>(betas[s]);
      }
    }
  }
  const std::vector<float> regressor = b.J_regressor.to_dense(), weights = b.weights.to_dense();
  std::vector<Matrix4> world(j_count), skin(j_count);
  std::vector<double> feature;
  for (std::size_t j = 0; j < j_count; ++j) {
    for (std::size_t v = 0; v < v_count; ++v) joints[j] += shaped[v] * static_cast<double>(regressor[j * v_count + v]);
    const npt::Vec3d axis{static_cast<double>(pose[3 * j]), static_cast<double>(pose[3 * j + 1]),
                          static_cast<double>(pose[3 * j + 2])};
    const double angle = npt::length(axis);
    const npt::Vec3d n = npt::normalised(axis);
    // exp of the skew matrix K: I + sin K + (1 - cos) K^2.
    const std::array<std::array<double, 3>, 3> k{{{0, -n.z, n.y}, {n.z, 0, -n.x}, {-n.y, n.x, 0}}};
    Matrix4 local{};
    for (std::size_t r = 0; r < 3; ++r) {
      for (std::size_t c = 0; c < 3; ++c) {
        double k2 = 0;
        for (std::size_t i = 0; i < 3; ++i) k2 += k[r][i] * k[i][c];
        const double rotation = (r == c ? 1.0 : 0.0) + std::sin(angle) * k[r][c] + (1 - std::cos(angle)) * k2;
        local[r][c] = rotation;
        if (j > 0) feature.push_back(rotation - (r == c ? 1.0 : 0.0));
      }
    }
    local[3][3] = 1;
    const bool root = b.parents[j] < 0;
    const std::size_t parent = root ? 0 : static_cast<std::size_t>(b.parents[j]);
    const npt::Vec3d offset = root ? joints[j] : joints[j] - joints[parent];
    local[0][3] = offset.x, local[1][3] = offset.y, local[2][3] = offset.z;
    world[j] = root ? local : multiplied(world[parent], local);
    Matrix4 back{};
    for (std::size_t i = 0; i < 4; ++i) back[i][i] = 1;
    back[0][3] = -joints[j].x, back[1][3] = -joints[j].y, back[2][3] = -joints[j].z;
    skin[j] = multiplied(world[j], back);
  }
  for (std::size_t v = 0; v < v_count; ++v) {
    npt::Vec3d p = shaped[v];
    for (std::size_t k = 0; k < 3 && !b.posedirs.empty(); ++k) {
      for (std::size_t f = 0; f < feature.size(); ++f) {
        at(p, k) += static_cast<double>(b.posedirs[(3 * v + k) * feature.size() + f]) * feature[f];
      }
    }
    for (std::size_t j = 0; j < j_count; ++j) {
      const double w = static_cast<double>(weights[v * j_count + j]);
      for (std::size_t k = 0; k < 3; ++k) {
        at(out[v], k) += w * (skin[j][k][0] * p.x + skin[j][k][1] * p.y + skin[j][k][2] * p.z + skin[j][k][3]);
      }
    }
  }
  return out;
}

std::vector<float> some_numbers(std::size_t n, std::uint64_t seed) {
  npt::Random random(seed);
  std::vector<float> values(n);
  for (float& x : values) x = static_cast<float>(random.normal());
  return values;
}

double worst_difference(const std::vector<float>& found, const std::vector<npt::Vec3d>& wanted) {
  double worst = 0;
  for (std::size_t v = 0; v < wanted.size(); ++v) {
    worst = std::max({worst, std::abs(static_cast<double>(found[3 * v]) - wanted[v].x),
                      std::abs(static_cast<double>(found[3 * v + 1]) - wanted[v].y),
                      std::abs(static_cast<double>(found[3 * v + 2]) - wanted[v].z)});
  }
  return worst;
}

}  // namespace

TEST_CASE("posing follows SMPL's formulas") {
  for (const bool corrected : {false, true}) {
    npt::BodyTables tables = small_body();
    if (corrected) tables.posedirs = some_numbers(3 * tables.vertex_count() * 9 * (tables.joint_count() - 1), 5);
    const npt::BodyModel model(tables);
    const std::vector<float> betas = some_numbers(model.shape_count(), 2),
                             pose = some_numbers(3 * model.joint_count(), 3);
    std::vector<float> out(3 * model.vertex_count());
    model.posed(betas, pose, out);
    CHECK(worst_difference(out, reference(tables, betas, pose)) < 5e-6);
  }
}

TEST_CASE("the mean shape without rotation is the template") {
  const npt::BodyModel model(small_body());
  const std::vector<float> pose(3 * model.joint_count(), 0.0F);
  std::vector<float> out(3 * model.vertex_count());
  model.posed({}, pose, out);
  for (std::size_t i = 0; i < out.size(); ++i) REQUIRE(std::abs(out[i] - model.tables().v_template[i]) < 1e-6F);
}

TEST_CASE("fewer shape parameters count as zeros") {
  const npt::BodyModel model(small_body());
  const std::vector<float> pose = some_numbers(3 * model.joint_count(), 9);
  std::vector<float> a(3 * model.vertex_count()), b(a.size());
  model.posed(std::vector<float>{0.5F}, pose, a);
  model.posed(std::vector<float>{0.5F, 0.0F, 0.0F}, pose, b);
  CHECK(a == b);
}

TEST_CASE("a rotation of the root turns everything about the root's joint") {
  const npt::BodyModel model(small_body());
  const std::vector<float> betas = some_numbers(model.shape_count(), 4);
  std::vector<float> pose = some_numbers(3 * model.joint_count(), 6);
  std::vector<float> before(3 * model.vertex_count()), after(before.size());
  pose[0] = pose[1] = pose[2] = 0.0F;
  model.posed(betas, pose, before);
  pose[1] = static_cast<float>(std::numbers::pi / 2);
  model.posed(betas, pose, after);
  const npt::Vec3d root = model.joints(betas)[0];
  for (std::size_t v = 0; v < model.vertex_count(); ++v) {
    const npt::Vec3d p = npt::Vec3f{before[3 * v], before[3 * v + 1], before[3 * v + 2]}.as<double>() - root;
    const npt::Vec3d q = npt::Vec3f{after[3 * v], after[3 * v + 1], after[3 * v + 2]}.as<double>() - root;
    // A quarter turn about y takes z to x and x to -z.
    REQUIRE(npt::length(q - npt::Vec3d{p.z, p.y, -p.x}) < 5e-6);
  }
}

TEST_CASE("a subset gives the bits of the full mesh") {
  npt::BodyTables tables = small_body();
  tables.posedirs = some_numbers(3 * tables.vertex_count() * 9 * (tables.joint_count() - 1), 5);
  const npt::BodyModel model(tables);
  const std::vector<float> betas = some_numbers(model.shape_count(), 7),
                           pose = some_numbers(3 * model.joint_count(), 8);
  std::vector<float> full(3 * model.vertex_count());
  model.posed(betas, pose, full);
  const std::vector<std::uint32_t> chosen{5, 0, 5, 3};
  std::vector<float> part(3 * chosen.size());
  model.posed(betas, pose, chosen, part);
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) REQUIRE(part[3 * i + k] == full[3 * chosen[i] + k]);
  }
  model.posed(betas, pose, std::vector<std::uint32_t>{}, std::span<float>{});
}

TEST_CASE("a body becomes a triangle mesh") {
  const npt::BodyModel model(small_body());
  const npt::Mesh rest = npt::to_mesh(model);
  CHECK(rest.vertex_count() == model.vertex_count());
  CHECK(rest.face_count() == model.triangles().size());
  for (std::size_t f = 0; f < rest.face_count(); ++f) {
    REQUIRE(rest.face(f).size() == 3);
    for (std::size_t k = 0; k < 3; ++k) REQUIRE(rest.face(f)[k] == model.triangles()[f][k]);
  }
  const std::vector<float> pose = some_numbers(3 * model.joint_count(), 8);
  std::vector<float> out(3 * model.vertex_count());
  model.posed({}, pose, out);
  const npt::Mesh bent = npt::to_mesh(model, {}, pose);
  CHECK(std::ranges::equal(bent.coordinates(), out));
}

TEST_CASE("tables that make no body are refused, with the tensor's name") {
  using Tables = npt::BodyTables;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const struct {
    const char* says;
    std::function<void(Tables&)> spoil;
  } cases[] = {
      {"v_template", [](Tables& t) { t.v_template.clear(); }},
      {"v_template", [](Tables& t) { t.v_template.pop_back(); }},
      {"v_template', element 4", [=](Tables& t) { t.v_template[4] = nan; }},
      {"shapedirs", [](Tables& t) { t.shapedirs.pop_back(); }},
      {"shapedirs', element 0", [](Tables& t) { t.shapedirs[0] = std::numeric_limits<float>::infinity(); }},
      {"posedirs", [](Tables& t) { t.posedirs.assign(5, 0.0F); }},
      {"parents", [](Tables& t) { t.parents.clear(); }},
      {"parents', joint 0", [](Tables& t) { t.parents[0] = 0; }},
      {"parents', joint 1", [](Tables& t) { t.parents[1] = 2; }},
      {"parents', joint 2", [](Tables& t) { t.parents[2] = 2; }},
      {"parents', joint 2", [](Tables& t) { t.parents[2] = -1; }},
      {"joint_names", [](Tables& t) { t.joint_names = {"one"}; }},
      {"J_regressor", [](Tables& t) { t.J_regressor.columns = 3; }},
      {"J_regressor', row 0: found sum", [](Tables& t) { t.J_regressor.value[0] += 0.01F; }},
      {"J_regressor", [](Tables& t) { t.J_regressor.column[0] = 99; }},
      {"J_regressor", [](Tables& t) { t.J_regressor.start.back() += 1; }},
      {"weights', row 0: found sum", [](Tables& t) { t.weights.value[0] -= 0.01F; }},
      {"aren't negative", [](Tables& t) { t.weights.value[0] = -1.0F; }},
      {"weights", [=](Tables& t) { t.weights.value[0] = nan; }},
      {"weights", [](Tables& t) { t.weights.rows -= 1; }},
      {"triangle 1", [](Tables& t) { t.triangles[1][2] = 6; }},
  };
  for (const auto& c : cases) {
    Tables tables = small_body();
    c.spoil(tables);
    std::string message;
    try {
      const npt::BodyModel model(tables, "here");
    } catch (const npt::Error& error) {
      message = error.what();
    }
    INFO("wanted: ", c.says, ", found: ", message);
    CHECK(message.find("here") != std::string::npos);
    CHECK(message.find(c.says) != std::string::npos);
  }
}

TEST_CASE("rounded weights pass") {
  npt::BodyTables tables = small_body();
  tables.weights.value[0] += 5e-4F;
  CHECK_NOTHROW(npt::BodyModel{tables});
}

TEST_CASE("arguments of the wrong size, NaN and foreign vertices are refused") {
  const npt::BodyModel model(small_body());
  std::vector<float> out(3 * model.vertex_count()), pose(3 * model.joint_count());
  const std::vector<float> many(model.shape_count() + 1);
  CHECK_THROWS_AS(model.posed(many, pose, out), npt::Error);
  CHECK_THROWS_AS(model.joints(many), npt::Error);
  CHECK_THROWS_AS(model.posed({}, std::vector<float>(3), out), npt::Error);
  CHECK_THROWS_AS(model.posed({}, pose, std::span(out).first(3)), npt::Error);
  CHECK_THROWS_AS(model.posed({}, pose, std::vector<std::uint32_t>{6}, std::span(out).first(3)), npt::Error);
  pose[1] = std::numeric_limits<float>::quiet_NaN();
  CHECK_THROWS_AS(model.posed({}, pose, out), npt::Error);
  CHECK_THROWS_AS(model.joints(std::vector<float>{std::numeric_limits<float>::infinity()}), npt::Error);
}
