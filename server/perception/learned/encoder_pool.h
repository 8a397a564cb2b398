#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "server/perception/learned/depth_encoder.h"

namespace gatefield::perception {

/// The encoders of one model that vehicles share: as many as threads look at images, whoever flies. All of them give
/// the same for the same image, so it does not matter which one a vehicle gets.
/// Thread-safe: yes.   Real-time safe: no (a mutex, and what DepthEncoder says).
class EncoderPool {
 public:
  /// @pre at least one
  explicit EncoderPool(std::vector<std::unique_ptr<DepthEncoder>> encoders);

  /// As many of the bundle's as are asked for. Errors: DepthEncoder::create()'s.
  static Result<std::unique_ptr<EncoderPool>> create(const model::Bundle& bundle, int count);

  /// DepthEncoder::encode() of one that is free; waits while there is none.
  std::optional<Encoding> encode(std::span<const float> depth_m, const CameraModel& camera,
                                 const std::optional<Eigen::Vector3d>& prior_C);

 private:
  const std::vector<std::unique_ptr<DepthEncoder>> encoders_;
  std::mutex mutex_;
  std::condition_variable returned_;
  std::vector<DepthEncoder*> free_;
};

}  // namespace gatefield::perception
