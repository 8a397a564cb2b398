#include "server/training/learn/networks.h"

#include <ATen/autocast_mode.h>
#include <torch/nn/functional.h>

#include <cmath>
#include <fstream>
#include <numbers>
#include <string>

namespace gatefield::training {
namespace {

namespace nn = torch::nn;

nn::Conv2d conv(int inputs, int outputs, int kernel, int stride) {
  nn::Conv2d layer(nn::Conv2dOptions(inputs, outputs, kernel).stride(stride).padding(kernel / 2));
  nn::init::kaiming_normal_(layer->weight, 0.0, torch::kFanIn, torch::kReLU);
  nn::init::zeros_(layer->bias);
  return layer;
}

nn::Linear linear(int inputs, int outputs) {
  nn::Linear layer(inputs, outputs);
  nn::init::kaiming_normal_(layer->weight, 0.0, torch::kFanIn, torch::kReLU);
  nn::init::zeros_(layer->bias);
  return layer;
}

/// Output layers begin near zero, so that the first steps are not spent on unlearning noise.
template <typename Layer>
Layer calm(Layer layer, double factor) {
  torch::NoGradGuard guard;
  layer->weight.mul_(factor);
  return layer;
}

torch::Tensor twice(const torch::Tensor& x) { return torch::upsample_nearest2d(x, {x.size(2) * 2, x.size(3) * 2}); }

}  // namespace

Autocast::Autocast(bool enabled) : enabled_(enabled) {
  if (!enabled_) return;
  at::autocast::set_autocast_cpu_dtype(at::kBFloat16);
  at::autocast::set_cpu_enabled(true);
  at::autocast::increment_nesting();
}

Autocast::~Autocast() {
  if (!enabled_) return;
  if (at::autocast::decrement_nesting() == 0) at::autocast::clear_cache();
  at::autocast::set_cpu_enabled(false);
}

FirstLookImpl::FirstLookImpl() {
  conv1 = register_module("conv1", conv(model::kLookChannels, kLookFeatures, 3, 2));
  conv2 = register_module("conv2", conv(kLookFeatures, 32, 3, 2));
  conv3 = register_module("conv3", conv(32, 64, 3, 1));
  deep1 = register_module("deep1", conv(64, 64, 3, 2));
  deep2 = register_module("deep2", conv(64, 64, 3, 1));
  deep3 = register_module("deep3", conv(64, 64, 3, 1));
  context = register_module("context", conv(128, 64, 1, 1));
  lateral = register_module("lateral", conv(64, kLookFeatures, 1, 1));
  head = register_module("head", conv(kLookFeatures + model::kAnchorChannels, kLookFeatures, 3, 1));
  maps = register_module("maps", calm(conv(kLookFeatures, kLookOutputs, 1, 1), 0.1));
  correction1 = register_module("correction1", linear(kLookHeads * (3 + kLookFeatures), 64));
  correction2 = register_module("correction2", calm(linear(64, 3), 0.1));
}

FirstLookImpl::Output FirstLookImpl::forward(const torch::Tensor& input, const torch::Tensor& anchors, bool bf16) {
  torch::Tensor features;
  torch::Tensor outputs;
  {
    Autocast autocast(bf16);
    const auto fine = torch::relu(conv1(input));
    const auto middle = torch::relu(conv3(torch::relu(conv2(fine))));
    auto deep = torch::relu(deep1(middle));
    const auto pooled = torch::cat({deep.mean({2, 3}, true), deep.amax({2, 3}, true)}, 1);
    deep = torch::relu(deep2(deep) + context(pooled));
    deep = torch::relu(deep3(deep));
    const auto joined = torch::relu(middle + twice(deep));
    const auto wide = torch::relu(fine + twice(lateral(joined)));
    features = torch::relu(head(torch::cat({wide, (anchors * (1.0 / model::kLookScale_m)).to(wide.scalar_type())}, 1)));
    outputs = maps(features);
  }
  // Positions in metres: single precision.
  const auto batch = input.size(0);
  features = features.to(torch::kFloat).flatten(2);
  outputs = outputs.to(torch::kFloat).flatten(2);
  Output out;
  out.segmentation = outputs.select(1, 0).view({batch, anchors.size(2), anchors.size(3)});
  out.votes = anchors.narrow(1, 0, 3).flatten(2) + outputs.narrow(1, 1, 3);
  const auto attention = torch::softmax(outputs.narrow(1, 4, kLookHeads), 2);
  const auto centers = torch::bmm(attention, out.votes.transpose(1, 2));
  const auto pooled = torch::bmm(attention, features.transpose(1, 2));
  const auto summary = torch::cat({centers.flatten(1), pooled.flatten(1)}, 1);
  out.center = centers.mean(1) + correction2(torch::relu(correction1(summary)));
  return out;
}

SecondLookImpl::SecondLookImpl(const Design& design) {
  // 24 x 24 features of the crop, however finely it is sampled.
  const int stride = design.crop_size / kCropFeatureSize;
  conv1 = register_module("conv1", conv(model::kCropChannels, 24, stride > 2 ? 7 : 5, stride));
  conv2 = register_module("conv2", conv(24, 48, 3, 2));
  conv3 = register_module("conv3", conv(48, 96, 3, 2));
  conv4 = register_module("conv4", conv(96, 96, 3, 1));
  squeeze = register_module("squeeze", conv(96, 32, 1, 1));
  dense = register_module("dense", linear(32 * 6 * 6 + model::kCropContext, 192));
  output = register_module("output", calm(linear(192, code_size(design)), 0.3));
}

torch::Tensor SecondLookImpl::forward(const torch::Tensor& crop, const torch::Tensor& context, bool bf16) {
  Autocast autocast(bf16);
  auto x = torch::relu(conv1(crop));
  x = torch::relu(conv2(x));
  x = torch::relu(conv3(x));
  x = torch::relu(conv4(x));
  x = torch::relu(squeeze(x));
  x = torch::cat({x.flatten(1), context.to(x.scalar_type())}, 1);
  x = torch::relu(dense(x));
  return output(x).to(torch::kFloat);
}

PlainEncoderImpl::PlainEncoderImpl(const Design& design, int width_px, int height_px) {
  conv1 = register_module("conv1", conv(2, 16, 5, 2));
  conv2 = register_module("conv2", conv(16, 32, 3, 2));
  conv3 = register_module("conv3", conv(32, 64, 3, 2));
  conv4 = register_module("conv4", conv(64, 96, 3, 2));
  conv5 = register_module("conv5", conv(96, 96, 3, 1));
  const auto reduced = [](int size) {
    for (int i = 0; i < 4; ++i) size = (size + 1) / 2;
    return size;
  };
  dense = register_module("dense", linear(96 * reduced(width_px) * reduced(height_px), 192));
  output = register_module("output", calm(linear(192, code_size(design)), 0.3));
}

torch::Tensor PlainEncoderImpl::forward(const torch::Tensor& image, bool bf16) {
  Autocast autocast(bf16);
  auto x = torch::relu(conv1(image));
  x = torch::relu(conv2(x));
  x = torch::relu(conv3(x));
  x = torch::relu(conv4(x));
  x = torch::relu(conv5(x));
  x = torch::relu(dense(x.flatten(1)));
  return output(x).to(torch::kFloat);
}

HyperDecoderImpl::HyperDecoderImpl(int latent_z, double scale_m) : scale_m_(scale_m) {
  nn::Linear made(latent_z, 4 * kHyperHidden);
  {
    // Planes at random attitudes near the centre to begin with; z then turns and moves them.
    torch::NoGradGuard guard;
    made->weight.normal_(0.0, 0.5 / std::sqrt(static_cast<double>(latent_z)));
    made->bias.normal_(0.0, 0.7);
  }
  generator = register_module("generator", made);
  layer0 = register_module("layer0", linear(kHyperHidden, kHyperHidden));
  layer1 = register_module("layer1", calm(linear(kHyperHidden, 1), 0.5));
}

torch::Tensor HyperDecoderImpl::forward(const torch::Tensor& z, const torch::Tensor& offsets) {
  const auto made = generator(z);
  const auto weight = made.narrow(1, 0, 3 * kHyperHidden).view({-1, kHyperHidden, 3});
  const auto bias = made.narrow(1, 3 * kHyperHidden, kHyperHidden).unsqueeze(1);
  auto x = torch::relu(torch::bmm(offsets * (1.0 / scale_m_), weight.transpose(1, 2)) + bias);
  x = torch::relu(layer0(x));
  return layer1(x).squeeze(2);
}

ConcatenatedDecoderImpl::ConcatenatedDecoderImpl(int latent_z, int octaves, double scale_m)
    : octaves_(octaves), scale_m_(scale_m) {
  layer0 = register_module("layer0", linear(latent_z + 3 + 6 * octaves, kConcatenatedHidden));
  layer1 = register_module("layer1", linear(kConcatenatedHidden, kConcatenatedHidden));
  layer2 = register_module("layer2", linear(kConcatenatedHidden, kConcatenatedHidden));
  layer3 = register_module("layer3", calm(linear(kConcatenatedHidden, 1), 0.5));
}

torch::Tensor ConcatenatedDecoderImpl::forward(const torch::Tensor& z, const torch::Tensor& points) {
  std::vector<torch::Tensor> parts = {z.unsqueeze(1).expand({-1, points.size(1), -1}), points};
  for (int octave = 0; octave < octaves_; ++octave) {
    const auto angle = points * (std::ldexp(std::numbers::pi, octave) / scale_m_);
    parts.push_back(torch::sin(angle));
    parts.push_back(torch::cos(angle));
  }
  auto x = torch::relu(layer0(torch::cat(parts, 2)));
  x = torch::relu(layer1(x));
  x = torch::relu(layer2(x));
  return layer3(x).squeeze(2);
}

DepthDecoderImpl::DepthDecoderImpl(int latent_z, int height, int width) : height_(height), width_(width) {
  dense = register_module("dense", linear(latent_z, 16 * (height / 2) * (width / 2)));
  conv1 = register_module("conv1", conv(16, 8, 3, 1));
  conv2 = register_module("conv2", calm(conv(8, 1, 1, 1), 0.3));
}

torch::Tensor DepthDecoderImpl::forward(const torch::Tensor& z, bool bf16) {
  Autocast autocast(bf16);
  auto x = torch::relu(dense(z)).view({-1, 16, height_ / 2, width_ / 2});
  x = torch::relu(conv1(twice(x)));
  return conv2(x).squeeze(1).to(torch::kFloat);
}

bool cpu_has_bf16() {
  std::ifstream info("/proc/cpuinfo");
  std::string line;
  while (std::getline(info, line)) {
    if (line.rfind("flags", 0) == 0) {
      return line.find(" avx512_bf16") != std::string::npos || line.find(" amx_bf16") != std::string::npos;
    }
  }
  return false;
}

}  // namespace gatefield::training
