// SPDX-License-Identifier: Apache-2.0
// Compiles a function once for each vector width; the loader picks one by the processor's
// abilities. The functions so marked give the same bits in every clone: element-wise operations
// round alike at any width, -ffp-contract=off forbids fused operations, and sums have a fixed
// order (vector_operations.h).
#pragma once

// Sanitizer run-times are not ready when the loader resolves clones, so they get the plain build,
// with the same results.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define ZERODRIFT_VECTOR_CLONES __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define ZERODRIFT_VECTOR_CLONES
#endif

// Inlined into each clone, so that it is compiled for that clone's width.
#define ZERODRIFT_IN_CLONE __attribute__((always_inline)) inline
