/// The clips of a glTF file: what moves which node, and when.
/// Errors    npt::Error for keys that don't fit their times, and for what can't be moved
#pragma once

#include <npt/config.hpp>
#include <npt/io/gltf_document.hpp>
#include <npt/scene/clip.hpp>
#include <npt/scene/scene.hpp>

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI::internal {

/// scene: with the meshes and nodes of the file.
class GltfClipReader {
 public:
  GltfClipReader(GltfDocument& document, const Scene& scene) : document_(document), scene_(scene) {}

  std::vector<Clip> read() {
    std::vector<Clip> clips;
    const std::vector<Item> items = document_.objects(document_.root(), "animations");
    for (std::size_t i = 0; i < items.size(); ++i) {
      Clip clip{document_.text(items[i], "name"), {}};
      if (clip.name.empty()) clip.name = "clip_" + std::to_string(i);
      const std::vector<Item> samplers = document_.objects(items[i], "samplers");
      for (const Item& item : document_.objects(items[i], "channels")) {
        const auto sampler = document_.index(item, "sampler", samplers.size(), "samplers");
        if (!sampler) document_.fail(item.place, "no sampler", "a sampler's number");
        const Item target = document_.need(item, "target", Kind::object);
        const auto node = document_.index(target, "node", scene_.nodes.size(), "nodes");
        const std::string path = document_.text(target, "path");
        if (!node) continue;  // moves something that only an extension knows
        if (auto moving = channel(target, samplers[*sampler], *node, path)) clip.channels.push_back(std::move(*moving));
      }
      clips.push_back(std::move(clip));
    }
    return clips;
  }

 private:
  using Kind = JsonValue::Kind;
  using Item = GltfItem;

  std::optional<ClipChannel> channel(const Item& target, const Item& sampler, std::size_t node,
                                     const std::string& path) {
    ClipChannel c{.node = node};
    if (path == "rotation")
      c.path = ChannelPath::rotation, c.width = 4;
    else if (path == "scale")
      c.path = ChannelPath::scale;
    else if (path == "weights")
      c.path = ChannelPath::weights, c.width = morph_targets(node);
    else if (path != "translation")
      return std::nullopt;
    if (c.width == 0) document_.fail(target.place, "weights of a node without morph targets", "a node that has some");
    if (c.path != ChannelPath::weights && scene_.nodes[node].matrix)
      document_.fail(target.place, "a node with a matrix", "one with translation, rotation and scale, to be moved");
    const std::string how = document_.text(sampler, "interpolation");
    if (how == "STEP")
      c.interpolation = Interpolation::step;
    else if (how == "CUBICSPLINE")
      c.interpolation = Interpolation::cubic;
    else if (!how.empty() && how != "LINEAR")
      document_.fail(sampler.place, in_quotes(how), "LINEAR, STEP or CUBICSPLINE");
    const auto number = [&](const char* key) {
      const auto a = document_.index(sampler, key, document_.accessor_count(), "accessors");
      if (!a) document_.fail(sampler.place, std::string("no ") + key, "an accessor's number");
      return *a;
    };
    c.times = document_.floats(number("input"), 1, "times");
    for (std::size_t k = 0; k < c.times.size(); ++k)
      if (c.times[k] < (k == 0 ? 0 : c.times[k - 1]))
        document_.fail(sampler.place, "key " + std::to_string(k) + " at " + std::to_string(c.times[k]) + " s",
                       "times from 0 on that ascend");
    if (static_cast<double>(c.times.back()) > longest_clip)
      document_.fail(sampler.place, "a clip of " + std::to_string(c.times.back()) + " s", "four hours at most");
    const std::size_t width = c.path == ChannelPath::weights ? 1 : c.width;
    c.values = document_.floats(number("output"), width, path);
    const std::size_t expected = c.times.size() * c.width * (c.interpolation == Interpolation::cubic ? 3 : 1);
    if (c.values.size() != expected)
      document_.fail(sampler.place,
                     std::to_string(c.values.size()) + " numbers for " + std::to_string(c.times.size()) + " keys",
                     std::to_string(expected));
    return c;
  }
  std::size_t morph_targets(std::size_t node) const {
    const std::size_t mesh = scene_.nodes[node].mesh;
    return mesh == no_item ? 0 : scene_.meshes[mesh].weights.size();
  }

  GltfDocument& document_;
  const Scene& scene_;
};

}  // namespace npt::inline NPT_ABI::internal
