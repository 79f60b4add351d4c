// One loop, compiled for several processors and chosen when the program starts.
//
// The build contracts no multiply-adds (cmake/KinespaceTargets.cmake), so every version computes the same bits.
#pragma once

// Sanitizers instrument the resolver that chooses, which runs before they are ready.
#if defined(__x86_64__) && defined(__gnu_linux__) && defined(__OPTIMIZE__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define KINESPACE_VECTOR_CLONES __attribute__((target_clones("avx2", "default")))
#else
#define KINESPACE_VECTOR_CLONES
#endif
