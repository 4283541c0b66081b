// FLEXFRAME_WIDE before a function: compiled for wider registers too, the version chosen when the program starts; FLEXFRAME_WIDEST: for the
// widest there are besides; FLEXFRAME_INLINE: a part of such functions. Floating-point operations are neither fused nor reordered, so that
// the results are the same.
#pragma once

// Not under sanitizers that watch every function: the choice is made before they are ready.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define FLEXFRAME_WATCHED
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define FLEXFRAME_WATCHED
#endif
#endif

#if defined(__x86_64__) && defined(__gnu_linux__) && !defined(FLEXFRAME_WATCHED)
#define FLEXFRAME_WIDE __attribute__((target_clones("avx2", "default")))
#define FLEXFRAME_WIDEST __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define FLEXFRAME_WIDE
#define FLEXFRAME_WIDEST
#endif

#define FLEXFRAME_INLINE [[gnu::always_inline]] inline
