#include <refining/refiner.hpp>

#include <npt/transfer/detail_refiner.hpp>

namespace refining {

namespace {

class EigenRefiner : public Refiner {
 public:
  explicit EigenRefiner(npt::DetailRefiner refiner) : refiner_(std::move(refiner)) {}
  void refine(std::span<float> positions) const override { refiner_(positions, positions); }

 private:
  npt::DetailRefiner refiner_;
};

}  // namespace

double default_radius() { return npt::DetailOptions{}.radius; }

std::unique_ptr<const Refiner> make_refiner(std::span<const float> identity, std::span<const npt::Triangle> triangles,
                                            double radius, const std::string& name) {
  return std::make_unique<EigenRefiner>(npt::DetailRefiner(identity, triangles, {.radius = radius}, name));
}

void expect_available() {}

}  // namespace refining
