/// What an engine multiplies in.
#pragma once

#include <npt/config.hpp>

namespace npt::inline NPT_ABI {

/// What the products are computed in. All else (moments, modulation, feature maps) is always the engine's scalar.
enum class Precision {
  native,     ///< the engine's scalar
  bf16,       ///< products of bfloat16 values summed in fp32
  bf16x2,     ///< values as sums of two bfloat16 values, three products: error about 2^-16; matrix registers (AMX)
  bf16x3,     ///< values as sums of three, six products: the error of fp32; matrix registers
  automatic,  ///< bf16x3 where it is faster than native, native elsewhere: no error that fp32 doesn't have
};

/// The name of a precision in options and reports.
constexpr const char* name_of(Precision precision) {
  constexpr const char* names[] = {"native", "bf16", "bf16x2", "bf16x3", "auto"};
  return names[static_cast<int>(precision)];
}

/// bfloat16 parts of a value in a precision, which is not `automatic`; 0: none.
constexpr int parts_of(Precision precision) {
  NPT_ASSERT(precision != Precision::automatic);
  return static_cast<int>(precision);
}

}  // namespace npt::inline NPT_ABI
