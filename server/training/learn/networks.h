#pragma once

#include <torch/nn.h>
#include <torch/types.h>

#include "server/training/learn/designs.h"

/// The networks (docs/training.md). Layer sizes stand here once; export.cpp writes the same graphs from the parameters'
/// names. With losses, model, checkpoint and trainer.cpp the only place that includes libtorch. Thread-safe: no.
namespace gatefield::training {

inline constexpr int kHyperHidden = 64;
inline constexpr int kConcatenatedHidden = 128;
inline constexpr int kLookHeads = 4;  ///< attention maps
inline constexpr int kLookFeatures = 18;
inline constexpr int kLookOutputs = 1 + 3 + kLookHeads;  ///< segmentation logit, vote offset, attention logits
/// What every encoder's last layer gives: the centre (or a correction of it) where the design has one, z, validity
/// logit, log predicted error.
inline int code_size(const Design& design) { return design.latent_size() + 2; }

/// Runs CPU operators in bfloat16 where that is faster, as long as the object lives.
class Autocast {
 public:
  explicit Autocast(bool enabled);
  ~Autocast();
  Autocast(const Autocast&) = delete;
  Autocast& operator=(const Autocast&) = delete;

 private:
  bool enabled_;
};

/// First look: where the nearest gate's centre roughly is.
struct FirstLookImpl : torch::nn::Module {
  FirstLookImpl();
  struct Output {
    torch::Tensor segmentation;  ///< [B, h, w] logits: shows the target gate's frame
    torch::Tensor votes;         ///< [B, 3, h w] where each block sees the centre, m
    torch::Tensor center;        ///< [B, 3] coarse centre, m
  };
  /// @param input [B, 13, H, W], @param anchors [B, 4, H / 2, W / 2] (common/model/two_look.h)
  Output forward(const torch::Tensor& input, const torch::Tensor& anchors, bool bf16);

  torch::nn::Conv2d conv1{nullptr}, conv2{nullptr}, conv3{nullptr}, deep1{nullptr}, deep2{nullptr}, deep3{nullptr},
      context{nullptr}, lateral{nullptr}, head{nullptr}, maps{nullptr};
  torch::nn::Linear correction1{nullptr}, correction2{nullptr};
};
TORCH_MODULE(FirstLook);

/// Second look: a crop around a given centre -> [B, code_size].
struct SecondLookImpl : torch::nn::Module {
  explicit SecondLookImpl(const Design& design);
  torch::Tensor forward(const torch::Tensor& crop, const torch::Tensor& context, bool bf16);

  torch::nn::Conv2d conv1{nullptr}, conv2{nullptr}, conv3{nullptr}, conv4{nullptr}, squeeze{nullptr};
  torch::nn::Linear dense{nullptr}, output{nullptr};
};
TORCH_MODULE(SecondLook);

/// One look at the whole image (two channels: inverse depth, validity) -> [B, code_size].
struct PlainEncoderImpl : torch::nn::Module {
  PlainEncoderImpl(const Design& design, int width_px, int height_px);
  torch::Tensor forward(const torch::Tensor& image, bool bf16);

  torch::nn::Conv2d conv1{nullptr}, conv2{nullptr}, conv3{nullptr}, conv4{nullptr}, conv5{nullptr};
  torch::nn::Linear dense{nullptr}, output{nullptr};
};
TORCH_MODULE(PlainEncoder);

/// g_phi with a first layer made by z (model::DecoderKind::kHyper).
struct HyperDecoderImpl : torch::nn::Module {
  HyperDecoderImpl(int latent_z, double scale_m);
  /// @param z [B, latent_z], @param offsets [B, N, 3] p - centre, m; @return [B, N] metres
  torch::Tensor forward(const torch::Tensor& z, const torch::Tensor& offsets);

  torch::nn::Linear generator{nullptr}, layer0{nullptr}, layer1{nullptr};
  double scale_m_;
};
TORCH_MODULE(HyperDecoder);

/// g_phi as published (model::DecoderKind::kConcatenated).
struct ConcatenatedDecoderImpl : torch::nn::Module {
  ConcatenatedDecoderImpl(int latent_z, int octaves, double scale_m);
  torch::Tensor forward(const torch::Tensor& z, const torch::Tensor& points);

  torch::nn::Linear layer0{nullptr}, layer1{nullptr}, layer2{nullptr}, layer3{nullptr};
  int octaves_;
  double scale_m_;
};
TORCH_MODULE(ConcatenatedDecoder);

/// D_psi: z -> a coarse clean depth image, training only. Doubles (height, width) once by a nearest-neighbour resize.
struct DepthDecoderImpl : torch::nn::Module {
  DepthDecoderImpl(int latent_z, int height, int width);
  /// @return [B, height, width]
  torch::Tensor forward(const torch::Tensor& z, bool bf16);

  torch::nn::Linear dense{nullptr};
  torch::nn::Conv2d conv1{nullptr}, conv2{nullptr};
  int height_, width_;
};
TORCH_MODULE(DepthDecoder);

/// True when this CPU multiplies bfloat16 in hardware, so that autocast pays.
bool cpu_has_bf16();

}  // namespace gatefield::training
