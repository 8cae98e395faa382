/// --rig FILE or FILE=WEIGHT: rigged characters, of which samples and pairs are made.
/// --joint-names FILE: other names for their joints.
#pragma once

#include "arguments.hpp"

#include <formats/read.hpp>

#include <npt/base/error.hpp>
#include <npt/base/number_text.hpp>
#include <npt/lab/rig/joint_renaming.hpp>
#include <npt/lab/rig/rig.hpp>

#include <cmath>
#include <filesystem>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

namespace program {

/// FILE or FILE=WEIGHT
/// Errors  npt::Error for a weight that isn't above 0
inline std::pair<std::string, double> split_weight(const std::string& argument, const std::string& option) {
  double weight = 1;
  const std::size_t sign = argument.rfind('=');
  if (sign == std::string::npos) return {argument, 1};
  const auto result = npt::number_from_chars(argument.data() + sign + 1, argument.data() + argument.size(), weight);
  if (result.ec != std::errc() || result.ptr != argument.data() + argument.size()) return {argument, 1};
  if (!(weight > 0) || !std::isfinite(weight))
    throw npt::Error({option + " " + argument, {}, "a weight of " + argument.substr(sign + 1), "a number above 0"});
  return {argument.substr(0, sign), weight};
}

struct NamedRig {
  npt::Rig rig;
  double weight = 1;
  std::string name;  ///< the file's, without folder and extension
};

/// Errors  npt::Error for files that can't have a skeleton, and npt::make_rig's
inline std::vector<NamedRig> load_rigs(const std::vector<std::string>& arguments, const std::string& option = "--rig") {
  std::vector<NamedRig> rigs;
  for (const std::string& argument : arguments) {
    const auto [file, weight] = split_weight(argument, option);
    if (!formats::is_scene(file))
      throw npt::Error(
          {option + " " + argument, {}, "a file without a skeleton", "a rigged character: .glb, .gltf, .fbx, .dae"});
    rigs.push_back(
        {npt::make_rig(formats::read_scene(file), file), weight, std::filesystem::path(file).stem().string()});
  }
  return rigs;
}

/// Does what --joint-names asks for, in all of these.
inline void rename_joints(const std::optional<std::filesystem::path>& names,
                          const std::vector<std::vector<NamedRig>*>& groups) {
  if (!names) return;
  std::vector<npt::Rig*> all;
  for (std::vector<NamedRig>* group : groups)
    for (NamedRig& named : *group) all.push_back(&named.rig);
  npt::JointRenaming::read(*names).apply(all);
}

}  // namespace program
