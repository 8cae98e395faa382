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
                  "Of products: fp32; bf16 (error about 1e-2) where the processor multiplies bfloat16; with AMX also "
                  "bf16x2 (about 1e-5) and bf16x3 (as fp32); auto: bf16x3 where it is faster than fp32, fp32 elsewhere")
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
