/// Version, which builds and packages read here, tag and the few macros of npt. All else in the library is macro-free.
///
/// Every entity lives in `npt::NPT_ABI`, an inline namespace named after the major version, the instruction set that
/// the translation unit is compiled for, and its default executor. Two units of one program built with different -march
/// flags therefore use two sets of symbols, and the linker can't pick AVX-512 code for a machine without it. Two that
/// disagree about oneTBB don't share an engine: where one asks for the other's function, the link fails.
#pragma once

// MSVC says 199711 without /Zc:__cplusplus, and the truth in _MSVC_LANG.
#if defined(_MSVC_LANG) ? _MSVC_LANG < 202002L : __cplusplus < 202002L
#error "npt needs C++20 (-std=c++20)"
#endif

// A NaN that goes in comes out, it never becomes a plausible mesh: -ffinite-math-only, a part of -ffast-math and
// -Ofast, lets the compiler take it for a number.
#if defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__ && !defined(NPT_ALLOW_FINITE_MATH_ONLY)
#error "npt: NaN is lost with -ffast-math: add -fno-finite-math-only (or -DNPT_ALLOW_FINITE_MATH_ONLY)"
#endif

#include <cassert>

#define NPT_VERSION_MAJOR 1
#define NPT_VERSION_MINOR 0
#define NPT_VERSION_PATCH 0
#define NPT_VERSION NPT_TEXT(NPT_VERSION_MAJOR) "." NPT_TEXT(NPT_VERSION_MINOR) "." NPT_TEXT(NPT_VERSION_PATCH)
#define NPT_TEXT(word) NPT_TEXT_OF(word)  // in two steps: # takes a macro's name as it stands
#define NPT_TEXT_OF(word) #word
#define NPT_VERSION_TAG(major, rest) NPT_VERSION_JOINED(major, rest)
#define NPT_VERSION_JOINED(major, rest) v##major##rest

/// Whether registers are xsimd's: 0 where NPT_PORTABLE_SIMD is defined, where xsimd is missing, and for architectures
/// that its older versions don't know. Registers are then the compiler's own vectors.
#if !defined(NPT_PORTABLE_SIMD) && __has_include(<xsimd/xsimd.hpp>) && \
    (defined(__SSE2__) || defined(_M_X64) || defined(__aarch64__) || defined(_M_ARM64))
#define NPT_HAS_XSIMD 1
#else
#define NPT_HAS_XSIMD 0
#endif

/// Whether this unit may use matrix registers (AMX) for bfloat16 products. g++ and clang name the macros differently.
#if NPT_HAS_XSIMD && defined(__AVX512BF16__) && defined(__AVX512BW__) && defined(__AVX512DQ__) && \
    defined(__linux__) &&                                                                         \
    ((defined(__AMX_TILE__) && defined(__AMX_BF16__)) || (defined(__AMXTILE__) && defined(__AMXBF16__)))
#define NPT_HAS_AMX 1
#else
#define NPT_HAS_AMX 0
#endif

/// Whether engines run on oneTBB unless told otherwise: 0 where NPT_NO_TBB is defined, and where its headers are
/// missing. Engines are then serial, or on std::thread where NPT_DEFAULT_THREADS is defined.
#if !defined(NPT_NO_TBB) && __has_include(<tbb/task_arena.h>)
#define NPT_HAS_TBB 1
#else
#define NPT_HAS_TBB 0
#endif

// What makes registers and what DefaultExecutor is changes types and functions everywhere.
#if NPT_HAS_XSIMD && NPT_HAS_TBB
#define NPT_TAG(set) NPT_VERSION_TAG(NPT_VERSION_MAJOR, _##set)
#elif NPT_HAS_XSIMD && defined(NPT_DEFAULT_THREADS)
#define NPT_TAG(set) NPT_VERSION_TAG(NPT_VERSION_MAJOR, _threads_##set)
#elif NPT_HAS_XSIMD
#define NPT_TAG(set) NPT_VERSION_TAG(NPT_VERSION_MAJOR, _serial_##set)
#elif NPT_HAS_TBB
#define NPT_TAG(set) NPT_VERSION_TAG(NPT_VERSION_MAJOR, _portable_##set)
#elif defined(NPT_DEFAULT_THREADS)
#define NPT_TAG(set) NPT_VERSION_TAG(NPT_VERSION_MAJOR, _portable_threads_##set)
#else
#define NPT_TAG(set) NPT_VERSION_TAG(NPT_VERSION_MAJOR, _portable_serial_##set)
#endif

// Every feature that npt or xsimd asks for has its part in the tag, also in combinations that only flags can name.
#if NPT_HAS_AMX
#define NPT_ABI NPT_TAG(avx512amx)
#define NPT_ISA_NAME "avx512+bf16"  // AMX is asked for at run time
#elif defined(__AVX512F__) && defined(__AVX512DQ__) && defined(__AVX512BW__) && defined(__AVX512BF16__)
#define NPT_ABI NPT_TAG(avx512bf16)
#define NPT_ISA_NAME "avx512+bf16"
#elif defined(__AVX512F__) && defined(__AVX512DQ__) && defined(__AVX512BW__)
#define NPT_ABI NPT_TAG(avx512)
#define NPT_ISA_NAME "avx512"
#elif defined(__AVX512F__) && defined(__AVX512BW__) && defined(__AVX512BF16__)
#define NPT_ABI NPT_TAG(avx512f_bw_bf16)
#define NPT_ISA_NAME "avx512f+bw+bf16"
#elif defined(__AVX512F__) && defined(__AVX512BW__)
#define NPT_ABI NPT_TAG(avx512f_bw)
#define NPT_ISA_NAME "avx512f+bw"
#elif defined(__AVX512F__) && defined(__AVX512DQ__)
#define NPT_ABI NPT_TAG(avx512f_dq)
#define NPT_ISA_NAME "avx512f+dq"
#elif defined(__AVX512F__)
#define NPT_ABI NPT_TAG(avx512f)
#define NPT_ISA_NAME "avx512f"
#elif defined(__AVX2__) && defined(__FMA__)
#define NPT_ABI NPT_TAG(avx2fma)
#define NPT_ISA_NAME "avx2+fma"
#elif defined(__AVX2__)
#define NPT_ABI NPT_TAG(avx2)
#define NPT_ISA_NAME "avx2"
#elif defined(__AVX__) && defined(__FMA__)
#define NPT_ABI NPT_TAG(avxfma)
#define NPT_ISA_NAME "avx+fma"
#elif defined(__AVX__)
#define NPT_ABI NPT_TAG(avx)
#define NPT_ISA_NAME "avx"
#elif defined(__SSE4_2__)
#define NPT_ABI NPT_TAG(sse42)
#define NPT_ISA_NAME "sse4.2"
#elif defined(__SSE4_1__)
#define NPT_ABI NPT_TAG(sse4)
#define NPT_ISA_NAME "sse4.1"
#elif defined(__SSSE3__)
#define NPT_ABI NPT_TAG(ssse3)
#define NPT_ISA_NAME "ssse3"
#elif defined(__SSE3__)
#define NPT_ABI NPT_TAG(sse3)
#define NPT_ISA_NAME "sse3"
#elif defined(__SSE2__) || defined(_M_X64)
#define NPT_ABI NPT_TAG(sse2)
#define NPT_ISA_NAME "sse2"
#elif (defined(__aarch64__) || defined(_M_ARM64)) && defined(__ARM_FEATURE_BF16_VECTOR_ARITHMETIC)
#define NPT_ABI NPT_TAG(neon64bf16)
#define NPT_ISA_NAME "neon64+bf16"
#elif defined(__aarch64__) && defined(__clang__)
#define NPT_ABI NPT_TAG(neon64clang)  // whose tiles are taller than g++'s
#define NPT_ISA_NAME "neon64"
#elif defined(__aarch64__) || defined(_M_ARM64)
#define NPT_ABI NPT_TAG(neon64)
#define NPT_ISA_NAME "neon64"
#else
#define NPT_ABI NPT_TAG(generic)
#define NPT_ISA_NAME "generic"
#endif

/// Stands before an ordinary function that a header defines. It makes a template of it, whose parameter nobody names:
/// units then parse the function, and only those that call it compile it. With `inline` alone each unit that includes
/// the header pays for it, a fifth of the umbrella's time in the compiler. `inline` stays beside it, as it lets g++
/// expand more. Where a library were compiled, NPT_INLINE would be empty, and the definitions in units of their own.
///
/// Not for: what is constexpr, operators, functions whose address is taken, what several units must agree on without a
/// header (NPT_COMPILED declares it).
#define NPT_INLINE        \
  template <class = void> \
  inline

/// The same for a class, whose members then cost only units that call them: declares the template BasicNAME and its
/// alias NAME; `template <class> class BasicNAME {` follows. 26 of 37 so save g++ 23 % of the umbrella's instructions.
#define NPT_INLINE_CLASS(kind, name) \
  template <class = void>            \
  kind Basic##name;                  \
  using name = Basic##name<>

/// Defined by target npt::compiled (cmake/compiled) for units that link it: what takes long is then declared only,
/// - kernels and engines on the default executor, the list of all networks, PoseTransfer and readers of weights, which
///   are `extern template`, so that the umbrella includes their classes only (core_class.hpp, pose_transfer_class.hpp);
/// - readers and writers of mesh files, the body method and the mannequin's tables.
/// NPT_COMPILING is what that library's own units define before those headers, to define what the others only declare.
#if defined(NPT_COMPILING) && !defined(NPT_COMPILED)
#error "npt: NPT_COMPILING is for the units of cmake/compiled, which define NPT_COMPILED"
#endif

#ifdef NPT_COMPILED_ABI
static_assert(
    [](const char* a, const char* b) {
      while (*a != 0 && *a == *b) ++a, ++b;
      return *a == *b;
    }(NPT_TEXT(NPT_COMPILED_ABI), NPT_TEXT(NPT_ABI)),
    "npt: unit for " NPT_TEXT(NPT_ABI) ", npt::compiled for " NPT_TEXT(NPT_COMPILED_ABI) ": give both the same -march");
#endif

/// A broken precondition inside the library, never bad user data (that is an npt::Error).
#define NPT_ASSERT(condition) assert(condition)

#if defined(__GNUC__)
#define NPT_ALWAYS_INLINE inline __attribute__((always_inline))
#define NPT_NOINLINE __attribute__((noinline))
#define NPT_LAMBDA_INLINE __attribute__((always_inline))
#define NPT_RESTRICT __restrict__
#elif defined(_MSC_VER)
#define NPT_ALWAYS_INLINE __forceinline
#define NPT_NOINLINE __declspec(noinline)
#define NPT_LAMBDA_INLINE
#define NPT_RESTRICT __restrict
#else
#define NPT_ALWAYS_INLINE inline
#define NPT_NOINLINE
#define NPT_LAMBDA_INLINE
#define NPT_RESTRICT
#endif

namespace npt::inline NPT_ABI {

/// The instruction set this translation unit was compiled for, as in the name of the inline namespace.
constexpr const char* compiled_isa() noexcept { return NPT_ISA_NAME; }

}  // namespace npt::inline NPT_ABI
