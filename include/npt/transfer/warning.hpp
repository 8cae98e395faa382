/// What a user should know of a transfer, as codes, and their plain English.
///   for (const npt::Warning& warning : result.warnings) puts(npt::text_of(warning, "hero.glb", "walk.glb").c_str());
#pragma once

#include <npt/base/error.hpp>
#include <npt/base/length_unit.hpp>
#include <npt/body/kind_words.hpp>
#include <npt/config.hpp>
#include <npt/estimate/warning_code.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <string_view>

namespace npt::inline NPT_ABI {

/// Which mesh of a pair something is said of.
enum class MeshRole { identity, pose };

struct Warning {
  WarningCode code = WarningCode::low_confidence;
  MeshRole mesh = MeshRole::identity;
  double value = 0;  ///< a confidence from 0 to 1, or metres in one unit (unit_assumed); else 0
  Remedy remedy = Remedy::look_at_result;
  const KindWords* kind = nullptr;  ///< of the domain that says so (kept_words), where one does

  friend bool operator==(const Warning&, const Warning&) = default;
};

NPT_INLINE_CLASS(class, Warnings);
/// A list of warnings in place, so that a warm transfer allocates nothing.
template <class>
class BasicWarnings {
 public:
  /// Each code at most once a mesh, and no mesh has more than seven at a time.
  static constexpr std::size_t capacity = 16;

  void push_back(const Warning& warning) {
    if (size_ < capacity) items_[size_++] = warning;
  }
  void append(const Warnings& others) {
    for (const Warning& warning : others) push_back(warning);
  }
  void clear() noexcept { size_ = 0; }
  std::size_t size() const noexcept { return size_; }
  bool empty() const noexcept { return size_ == 0; }
  const Warning& operator[](std::size_t i) const { return items_[i]; }
  const Warning* begin() const noexcept { return items_.data(); }
  const Warning* end() const noexcept { return items_.data() + size_; }
  /// Whether a code is in the list.
  bool contains(WarningCode code) const {
    for (const Warning& warning : *this)
      if (warning.code == code) return true;
    return false;
  }

 private:
  std::array<Warning, capacity> items_{};
  std::size_t size_ = 0;
};

/// "66 %"
NPT_INLINE std::string percent_text(double fraction) { return std::to_string(std::lround(100 * fraction)) + " %"; }

/// What a warning says, without its remedy. identity, pose: what the meshes are called
NPT_INLINE std::string text_of(const Warning& warning, std::string_view identity, std::string_view pose) {
  using enum WarningCode;
  const std::string name(warning.mesh == MeshRole::identity ? identity : pose);
  static const KindWords any;
  const KindWords& kind = warning.kind == nullptr ? any : *warning.kind;
  switch (warning.code) {
    case not_recognised:
      return name + " is not recognised as " + with_article(kind.one) + " (confidence " + percent_text(warning.value) +
             ")";
    case low_confidence:
      return name + " is recognised as " + with_article(kind.one) + " with a low confidence of " +
             percent_text(warning.value);
    case no_surface:
      return name + " has no surface, so no body was estimated: the pose transfer network was used";
    case upside_down:
      return name + " stands upside down";
    case lying:
      return name + " lies or is bent over";
    case lying_or_z_up:
      return name + " lies, or its vertical axis is z";
    case arms_uncertain:
      return name + ": " + with_article(kind.upper_limb) + " may be in the wrong place";
    case legs_uncertain:
      return name + ": " + with_article(kind.lower_limb) + " may be in the wrong place";
    case unusual_proportions:
      return name + " has proportions that no " + kind.one + " has";
    case faces_inward:
      return name + " has faces that are turned inwards";
    case unit_assumed:
      return name + " is taken to be in " + unit_name(warning.value) + ", by its size";
    case part_of_mesh:
      return name + " is " + with_article(kind.one) + " in some of its pieces; the others are left as they are";
  }
  return name;
}

/// What a user can do, in plain words and without any program's options; empty for Remedy::none.
NPT_INLINE std::string text_of(Remedy remedy) {
  switch (remedy) {
    case Remedy::none:
      return {};
    case Remedy::look_at_result:
      return "look at the result before using it";
    case Remedy::choose_method:
      return "ask for the body method or for the network to get its result all the same";
    case Remedy::give_unit:
      return "say the unit of the mesh";
    case Remedy::give_weights:
      return "put the missing weights beside the others, or ask for the network alone";
  }
  return {};
}

}  // namespace npt::inline NPT_ABI
