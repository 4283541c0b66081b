// FLEXFRAME_WIDE before a function: compiled for wider registers too, the version chosen when the program starts. Floating-point
// operations are neither fused nor reordered, so that the results are the same.
#pragma once

// Not under sanitizers: the choice is made before they are ready.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define FLEXFRAME_WIDE __attribute__((target_clones("avx2", "default")))
#else
#define FLEXFRAME_WIDE
#endif
