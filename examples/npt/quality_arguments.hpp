/// The arguments that make transfers better at the cost of time, shared by `npt transfer` and `npt evaluate`. docs/transfer.md
/// has their measured effect.
#pragma once

#include "transfer_backend.hpp"

#include <CLI/CLI.hpp>

namespace program {

inline void add_quality_options(CLI::App& command, TransferOptions& options) {
  command
      .add_option("--pairings", options.pairings,
                  "Average over so many random pairings of pose and identity vertices (per-vertex feature)")
      ->check(CLI::Range(1, 10000))
      ->capture_default_str();
  command.add_flag("--mirror", options.mirror,
                   "Average with the transfer of the mirror images, left to right; for symmetric subjects");
  CLI::Option* refine =
      command.add_flag("--refine", options.refine, "Give results the identity's surface detail (needs Eigen)");
  command
      .add_option("--refine-radius", options.refine_radius,
                  "Detail below this size comes from the identity, as a share of the root of its area; without: as the "
                  "weights say, or 0.04")
      ->check(CLI::Range(1e-6, 10.0))
      ->needs(refine);
}

}  // namespace program
