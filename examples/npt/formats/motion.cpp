#include <formats/motion.hpp>
#include <formats/read.hpp>

#include <npt/base/error.hpp>
#include <npt/body/roles/placed_motion.hpp>
#include <npt/io/bvh.hpp>
#include <npt/io/text.hpp>
#include <npt/scene/motion_of_scene.hpp>
#include <npt/scene/pose.hpp>

namespace formats {

bool is_bvh(const std::filesystem::path& path) { return npt::lower_case(path.extension().string()) == ".bvh"; }

npt::Motion read_bvh_motion(const std::filesystem::path& path) {
  return npt::placed_motion(npt::motion_of(npt::read_bvh(path), path.stem().string()));
}

npt::Motion read_motion(const std::filesystem::path& path, const std::optional<std::string>& clip) {
  if (is_bvh(path)) return read_bvh_motion(path);
  if (!is_scene(path))
    throw npt::Error(
        {path.string(), {}, "extension '" + path.extension().string() + "'", ".bvh or a format with clips"});
  const npt::Scene scene = read_scene(path);
  if (!clip && scene.clips.size() > 1)
    throw npt::Error({path.string(),
                      {},
                      std::to_string(scene.clips.size()) + " clips",
                      "the name of one of them: " + npt::clip_names(scene)});
  const npt::Clip* own = clip                  ? &npt::find_clip(scene, *clip, path.string())
                         : scene.clips.empty() ? nullptr
                                               : &scene.clips.front();
  return npt::motion_of(scene, own, path.string());
}

}  // namespace formats
