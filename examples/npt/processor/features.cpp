#include "processor/features.hpp"

#include <cstddef>

namespace program {

namespace {

const char* const names[feature_count] = {"sse3",         "ssse3",
                                          "sse4.1",       "sse4.2",
                                          "popcnt",       "avx",
                                          "avx2",         "fma",
                                          "bmi",          "bmi2",
                                          "avx512f",      "avx512cd",
                                          "avx512er",     "avx512vl",
                                          "avx512bw",     "avx512dq",
                                          "avx512ifma",   "avx512vbmi",
                                          "avx512vbmi2",  "avx512vnni",
                                          "avx512bitalg", "avx512vpopcntdq",
                                          "avx512bf16"};

}  // namespace

FeatureSet processor_features() noexcept {
#if defined(__x86_64__)
  FeatureSet set = 0;
  const auto add = [&set](Feature feature, int present) { set |= (present != 0 ? 1U : 0U) << feature; };
  __builtin_cpu_init();
  add(sse3, __builtin_cpu_supports("sse3"));
  add(ssse3, __builtin_cpu_supports("ssse3"));
  add(sse4_1, __builtin_cpu_supports("sse4.1"));
  add(sse4_2, __builtin_cpu_supports("sse4.2"));
  add(popcnt, __builtin_cpu_supports("popcnt"));
  add(avx, __builtin_cpu_supports("avx"));
  add(avx2, __builtin_cpu_supports("avx2"));
  add(fma, __builtin_cpu_supports("fma"));
  add(bmi, __builtin_cpu_supports("bmi"));
  add(bmi2, __builtin_cpu_supports("bmi2"));
  add(avx512f, __builtin_cpu_supports("avx512f"));
  add(avx512cd, __builtin_cpu_supports("avx512cd"));
#if !defined(__clang__) || __clang_major__ < 19  // which neither knows Xeon Phi nor compiles for it
  add(avx512er, __builtin_cpu_supports("avx512er"));
#endif
  add(avx512vl, __builtin_cpu_supports("avx512vl"));
  add(avx512bw, __builtin_cpu_supports("avx512bw"));
  add(avx512dq, __builtin_cpu_supports("avx512dq"));
  add(avx512ifma, __builtin_cpu_supports("avx512ifma"));
  add(avx512vbmi, __builtin_cpu_supports("avx512vbmi"));
  add(avx512vbmi2, __builtin_cpu_supports("avx512vbmi2"));
  add(avx512vnni, __builtin_cpu_supports("avx512vnni"));
  add(avx512bitalg, __builtin_cpu_supports("avx512bitalg"));
  add(avx512vpopcntdq, __builtin_cpu_supports("avx512vpopcntdq"));
  add(avx512bf16, __builtin_cpu_supports("avx512bf16"));
  return set;
#else
  return ~FeatureSet{0};
#endif
}

std::size_t complain_of_missing(FeatureSet needed, FeatureSet has, const char* compiled, char* line,
                                std::size_t size) noexcept {
  std::size_t length = 0;
  const auto add = [&](const char* text) {
    while (*text != '\0' && length < size) line[length++] = *text++;
  };
  const FeatureSet missing = needed & ~has;
  if (missing == 0) return 0;
  add("npt: error: this program was compiled for ");
  add(compiled);
  add(", and this processor lacks");
  for (unsigned f = 0; f < feature_count; ++f)
    if ((missing >> f & 1U) != 0) {
      add(" ");
      add(names[f]);
    }
  add(": build it on this machine, or with cmake -DNPT_NATIVE=OFF for every x86-64 processor\n");
  return length;
}

}  // namespace program
