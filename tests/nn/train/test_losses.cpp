#include <doctest/doctest.h>

#include <npt/base/random.hpp>
#include <npt/io/safetensors.hpp>
#include <npt/nn/train/losses.hpp>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

namespace {

using npt::Edge;
using npt::LossScaling;
using npt::Triangle;

/// Mesh n of a [N, 3, V] tensor as [V, 3].
std::vector<double> mesh_of(const npt::FileTensor& tensor, std::size_t n) {
  const std::vector<double> values = npt::to_double(tensor);
  const std::size_t vertices = tensor.shape[2];
  std::vector<double> points(3 * vertices);
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (std::size_t v = 0; v < vertices; ++v) points[3 * v + axis] = values[(3 * n + axis) * vertices + v];
  return points;
}

std::vector<Triangle> triangles_of(const npt::FileTensor& tensor) {
  const std::vector<std::int64_t> corners = npt::to_int64(tensor);
  std::vector<Triangle> triangles;
  for (std::size_t i = 0; i < corners.size(); i += 3)
    triangles.push_back({static_cast<std::uint32_t>(corners[i]), static_cast<std::uint32_t>(corners[i + 1]),
                         static_cast<std::uint32_t>(corners[i + 2])});
  return triangles;
}

std::vector<Edge> edges_of(const std::vector<Triangle>& triangles) {
  npt::Mesh mesh;
  mesh.face_start.push_back(0);
  for (const Triangle& t : triangles) {
    mesh.corners.insert(mesh.corners.end(), t.begin(), t.end());
    mesh.face_start.push_back(mesh.corners.size());
  }
  return npt::unique_edges(mesh);
}

double relative(double a, double b) { return std::abs(a - b) / std::abs(b); }

/// Largest difference between the gradient and central differences, relative to the gradient's largest entry.
double gradient_error(const std::function<double(const std::vector<double>&, std::vector<double>&)>& loss,
                      std::vector<double> x) {
  std::vector<double> gradient(x.size()), ignored(x.size());
  loss(x, gradient);
  double worst = 0, largest = 0;
  for (const double g : gradient) largest = std::max(largest, std::abs(g));
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double h = 1e-6, at = x[i];
    x[i] = at + h;
    const double up = loss(x, ignored);
    x[i] = at - h;
    const double down = loss(x, ignored);
    x[i] = at;
    worst = std::max(worst, std::abs((up - down) / (2 * h) - gradient[i]));
  }
  return worst / largest;
}

}  // namespace

TEST_CASE("losses and the gradient of their sum equal the golden cases") {
  for (const char* name :
       {"paper_b16_v35", "paper_b61_v99", "released_b16_v35", "pooled_b16_v35", "released_pooled_b29_v48"}) {
    CAPTURE(name);
    const auto golden =
        npt::SafetensorsFile::read(std::string(NPT_TEST_DATA) + "/golden/" + name + ".case.safetensors");
    const std::vector<Triangle> triangles = triangles_of(golden.at("faces"));
    const std::vector<Edge> edges = edges_of(triangles);
    const std::size_t meshes = golden.at("output").shape[0];
    double rec = 0, edge = 0, rel = 0;
    for (std::size_t n = 0; n < meshes; ++n) {
      const std::vector<double> output = mesh_of(golden.at("output"), n), target = mesh_of(golden.at("target"), n),
                                identity = mesh_of(golden.at("identity"), n);
      std::vector<double> gradient(output.size()), ignored(output.size());
      const double share = 1.0 / static_cast<double>(meshes);
      using Span = std::span<const double>;
      rec += share * npt::reconstruction_loss<double>(Span(output), Span(target), LossScaling::sum, share, gradient);
      edge += share * npt::edge_length_loss<double>(Span(output), edges, LossScaling::sum,
                                                    npt::paper_edge_weight * share, gradient);
      rel += share * npt::relative_edge_loss<double>(Span(output), Span(identity), triangles, 1, ignored);
      const std::vector<double> expected = mesh_of(golden.at("grad.output"), n);
      double difference = 0, norm = 0;
      for (std::size_t i = 0; i < expected.size(); ++i) {
        difference += std::pow(gradient[i] - expected[i], 2);
        norm += expected[i] * expected[i];
      }
      CHECK(std::sqrt(difference / norm) < 1e-12);
    }
    CHECK(relative(rec, npt::to_double(golden.at("loss.rec"))[0]) < 1e-12);
    CHECK(relative(edge, npt::to_double(golden.at("loss.edge"))[0]) < 1e-12);
    CHECK(relative(rel, npt::to_double(golden.at("loss.edge_relative"))[0]) < 1e-12);
    CHECK(relative(rec + npt::paper_edge_weight * edge, npt::to_double(golden.at("loss.total"))[0]) < 1e-12);
  }
}

TEST_CASE("gradients equal central differences in both scalings") {
  npt::Random random(3);
  std::vector<double> x(36), truth(36);
  for (double& v : x) v = random.uniform(-1, 1);
  for (double& v : truth) v = random.uniform(-1, 1);
  const std::vector<Triangle> triangles{{0, 1, 2}, {2, 3, 4}, {4, 5, 11}, {0, 7, 9}};
  const std::vector<Edge> edges = edges_of(triangles);
  using Span = std::span<const double>;
  for (const LossScaling scaling : {LossScaling::sum, LossScaling::mean}) {
    CHECK(gradient_error([&](const auto& p,
                             auto& g) { return npt::reconstruction_loss<double>(Span(p), Span(truth), scaling, 1, g); },
                         x) < 1e-6);
    CHECK(gradient_error(
              [&](const auto& p, auto& g) { return npt::edge_length_loss<double>(Span(p), edges, scaling, 1, g); }, x) <
          1e-6);
  }
  CHECK(gradient_error([&](const auto& p,
                           auto& g) { return npt::relative_edge_loss<double>(Span(p), Span(truth), triangles, 1, g); },
                       x) < 1e-6);
}

TEST_CASE("sides without length give no NaN") {
  const std::vector<double> apart{0, 0, 0, 1, 0, 0, 0, 1, 0}, together{0, 0, 0, 0, 0, 0, 0, 1, 0};
  const std::vector<Triangle> triangle{{0, 1, 2}};
  using Span = std::span<const double>;
  std::vector<double> gradient(9);
  CHECK(npt::relative_edge_loss<double>(Span(apart), Span(together), triangle, 1, gradient) ==
        std::abs(std::sqrt(2.0) - 1));  // the side 0-1 of the identity has no length
  CHECK(std::isfinite(npt::relative_edge_loss<double>(Span(together), Span(apart), triangle, 1, gradient)));
  for (const double g : gradient) CHECK(std::isfinite(g));
}
