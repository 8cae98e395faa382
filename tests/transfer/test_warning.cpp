#include <doctest/doctest.h>

#include <npt/base/error.hpp>
#include <npt/transfer/body_interface.hpp>
#include <npt/transfer/notes.hpp>

#include <string>
#include <vector>

TEST_CASE("a sure transfer needs no words, a doubtful one says which mesh") {
  npt::TransferReport report{.method = npt::Method::body,
                             .read = true,
                             .identity_confidence = 1,
                             .pose_confidence = 0.9,
                             .identity_notes = {},
                             .pose_notes = {}};
  CHECK(npt::method_notes(report, "a.ply", "b.ply").empty());
  report.pose_confidence = 0.7;
  report.identity_notes = "lies";
  CHECK(
      npt::method_notes(report, "a.ply", "b.ply") ==
      std::vector<std::string>{
          "a.ply: lies", "b.ply reads as a person with a confidence of only 70 %: look at the result before using it"});
  report.method = npt::Method::network;
  report.identity_confidence = 0.25;
  CHECK(npt::method_notes(report, "a.ply", "b.ply") ==
        std::vector<std::string>{
            "a.ply doesn't read as a person (confidence 25 %, asked 60 %): left to the pose transfer "
            "network, which was trained on people in few poses; look at the result before using it"});
  report.read = false;
  CHECK(npt::method_notes(report, "a.ply", "b.ply").empty());
}

TEST_CASE("a refusal of the network says why it was asked") {
  const npt::Error refusal({.file = "a.ply", .found = "9 units", .expected = "a person"});
  npt::TransferReport report{.method = npt::Method::network,
                             .read = true,
                             .identity_confidence = 0.9,
                             .pose_confidence = 0.1,
                             .identity_notes = {},
                             .pose_notes = {}};
  CHECK(std::string(npt::with_confidence(refusal, report, "a.ply", "b.ply").what()) ==
        "a.ply: found 9 units, expected a person; the network was asked since b.ply doesn't read as a person "
        "(confidence 10 "
        "%, asked 60 %)");
  report.method = npt::Method::body;
  CHECK(std::string(npt::with_confidence(refusal, report, "a.ply", "b.ply").what()) == refusal.what());
}
