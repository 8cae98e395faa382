/// Writing BVH files; bvh.hpp says what is kept.
#pragma once

#include <npt/config.hpp>
#include <npt/io/bvh_file.hpp>
#include <npt/io/text.hpp>

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace npt::inline NPT_ABI {

namespace internal::bvh {

/// A name on one line, without a brace at its end, which would be taken for the joint's.
inline std::string written_name(std::string_view name) {
  std::string text(trimmed(name));
  for (char& c : text)
    if (c == '\n' || c == '\r') c = '_';
  if (text.ends_with('{')) text.back() = '_';
  return text;
}

inline void append_joint(std::string& text, const BvhJoint& joint, std::size_t depth) {
  const std::string indent(2 * depth, ' ');
  const std::string kind = joint.parent == no_item ? "ROOT " : "JOINT ";
  text += indent + (joint.end ? "End Site" : kind + written_name(joint.name)) + "\n" + indent + "{\n";
  text += indent + "  OFFSET";
  for (const double component : {joint.offset.x, joint.offset.y, joint.offset.z}) append_number(text += ' ', component);
  text += '\n';
  if (joint.end) return;
  append_number(text += indent + "  CHANNELS ", joint.channels.size());
  for (const BvhChannel channel : joint.channels) (text += ' ') += bvh_channel_names[static_cast<std::size_t>(channel)];
  text += '\n';
}

}  // namespace internal::bvh

/// The text of a BVH file. Numbers are as short as reads back to the same bits.
inline std::string format_bvh(const Bvh& bvh) {
  std::string text = "HIERARCHY\n";
  std::vector<std::size_t> open;
  const auto close = [&] {
    open.pop_back();
    text += std::string(2 * open.size(), ' ') + "}\n";
  };
  for (std::size_t j = 0; j < bvh.joints.size(); ++j) {
    while (!open.empty() && open.back() != bvh.joints[j].parent) close();
    internal::bvh::append_joint(text, bvh.joints[j], open.size());
    open.push_back(j);
  }
  while (!open.empty()) close();
  append_number(text += "MOTION\nFrames: ", bvh.frames);
  append_number(text += "\nFrame Time: ", bvh.frame_time);
  text += '\n';
  const std::size_t width = bvh.channel_count();
  for (std::size_t i = 0; i < bvh.values.size(); ++i) {
    append_number(text, bvh.values[i]);
    text += (i + 1) % width == 0 ? '\n' : ' ';
  }
  return text;
}

}  // namespace npt::inline NPT_ABI
