#include "server/perception/learned/encoder_pool.h"

namespace gatefield::perception {

EncoderPool::EncoderPool(std::vector<std::unique_ptr<DepthEncoder>> encoders) : encoders_(std::move(encoders)) {
  for (const auto& encoder : encoders_) free_.push_back(encoder.get());
}

Result<std::unique_ptr<EncoderPool>> EncoderPool::create(const model::Bundle& bundle, int count) {
  std::vector<std::unique_ptr<DepthEncoder>> encoders;
  for (int i = 0; i < count; ++i) {
    auto encoder = DepthEncoder::create(bundle);
    if (!encoder) return encoder.failure();
    encoders.push_back(std::move(encoder).value());
  }
  return std::make_unique<EncoderPool>(std::move(encoders));
}

std::optional<Encoding> EncoderPool::encode(std::span<const float> depth_m, const CameraModel& camera,
                                            const std::optional<Eigen::Vector3d>& prior_C) {
  DepthEncoder* encoder = nullptr;
  {
    std::unique_lock lock(mutex_);
    returned_.wait(lock, [this] { return !free_.empty(); });
    encoder = free_.back();
    free_.pop_back();
  }
  struct Return {
    EncoderPool& pool;
    DepthEncoder* encoder;
    ~Return() {
      {
        const std::lock_guard lock(pool.mutex_);
        pool.free_.push_back(encoder);
      }
      pool.returned_.notify_one();
    }
  } const give_back{*this, encoder};
  return encoder->encode(depth_m, camera, prior_C);
}

}  // namespace gatefield::perception
