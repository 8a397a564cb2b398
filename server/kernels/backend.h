#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "common/base/result.h"
#include "common/model/bundle.h"
#include "server/kernels/decoder/decoder.h"
#include "server/kernels/noise/noise.h"
#include "server/kernels/rollout/rates.h"
#include "server/kernels/rollout/rollout.h"

/// Who computes: back ends, each an object that offers every kernel. A planner is given one, and so is a field; nothing
/// is chosen per process, so planners of one process may compute on different ones.
///
/// Names, best first: Highway's targets in lower case. On x86-64
///   avx3        AVX-512 with BW, DQ, VL
///   avx3_int16  the same with the decoder's inner layers in 16-bit fixed point through AVX512_VNNI: nearly twice as
///               fast, less exact (decoder.h); taken only when asked for
///   avx3_amx    the same with all of the decoder's hidden layers in AMX tiles of bf16; likewise only when asked for,
///               since it never ran on a machine that has them
///   avx2        with FMA
///   sse4
///   scalar or emu128, by the compiler's version: portable code
/// On arm64 neon takes the place of the first five.
///
/// How one is added. The same instructions but for the decoder: a loop (decoder/view.h) in a file with flags of its
/// own, and a row in cpu_backend.cpp, as avx3_int16 has it. Another instruction set: Highway compiles the existing
/// loops for it. Another kind of device: a class of its own derived from Backend and PreparedDecoder, and its object in
/// backends(). What it keeps on the device belongs to the PreparedDecoder, which is made once a model; a FoldedDecoder
/// is a few kilobytes of plain numbers that travel with the points. tests/unit/server/kernels runs every suite on every
/// back end of backends() that the machine supports, and holds it to the tolerances that each kernel's header states.
namespace gatefield::kernels {

/// One way to compute every kernel. Same numbers in, same bits out, whatever other back ends do meanwhile.
/// Thread-safe: yes.   Real-time safe: all but prepare(). Lives as long as the process.
/// @pre of every call: supported()
class Backend {
 public:
  Backend(const Backend&) = delete;
  Backend& operator=(const Backend&) = delete;
  virtual ~Backend() = default;

  std::string_view name() const noexcept { return name_; }
  /// Whether this machine, its system included, can run it. Asked once, when the first of all back ends is.
  bool supported() const noexcept { return supported_; }
  /// Largest |ds| of its decoder against decode_reference() with trained weights.
  double decode_tolerance_m() const noexcept { return decode_tolerance_m_; }

  /// Lays a model's weights out, once a model. The result is shared by all who fold latents into it
  /// (decoder/decoder.h).
  virtual std::shared_ptr<const PreparedDecoder> prepare(const model::DecoderWeights& weights) const = 0;

  /// Gaussian inputs around a plan: noise/noise.h.
  virtual void sample(const NoiseShape& shape, std::uint64_t key, std::uint64_t step, int first_sample,
                      const float* mean, SampleBlock inputs) const noexcept = 0;
  /// States that follow from inputs: rollout/rollout.h.
  virtual void rollout(const QuadrotorModel& model, const QuadrotorState& start, double dt_s, SampleBlock inputs,
                       SampleBlock states) const noexcept = 0;
  /// The same for a vehicle that follows thrust and body rates: rollout/rates.h.
  virtual void rollout_rates(const RateRollout& how, const QuadrotorState& start, const RateCommand& asked, double dt_s,
                             SampleBlock inputs, SampleBlock states) const noexcept = 0;
  /// Weights of the samples, their temperature and their average: average/average.h.
  virtual double softmax_weights(std::span<const float> cost, double temperature,
                                 std::span<float> weight) const noexcept = 0;
  virtual double temperature_for(std::span<const float> cost, double target_effective_samples, double low,
                                 double high) const noexcept = 0;
  virtual void accumulate_average(std::span<const float> weight, SampleBlock inputs, double* mean) const noexcept = 0;

 protected:
  Backend(std::string name, bool supported, double decode_tolerance_m)
      : name_(std::move(name)), supported_(supported), decode_tolerance_m_(decode_tolerance_m) {}

 private:
  std::string name_;
  bool supported_;
  double decode_tolerance_m_;
};

/// All that this build has, best first. On Linux with AMX the first call asks the system for tiles, which has to happen
/// before threads start.
std::span<const Backend* const> backends();
/// Those of them that this machine can run, best first; never empty.
std::span<const Backend* const> available_backends();
/// The first of those: what "auto" takes.
const Backend& best_backend();
/// By name, of all that this build has; null: none of this name.
const Backend* find_backend(std::string_view name);
/// What `--isa` asks for: a name, or "auto". The error (kUnsupported) lists what is available.
Result<const Backend*> select_backend(std::string_view name);

}  // namespace gatefield::kernels
