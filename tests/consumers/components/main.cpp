/// Uses what the libraries behind the components bring: liblbfgs finds a minimum, Eigen refines a body that the
/// laboratory draws.
#include <npt/baseline/fit/lbfgs.hpp>
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/lab/evaluation.hpp>
#include <npt/transfer/detail_refiner.hpp>

#include <cmath>
#include <cstdio>
#include <span>
#include <vector>

int main() {
  std::vector<double> x{1, 2};
  const auto squares = [](std::span<const double> at, std::span<double> gradient) {
    gradient[0] = 2 * (at[0] - 3);
    gradient[1] = 2 * at[1];
    return (at[0] - 3) * (at[0] - 3) + at[1] * at[1];
  };
  const npt::LbfgsResult found = npt::minimise_lbfgs(squares, x);
  const npt::Mesh mesh = npt::to_mesh(npt::mannequin());
  const npt::DetailRefiner refiner(mesh.coordinates(), npt::triangulate(mesh), {.iterations = 1});
  const npt::EvaluationSet none;
  std::printf("%d steps, %zu vertices, %zu pairs\n", found.iterations, mesh.vertex_count(), none.count);
  return found.converged && std::abs(x[0] - 3) < 1e-3 && none.count == 0 ? 0 : 1;
}
