#include <doctest/doctest.h>

#include <estimate/people.hpp>

#include <npt/base/random.hpp>
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/body/natural_poses.hpp>
#include <npt/body/people_plan.hpp>
#include <npt/body/pose_prior.hpp>
#include <npt/solve/normal_equations.hpp>

#include <cmath>
#include <cstddef>
#include <vector>

namespace {

double value(const npt::PosePrior& prior, const std::vector<double>& theta, std::vector<double>& gradient) {
  gradient.assign(72, 0.0);
  return prior(theta, 0.7, 0.4, gradient);
}

}  // namespace

TEST_CASE("gradient and curvature of the pose prior agree with differences") {
  npt::Random random(3);
  std::vector<double> theta(72), gradient, before, after;
  for (double& t : theta) t = 0.5 * random.normal();
  for (const npt::PosePrior& prior :
       {npt::PosePrior(npt::mannequin(), npt::people_plan()), npt::PosePrior::natural(*people::mannequins())}) {
    value(prior, theta, gradient);
    npt::NormalEquations equations(75);
    prior.add_curvature(theta, 0.7, 0.4, 3, equations);
    for (std::size_t i = 0; i < 72; ++i) {
      constexpr double change = 1e-5;
      std::vector<double> other = theta;
      other[i] += change;
      const double up = value(prior, other, after);
      other[i] -= 2 * change;
      const double down = value(prior, other, before);
      CHECK(gradient[i] == doctest::Approx((up - down) / (2 * change)).epsilon(1e-6));
      CHECK(2 * equations.diagonal(3 + i) == doctest::Approx((after[i] - before[i]) / (2 * change)).epsilon(1e-5));
    }
  }
}

TEST_CASE("natural poses are likelier than wild ones under the natural prior") {
  const npt::PosePrior prior = npt::PosePrior::natural(*people::mannequins());
  npt::Random random(4);
  std::vector<double> gradient;
  for (int i = 0; i < 20; ++i) {
    const npt::NaturalPoses::Pose pose = npt::natural_poses().sample(random);
    const std::vector<double> natural(pose.begin(), pose.end());
    std::vector<double> wild(72);
    for (double& t : wild) t = 1.5 * random.normal();
    CHECK(value(prior, natural, gradient) < value(prior, wild, gradient));
  }
}
