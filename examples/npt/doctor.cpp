/// npt doctor: what this program was compiled for, what the machine has, and what to do about the difference.
#include "host/host.hpp"
#include "report.hpp"
#include "subcommand.hpp"

#include <npt/config.hpp>
#include <npt/nn/simd/batch.hpp>

#if NPT_HAS_TBB
#include <tbb/info.h>
#include <tbb/version.h>
#endif

#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

namespace doctor_command {

using program::Report;

/// One level of NPT_ABI, from the best down, and whether this processor (and operating system) runs it.
struct InstructionSet {
  std::string_view name;
  bool present;
};

std::vector<InstructionSet> instruction_sets() {
#if defined(__x86_64__) || defined(__i386__)
  const bool avx512 =
      __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw");
  return {{"avx512+bf16", avx512 && __builtin_cpu_supports("avx512bf16")},
          {"avx512", avx512},
          {"avx2+fma", __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")},
          {"avx", __builtin_cpu_supports("avx") != 0},
          {"sse4.2", __builtin_cpu_supports("sse4.2") != 0},
          {"sse4.1", __builtin_cpu_supports("sse4.1") != 0},
          {"sse2", __builtin_cpu_supports("sse2") != 0}};
#else
  return {{npt::compiled_isa(), true}};
#endif
}

/// The SIMD vocabulary's fma is rounded once: (1 + e)(1 - e) - 1 is -e^2, and 0 when the product is rounded first.
bool fma_is_fused() {
  volatile float e = 0x1p-13F;
  constexpr int lanes = npt::simd::lanes<float>;
  alignas(64) std::array<float, static_cast<std::size_t>(lanes)> result{};
  npt::simd::store(result.data(), npt::simd::fma(npt::simd::broadcast(1 + e), npt::simd::broadcast(1 - e),
                                                 npt::simd::broadcast(-1.0F)));
  return std::ranges::all_of(result, [](float v) { return v == -0x1p-26F; });
}

struct Machine {
  std::vector<InstructionSet> sets = instruction_sets();
  unsigned hardware_threads = std::thread::hardware_concurrency();
  int allowed = host::allowed_processors();
  std::optional<double> quota = host::processor_quota();
  double memory = host::memory_limit();
  bool fused = fma_is_fused();

  std::string best() const {
    const auto found = std::ranges::find_if(sets, &InstructionSet::present);
    return found == sets.end() ? "generic" : std::string(found->name);
  }
  int sensible_threads() const {
    const double granted = quota ? std::min<double>(*quota, allowed) : allowed;
    return std::max(1, static_cast<int>(std::floor(granted)));
  }
};

std::vector<std::string> advice(const Machine& machine) {
  std::vector<std::string> lines;
  const std::string_view compiled = npt::compiled_isa();
  if (machine.best() != compiled)  // a processor that has less than that never comes here: processor_guard.cpp
    lines.push_back("this processor has " + machine.best() + ", better than " + std::string(compiled) +
                    ": build again with -DNPT_NATIVE=ON");
#if !defined(NDEBUG)
  lines.emplace_back("built with assertions: for speed use cmake --preset release");
#endif
#if !defined(__OPTIMIZE__)
  lines.emplace_back("built without optimisation: for speed use cmake --preset release");
#endif
  if (!machine.fused)
    lines.emplace_back("multiplication and addition are not fused: half of the processor's speed is out of reach");
  if (machine.allowed < static_cast<int>(machine.hardware_threads))
    lines.push_back("this process may use " + std::to_string(machine.allowed) + " of " +
                    std::to_string(machine.hardware_threads) +
                    " hardware threads (taskset, container or batch system)");
  if (machine.quota && *machine.quota < machine.allowed)
    lines.push_back("a control group grants the time of " + program::internal::value_text(*machine.quota) +
                    " processors: give --threads " + std::to_string(machine.sensible_threads()));
  if (machine.memory < 1e9) lines.emplace_back("less than 1 GB of memory: large meshes may not fit");
  return lines;
}

Report examine() {
  const Machine machine;
  Report present = Report::array();
  for (const InstructionSet& set : machine.sets)
    if (set.present) present.push_back(set.name);
  Report report;
  report["version"] = NPT_VERSION;
#if defined(__clang__)
  report["compiler"] = std::string("clang++ ") + __clang_version__;
#else
  report["compiler"] = std::string("g++ ") + __VERSION__;
#endif
  report["compiled_for"] = npt::compiled_isa();
  report["processor_has"] = present;
  report["lanes_of_float"] = npt::simd::lanes<float>;
  report["fused_multiply_add"] = machine.fused;
  report["processor"] = host::processor_name();
  report["hardware_threads"] = machine.hardware_threads;
  report["threads_allowed"] = machine.allowed;
  report["processor_quota"] = machine.quota ? Report(*machine.quota) : Report("none");
#if NPT_HAS_TBB
  report["threads_of_tbb"] = tbb::info::default_concurrency();
  report["tbb"] = TBB_runtime_version();
#else
  report["tbb"] = "none";
#endif
  report["memory_gb"] = std::round(machine.memory / 1e8) / 10;
  report["advice"] = advice(machine);
  return report;
}

void run(bool json) {
  Report report = examine();
  if (json) {
    std::cout << report.dump(2) << '\n';
    return;
  }
  const Report advice = report["advice"];
  report.erase("advice");
  program::print(std::cout, report);
  std::cout << '\n';
  for (const Report& line : advice) std::cout << "advice: " << line.get<std::string>() << '\n';
  if (advice.empty()) std::cout << "Nothing to advise: this build fits this machine.\n";
}

void add(CLI::App& command) {
  auto json = std::make_shared<bool>(false);
  command.add_flag("--json", *json, "Print JSON");
  command.callback([json] { run(*json); });
}

const program::Subcommand registered("doctor", "Check this build on this machine, and give advice", add);

}  // namespace doctor_command
