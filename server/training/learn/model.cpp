#include "server/training/learn/model.h"

#include <utility>

#include "server/training/learn/tensors.h"

namespace gatefield::training {

ModelImpl::ModelImpl(const Design& design) {
  const int z = design.latent_z;
  if (design.plain()) {
    encoder = register_module("encoder", PlainEncoder(design, kImageWidth_px, kImageHeight_px));
    depth = register_module("depth", DepthDecoder(z, kPlainDepthHeight, kPlainDepthWidth));
  } else {
    first = register_module("first", FirstLook());
    second = register_module("second", SecondLook(design));
    depth = register_module("depth", DepthDecoder(z, kDepthTargetSize, kDepthTargetSize));
  }
  if (design.decoder == model::DecoderKind::kHyper) {
    hyper = register_module("decoder", HyperDecoder(z, kHyperScale_m));
  } else {
    concatenated = register_module("decoder", ConcatenatedDecoder(z, kPlainOctaves, kPlainScale_m));
  }
  normal = register_module("normal", torch::nn::Linear(z, 6));
}

void lay_out(torch::nn::Module* module) {
  torch::NoGradGuard guard;
  for (auto& parameter : module->parameters()) {
    if (parameter.dim() == 4) parameter.set_data(parameter.contiguous(at::MemoryFormat::ChannelsLast));
  }
}

Weights weights_in(const torch::nn::Module& module) {
  Weights out;
  for (const auto& item : module.named_parameters()) {
    NamedTensor tensor;
    tensor.shape.assign(item.value().sizes().begin(), item.value().sizes().end());
    tensor.values = unwrap(item.value());
    out.emplace(item.key(), std::move(tensor));
  }
  return out;
}

}  // namespace gatefield::training
