/// What tools call the joints of a person or a four-legged animal: a row for each dialect. Words as joint_name.hpp
/// leaves them, in lower case and without side, prefix and separators.
///   middle    hips, neck, head; joints between hips and neck are found by their place in the skeleton
///   arm       shoulder, upper arm, lower arm, hand
///   leg       upper leg, lower leg, foot, toes
///   digits    fifteen words, of joint_digits
/// An animal's row calls its forelegs arms, has two more words in the middle, the first joint of the tail and the jaw,
/// and two for each side:
///   animal    what stands on the ground below the foreleg's hand, ear
/// Several words of one joint are separated by '/', the preferred one first; '-': the dialect has none. Where a rig has
/// a wrist and a hand below it, the wrist is the hand's joint.
/// Sources   Mixamo's, MotionBuilder's (HumanIK), Unreal's mannequins', VRM 1.0's, VRoid Studio's, 3ds Max' Biped's, Daz
///           Genesis', Poser's, Rigify's, Reallusion's and MikuMikuDance's skeletons; CMU's in ASF and as converted to
///           BVH; SMPL-X; the packs of Quaternius, KayKit and Kenney
#pragma once

#include <npt/config.hpp>

#include <array>
#include <string_view>

namespace npt::inline NPT_ABI {

/// Fifteen words: three joints from the hand on, of thumb, index, middle, ring and little finger.
namespace joint_digits {

inline constexpr std::string_view hand =
    "handthumb1/inhandthumb1 handthumb2/inhandthumb2 handthumb3/inhandthumb3 handindex1/inhandindex1 "
    "handindex2/inhandindex2 handindex3/inhandindex3 handmiddle1/inhandmiddle1 handmiddle2/inhandmiddle2 "
    "handmiddle3/inhandmiddle3 handring1/inhandring1 handring2/inhandring2 handring3/inhandring3 "
    "handpinky1/inhandpinky1 handpinky2/inhandpinky2 handpinky3/inhandpinky3";
inline constexpr std::string_view padded =
    "thumb01 thumb02 thumb03 index01 index02 index03 middle01 middle02 middle03 ring01 ring02 ring03 "
    "pinky01 pinky02 pinky03";
inline constexpr std::string_view words =
    "thumbproximal thumbintermediate thumbdistal indexproximal indexintermediate indexdistal "
    "middleproximal middleintermediate middledistal ringproximal ringintermediate ringdistal "
    "littleproximal littleintermediate littledistal";
inline constexpr std::string_view vrm =
    "thumbmetacarpal thumbproximal thumbdistal indexproximal indexintermediate indexdistal middleproximal "
    "middleintermediate middledistal ringproximal ringintermediate ringdistal littleproximal "
    "littleintermediate littledistal";
inline constexpr std::string_view named_little =
    "thumb1 thumb2 thumb3 index1 index2 index3 middle1 middle2 middle3 ring1 ring2 ring3 little1 little2 little3";
inline constexpr std::string_view pinky =
    "thumb1 thumb2 thumb3 index1 index2 index3 middle1 middle2 middle3 ring1 ring2 ring3 pinky1 pinky2 pinky3";
inline constexpr std::string_view from_two =
    "thumb2 thumb3 thumb4 index2 index3 index4 middle2 middle3 middle4 ring2 ring3 ring4 pinky2 pinky3 pinky4";
inline constexpr std::string_view mid =
    "thumb1 thumb2 thumb3 index1 index2 index3 mid1 mid2 mid3 ring1 ring2 ring3 pinky1 pinky2 pinky3";
inline constexpr std::string_view biped =
    "finger0 finger01 finger02 finger1 finger11 finger12 finger2 finger21 finger22 finger3 finger31 "
    "finger32 finger4 finger41 finger42";
inline constexpr std::string_view rigify =
    "thumb01 thumb02 thumb03 findex01 findex02 findex03 fmiddle01 fmiddle02 fmiddle03 fring01 fring02 "
    "fring03 fpinky01 fpinky02 fpinky03";
inline constexpr std::string_view mmd =
    "親指０/thumb0 親指１/thumb1 親指２/thumb2 人指１/fore1 人指２/fore2 人指３/fore3 中指１/middle1 中指２/middle2 "
    "中指３/middle3 "
    "薬指１/third1 薬指２/third2 薬指３/third3 小指１/little1 小指２/little2 小指３/little3";
inline constexpr std::string_view cmu = "thumb - - handindex1/fingers handindex2 handindex3 - - - - - - - - -";
inline constexpr std::string_view no_digits = "- - - - - - - - - - - - - - -";

}  // namespace joint_digits

struct JointDialect {
  std::string_view name, middle, arm, leg, digits, animal{};
};

inline constexpr std::array<JointDialect, 19> joint_dialects{{
    {"Mixamo, HumanIK", "hips neck head", "shoulder arm forearm hand", "upleg leg foot toebase/toes",
     joint_digits::hand},
    {"Unreal", "pelvis neck01/neck head", "clavicle upperarm lowerarm hand", "thigh calf foot ball",
     joint_digits::padded},
    {"Unity, VRM 0", "hips neck head", "shoulder upperarm lowerarm wrist/hand", "upperleg lowerleg foot toes/toe",
     joint_digits::words},
    {"VRM 1", "hips neck head", "shoulder upperarm lowerarm wrist/hand", "upperleg lowerleg foot toes/toe",
     joint_digits::vrm},
    {"VRoid", "hips neck head", "shoulder upperarm lowerarm hand", "upperleg lowerleg foot toebase",
     joint_digits::named_little},
    {"Biped", "pelvis neck/neck1 head/head1", "clavicle upperarm forearm hand", "thigh calf foot toe0",
     joint_digits::biped},
    {"CMU, ASF", "root lowerneck/upperneck head", "clavicle humerus radius wrist/hand", "femur tibia foot toes",
     joint_digits::cmu},
    {"CMU, BVH", "hips neck head", "shoulder arm forearm hand", "upleg leg foot toebase", joint_digits::cmu},
    {"Daz Genesis 8", "hip necklower head", "collar shldrbend forearmbend hand", "thighbend shin foot toe",
     joint_digits::mid},
    {"Daz Genesis 9", "hip neck1/neck head", "shoulder upperarm forearm hand", "thigh shin foot toes",
     joint_digits::mid},
    {"Poser", "hip neck head", "collar shldr forearm hand", "thigh shin foot toe", joint_digits::mid},
    {"Rigify", "spine spine004/neck spine006/head", "shoulder upperarm forearm hand", "thigh shin foot toe",
     joint_digits::rigify},
    {"SMPL", "pelvis neck head", "collar shoulder elbow wrist", "hip knee ankle foot", joint_digits::pinky},
    {"Reallusion", "hip/pelvis necktwist01 head", "clavicle upperarm forearm hand", "thigh calf foot toebase",
     joint_digits::mid},
    {"MikuMikuDance", "センター/下半身/lowerbody/center 首/neck 頭/head", "肩/shoulder 腕/arm ひじ/elbow 手首/wrist",
     "足/leg ひざ/knee 足首/ankle つま先/toe", joint_digits::mmd},
    {"Quaternius", "hips/body neck head", "shoulder upperarm lowerarm/forearm hand/palm/wrist/fist",
     "upperleg lowerleg/downleg foot/feet toes", joint_digits::pinky},
    {"Quaternius, people", "hips/body neck head", "shoulder upperarm lowerarm hand/palm", "upperleg lowerleg foot toes",
     joint_digits::from_two},
    {"KayKit", "hips neck head", "shoulder upperarm lowerarm wrist/hand", "upperleg lowerleg foot toes",
     joint_digits::no_digits},
    {"Kenney", "root - head", "- arm - -", "leg - - -", joint_digits::no_digits},
}};

/// npt's is that of examples/sculpt/quadruped.plan.
inline constexpr std::array<JointDialect, 6> animal_dialects{{
    {"npt, animals", "pelvis neck1 head tail1 jaw", "scapula shoulder elbow wrist", "hip knee hock hindfoot", "",
     "forefoot ear"},
    {"Quaternius, animals", "back neck1/neck head tail1/tail jaw/mouth",
     "frontshoulder frontupperleg/frontupleg/frontleg1/frontleg frontlowerleg/frontlowleg/frontleg2 "
     "ikfrontleg/frontfoot/frontfeet",
     "backleg/backupperleg/backleg1 backupperleg/backleg2 backlowerleg/backleg3 ikbackleg", "", "ff ear1/ear"},
    {"Quaternius, farm and dinosaurs", "body/hips neck head tail1 jaw/mouth",
     "frontleg frontupleg/frontupperleg frontlowleg/frontlowerleg frontfoot",
     "backupleg/backupperleg backlowleg/backlowerleg backfoot backtoes", "", "- ear"},
    {"Rigify, animals", "spine/hips/pelvis spine008/neck spine011/head tail/tail001 jaw",
     "shoulder/frontshoulder frontthigh frontshin frontfoot", "thigh shin foot toe", "", "fronttoe ear"},
    {"Unreal, animals", "pelvis/hips neck01/neck1/neck head tail01/tail1/tail jaw",
     "clavicle/scapula upperarm/frontupperleg lowerarm/forearm/frontlowerleg hand/frontfoot",
     "thigh/hindupperleg calf/hindlowerleg foot/hindfoot ball/hindtoes/toes", "", "ball/fronttoes ear/ear1"},
    {"Biped, animals", "pelvis neck/neck1 head tail/tail1 jaw", "clavicle upperarm forearm hand",
     "thigh calf horselink/foot foot/toe0", "", "finger0 ear"},
}};

/// Words before a joint's own that say nothing about it.
inline constexpr std::array<std::string_view, 24> joint_prefixes{
    "mixamorig", "bip", "bip01",    "bip001", "valvebiped", "character", "character1", "def",
    "org",       "mch", "armature", "ccbase", "cc",         "base",      "j",          "c",
    "sec",       "b",   "bn",       "jnt",    "joint",      "bone",      "rig",        "m"};

}  // namespace npt::inline NPT_ABI
