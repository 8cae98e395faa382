/// Other names for rigs' joints: a small file, so that characters whose joints are named otherwise share poses, or are
/// known as people.
///   # joint            is called
///   Bip_Bein_L         left_hip
///   [knight]           # from here on only in knight.glb
///   "Upper arm, left"  UpperArm.L
/// Names with blanks in quotes; # begins a comment. Lines above the first [rig] hold for every rig that has the joint.
/// Errors    npt::Error that names the file and the line: not two words, a joint renamed twice, [rig] that isn't there,
///           a joint that no rig has, and a name that another joint of the rig has
#pragma once

#include <npt/base/error.hpp>
#include <npt/config.hpp>
#include <npt/io/file.hpp>
#include <npt/io/text.hpp>
#include <npt/io/words.hpp>
#include <npt/lab/rig/rig.hpp>

#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

class JointRenaming {
 public:
  /// `name` stands in messages of errors.
  JointRenaming(std::string_view text, std::string name) : name_(std::move(name)) {
    TextLines lines(text);
    std::string rig;
    for (std::string_view line; lines.next(line);) {
      const auto words = list_words(line);
      if (words && words->empty()) continue;
      const std::string place = "line " + std::to_string(lines.number());
      if (words && words->size() == 1 && words->front().starts_with('[') && words->front().ends_with(']')) {
        rig = words->front().substr(1, words->front().size() - 2);
        if (rig.empty()) fail(place, "no name in []", "a rig's file without folder and extension");
        continue;
      }
      if (!words || words->size() != 2) fail(place, found_words(words), "a joint and its other name, or [rig]");
      for (const Entry& before : entries_)
        if (before.rig == rig && before.joint == words->front())
          fail(place, "joint '" + before.joint + "' again (" + before.place + ")", "one other name for a joint");
      entries_.push_back({rig, (*words)[0], (*words)[1], place});
    }
    if (entries_.empty()) fail("", "no names", "lines of: joint other_name");
  }

  static JointRenaming read(const std::filesystem::path& file) { return {read_file(file), file.string()}; }

  /// Renames joints of all rigs. What stands below a rig's own [rig] comes before what holds for all.
  void apply(std::span<Rig* const> rigs) const {
    std::vector<bool> used(entries_.size());
    for (Rig* rig : rigs) apply(*rig, used);
    for (std::size_t e = 0; e < entries_.size(); ++e)
      if (!used[e]) refuse(entries_[e], rigs);
  }

 private:
  struct Entry {
    std::string rig;  ///< empty: every rig
    std::string joint, other_name;
    std::string place;  ///< "line 3", for messages
  };

  [[noreturn]] void fail(std::string place, std::string found, std::string expected) const {
    throw Error({name_, std::move(place), std::move(found), std::move(expected)});
  }

  void apply(Rig& rig, std::vector<bool>& used) const {
    const std::string own = rig::internal::stem(rig.name);
    std::vector<std::optional<std::size_t>> renamed(rig.joint_count());
    for (std::size_t e = 0; e < entries_.size(); ++e) {
      if (!entries_[e].rig.empty() && entries_[e].rig != own) continue;
      for (std::size_t j = 0; j < rig.joint_count(); ++j)
        if (rig.joint_name(j) == entries_[e].joint) {
          used[e] = true;
          if (!renamed[j] || entries_[*renamed[j]].rig.empty()) renamed[j] = e;
        }
    }
    // All at once: two joints may exchange their names.
    for (std::size_t j = 0; j < rig.joint_count(); ++j)
      if (renamed[j]) rig.scene.nodes[rig.joints[j]].name = entries_[*renamed[j]].other_name;
    std::map<std::string, std::size_t> first;
    for (std::size_t j = 0; j < rig.joint_count(); ++j) {
      const auto [at, fresh] = first.emplace(rig.joint_name(j), j);
      const auto by = renamed[j] ? renamed[j] : renamed[at->second];
      if (!fresh && by)
        fail(entries_[*by].place, "a second joint '" + rig.joint_name(j) + "' in " + rig.name,
             "a name that no other joint of the rig has");
    }
  }

  /// An entry that no rig uses.
  [[noreturn]] void refuse(const Entry& entry, std::span<Rig* const> rigs) const {
    std::string names;
    for (const Rig* rig : rigs) {
      if (rig::internal::stem(rig->name) == entry.rig)
        fail(entry.place, "joint '" + entry.joint + "', which " + rig->name + " doesn't have",
             "the name of one of its " + std::to_string(rig->joint_count()) + " joints");
      names += (names.empty() ? "" : ", ") + rig::internal::stem(rig->name);
    }
    if (entry.rig.empty()) fail(entry.place, "joint '" + entry.joint + "', which no rig has", "a joint of " + names);
    fail(entry.place, "[" + entry.rig + "]", names.empty() ? "a rig" : "one of the rigs: " + names);
  }

  std::string name_;
  std::vector<Entry> entries_;
};

}  // namespace npt::inline NPT_ABI
