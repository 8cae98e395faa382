/// What help calls the value of an option that is a path. CLI11 would say TEXT, as it does of paths in texts.
#pragma once

#include <CLI/CLI.hpp>

#include <filesystem>
#include <optional>

namespace CLI::detail {

template <>
constexpr const char* type_name<std::filesystem::path>() {
  return "PATH";
}

template <>
constexpr const char* type_name<std::optional<std::filesystem::path>>() {
  return "PATH";
}

}  // namespace CLI::detail
