#include <doctest/doctest.h>

#include <npt/base/quaternion.hpp>
#include <npt/base/rotation.hpp>
#include <npt/io/bvh.hpp>
#include <npt/io/bvh_file.hpp>
#include <npt/io/bvh_motion.hpp>
#include <npt/io/bvh_reader.hpp>
#include <npt/io/bvh_writer.hpp>
#include <npt/scene/motion.hpp>

#include <io/scratch.hpp>

#include <array>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <string>

namespace {

std::string bvh_text(const std::string& channels = "CHANNELS 3 Zrotation Xrotation Yrotation",
                     const std::string& motion = "MOTION\nFrames: 1\nFrame Time: 0.04\n1 2 3 10 20 30 40 50 60\n") {
  return "HIERARCHY\nROOT Hips\n{\n  OFFSET 0 1 0\n  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation "
         "Yrotation\n  JOINT Left Arm\n  {\n    OFFSET 1.5 -2e-1 3\n    " +
         channels + "\n    End Site\n    {\n      OFFSET 0 0.25 0\n    }\n  }\n}\n" + motion;
}

std::string error_in(const std::string& text) {
  return scratch::error_of([&] { npt::parse_bvh(text, "a.bvh"); });
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + by.size()))
    text.replace(at, what.size(), by);
  return text;
}

double largest_difference(const npt::Motion& a, const npt::Motion& b, double scale, double time) {
  const auto pa = npt::joint_positions(a, time), pb = npt::joint_positions(b, time);
  REQUIRE(pa.size() == pb.size());
  double most = 0;
  for (std::size_t j = 0; j < pa.size(); ++j) most = std::max(most, npt::length(pa[j] - pb[j] * scale));
  return most;
}

}  // namespace

TEST_CASE("a BVH file's joints, channels and frames are read, whatever its blanks and line ends") {
  const npt::Bvh bvh = npt::parse_bvh(bvh_text(), "a.bvh");
  REQUIRE(bvh.joints.size() == 3);
  CHECK(bvh.joints[1].name == "Left Arm");
  CHECK(bvh.joints[1].parent == 0);
  CHECK(bvh.joints[1].offset == npt::Vec3d{1.5, -0.2, 3});
  CHECK(bvh.joints[2].end);
  CHECK(bvh.channel_count() == 9);
  CHECK(bvh.frames == 1);
  CHECK(bvh.frame_time == 0.04);
  CHECK(bvh.values == std::vector<double>{1, 2, 3, 10, 20, 30, 40, 50, 60});
  for (const auto& [what, by] :
       {std::pair{"\n", "\r\n"}, std::pair{"\n", "\r"}, std::pair{"  ", "\t"}, std::pair{"\n{", " {"},
        std::pair{"\n{", "{"}, std::pair{"Frames: ", "Frames :\t"}, std::pair{"10 20", "10\n20"},
        std::pair{"rotation", "ROTATION"}, std::pair{"HIERARCHY", "\xEF\xBB\xBFhierarchy"}})
    CHECK(npt::parse_bvh(replaced(bvh_text(), what, by), "a.bvh") == bvh);
}

TEST_CASE("a BVH file that is written reads back the same") {
  npt::Bvh bvh = npt::parse_bvh(
      bvh_text("CHANNELS 4 Yrotation Zposition Zrotation Xrotation",
               "MOTION\nFrames: 2\nFrame Time: 0.0333333\n" + replaced("1 2 3 4 5 6 7 8 9 -0.123457 ", " ", "\n") +
                   "1e-7 2 3 4 179.999999 6 7 8 9 1e9"),
      "a.bvh");
  CHECK(npt::parse_bvh(npt::format_bvh(bvh), "copy") == bvh);
  bvh.joints.push_back({.name = "odd\nname {", .parent = 0, .offset = {0, 0, 1}});
  CHECK(npt::parse_bvh(npt::format_bvh(bvh), "copy").joints[3].name == "odd_name _");
  const scratch::Folder folder;
  npt::write_bvh(folder / "a.bvh", bvh);
  CHECK(npt::read_bvh(folder / "a.bvh").values == bvh.values);
}

TEST_CASE("names of a BVH file become UTF-8 in a motion") {
  const npt::Bvh bvh = npt::parse_bvh(replaced(bvh_text(), "Left Arm", "H\xE4nd"), "a.bvh");
  const npt::Motion motion = npt::motion_of(bvh, "w\xE4lk");
  CHECK(motion.clip.name == "w\xC3\xA4lk");
  CHECK(motion.joints[1].name == "H\xC3\xA4nd");
  CHECK(motion.joints[2].name == "H\xC3\xA4nd_end");
}

TEST_CASE("what is wrong in a BVH file is an error that names the line") {
  const std::string good = bvh_text();
  CHECK(error_in("") == "a.bvh: line 0: found the end of the file, expected HIERARCHY");
  CHECK(error_in(replaced(good, "MOTION", "ROOT b")) ==
        "a.bvh: line 16: found a second ROOT 'b', expected MOTION: one root in a file");
  CHECK(error_in(replaced(good, "Frames: 1", "Frames: 2")) ==
        "a.bvh: line 19: found 9 numbers, 1 frames, expected 2 frames of 9 numbers");
  CHECK(error_in(good + "7") == "a.bvh: line 20: found a number behind frame 1, expected the end of the file");
  CHECK(error_in(replaced(good, " 40", " nan")) == "a.bvh: line 19: found 'nan', expected a number, of at most 1e9");
  CHECK(error_in(replaced(good, " 40", " 1e300")) ==
        "a.bvh: line 19: found '1e300', expected a number, of at most 1e9");
  CHECK(error_in(replaced(good, " 40", " 4,0")) == "a.bvh: line 19: found '4,0', expected a number");
  CHECK(error_in(replaced(good, "0.04", "0")).starts_with("no error"));
  CHECK(error_in(replaced(good, "0.04", "-1")).starts_with("a.bvh: line 18: found a frame time of -1"));
  // Rates that are no number, and more frames than memory has at a rate of 30.
  const std::string two = replaced(good, "Frames: 1", "Frames: 2") + "1 2 3 10 20 30 40 50 60\n";
  CHECK(error_in(two) == "no error");
  CHECK(error_in(replaced(two, "0.04", "5e-324")) ==
        "a.bvh: line 18: found a frame time of 5e-324 s, expected a millionth of a second at least");
  CHECK(error_in(replaced(two, "0.04", "14401"))
            .ends_with("found a clip of 14401.000000 s, expected four hours at most"));
  CHECK(error_in(replaced(good, "OFFSET 1.5", "{ OFFSET 1.5")) == "a.bvh: line 8: found '{', expected OFFSET");
  CHECK(error_in(replaced(good, "Frames: 1", "Frames: 0")) ==
        "a.bvh: line 17: found '0' frames, expected a whole number from 1 on");
  CHECK(error_in(replaced(good, "Frames: 1", "Frames 1")) ==
        "a.bvh: line 17: found 'Frames 1', expected Frames: NUMBER");
  CHECK(error_in(bvh_text("CHANNELS 3 Zrotation Zrotation Yrotation")) ==
        "a.bvh: line 9: found 'Zrotation' twice, expected each channel once");
  CHECK(error_in(bvh_text("CHANNELS 3 Zrotation Wrotation Yrotation")) ==
        "a.bvh: line 9: found 'Wrotation', expected Xposition to Zposition, Xrotation to Zrotation");
  CHECK(error_in(bvh_text("CHANNELS 7 Zrotation")) == "a.bvh: line 9: found '7' channels, expected 0 to 6");
  CHECK(error_in(replaced(good, "OFFSET 1.5", "OFFSET x")) == "a.bvh: line 8: found 'x', expected OFFSET X Y Z");
}

TEST_CASE("every truncation of a BVH file is an error or a whole file") {
  const std::string text = bvh_text();
  std::size_t whole = 0;
  for (std::size_t n = 0; n < text.size(); ++n) whole += error_in(text.substr(0, n)) == "no error" ? 1U : 0U;
  CHECK(whole == 2);  // without the last line end, and with the last number 6
  std::string deep = "HIERARCHY ROOT a\n{OFFSET 0 0 0\n";
  for (int i = 0; i < 70000; ++i) deep += "JOINT a\n{\nOFFSET 0 0 0\n";
  CHECK(error_in(replaced(deep, "{OFFSET", "{\nOFFSET")).find("more than 65535 joints") != std::string::npos);
}

TEST_CASE("channels turn a joint in their order, in all six orders") {
  const std::array<std::string, 3> names{"Xrotation", "Yrotation", "Zrotation"};
  const std::array<npt::Vec3d, 3> axes{npt::Vec3d{1, 0, 0}, npt::Vec3d{0, 1, 0}, npt::Vec3d{0, 0, 1}};
  const std::array<std::array<std::size_t, 3>, 6> orders{
      {{{0, 1, 2}}, {{0, 2, 1}}, {{1, 0, 2}}, {{1, 2, 0}}, {{2, 0, 1}}, {{2, 1, 0}}}};
  for (const auto& order : orders) {
    const npt::Bvh bvh = npt::parse_bvh(
        bvh_text("CHANNELS 3 " + names[order[0]] + " " + names[order[1]] + " " + names[order[2]]), "a.bvh");
    const npt::Motion motion = npt::motion_of(bvh, "a");
    const npt::NodePlace place = npt::local_places(motion, 0.0)[1];
    npt::Matrix3 expected = npt::Matrix3::identity();
    for (std::size_t i = 0; i < 3; ++i)
      expected = expected * npt::rotation_matrix(axes[order[i]] *
                                                 ((40.0 + 10.0 * static_cast<double>(i)) * std::numbers::pi / 180));
    CHECK((npt::matrix_of(place.rotation) - expected).squared_norm() < 1e-12);
    CHECK(npt::length(place.translation - npt::Vec3d{1.5, -0.2, 3}) < 1e-12);
  }
  const npt::Motion motion = npt::motion_of(npt::parse_bvh(bvh_text(), "a.bvh"), "a");
  CHECK(npt::local_places(motion, 0.0)[0].translation == npt::Vec3d{1, 2, 3});  // stands for the offset
  CHECK(npt::local_places(motion, std::nullopt)[0].translation == npt::Vec3d{0, 1, 0});
  CHECK(motion.joints[2].name == "Left Arm_end");
}

TEST_CASE("a motion that becomes BVH and a motion again has its joints where they were") {
  npt::Motion motion = npt::motion_of(
      npt::parse_bvh(bvh_text("CHANNELS 3 Xrotation Yrotation Zrotation",
                              "MOTION\nFrames: 3\nFrame Time: 0.5\n1 2 3 10 20 30 40 90 60\n1 2 4 190 20 30 40 50 6\n"
                              "1 3 4 300 -20 30 -40 50 6\n"),
                     "a.bvh"),
      "a");
  motion.base.linear = npt::rotation_matrix({-1.5707963267948966, 0, 0}) * 0.1;
  motion.joints[1].rest.rotation = npt::normalised(npt::Quaternion{0.1, 0.2, 0.3, 0.9});
  const npt::Bvh bvh = npt::bvh_of(motion, 2);
  const npt::Motion again = npt::motion_of(npt::parse_bvh(npt::format_bvh(bvh), "b.bvh"), "b");
  CHECK(bvh.frames == 3);
  for (const double time : {0.0, 0.5, 1.0}) CHECK(largest_difference(motion, again, 0.01, time) < 1e-6);
  for (std::size_t i = 9; i < bvh.values.size(); ++i)
    if (i % 9 > 2) CHECK(std::abs(bvh.values[i] - bvh.values[i - 9]) <= 180);
}
