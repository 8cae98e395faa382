#include <doctest/doctest.h>

#include <npt/base/random.hpp>
#include <npt/nets/correspondence_net.hpp>
#include <npt/nn/engine/engine.hpp>
#include <npt/nn/engine/model.hpp>

#include <cmath>
#include <numeric>
#include <vector>

TEST_CASE("a reading of shuffled points is the shuffled reading, and all of it is within tanh") {
  npt::Model<npt::CorrespondenceNet<32>, double> model;
  npt::randomise(model, 3);
  const npt::Engine engine(model, 1);
  npt::Random random(4);
  constexpr std::size_t n = 50;
  std::vector<double> points(3 * n), normals(3 * n), places(3 * n), p(3 * n), q(3 * n), again(3 * n);
  for (double& x : points) x = random.uniform(-1, 1);
  for (double& x : normals) x = random.uniform(-1, 1);
  engine({points, normals}, places);
  const auto order = npt::random_permutation(n, random);
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      p[3 * i + k] = points[3 * order[i] + k];
      q[3 * i + k] = normals[3 * order[i] + k];
    }
  engine({p, q}, again);
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      CHECK(again[3 * i + k] == doctest::Approx(places[3 * order[i] + k]).epsilon(1e-9));
      CHECK(std::abs(places[3 * i + k]) <= 1);
    }
}

TEST_CASE("normals matter to a reading") {
  npt::Model<npt::CorrespondenceNet<32>> model;
  npt::randomise(model, 3);
  const npt::Engine engine(model, 1);
  npt::Random random(5);
  std::vector<float> points(90), normals(90), other(90), a(90), b(90);
  for (float& x : points) x = static_cast<float>(random.uniform(-1, 1));
  for (float& x : normals) x = static_cast<float>(random.uniform(-1, 1));
  for (float& x : other) x = static_cast<float>(random.uniform(-1, 1));
  engine({points, normals}, a);
  engine({points, other}, b);
  CHECK(a != b);
}
