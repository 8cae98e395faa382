/// What a clip adds to a glTF document: accessors over its numbers, equal ones once and all in one buffer view, and an
/// animation's samplers and channels, as JSON.
/// Source    glTF 2.0 specification, sections 3.6.2 and 3.11
#pragma once

#include <npt/config.hpp>
#include <npt/io/glb.hpp>
#include <npt/io/text.hpp>
#include <npt/scene/clip.hpp>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI::internal {

/// Accessors that are added to a document. `first`: how many it has; `view`: the number of their buffer view
class AddedAccessors {
 public:
  AddedAccessors(std::size_t first, std::size_t view) : first_(first), view_(view) {}

  /// The number of an accessor over rows of `width` floats. bounds: whether to say the least and the most.
  std::size_t add(const std::vector<float>& values, std::size_t width, bool bounds) {
    std::string bytes;
    for (const float value : values) append_little_u32(bytes, std::bit_cast<std::uint32_t>(value + 0.0F));
    const auto [known, fresh] = known_.emplace(std::pair{std::pair{width, bounds}, bytes}, first_ + items_.size());
    if (!fresh) return known->second;
    std::string json = "{\"bufferView\":" + std::to_string(view_);
    if (!bytes_.empty()) json += ",\"byteOffset\":" + std::to_string(bytes_.size());
    json += ",\"componentType\":5126,\"count\":" + std::to_string(values.size() / width) + ",\"type\":\"";
    json += width == 1 ? "SCALAR\"" : "VEC" + std::to_string(width) + "\"";
    if (bounds) {
      const auto [least, most] = std::minmax_element(values.begin(), values.end());
      json += ",\"min\":[";
      append_number(json, static_cast<double>(*least));
      json += "],\"max\":[";
      append_number(json, static_cast<double>(*most));
      json += "]";
    }
    items_.push_back(json + "}");
    bytes_ += bytes;
    return known->second;
  }

  const std::vector<std::string>& items() const noexcept { return items_; }
  const std::string& bytes() const noexcept { return bytes_; }

 private:
  std::size_t first_, view_;
  std::map<std::pair<std::pair<std::size_t, bool>, std::string>, std::size_t> known_;
  std::vector<std::string> items_;
  std::string bytes_;
};

/// Samplers and channels of one animation. `first`: how many samplers it has.
class AddedChannels {
 public:
  AddedChannels(AddedAccessors& accessors, std::size_t first) : accessors_(accessors), first_(first) {}

  void add(std::size_t node, const ClipChannel& c) {
    static constexpr const char* hows[] = {"STEP", "LINEAR", "CUBICSPLINE"};
    static constexpr const char* paths[] = {"translation", "rotation", "scale"};
    const std::string path = paths[static_cast<std::size_t>(c.path)];
    std::string sampler = "{\"input\":" + std::to_string(accessors_.add(c.times, 1, true));
    sampler += ",\"output\":" + std::to_string(accessors_.add(c.values, c.width, false));
    sampler += ",\"interpolation\":\"" + std::string(hows[static_cast<std::size_t>(c.interpolation)]) + "\"}";
    // Tools that keep what they made of a sampler made it for one path.
    const auto [known, fresh] = known_.emplace(path + sampler, first_ + samplers_.size());
    if (fresh) samplers_.push_back(sampler);
    channels_.push_back("{\"sampler\":" + std::to_string(known->second) +
                        ",\"target\":{\"node\":" + std::to_string(node) + ",\"path\":\"" + path + "\"}}");
  }

  const std::vector<std::string>& samplers() const noexcept { return samplers_; }
  const std::vector<std::string>& channels() const noexcept { return channels_; }

 private:
  AddedAccessors& accessors_;
  std::size_t first_;
  std::map<std::string, std::size_t> known_;
  std::vector<std::string> samplers_, channels_;
};

}  // namespace npt::inline NPT_ABI::internal
