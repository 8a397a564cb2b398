// What one core can do at best: multiply-adds on registers alone. Fractions of peak in docs/performance.md refer to it.

#include <benchmark/benchmark.h>

#include "tests/bench/register.h"

#if defined(__x86_64__)
#include <cpuid.h>
#include <immintrin.h>

namespace gatefield::bench {
namespace {

constexpr int kTurns = 4096;
constexpr int kSums = 16;  // more than latency times throughput

__attribute__((target("avx2,fma"))) void fma_avx2() {
  __m256 sums[kSums / 2 + 4];
  for (__m256& sum : sums) sum = _mm256_setzero_ps();
  const __m256 a = _mm256_set1_ps(1.0f), b = _mm256_set1_ps(1e-9f);
  for (int i = 0; i < kTurns; ++i) {
#pragma GCC unroll 16
    for (__m256& sum : sums) asm("vfmadd231ps %1, %2, %0" : "+x"(sum) : "x"(a), "x"(b));
  }
  for (__m256& sum : sums) asm volatile("" : : "x"(sum));
}

__attribute__((target("avx512f"))) void fma_avx512() {
  __m512 sums[kSums];
  for (__m512& sum : sums) sum = _mm512_setzero_ps();
  const __m512 a = _mm512_set1_ps(1.0f), b = _mm512_set1_ps(1e-9f);
  for (int i = 0; i < kTurns; ++i) {
#pragma GCC unroll 16
    for (__m512& sum : sums) asm("vfmadd231ps %1, %2, %0" : "+v"(sum) : "v"(a), "v"(b));
  }
  for (__m512& sum : sums) asm volatile("" : : "v"(sum));
}

__attribute__((target("avx512f"))) void dot_bf16() {
  __m512 sums[kSums];
  for (__m512& sum : sums) sum = _mm512_setzero_ps();
  const __m512i a = _mm512_setzero_si512();
  for (int i = 0; i < kTurns; ++i) {
#pragma GCC unroll 16
    for (__m512& sum : sums) asm("vdpbf16ps %1, %1, %0" : "+v"(sum) : "v"(a));
  }
  for (__m512& sum : sums) asm volatile("" : : "v"(sum));
}

__attribute__((target("avx512f"))) void dot_int16() {
  __m512i sums[kSums];
  for (__m512i& sum : sums) sum = _mm512_setzero_si512();
  const __m512i a = _mm512_setzero_si512();
  for (int i = 0; i < kTurns; ++i) {
#pragma GCC unroll 16
    for (__m512i& sum : sums) asm("vpdpwssd %1, %1, %0" : "+v"(sum) : "v"(a));
  }
  for (__m512i& sum : sums) asm volatile("" : : "v"(sum));
}

bool has_int16() {
  unsigned a = 0, b = 0, c = 0, d = 0;
  return __builtin_cpu_supports("avx512f") && __get_cpuid_count(7, 0, &a, &b, &c, &d) != 0 && (c >> 11 & 1) != 0;
}

bool has_bf16() {
  unsigned a = 0, b = 0, c = 0, d = 0;
  return __builtin_cpu_supports("avx512f") && __get_cpuid_count(7, 1, &a, &b, &c, &d) != 0 && (a >> 5 & 1) != 0;
}

void add(const char* name, void (*loop)(), double products) {
  benchmark::RegisterBenchmark(name, [loop, products](benchmark::State& state) {
    for (auto _ : state) loop();
    state.counters["MAC/s"] = benchmark::Counter(products, benchmark::Counter::kIsIterationInvariantRate);
  })->Unit(benchmark::kMicrosecond);
}

}  // namespace

void register_peaks() {
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) add("peak/avx2", fma_avx2, kTurns * 12 * 8.0);
  if (__builtin_cpu_supports("avx512f")) add("peak/avx3", fma_avx512, kTurns * kSums * 16.0);
  if (has_int16()) add("peak/avx3_int16", dot_int16, kTurns * kSums * 32.0);
  if (has_bf16()) add("peak/avx3_bf16", dot_bf16, kTurns * kSums * 32.0);
}

}  // namespace gatefield::bench
#else
namespace gatefield::bench {
void register_peaks() {}
}  // namespace gatefield::bench
#endif
