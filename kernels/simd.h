// Internal: one body, compiled for the instruction sets of the processors there are, chosen at run time.
//
// KINESPACE_SIMD(name, result, (parameters), (arguments)) makes `name`, which runs name_body, a static function marked
// KINESPACE_SIMD_BODY, with the widest vectors that the processor has. The bits are the same on all of them:
// contraction is off, and loops vectorise over independent results only.
#pragma once

#if defined(__x86_64__) && defined(__GNUC__)
#define KINESPACE_SIMD_BODY static inline __attribute__((always_inline))
#define KINESPACE_SIMD(name, result, parameters, arguments)                                           \
  __attribute__((target("avx512f,prefer-vector-width=512"))) static result name##_avx512 parameters { \
    return name##_body arguments;                                                                     \
  }                                                                                                   \
  __attribute__((target("avx2"))) static result name##_avx2 parameters {                              \
    return name##_body arguments;                                                                     \
  }                                                                                                   \
  static result name##_plain parameters {                                                             \
    return name##_body arguments;                                                                     \
  }                                                                                                   \
  static result name parameters {                                                                     \
    static const auto chosen = __builtin_cpu_supports("avx512f") ? name##_avx512                      \
                               : __builtin_cpu_supports("avx2")  ? name##_avx2                        \
                                                                 : name##_plain;                       \
    return chosen arguments;                                                                          \
  }
#else
#define KINESPACE_SIMD_BODY static inline
#define KINESPACE_SIMD(name, result, parameters, arguments) \
  static result name parameters {                           \
    return name##_body arguments;                           \
  }
#endif
