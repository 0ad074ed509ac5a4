// Loops that are compiled once for each instruction set and chosen at run time. Internal to the libraries
// and not installed.
#pragma once

// Sanitizers run before the dispatcher is resolved and crash in it.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define HOOKE_CLONES __attribute__((target_clones("default", "arch=x86-64-v3", "arch=x86-64-v4")))
#else
#define HOOKE_CLONES
#endif
// Outputs never overlap inputs; compilers forget __restrict once a function is inlined.
#if defined(__clang__)
#define HOOKE_INDEPENDENT _Pragma("clang loop vectorize(assume_safety)")
#else
#define HOOKE_INDEPENDENT _Pragma("GCC ivdep")
#endif
#define HOOKE_INLINE static inline __attribute__((always_inline))
