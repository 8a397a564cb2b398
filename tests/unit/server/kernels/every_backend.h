#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "server/kernels/backend.h"
#include "server/kernels/rollout/rollout.h"

namespace gatefield::kernels {

/// Runs a test once on every back end that this machine has.
class EveryBackend : public testing::TestWithParam<const Backend*> {
 protected:
  const Backend& backend() const { return *GetParam(); }
};

inline std::string backend_name(const testing::TestParamInfo<const Backend*>& info) {
  return std::string(info.param->name());
}

#define ON_EVERY_BACKEND(suite)                                                                    \
  INSTANTIATE_TEST_SUITE_P(, suite, testing::ValuesIn(::gatefield::kernels::available_backends()), \
                           ::gatefield::kernels::backend_name)

/// A block with memory of its own, and with guard lanes after every row's padding that a kernel must leave alone.
class OwnedBlock {
 public:
  static constexpr float kGuard = -12345.0f;

  OwnedBlock(int steps, int channels, int samples, float fill = 0.0f) {
    block_.steps = steps;
    block_.channels = channels;
    block_.samples = samples;
    block_.stride = padded_samples(samples) + 16;
    // One float off, so that no row is aligned to a vector.
    memory_.assign(
        static_cast<std::size_t>(steps) * static_cast<std::size_t>(channels) * static_cast<std::size_t>(block_.stride) +
            1,
        fill);
    block_.data = memory_.data() + 1;
    for (int row = 0; row < steps * channels; ++row) {
      for (int m = padded_samples(samples); m < block_.stride; ++m) block_.row(0, row)[m] = kGuard;
    }
  }

  SampleBlock block() const noexcept { return block_; }
  float& at(int k, int channel, int m) noexcept { return block_.row(k, channel)[m]; }

  bool guards_hold() const noexcept {
    for (int row = 0; row < block_.steps * block_.channels; ++row) {
      for (int m = padded_samples(block_.samples); m < block_.stride; ++m) {
        if (block_.row(0, row)[m] != kGuard) return false;
      }
    }
    return true;
  }

 private:
  SampleBlock block_;
  std::vector<float> memory_;
};

}  // namespace gatefield::kernels
