/// The option --precision of several subcommands.
#pragma once

#include <npt/nn/engine/packed_program.hpp>

#include <CLI/CLI.hpp>

#include <string>

namespace program {

/// Texts: auto, fp32, bf16, bf16x2, bf16x3.
inline CLI::Option* add_precision_option(CLI::App& command, std::string& text) {
  return command
      .add_option("--precision", text,
                  "Multiply matrices in fp32, in bf16, which is least exact, or with AMX in bf16x2 or bf16x3, which is "
                  "as exact as fp32; auto: bf16x3 where it is faster than fp32, else fp32")
      ->check(CLI::IsMember({"auto", "fp32", "bf16", "bf16x2", "bf16x3"}))
      ->capture_default_str();
}

inline npt::Precision precision_from(const std::string& text) {
  for (const auto p : {npt::Precision::automatic, npt::Precision::bf16, npt::Precision::bf16x2, npt::Precision::bf16x3})
    if (text == npt::name_of(p)) return p;
  return npt::Precision::native;
}

/// As the option's texts.
inline std::string products_text(npt::Precision precision) {
  return precision == npt::Precision::native ? "fp32" : npt::name_of(precision);
}

/// The option, and what it became where that isn't the same.
inline std::string precision_text(const std::string& option, const std::string& products) {
  return option == products ? option : option + " (" + products + ")";
}

}  // namespace program
