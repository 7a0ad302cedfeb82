#pragma once

// One binary for every x86-64 processor that still uses the widest vectors it finds. The variant is
// picked at load time, which glibc can do, and where ThreadSanitizer crashes.
#if defined(__x86_64__) && defined(__GLIBC__) && !defined(__clang__) && \
    !defined(__SANITIZE_THREAD__)
#define MERL_SCAN_WIDEST_VECTORS __attribute__((target_clones("avx512f", "avx2", "default")))
// The same where each variant but the last multiplies and adds in one rounding: both give the same
// bits.
#define MERL_SCAN_WIDEST_VECTORS_FUSED \
    __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define MERL_SCAN_WIDEST_VECTORS
#define MERL_SCAN_WIDEST_VECTORS_FUSED
#endif
