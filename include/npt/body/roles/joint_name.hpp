/// A joint's name as its side and the words that dialects.hpp lists: "mixamorig1:LeftUpLeg", "upleg_l", "Bip01 L UpLeg"
/// and "J_Bip_L_UpLeg" are all the left side's "upleg".
#pragma once

#include <npt/body/roles/dialects.hpp>
#include <npt/config.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

struct JointName {
  std::optional<std::size_t> side{};  ///< 0 left, 1 right
  /// The name in lower case without side, prefix and separators; then without the zeros before its last number, and
  /// without that number, which exporters add. The better one first.
  std::vector<std::string> words{};
};

namespace internal {

inline bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c & 0x80) != 0; }
inline bool is_upper(char c) { return c >= 'A' && c <= 'Z'; }
inline bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// "LHipJoint01" to "l", "hip", "joint", "01".
inline std::vector<std::string> name_tokens(std::string_view name) {
  std::vector<std::string> tokens;
  for (std::size_t i = 0; i < name.size(); ++i) {
    const char c = name[i], last = i > 0 ? name[i - 1] : ' ', next = i + 1 < name.size() ? name[i + 1] : ' ';
    if (!is_letter(c) && !is_digit(c)) continue;
    const bool same = is_letter(c) ? is_letter(last) : is_digit(last);
    const bool begins = is_upper(c) && (!is_upper(last) || (is_letter(next) && !is_upper(next)));
    if (!same || begins) tokens.emplace_back();
    tokens.back() += is_upper(c) ? static_cast<char>(c - 'A' + 'a') : c;
  }
  return tokens;
}

/// Takes a side's word off a token: all of it, or what it begins or ends with where that can't be another word.
inline std::optional<std::size_t> take_side(std::string& token) {
  constexpr std::array<std::pair<std::string_view, std::size_t>, 8> whole{
      {{"l", 0}, {"left", 0}, {"lft", 0}, {"lt", 0}, {"r", 1}, {"right", 1}, {"rgt", 1}, {"rt", 1}}};
  constexpr std::array<std::pair<std::string_view, std::size_t>, 4> part{
      {{"left", 0}, {"right", 1}, {"左", 0}, {"右", 1}}};
  for (const auto& [word, side] : whole)
    if (token == word) {
      token.clear();
      return side;
    }
  for (const auto& [word, side] : part) {
    if (token.size() <= word.size()) continue;
    if (token.starts_with(word))
      token.erase(0, word.size());
    else if (token.ends_with(word))
      token.erase(token.size() - word.size());
    else
      continue;
    return side;
  }
  return std::nullopt;
}

}  // namespace internal

inline JointName parse_joint_name(std::string_view name) {
  name = name.substr(name.find_last_of(":|") + 1);
  JointName parsed;
  std::vector<std::string> tokens = internal::name_tokens(name);
  for (std::string& token : tokens)
    if (!parsed.side) parsed.side = internal::take_side(token);
  std::erase(tokens, "");
  // Prefixes may have a number: "Bip01". What is left must not be empty: "Armature" is a name, too.
  const auto is_prefix = [](const std::string& token) {
    return std::ranges::find(joint_prefixes, token) != joint_prefixes.end();
  };
  std::size_t first = 0;
  while (first + 1 < tokens.size() && is_prefix(tokens[first])) {
    std::size_t next = first + 1;
    if (internal::is_digit(tokens[next].front())) ++next;
    if (next >= tokens.size()) break;
    first = next;
  }
  std::string word;
  for (std::size_t i = first; i < tokens.size(); ++i) word += tokens[i];
  parsed.words.push_back(word);
  if (tokens.size() > first + 1 && internal::is_digit(tokens.back().front())) {
    const std::string number = tokens.back();
    const std::string stem = word.substr(0, word.size() - number.size());
    const std::size_t zeros = std::min(number.find_first_not_of('0'), number.size() - 1);
    if (zeros > 0) parsed.words.push_back(stem + number.substr(zeros));
    parsed.words.push_back(stem);
  }
  return parsed;
}

}  // namespace npt::inline NPT_ABI
