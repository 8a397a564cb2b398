#pragma once

/// Marks a function whose plain loops the compiler should also build for wider vectors, chosen at load time. Results
/// are the same bits in every version, since contraction is off (deploy/cmake/GatefieldTargets.cmake) and no reduction
/// is reordered. Sanitizers and other compilers get the plain version.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define GATEFIELD_MULTIVERSION __attribute__((target_clones("default", "arch=x86-64-v3", "arch=x86-64-v4")))
#else
#define GATEFIELD_MULTIVERSION
#endif
