#pragma once

#include <torch/types.h>

#include <span>
#include <vector>

/// Numbers of ours as libtorch's tensors and back. Not for use outside of this folder. Thread-safe: yes.
namespace gatefield::training {

/// A tensor over the numbers where they lie: they outlive it.
inline torch::Tensor wrap(std::vector<float>& values, at::IntArrayRef shape) {
  return torch::from_blob(values.data(), shape, torch::kFloat);
}
inline torch::Tensor wrap(std::span<const float> values, at::IntArrayRef shape) {
  return torch::from_blob(const_cast<float*>(values.data()), shape, torch::kFloat);
}

/// Convolutions run a good deal faster on the channels-last layout.
inline torch::Tensor wrap_image(std::vector<float>& values, at::IntArrayRef shape) {
  return wrap(values, shape).contiguous(at::MemoryFormat::ChannelsLast);
}

/// Row-major, in single precision.
inline std::vector<float> unwrap(const torch::Tensor& tensor) {
  const auto flat = tensor.detach().to(torch::kFloat).contiguous().view(-1);
  return {flat.data_ptr<float>(), flat.data_ptr<float>() + flat.numel()};
}

}  // namespace gatefield::training
