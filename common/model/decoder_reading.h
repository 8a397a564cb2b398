#pragma once

#include <filesystem>

#include "common/base/result.h"
#include "common/model/bundle.h"
#include "common/model/onnx_graph.h"

namespace gatefield::model {

/// The weights of a field decoder, found by asking its graph and not by its names: the layers end where the Relu nodes
/// are, a layer's weights are the differences that unit vectors make before the next one, and Sin and Cos nodes are
/// told apart by how fast they turn. So it doesn't matter how an exporter writes a layer, in which order parts are
/// joined or what anything is called. In the end the weights, by the formulas of DecoderWeights, have to give what the
/// graph gives at random latents and points.
///
/// @param graph     decoder.onnx with inputs 'latent' [1, D] (or [N, D], the same row N times) and 'points' [N, 3],
///                  output 'sdf' [N, 1] or [N]
/// @param latent_repeated  the graph wants the latent once per point
/// Errors: the graph computes something else, with the node or layer where that shows. Thread-safe: yes.
/// Real-time safe: no.
Result<DecoderWeights> read_decoder(const std::filesystem::path& file, const Graph& graph, bool latent_repeated,
                                    const Manifest& manifest);

}  // namespace gatefield::model
