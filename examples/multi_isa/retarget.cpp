/// Compiled once for each instruction set by npt_add_multi_isa.
#include "retarget.hpp"

#include <npt/npt.hpp>

#include <memory>

namespace {

class NetworkRetarget final : public Retarget {
 public:
  explicit NetworkRetarget(const npt::Model<npt::PoseTransferNet<16>>& model) : engine_(model) {}

  void operator()(const float* pose, const float* identity, float* result, std::size_t vertices) const override {
    engine_({{pose, 3 * vertices}, {identity, 3 * vertices}}, {result, 3 * vertices});
  }
  const char* instruction_set() const override { return npt::compiled_isa(); }

 private:
  npt::Engine<npt::PoseTransferNet<16>> engine_;
};

}  // namespace

Retarget* make_retarget(std::uint64_t seed) {
  npt::Model<npt::PoseTransferNet<16>> model;
  npt::randomise(model, seed);
  return std::make_unique<NetworkRetarget>(model).release();
}
