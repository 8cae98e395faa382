/// What `npt info` and `npt doctor` say: named values, printed for people or, with --json, for programs.
#pragma once

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <ostream>
#include <string>
#include <vector>

namespace program {

/// Keys are words joined by '_'; they keep their order.
using Report = nlohmann::ordered_json;

namespace internal {

inline std::string with_blanks(std::string key) {
  std::ranges::replace(key, '_', ' ');
  return key;
}

/// Numbers with a fraction in six digits: enough to recognise, short enough to read.
inline std::string value_text(const Report& value) {
  if (value.is_string()) return value.get<std::string>();
  if (value.is_boolean()) return value.get<bool>() ? "yes" : "no";
  if (value.is_number_float()) {
    char text[32];
    std::snprintf(text, sizeof text, "%.6g", value.get<double>());
    return text;
  }
  if (!value.is_structured()) return value.dump();
  std::string text;
  for (const auto& [key, entry] : value.items())
    text +=
        (text.empty() ? "" : ", ") + (value.is_object() ? with_blanks(key) + " " : std::string()) + value_text(entry);
  return text;
}

}  // namespace internal

/// Lines "key  value"; an array of objects gets a line for each.
inline void print(std::ostream& out, const Report& report) {
  std::size_t width = 0;
  for (const auto& [key, value] : report.items()) width = std::max(width, key.size());
  for (const auto& [key, value] : report.items()) {
    if (value.is_array() && !value.empty() && value.front().is_object()) {
      out << internal::with_blanks(key) << '\n';
      for (const Report& entry : value) {
        std::string line;
        for (const Report& part : entry) line += "  " + internal::value_text(part);
        out << line << '\n';
      }
    } else {
      out << internal::with_blanks(key) << std::string(width + 2 - key.size(), ' ') << internal::value_text(value)
          << '\n';
    }
  }
}

}  // namespace program
