// Functions that are compiled twice: with wider vector instructions where a processor has them.
#pragma once

// The run-time loader chooses. Both do the same operations, none of them contracted, so results are equal.
#if defined(__x86_64__) && defined(__GLIBC__) && defined(__GNUC__) && !defined(__clang__) && !defined(SANITIZED)
#define STAIRMAP_VECTORS __attribute__((target_clones("avx2", "default")))
#else
#define STAIRMAP_VECTORS
#endif
