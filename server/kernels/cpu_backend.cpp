// The processor's back ends: what Highway compiled for each of its targets, and the decoders with instructions that
// Highway has no target for.

#include <hwy/highway.h>

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <memory>
#include <vector>

#include "server/kernels/average/average.h"
#include "server/kernels/backend.h"
#include "server/kernels/decoder/cpu_decoder.h"

#if GATEFIELD_AVX512_INT16 || GATEFIELD_AMX_BF16
#include <cpuid.h>
#endif
#if GATEFIELD_AMX_BF16
#include <sys/syscall.h>
#include <unistd.h>
#endif

namespace gatefield::kernels {
namespace {

constexpr double kTolerance_m = 1e-4, kInt16Tolerance_m = 0.004, kTilesTolerance_m = 1e-3;  // decoder.h

class CpuBackend final : public Backend {
 public:
  /// @param target   of Highway, whose loops run
  /// @param decoder  in the place of the target's own, where the network has enough layers
  CpuBackend(std::string name, bool supported, double decode_tolerance_m, std::int64_t target,
             const DecodeKernel& decoder)
      : Backend(std::move(name), supported, decode_tolerance_m),
        decoder_(decoder),
        plain_decoder_{Layout::kFp32, decode_loop(target)},
        sample_(sample_loop(target)),
        rollout_(rollout_loop(target)),
        rates_(rate_loop(target)),
        average_(average_loops(target)) {}

  std::shared_ptr<const PreparedDecoder> prepare(const model::DecoderWeights& weights) const override {
    return std::make_shared<CpuDecoder>(weights, takes(decoder_.layout, weights) ? decoder_ : plain_decoder_);
  }
  void sample(const NoiseShape& shape, std::uint64_t key, std::uint64_t step, int first_sample, const float* mean,
              SampleBlock inputs) const noexcept override {
    kernels::sample(sample_, shape, key, step, first_sample, mean, inputs);
  }
  void rollout(const QuadrotorModel& model, const QuadrotorState& start, double dt_s, SampleBlock inputs,
               SampleBlock states) const noexcept override {
    kernels::rollout(rollout_, model, start, dt_s, inputs, states);
  }
  void rollout_rates(const RateRollout& how, const QuadrotorState& start, const RateCommand& asked, double dt_s,
                     SampleBlock inputs, SampleBlock states) const noexcept override {
    kernels::rollout_rates(rates_, how, start, asked, dt_s, inputs, states);
  }
  double softmax_weights(std::span<const float> cost, double temperature,
                         std::span<float> weight) const noexcept override {
    return kernels::softmax_weights(average_, cost, temperature, weight);
  }
  double temperature_for(std::span<const float> cost, double target_effective_samples, double low,
                         double high) const noexcept override {
    return kernels::temperature_for(average_, cost, target_effective_samples, low, high);
  }
  void accumulate_average(std::span<const float> weight, SampleBlock inputs, double* mean) const noexcept override {
    average_.accumulate(weight.data(), weight.size(), inputs, mean);
  }

 private:
  DecodeKernel decoder_, plain_decoder_;
  SampleLoop* sample_;
  RolloutLoop* rollout_;
  RateLoop* rates_;
  AverageLoops average_;
};

#if GATEFIELD_AVX512_INT16
/// CPUID leaf 7.0: AVX512_VNNI. That the system keeps the registers is known from Highway's choice of AVX-512.
bool cpu_has_int16() noexcept {
  unsigned a = 0, b = 0, c = 0, d = 0;
  return __get_cpuid_count(7, 0, &a, &b, &c, &d) != 0 && (c >> 11 & 1) != 0;
}
#endif

#if GATEFIELD_AMX_BF16
/// CPUID leaf 7.0: AMX-TILE and AMX-BF16; XCR0: the system keeps configuration and data of tiles; and Linux has to be
/// asked for the latter, once per process, before threads start.
bool amx_granted() noexcept {
  unsigned a = 0, b = 0, c = 0, d = 0;
  if (__get_cpuid_count(7, 0, &a, &b, &c, &d) == 0 || (d >> 24 & 1) == 0 || (d >> 22 & 1) == 0) return false;
  if (__get_cpuid(1, &a, &b, &c, &d) == 0 || (c >> 27 & 1) == 0) return false;
  std::uint32_t low = 0, high = 0;
  asm("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
  if ((low >> 17 & 3) != 3) return false;
  constexpr long kRequestPermission = 0x1023, kTileData = 18;  // ARCH_REQ_XCOMP_PERM, XFEATURE_XTILEDATA
  return syscall(SYS_arch_prctl, kRequestPermission, kTileData) == 0;
}
#endif

/// Lower bits are better, in Highway's own order.
std::vector<std::unique_ptr<const Backend>> make_backends() {
  std::vector<std::unique_ptr<const Backend>> made;
  const std::int64_t machine = hwy::SupportedTargets();
  for (std::int64_t rest = HWY_TARGETS; rest != 0; rest &= rest - 1) {
    const std::int64_t target = rest & -rest;
    const bool supported = (machine & target) != 0;
    std::string name = hwy::TargetName(target);
    std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::tolower(c); });
    const auto add = [&](const char* suffix, bool has, double tolerance_m, const DecodeKernel& decoder) {
      made.push_back(std::make_unique<CpuBackend>(name + suffix, supported && has, tolerance_m, target, decoder));
    };
    add("", true, kTolerance_m, {Layout::kFp32, decode_loop(target)});
#if GATEFIELD_AVX512_INT16
    if (target == HWY_AVX3) add("_int16", cpu_has_int16(), kInt16Tolerance_m, {Layout::kInt16, decode_avx512_int16});
#endif
#if GATEFIELD_AMX_BF16
    if (target == HWY_AVX3) add("_amx", amx_granted(), kTilesTolerance_m, {Layout::kTiles, decode_amx_bf16});
#endif
  }
  return made;
}

/// Made once and never changed.
struct Registry {
  std::vector<std::unique_ptr<const Backend>> owned = make_backends();
  std::vector<const Backend*> all, available;
  Registry() {
    for (const auto& backend : owned) {
      all.push_back(backend.get());
      if (backend->supported()) available.push_back(backend.get());
    }
  }
};

const Registry& registry() {
  static const Registry made;
  return made;
}

}  // namespace

std::span<const Backend* const> backends() { return registry().all; }
std::span<const Backend* const> available_backends() { return registry().available; }
const Backend& best_backend() { return *registry().available.front(); }

const Backend* find_backend(std::string_view name) {
  for (const Backend* backend : backends())
    if (backend->name() == name) return backend;
  return nullptr;
}

Result<const Backend*> select_backend(std::string_view name) {
  if (name == "auto") return &best_backend();
  if (const Backend* found = find_backend(name); found != nullptr && found->supported()) return found;
  std::string list = "auto";
  for (const Backend* backend : available_backends()) list += ", " + std::string(backend->name());
  Error error("instruction set '" + std::string(name) + "' is not available here, expected one of: " + list,
              ErrorCode::kUnsupported, "isa");
  error.value = name;
  error.expected = list;
  return error;
}

}  // namespace gatefield::kernels
