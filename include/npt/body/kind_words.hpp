/// What messages call the bodies of a kind and their limbs.
/// Memory    equal words are kept once, as long as the program runs: warnings and results name them
#pragma once

#include <npt/config.hpp>

#include <forward_list>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>

namespace npt::inline NPT_ABI {

struct KindWords {
  std::string one = "body", many = "bodies";  ///< "person", "people"
  std::string upper_limb = "limb";            ///< of a pair that hangs from a girdle: "arm", "foreleg"
  std::string lower_limb = "limb";            ///< of one that hangs from the trunk: "leg", "hindleg"

  friend bool operator==(const KindWords&, const KindWords&) = default;
};

/// "an arm", "a leg"
NPT_INLINE std::string with_article(const std::string& word) {
  const bool vowel = !word.empty() && std::string_view("aeiou").find(word.front()) != std::string_view::npos;
  return (vowel ? "an " : "a ") + word;
}

/// The same address for equal words.
NPT_INLINE const KindWords& kept_words(KindWords words) {
  static std::mutex mutex;
  static std::forward_list<KindWords> kept;
  const std::scoped_lock lock(mutex);
  for (const KindWords& known : kept)
    if (known == words) return known;
  return kept.emplace_front(std::move(words));
}

}  // namespace npt::inline NPT_ABI
