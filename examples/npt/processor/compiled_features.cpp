#include "processor/features.hpp"

#include <npt/config.hpp>

namespace program {

const char* const compiled_for = npt::compiled_isa();

const FeatureSet compiled_features = 0
#if defined(__SSE3__)
                                     | 1U << sse3
#endif
#if defined(__SSSE3__)
                                     | 1U << ssse3
#endif
#if defined(__SSE4_1__)
                                     | 1U << sse4_1
#endif
#if defined(__SSE4_2__)
                                     | 1U << sse4_2
#endif
#if defined(__POPCNT__)
                                     | 1U << popcnt
#endif
#if defined(__AVX__)
                                     | 1U << avx
#endif
#if defined(__AVX2__)
                                     | 1U << avx2
#endif
#if defined(__FMA__)
                                     | 1U << fma
#endif
#if defined(__BMI__)
                                     | 1U << bmi
#endif
#if defined(__BMI2__)
                                     | 1U << bmi2
#endif
#if defined(__AVX512F__)
                                     | 1U << avx512f
#endif
#if defined(__AVX512CD__)
                                     | 1U << avx512cd
#endif
#if defined(__AVX512ER__)
                                     | 1U << avx512er
#endif
#if defined(__AVX512VL__)
                                     | 1U << avx512vl
#endif
#if defined(__AVX512BW__)
                                     | 1U << avx512bw
#endif
#if defined(__AVX512DQ__)
                                     | 1U << avx512dq
#endif
#if defined(__AVX512IFMA__)
                                     | 1U << avx512ifma
#endif
#if defined(__AVX512VBMI__)
                                     | 1U << avx512vbmi
#endif
#if defined(__AVX512VBMI2__)
                                     | 1U << avx512vbmi2
#endif
#if defined(__AVX512VNNI__)
                                     | 1U << avx512vnni
#endif
#if defined(__AVX512BITALG__)
                                     | 1U << avx512bitalg
#endif
#if defined(__AVX512VPOPCNTDQ__)
                                     | 1U << avx512vpopcntdq
#endif
#if defined(__AVX512BF16__)
                                     | 1U << avx512bf16
#endif
    ;

}  // namespace program
