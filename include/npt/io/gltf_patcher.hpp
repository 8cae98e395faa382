/// A GLB or glTF file, clips and other rests of nodes put into it; gltf_patch.hpp says what is kept.
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/quaternion.hpp>
#include <npt/base/vec3.hpp>
#include <npt/config.hpp>
#include <npt/io/glb.hpp>
#include <npt/io/glb_patch.hpp>
#include <npt/io/gltf_added.hpp>
#include <npt/io/gltf_curves.hpp>
#include <npt/io/gltf_text.hpp>
#include <npt/io/gltf_uri.hpp>
#include <npt/io/json_tree.hpp>
#include <npt/io/text.hpp>
#include <npt/scene/clip.hpp>
#include <npt/scene/clip_of_motion.hpp>
#include <npt/scene/motion.hpp>
#include <npt/scene/scene.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI::internal {

class GltfPatcher {
 public:
  /// `file` has to outlive it.
  GltfPatcher(std::string_view file, const std::string& name)
      : file_(file),
        chunks_(is_glb(file) ? read_glb(file, name) : GlbChunks{file, {}}),
        text_(chunks_.json, name),
        accessors_(text_.count(text_.root(), "accessors"), text_.count(text_.root(), "bufferViews")) {
    name_clips();
  }

  /// One more animation; its name, "motion" where none is wanted.
  std::string add_clip(const Motion& motion, const std::string& wanted) {
    std::string name = free_clip_name(names_, wanted.empty() ? "motion" : wanted);
    const std::string place = "clip " + in_quotes(name);
    if (motion.clip.channels.empty()) text_.fail(place, "no curve", "one at least");
    AddedChannels added(accessors_, 0);
    std::set<std::string> own;
    for (const ClipChannel& c : written_curves(motion, place)) {
      added.add(c.node, c);
      own.insert(pointer(c.node, c.path));
      make_place(c.node);
    }
    for (const ClipChannel& part : moved_by_others(motion))
      if (!own.contains(pointer(part.node, part.path))) added.add(part.node, part);
    std::string json = "{\"name\":" + text_.quoted(name) + ",\"samplers\":[";
    for (const std::string& sampler : added.samplers()) json += sampler + ",";
    json.back() = ']';
    json += ",\"channels\":[";
    for (const std::string& channel : added.channels()) json += channel + ",";
    json.back() = ']';
    text_.add_item(text_.root(), "animations", json + "}");
    names_.push_back(name);
    return name;
  }

  /// The pose at a time as the rest of the nodes.
  void set_rest(const Motion& motion, double time) {
    for (const ClipChannel* c : last_of_each(motion, "pose"))
      check_curve(*c, text_.name(), "pose, joint " + in_quotes(motion.joints[c->node].name));
    const std::vector<NodePlace> places = local_places(motion, time);
    std::vector<ClipChannel> old;  // the rests that were
    for (std::size_t j = 0; j < places.size(); ++j) {
      const auto moves = [j](const ClipChannel& c) { return c.node == j; };
      if (motion.joints[j].node == no_item && std::ranges::none_of(motion.clip.channels, moves)) continue;
      const std::size_t node = node_of(motion, j);
      std::vector<ClipChannel> parts = changed_parts(node, place_of_node(node), places[j]);
      if (parts.empty()) continue;
      write_place(node, places[j], parts);
      for (ClipChannel& part : parts) old.push_back(std::move(part));
    }
    keep_clips(old);
  }

  bool is_vrm() const {
    const JsonValue* extensions = text_.root().find("extensions");
    return extensions != nullptr && (extensions->find("VRM") != nullptr || extensions->find("VRMC_vrm") != nullptr);
  }

  /// The file with all that was put in. Called once.
  std::string finish() {
    for (const std::string& item : accessors_.items()) text_.add_item(text_.root(), "accessors", item);
    const bool in_chunk = is_glb(file_) && add_buffer();
    if (!is_glb(file_)) add_own_buffer();
    std::string json = text_.changed();
    if (!is_glb(file_)) return json;
    return patched_glb(file_, std::move(json), in_chunk ? std::string_view(accessors_.bytes()) : "", text_.name());
  }

 private:
  using Kind = JsonValue::Kind;

  // Names.

  void name_clips() {
    for (std::size_t i = 0; i < text_.count(text_.root(), "animations"); ++i) {
      const JsonValue* name = text_.item("animations", i).find("name");
      // What npt's reader calls those without a name.
      const bool own = name != nullptr && name->is(Kind::string) && !name->text.empty();
      names_.push_back(own ? name->text : "clip_" + std::to_string(i));
    }
  }

  // Nodes.

  static std::string place_in_file(std::size_t node) { return "nodes[" + std::to_string(node) + "]"; }

  /// The node of a joint. A name that isn't the joint's means that the motion is another file's.
  std::size_t node_of(const Motion& motion, std::size_t number) const {
    const MotionJoint& joint = motion.joints[number];
    const std::size_t count = text_.count(text_.root(), "nodes");
    if (joint.node >= count)
      text_.fail("joint " + in_quotes(joint.name),
                 joint.node == no_item ? "no node" : "node " + std::to_string(joint.node),
                 "one of the file's " + std::to_string(count) + " nodes");
    const JsonValue* own = text_.item("nodes", joint.node).find("name");
    const std::string name = own == nullptr ? std::string() : own->text;
    if (name != joint.name)
      text_.fail(place_in_file(joint.node), in_quotes(name), "joint " + in_quotes(joint.name) + " of the motion");
    return joint.node;
  }

  const JsonValue& node(std::size_t number) const { return text_.item("nodes", number); }

  std::optional<Affine> matrix_of_node(std::size_t number) const {
    const auto m = text_.reals(node(number), "matrix", 16, place_in_file(number));
    if (!m) return std::nullopt;
    const auto column = [&](std::size_t c) { return Vec3d{(*m)[4 * c], (*m)[4 * c + 1], (*m)[4 * c + 2]}; };
    return Affine{Matrix3::from_columns(column(0), column(1), column(2)), column(3)};
  }
  /// A node's place, that of its matrix where it has one.
  NodePlace place_of_node(std::size_t number) const {
    const std::string place = place_in_file(number);
    if (const auto matrix = matrix_of_node(number)) return place_of(*matrix);
    NodePlace result;
    if (const auto v = text_.reals(node(number), "translation", 3, place))
      result.translation = {(*v)[0], (*v)[1], (*v)[2]};
    if (const auto v = text_.reals(node(number), "scale", 3, place)) result.scale = {(*v)[0], (*v)[1], (*v)[2]};
    if (const auto v = text_.reals(node(number), "rotation", 4, place))
      result.rotation = normalised(Quaternion{(*v)[0], (*v)[1], (*v)[2], (*v)[3]});
    return result;
  }
  void expect_no_shear(std::size_t number) const {
    const Matrix3 own = matrix_of_node(number)->linear, again = place_of_node(number).affine().linear;
    double most = 0, off = 0;
    for (std::size_t r = 0; r < 3; ++r) {
      most = std::max(most, length(own.rows[r]));
      off = std::max(off, length(again.rows[r] - own.rows[r]));
    }
    if (!(off <= 1e-4 * most))
      text_.fail(place_in_file(number) + ".matrix", "a matrix that shears", "one of translation, rotation, scale");
  }

  static std::string list_of(const std::vector<double>& values) {
    std::string json = "[";
    for (const double value : values) {
      if (json.size() > 1) json += ',';
      append_number(json, value + 0.0);
    }
    return json + "]";
  }
  static std::vector<double> numbers(Vec3d v) { return {v.x, v.y, v.z}; }
  static std::vector<double> numbers(Quaternion q) {
    const std::array<double, 4> all = components(q);
    return {all.begin(), all.end()};
  }

  /// Translation, rotation and scale in the place of a matrix, which animations can't move.
  void make_place(std::size_t number) {
    if (node(number).find("matrix") == nullptr || !with_place_.insert(number).second) return;
    replace_matrix(number, place_of_node(number));
  }
  void replace_matrix(std::size_t number, const NodePlace& place) {
    expect_no_shear(number);
    for (const char* key : {"translation", "rotation", "scale"})
      if (node(number).find(key) != nullptr)
        text_.fail(place_in_file(number), "matrix and " + std::string(key), "one of them");
    text_.replace_member(node(number), "matrix",
                         "\"translation\":" + list_of(numbers(place.translation)) + ",\"rotation\":" +
                             list_of(numbers(place.rotation)) + ",\"scale\":" + list_of(numbers(place.scale)));
  }

  // Rests.

  /// `parts`: what of it is another than it was
  void write_place(std::size_t number, const NodePlace& place, const std::vector<ClipChannel>& parts) {
    if (node(number).find("matrix") != nullptr) {
      if (with_place_.insert(number).second) replace_matrix(number, place);
      return;
    }
    for (const ClipChannel& part : parts) {
      if (part.path == ChannelPath::rotation)
        text_.set_member(node(number), "rotation", list_of(numbers(place.rotation)));
      else if (part.path == ChannelPath::scale)
        text_.set_member(node(number), "scale", list_of(numbers(place.scale)));
      else
        text_.set_member(node(number), "translation", list_of(numbers(place.translation)));
    }
  }

  /// Animations that were there get the old rest of what they don't move.
  void keep_clips(const std::vector<ClipChannel>& old) {
    for (std::size_t i = 0; i < text_.count(text_.root(), "animations"); ++i) {
      const JsonValue& animation = text_.item("animations", i);
      const std::string place = "animations[" + std::to_string(i) + "]";
      const std::set<std::string> moved = moved_by(animation, place);
      AddedChannels added(accessors_, text_.count(animation, "samplers", place));
      for (const ClipChannel& part : old)
        if (!moved.contains(pointer(part.node, part.path))) added.add(part.node, part);
      for (const std::string& sampler : added.samplers()) text_.add_item(animation, "samplers", sampler);
      for (const std::string& channel : added.channels()) text_.add_item(animation, "channels", channel);
    }
  }
  static std::string pointer(std::size_t number, ChannelPath path) {
    static constexpr std::array<const char*, 3> names{"/translation", "/rotation", "/scale"};
    return "/nodes/" + std::to_string(number) + names[static_cast<std::size_t>(path)];
  }
  /// As KHR_animation_pointer writes it, which is read, too.
  std::set<std::string> moved_by(const JsonValue& animation, const std::string& place) const {
    std::set<std::string> moved;
    const JsonValue* channels = text_.list(animation, "channels", place);
    for (std::size_t c = 0; channels != nullptr && c < channels->items.size(); ++c) {
      const JsonValue* target = channels->items[c].find("target");
      if (target == nullptr) continue;
      const JsonValue *node = target->find("node"), *path = target->find("path");
      const auto number = node == nullptr ? std::nullopt : node->whole();
      if (number && path != nullptr) moved.insert("/nodes/" + std::to_string(*number) + "/" + path->text);
      const JsonValue* extensions = target->find("extensions");
      const JsonValue* extension = extensions == nullptr ? nullptr : extensions->find("KHR_animation_pointer");
      const JsonValue* there = extension == nullptr ? nullptr : extension->find("pointer");
      if (there != nullptr) moved.insert(there->text);
    }
    return moved;
  }

  /// The rests of what the file's animations move of a motion's joints: players leave what a clip doesn't move where the
  /// clip before left it.
  std::vector<ClipChannel> moved_by_others(const Motion& motion) const {
    std::set<std::string> moved;
    for (std::size_t i = 0; i < text_.count(text_.root(), "animations"); ++i)
      moved.merge(moved_by(text_.item("animations", i), "animations[" + std::to_string(i) + "]"));
    std::vector<ClipChannel> rests;
    for (std::size_t j = 0; j < motion.joints.size(); ++j) {
      if (motion.joints[j].node == no_item) continue;
      const std::size_t node = node_of(motion, j);
      for (ClipChannel& part : constant_curves(node, place_of_node(node)))
        if (moved.contains(pointer(node, part.path))) rests.push_back(std::move(part));
    }
    return rests;
  }

  /// A motion's curves; of several of one part of one joint the last.
  std::vector<const ClipChannel*> last_of_each(const Motion& motion, const std::string& place) const {
    std::map<std::pair<std::size_t, ChannelPath>, const ClipChannel*> last;
    for (const ClipChannel& c : motion.clip.channels) {
      if (c.node >= motion.joints.size())
        text_.fail(place, "a curve of joint " + std::to_string(c.node),
                   std::to_string(motion.joints.size()) + " joints");
      last[{c.node, c.path}] = &c;
    }
    std::vector<const ClipChannel*> channels;
    channels.reserve(last.size());
    for (const auto& [key, channel] : last) channels.push_back(channel);
    return channels;
  }

  /// Of nodes. One of them ends when the motion ends, also where all stay the same.
  std::vector<ClipChannel> written_curves(const Motion& motion, const std::string& place) const {
    std::vector<ClipChannel> curves;
    float end = 0, own_end = 0;
    std::size_t longest = 0;
    for (const ClipChannel* c : last_of_each(motion, place)) {
      check_curve(*c, text_.name(), place + ", joint " + in_quotes(motion.joints[c->node].name));
      if (c->times.back() > end) end = c->times.back(), longest = curves.size();
      curves.push_back(written_curve(*c));
      curves.back().node = node_of(motion, c->node);
      own_end = std::max(own_end, curves.back().times.back());
    }
    if (own_end < end) {  // the longest has one key, as it stays the same
      ClipChannel& c = curves[longest];
      c.times.push_back(end);
      for (std::size_t i = 0; i < c.width; ++i) c.values.push_back(c.values[i]);
    }
    return curves;
  }

  // Bytes.

  void add_view(std::size_t buffer, std::size_t offset) {
    std::string json = "{\"buffer\":" + std::to_string(buffer);
    if (offset > 0) json += ",\"byteOffset\":" + std::to_string(offset);
    text_.add_item(text_.root(), "bufferViews",
                   json + ",\"byteLength\":" + std::to_string(accessors_.bytes().size()) + "}");
  }
  /// A buffer of its own, as a data URI.
  void add_own_buffer() {
    if (accessors_.bytes().empty()) return;
    add_view(text_.count(text_.root(), "buffers"), 0);
    text_.add_item(text_.root(), "buffers",
                   "{\"byteLength\":" + std::to_string(accessors_.bytes().size()) +
                       ",\"uri\":\"data:application/octet-stream;base64," + to_base64(accessors_.bytes()) + "\"}");
  }
  /// Behind the GLB's own bytes, which only its first buffer can be; whether that was possible.
  bool add_buffer() {
    if (accessors_.bytes().empty()) return false;
    const bool has_buffers = text_.count(text_.root(), "buffers") > 0;
    if (has_buffers && (!chunks_.bytes || text_.item("buffers", 0).find("uri") != nullptr)) {
      add_own_buffer();
      return false;
    }
    const std::size_t offset = chunks_.bytes ? glb_end(chunks_.bytes->size()) : 0;
    const std::string size = std::to_string(offset + accessors_.bytes().size());
    if (has_buffers)
      text_.set_member(text_.item("buffers", 0), "byteLength", size);
    else
      text_.add_item(text_.root(), "buffers", "{\"byteLength\":" + size + "}");
    add_view(0, offset);
    return true;
  }

  std::string_view file_;
  GlbChunks chunks_;
  GltfText text_;
  AddedAccessors accessors_;
  std::vector<std::string> names_;
  std::set<std::size_t> with_place_;  ///< nodes whose matrix was replaced
};

}  // namespace npt::inline NPT_ABI::internal
