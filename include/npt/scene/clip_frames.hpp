/// The frames of a scene's clip as meshes, at a rate.
#pragma once

#include <npt/base/error.hpp>
#include <npt/config.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/normals.hpp>
#include <npt/scene/clip.hpp>
#include <npt/scene/pose.hpp>
#include <npt/scene/scene.hpp>

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// Threads   one at a time
class ClipFrames {
 public:
  struct Options {
    std::optional<std::string> clip{};  ///< its name; none: the only one
    double rate = 30;                   ///< frames a second
    std::optional<double> time{};       ///< one frame at this time, in seconds, in place of all
  };

  /// name: of the file, for messages
  /// Errors    npt::Error for no clip of that name, several where none is named, a time beyond the clip's end, and a
  ///           clip of more than 100,000 frames
  ClipFrames(Scene scene, std::string name, const Options& options)
      : scene_(std::make_unique<const Scene>(std::move(scene))),
        name_(std::move(name)),
        clip_(&choose(*scene_, name_, options.clip)),
        poser_(*scene_, name_),
        mesh_(poser_.mesh()),
        times_(times_of(*clip_, name_, options)) {}

  std::size_t size() const noexcept { return times_.size(); }
  const std::vector<double>& times() const noexcept { return times_; }  ///< [frames] in seconds
  const std::string& clip_name() const noexcept { return clip_->name; }

  /// Frame i's mesh, valid until the next call.
  const Mesh& frame(std::size_t i) {
    poser_.positions(clip_, times_[i], mesh_.coordinates());
    recompute_normals(mesh_);
    return mesh_;
  }
  /// The scene at rest, valid until the next call.
  const Mesh& at_rest() { return mesh_ = poser_.mesh(); }

 private:
  static const Clip& choose(const Scene& scene, const std::string& name, const std::optional<std::string>& wanted) {
    if (wanted) return find_clip(scene, *wanted, name);
    if (scene.clips.size() == 1) return scene.clips.front();
    throw Error({.file = name,
                 .found = std::to_string(scene.clips.size()) + " clips",
                 .expected = scene.clips.empty() ? "a clip to take poses from"
                                                 : "the name of one of them: " + clip_names(scene)});
  }
  static std::vector<double> times_of(const Clip& clip, const std::string& name, const Options& options) {
    constexpr int most_frames = 100'000;
    if (options.time) {
      if (*options.time > clip.length() + 1e-3)
        throw Error({.file = "time",
                     .found = std::to_string(*options.time) + " s",
                     .expected = "at most " + std::to_string(clip.length()) + " s, the clip's length"});
      return {*options.time};
    }
    // Counted before any frame is made: a clip may claim to be a year long.
    if (clip.length() * options.rate > most_frames)
      throw Error({.file = name,
                   .place = "clip '" + clip.name + "'",
                   .found = std::to_string(clip.length()) + " s",
                   .expected = "at most " + std::to_string(most_frames) + " frames"});
    return frame_times(clip, options.rate);
  }

  std::unique_ptr<const Scene> scene_;  // in one place, also where this moves
  std::string name_;
  const Clip* clip_;
  ScenePoser poser_;
  Mesh mesh_;
  std::vector<double> times_;
};

}  // namespace npt::inline NPT_ABI
