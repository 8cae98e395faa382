/// npt bench transfer: what a transfer costs a user, from meshes in memory to the result.
#pragma once

#include <CLI/CLI.hpp>

namespace program {

void add_bench_transfer(CLI::App& bench);

}  // namespace program
