// A host application's unit with one network.
#include <npt/npt.hpp>

#include <vector>

void pose(const std::vector<float>& pose, const std::vector<float>& identity, std::vector<float>& result) {
  static const npt::Engine<npt::PoseTransferNet<>> engine = [] {
    npt::Model<npt::PoseTransferNet<>> model;
    npt::load(model, "weights.safetensors");
    return npt::Engine(model);
  }();
  engine({pose, identity}, result);
}
