/// Reading BVH files; bvh.hpp says what is kept.
#pragma once

#include <npt/base/error.hpp>
#include <npt/base/vec3.hpp>
#include <npt/config.hpp>
#include <npt/io/bvh_file.hpp>
#include <npt/io/text.hpp>
#include <npt/scene/clip.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

namespace internal::bvh {

inline bool same_letters(std::string_view a, std::string_view b) { return lower_case(a) == lower_case(b); }

class Reader {
 public:
  Reader(std::string_view text, const std::string& file) : lines_(text), file_(file) {
    if (text.starts_with("\xEF\xBB\xBF")) lines_ = TextLines(text.substr(3));
  }

  Bvh read() {
    expect("HIERARCHY");
    expect("ROOT");
    read_tree();
    const std::string_view after = word();
    if (same_letters(after, "ROOT")) fail("a second ROOT " + in_quotes(trimmed(line_)), "MOTION: one root in a file");
    if (!same_letters(after, "MOTION")) fail(shown(after), "MOTION");
    read_frame_count();
    read_values();
    return std::move(bvh_);
  }

 private:
  // Deeper than any body, and a bound on what a short file can make of the walks over the tree.
  static constexpr std::size_t most_joints = 65535;
  // Numbers beyond it are no lengths and no angles; their floats would lose every digit that matters.
  static constexpr double largest = 1e9;
  // Of seconds: frames that are nearer stand at one time as floats, and their rate is no number.
  static constexpr double least_frame = 1e-6;

  [[noreturn]] void fail(std::string found, std::string expected) const {
    throw Error({.file = file_,
                 .place = "line " + std::to_string(lines_.number()),
                 .found = std::move(found),
                 .expected = std::move(expected)});
  }
  std::string shown(std::string_view word) const { return word.empty() ? "the end of the file" : in_quotes(word); }

  /// The next word, on this line or one below; empty at the end of the file.
  std::string_view word() {
    while (true) {
      const std::string_view next = next_word(line_);
      if (!next.empty() || !lines_.next(line_)) return next;
    }
  }
  void expect(std::string_view keyword) {
    if (const std::string_view found = word(); !same_letters(found, keyword)) fail(shown(found), std::string(keyword));
  }

  double number(std::string_view found, const char* what) const {
    const std::optional<double> value = parse_number<double>(found);
    if (!value) fail(shown(found), what);
    if (!std::isfinite(*value) || std::abs(*value) > largest)
      fail(shown(found), std::string(what) + ", of at most 1e9");
    return *value;
  }

  /// What stands behind ROOT or JOINT: a name, which may hold blanks, and the brace on this line or the next.
  void open_joint(std::size_t parent) {
    std::string_view name = trimmed(line_);
    line_ = {};
    const bool brace = name.ends_with('{');
    if (brace) name = trimmed(name.substr(0, name.size() - 1));
    add({.name = std::string(name), .parent = parent});
    if (!brace) expect("{");
    read_offset();
  }
  void add(BvhJoint joint) {
    if (bvh_.joints.size() >= most_joints) fail("more than 65535 joints", "fewer");
    bvh_.joints.push_back(std::move(joint));
  }
  void read_offset() {
    expect("OFFSET");
    Vec3d& offset = bvh_.joints.back().offset;
    for (double* component : {&offset.x, &offset.y, &offset.z}) *component = number(word(), "OFFSET X Y Z");
  }

  void read_channels(BvhJoint& joint) {
    const std::string_view digits = word();
    const auto count = parse_number<std::uint32_t>(digits);
    if (!count || *count > bvh_channel_names.size()) fail(shown(digits) + " channels", "0 to 6");
    if (!joint.channels.empty()) fail("CHANNELS twice", "one list a joint");
    for (std::uint32_t i = 0; i < *count; ++i) {
      const std::string_view name = word();
      const auto known = std::ranges::find_if(bvh_channel_names, [&](auto n) { return same_letters(n, name); });
      if (known == bvh_channel_names.end()) fail(shown(name), "Xposition to Zposition, Xrotation to Zrotation");
      const auto channel = static_cast<BvhChannel>(known - bvh_channel_names.begin());
      if (std::ranges::find(joint.channels, channel) != joint.channels.end())
        fail(in_quotes(name) + " twice", "each channel once");
      joint.channels.push_back(channel);
    }
  }

  /// The root, its joints and its closing brace, without recursion: a file may be nested deep.
  void read_tree() {
    open_joint(no_item);
    std::vector<std::size_t> open{0};
    while (!open.empty()) {
      const std::string_view keyword = word();
      if (keyword == "}") {
        open.pop_back();
      } else if (same_letters(keyword, "CHANNELS")) {
        read_channels(bvh_.joints[open.back()]);
      } else if (same_letters(keyword, "JOINT")) {
        open_joint(open.back());
        open.push_back(bvh_.joints.size() - 1);
      } else if (same_letters(keyword, "End")) {
        expect("Site");
        add({.parent = open.back(), .end = true});
        expect("{");
        read_offset();
        expect("}");
      } else {
        fail(shown(keyword), "CHANNELS, JOINT, End Site or }");
      }
    }
  }

  /// "Frames: 25", with or without blanks around the colon, and "Frame Time: 0.0333".
  std::string_view after_colon(std::string_view label) {
    std::string_view line;
    while (trimmed(line_).empty())
      if (!lines_.next(line_)) fail("the end of the file", std::string(label) + ": NUMBER");
    line = trimmed(line_);
    line_ = {};
    const std::size_t colon = line.find(':');
    if (colon == std::string_view::npos || !same_letters(trimmed(line.substr(0, colon)), label))
      fail(in_quotes(line), std::string(label) + ": NUMBER");
    return trimmed(line.substr(colon + 1));
  }

  void read_frame_count() {
    const std::string_view digits = after_colon("Frames");
    const auto frames = parse_number<std::uint32_t>(digits);
    if (!frames || *frames == 0) fail(shown(digits) + " frames", "a whole number from 1 on");
    bvh_.frames = *frames;
    const std::string_view time = after_colon("Frame Time");
    bvh_.frame_time = number(time, "seconds");
    const double length = bvh_.frame_time * static_cast<double>(bvh_.frames - 1);
    if (bvh_.frame_time < 0 || (bvh_.frame_time < least_frame && bvh_.frames > 1))
      fail("a frame time of " + std::string(time) + " s", "a millionth of a second at least");
    if (length > longest_clip) fail("a clip of " + std::to_string(length) + " s", "four hours at most");
  }

  void read_values() {
    const std::size_t width = bvh_.channel_count();
    if (width == 0) fail("joints without channels", "channels that the frames move");
    const std::uint64_t expected = std::uint64_t{width} * bvh_.frames;
    for (std::string_view found = word(); !found.empty(); found = word()) {
      if (bvh_.values.size() == expected)
        fail("a number behind frame " + std::to_string(bvh_.frames), "the end of the file");
      bvh_.values.push_back(number(found, "a number"));
    }
    if (bvh_.values.size() != expected)
      fail(std::to_string(bvh_.values.size()) + " numbers, " + std::to_string(bvh_.values.size() / width) + " frames",
           std::to_string(bvh_.frames) + " frames of " + std::to_string(width) + " numbers");
  }

  TextLines lines_;
  std::string_view line_;
  const std::string& file_;
  Bvh bvh_;
};

}  // namespace internal::bvh

/// The motion in the text of a BVH file. `name` stands in the messages of errors.
inline Bvh parse_bvh(std::string_view text, const std::string& name) {
  return internal::bvh::Reader(text, name).read();
}

}  // namespace npt::inline NPT_ABI
