/// Tests that need products of values in one bfloat16 part.
#pragma once

#include <npt/nn/kernel/amx_kernel.hpp>

#include "support/needs.hpp"

namespace support {

inline Needs needs_bf16_words() { return {npt::kernel::has_word_products(1), "matrix registers (AMX) or AVX512_BF16"}; }

}  // namespace support
