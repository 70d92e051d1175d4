#pragma once

namespace nullmark {

// clang-format off
/// X(name, macro): what a CPU may lack, as __builtin_cpu_supports calls it, and what the compiler defines where it uses it.
#define NULLMARK_CPU_FEATURES(X) \
  X("sse3", __SSE3__) X("ssse3", __SSSE3__) X("sse4.1", __SSE4_1__) X("sse4.2", __SSE4_2__) X("popcnt", __POPCNT__) \
  X("fma4", __FMA4__) X("xop", __XOP__) X("aes", __AES__) X("pclmul", __PCLMUL__) \
  X("avx", __AVX__) X("fma", __FMA__) X("bmi", __BMI__) X("bmi2", __BMI2__) X("avx2", __AVX2__) \
  X("avx512f", __AVX512F__) X("avx512cd", __AVX512CD__) X("avx512dq", __AVX512DQ__) X("avx512bw", __AVX512BW__) \
  X("avx512vl", __AVX512VL__) X("avx512ifma", __AVX512IFMA__) X("avx512vbmi", __AVX512VBMI__) \
  X("avx512vbmi2", __AVX512VBMI2__) X("avx512vnni", __AVX512VNNI__) X("avx512bitalg", __AVX512BITALG__) \
  X("avx512vpopcntdq", __AVX512VPOPCNTDQ__) X("avx512bf16", __AVX512BF16__) X("gfni", __GFNI__) X("vpclmulqdq", __VPCLMULQDQ__)
// clang-format on

/// Of each feature, whether the program was built for it.
extern const bool kNeededFeatures[];

/// Ends the process with one line and ExitCode::input_error if this CPU lacks a feature that is needed.
void check_cpu(const bool needed[]);

}  // namespace nullmark
