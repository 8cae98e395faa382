/// npt bench train: a whole training step beside the processor's peak.
#pragma once

#include <CLI/CLI.hpp>

namespace program {

void add_bench_train(CLI::App& bench);

}  // namespace program
