#pragma once

#include <filesystem>
#include <string>

#include "common/base/result.h"
#include "server/training/learn/trainer.h"

namespace gatefield::training {

/// Writes a bundle (common/model/bundle.h): manifest.txt and look1.onnx, look2.onnx (or encoder.onnx), decoder.onnx.
/// The folder is replaced as a whole, so that a reader never sees half of it.
/// Inputs and outputs of the files:
///   look1.onnx    input [1,13,48,80], anchors [1,4,24,40] -> center [1,3]
///   look2.onnx    crop [1,7,S,S], context [1,3]           -> code [1,D+2]: correction 3, z, validity logit, log error
///   encoder.onnx  image [1,2,90,160]                      -> code [1,D+2]: latent D, validity logit, log error
///   decoder.onnx  latent [1,D], points [N,3]              -> sdf [N,1]
/// Errors: a weight that is missing or has another shape (named), folder can't be written.
Status export_bundle(const Weights& weights, const Design& design, const std::string& name,
                     const std::filesystem::path& folder);

}  // namespace gatefield::training
