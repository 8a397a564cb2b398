#pragma once

#include <string>
#include <vector>

#include "common/model/bundle.h"
#include "server/kernels/backend.h"

namespace gatefield::bench {

void register_peaks();
void register_kernels();
void register_decoders();  ///< ours beside oneDNN, Eigen and libtorch
void register_steps();
void register_vehicles();
void register_encoders();

/// deploy/models/<name>; the program ends with a sentence when it can't be read.
const model::Bundle& shipped(const std::string& name);

/// A decoder, a latent, and points around its gate. Worlds' axes are the camera's.
struct DecoderCase {
  std::string name;
  const model::DecoderWeights* weights = nullptr;
  std::vector<float> latent;
  kernels::FoldedDecoder folded;     ///< on the best back end
  std::vector<model::Dense> layers;  ///< the same plainly, the first with all that it multiplies
  std::vector<float> x, y, z;
  double products_per_query = 0.0;
};
/// The shipped race and paper decoders, each with the latent of a drawn gate, 8192 x 20 points.
const std::vector<DecoderCase>& decoder_cases();

/// Makes docs/performance.md and its pictures from results. @return exit code
int report(const std::vector<std::string>& files, const std::string& folder);

}  // namespace gatefield::bench
