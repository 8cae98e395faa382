/// What rigs of four-legged animals call their joints: of each part of the body the words, as joint_name.hpp leaves
/// them, in lower case and without side, prefix, separators and number. Which joint of its part a joint is, places
/// tell: one pack's lower foreleg begins at the elbow of its dogs and at the wrist of its horses.
/// Format    lines of a part and its words; # begins a comment. `aside` moves nothing of the body; `body` is above all
///           joints of the trunk, and no place of it
/// Sources   the animal packs of Quaternius, by their files; the others are words of anatomy, which no file was tried
///           with
#pragma once

#include <npt/config.hpp>

#include <string_view>

namespace npt::inline NPT_ABI {

inline constexpr std::string_view quadruped_names = R"(
body     body root armature master hiproot cog
trunk    back torso hips pelvis spine chest ribcage abdomen waist thorax withers rump
neck     neck
head     head skull
jaw      jaw chin mandible
ear      ear
tail     tail
girdle   scapula shoulderblade clavicle
foreleg  frontshoulder frontleg frontupleg frontupperleg frontlowleg frontlowerleg frontfoot fronttoe ikfrontleg ff
foreleg  foreleg forelegupper foreleglower forearm upperarm arm humerus radius carpus elbow wrist hand metacarpus
foreleg  frontthigh frontshin frontpaw fronthoof frontpastern frontcannon forefoot forepaw forehoof finger
hindleg  backshoulder backleg backupleg backupperleg backlowleg backlowerleg backfoot backtoe ikbackleg ffb
hindleg  hindleg hindlegupper hindleglower rearleg thigh shin femur tibia tarsus knee hock metatarsus leg
hindleg  hindfoot hindpaw hindhoof rearfoot backpaw backhoof foot toe paw upleg upperleg lowerleg
aside    poletarget poletargetback pole target iktarget prop saddle
)";

}  // namespace npt::inline NPT_ABI
