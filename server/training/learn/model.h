#pragma once

#include <torch/nn.h>

#include "server/training/learn/networks.h"
#include "server/training/learn/trainer.h"

/// All networks of a design together. Not for use outside of this folder. Thread-safe: no; libtorch's exceptions pass.
namespace gatefield::training {

/// Everything that is trained, as one module, so that one name space serves optimiser, checkpoint and export.
struct ModelImpl : torch::nn::Module {
  explicit ModelImpl(const Design& design);

  FirstLook first{nullptr};       ///< of two looks
  SecondLook second{nullptr};     ///< of two looks
  PlainEncoder encoder{nullptr};  ///< of one look
  HyperDecoder hyper{nullptr};    ///< the decoder "decoder", one of these two
  ConcatenatedDecoder concatenated{nullptr};
  DepthDecoder depth{nullptr};        ///< training only
  torch::nn::Linear normal{nullptr};  ///< training only: z to the gate's axes
};
TORCH_MODULE(Model);

/// Puts convolutions' weights into the channels-last layout, in which they run a good deal faster.
void lay_out(torch::nn::Module* module);

/// All parameters by name, in single precision.
Weights weights_in(const torch::nn::Module& module);

}  // namespace gatefield::training
