// Loops that are compiled once for each instruction set and chosen at run time. Internal to the libraries
// and not installed.
#pragma once

// Sanitizers run before the dispatcher is resolved and crash in it.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define HOOKE_CLONES __attribute__((target_clones("default", "arch=x86-64-v3", "arch=x86-64-v4")))
// For loops over vectors of a length that is written down: HOOKE_WIDE for those of 64 bytes, to be called where
// has_wide_vectors, HOOKE_NARROW_CLONES for shorter ones.
#define HOOKE_WIDE __attribute__((target("arch=x86-64-v4,prefer-vector-width=512")))
#define HOOKE_NARROW_CLONES __attribute__((target_clones("default", "arch=x86-64-v3")))
#else
#define HOOKE_CLONES
#define HOOKE_NARROW_CLONES
#endif
// Outputs never overlap inputs; compilers forget __restrict once a function is inlined.
#if defined(__clang__)
#define HOOKE_INDEPENDENT _Pragma("clang loop vectorize(assume_safety)")
#else
#define HOOKE_INDEPENDENT _Pragma("GCC ivdep")
#endif
#define HOOKE_INLINE static inline __attribute__((always_inline))

namespace hooke {

inline bool has_wide_vectors() {
#if defined(HOOKE_WIDE)
  return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
         __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl");
#else
  return false;
#endif
}

}  // namespace hooke
