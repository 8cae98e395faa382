#include <doctest/doctest.h>

#include <npt/nets/pose_transfer_net.hpp>
#include <npt/nn/graph/explain.hpp>

TEST_CASE("explain names every convolution, its shape and what rides along") {
  const std::string text = npt::explain<npt::PoseTransferNet<>>();
  CHECK(text.find("16 stages in 10 sweeps; 3 of them encode pose. 6035762 multiply-adds a vertex.") == 0);
  for (const char* part :
       {"Inputs: pose [V, 3], identity [V, 3].", "Inputs meet vertex by vertex: equal counts are needed.",
        "sweep 4, over the vertices of identity",
        "encoder.conv1                    3 -> 64       pose  =>  (bias unused) -> map 0, moments",
        "decoder.conv1                    1027 -> 1027  code | instance_norm | relu ++ identity",
        "decoder.spadain_block1.conv_res", "| instance_norm | modulate(identity)  =>  + bias | relu | add(scratch",
        "decoder.conv4                    256 -> 3", "| tanh -> result"}) {
    CAPTURE(part);
    CHECK(text.find(part) != std::string::npos);
  }
  CHECK(npt::explain<npt::PoseTransferNet<64, npt::ConvRelu, npt::Pooled>>().find(
            "No vertex of pose meets one of the others: it may have any number of them.") != std::string::npos);
}
