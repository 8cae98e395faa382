/// What the program was compiled for against what the processor has. Nothing else in the program works where they
/// differ, so what stands behind this header is compiled for the oldest processor and uses no templates and no inline
/// functions: a linker keeps any one of their copies, which may be one that needs the missing instructions.
#pragma once

#include <cstddef>

namespace program {

/// Extensions of x86-64 that compilers use on their own when they may.
enum Feature : unsigned {
  sse3,
  ssse3,
  sse4_1,
  sse4_2,
  popcnt,
  avx,
  avx2,
  fma,
  bmi,
  bmi2,
  avx512f,
  avx512cd,
  avx512er,
  avx512vl,
  avx512bw,
  avx512dq,
  avx512ifma,
  avx512vbmi,
  avx512vbmi2,
  avx512vnni,
  avx512bitalg,
  avx512vpopcntdq,
  avx512bf16,
  feature_count
};

/// Bit f: there is Feature f.
using FeatureSet = unsigned;

/// Of the program's ordinary units. Constants, so that reading them runs no code of such a unit.
extern const FeatureSet compiled_features;
extern const char* const compiled_for;  ///< npt::compiled_isa()

/// Of this processor, as far as the operating system lets programs use them. All of them where it is no x86-64.
FeatureSet processor_features() noexcept;

/// Writes one line that names what of `needed` the processor lacks, and what to do, cut to `size` characters. Returns
/// its length; 0 where nothing is missing.
std::size_t complain_of_missing(FeatureSet needed, FeatureSet has, const char* compiled, char* line,
                                std::size_t size) noexcept;

}  // namespace program
