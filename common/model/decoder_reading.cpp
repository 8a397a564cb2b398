#include "common/model/decoder_reading.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include "common/base/random.h"
#include "common/model/onnx_file.h"

namespace gatefield::model {
namespace {

constexpr int kMaxLayers = 8;
constexpr int kMaxWidth = 256;                      // kernels::kMaxWidth
constexpr std::int64_t kMaxMultiplyAdds = 1 << 20;  ///< a query
constexpr std::int64_t kMaxNumbers = 100'000;       ///< a query
constexpr std::int64_t kTrialPoints = 7;            ///< a size that nothing else in a decoder has
constexpr double kTolerance = 1e-3;                 ///< of the largest |s|, or in metres below 1 m
constexpr const char* kManual = " (docs/bring-your-own-network.md)";

using Numbers = std::vector<double>;

/// Nonlinear operators that have no place in a field decoder: Relu bends, Sin and Cos encode.
constexpr std::array kForeign = std::to_array<std::string_view>(
    {"Abs",       "AveragePool", "Ceil",          "Clip",        "Elu",       "Erf",
     "Exp",       "Floor",       "GlobalMaxPool", "HardSigmoid", "HardSwish", "InstanceNormalization",
     "LeakyRelu", "Log",         "Max",           "MaxPool",     "Min",       "PRelu",
     "Pow",       "Reciprocal",  "ReduceL2",      "ReduceMax",   "ReduceMin", "Sigmoid",
     "Softmax",   "Softplus",    "Sqrt",          "Tanh"});

/// The shape of a result that has one row per point.
struct Rows {
  std::vector<std::int64_t> shape;
  std::size_t dimension = 0;  ///< of the points
  int width = 0;              ///< numbers per point

  std::vector<std::int64_t> of(std::int64_t points) const {
    std::vector<std::int64_t> changed = shape;
    changed[dimension] = points;
    return changed;
  }
};

std::optional<Rows> rows_of(const Array* array) {
  if (array == nullptr) return std::nullopt;
  Rows rows{array->shape, 0, 0};
  while (rows.dimension < rows.shape.size() && rows.shape[rows.dimension] == 1) ++rows.dimension;
  if (rows.dimension == rows.shape.size() || rows.shape[rows.dimension] != kTrialPoints) return std::nullopt;
  rows.width = static_cast<int>(array->values.size() / kTrialPoints);
  return rows;
}

/// A Sin or Cos node that encodes points: which column of the encoding each of its results is.
struct Wave {
  int slot = -1;
  Rows rows;
  std::vector<int> columns;  ///< behind the latent: 3 + 6 octave + (cosine ? 3 : 0) + axis
};

class Reader {
 public:
  Reader(const std::filesystem::path& file, const Graph& graph, bool latent_repeated, const Manifest& manifest)
      : file_(file), graph_(graph), repeated_(latent_repeated), manifest_(manifest) {}

  Result<DecoderWeights> read() {
    if (Status status = look(); !status) return status.failure();
    DecoderWeights weights;
    weights.kind = manifest_.decoder_kind;
    weights.latent_size = manifest_.latent_size;
    weights.position_scale_m = manifest_.position_scale_m;
    const bool hyper = weights.kind == DecoderKind::kHyper;
    if (hyper) {
      if (Status status = read_generator(&weights.generator); !status) return status.failure();
    } else {
      weights.encoding_octaves = manifest_.encoding_octaves;
      weights.layers.emplace_back();
      if (Status status = read_first(&weights.layers.back()); !status) return status.failure();
    }
    for (std::size_t i = 0; i < hidden_.size(); ++i) {
      weights.layers.emplace_back();
      if (Status status = read_layer(i, &weights.layers.back()); !status) return status.failure();
    }
    if (Status status = compare(weights); !status) return status.failure();
    return weights;
  }

 private:
  struct Hidden {
    const Node* node = nullptr;
    Rows rows;
  };

  Error wrong(const std::string& what) const { return file_error(file_, what + kManual); }
  static std::string text(const Node& node) { return "node " + in_quotes(node.name) + " (" + node.type + ")"; }

  /// @param points [N][3]
  Result<Evaluation> evaluate(const Numbers& latent, const Numbers& points,
                              const std::map<int, Array>& replaced = {}) const {
    const auto n = static_cast<std::int64_t>(points.size() / 3);
    const std::int64_t copies = repeated_ ? n : 1;
    Numbers repeated;
    for (std::int64_t i = 0; i < copies; ++i) repeated.insert(repeated.end(), latent.begin(), latent.end());
    return graph_.evaluate(
        {{"latent", {{copies, static_cast<std::int64_t>(latent.size())}, std::move(repeated), false}},
         {"points", {{n, 3}, points, false}}},
        {kMaxMultiplyAdds * (n + 1), kMaxNumbers * (n + 1)}, replaced);
  }

  /// The values of `slot`, one row per point; empty when the graph's shapes depend on more than the number of points.
  static std::optional<Numbers> rows_at(const Evaluation& evaluation, int slot, std::int64_t points, int width) {
    const Array* const array = evaluation.values[static_cast<std::size_t>(slot)];
    if (array == nullptr || static_cast<std::int64_t>(array->values.size()) != points * width) return std::nullopt;
    return array->values;
  }

  /// Where the layers and the encoding are.
  Status look() {
    const bool hyper = manifest_.decoder_kind == DecoderKind::kHyper;
    Random random(1, Stream("gatefield.model_trial"));
    Numbers latent, points;
    for (int i = 0; i < manifest_.latent_size; ++i) latent.push_back(random.normal());
    for (int i = 0; i < 3 * kTrialPoints; ++i) points.push_back(manifest_.position_scale_m * random.uniform(-1.0, 1.0));
    const Result<Evaluation> trial = evaluate(latent, points);
    if (!trial) return trial.failure();
    output_ = graph_.slot("sdf");
    const auto array = [&](int slot) { return slot < 0 ? nullptr : trial->values[static_cast<std::size_t>(slot)]; };
    const auto output = rows_of(array(output_));
    if (!output || output->width != 1) {
      return wrong("gives 'sdf' of shape " + (array(output_) ? shape_text(array(output_)->shape) : "[]") + " for " +
                   std::to_string(kTrialPoints) + " points, expected [" + std::to_string(kTrialPoints) + ", 1]");
    }
    for (const Node& node : graph_.nodes()) {
      if (std::find(kForeign.begin(), kForeign.end(), node.type) != kForeign.end()) {
        return wrong(
            text(node) +
            " has no place in a field decoder, expected Relu between its layers, Sin and Cos to encode points");
      }
      const bool wave = node.type == "Sin" || node.type == "Cos";
      if (node.type != "Relu" && !wave) continue;
      const auto rows = rows_of(array(node.outputs[0]));
      if (!rows) {
        return wrong(text(node) + " gives shape " +
                     (array(node.outputs[0]) ? shape_text(array(node.outputs[0])->shape) : "[]") + " for " +
                     std::to_string(kTrialPoints) + " points, expected one row for each");
      }
      if (wave && hyper)
        return wrong(text(node) + " encodes points, but the manifest says that the decoder is HYPER: it takes none");
      if (wave) {
        if (Status status = recognise(node, *rows, *array(node.inputs[0]), points); !status) return status;
        continue;
      }
      if (rows->width < 1 || rows->width > kMaxWidth) {
        return wrong(text(node) + " is " + std::to_string(rows->width) + " wide, expected 1 to " +
                     std::to_string(kMaxWidth));
      }
      hidden_.push_back({&node, *rows});
    }
    if (hidden_.size() >= static_cast<std::size_t>(kMaxLayers)) {
      return wrong("has " + std::to_string(hidden_.size() + 1) + " layers, expected at most " +
                   std::to_string(kMaxLayers));
    }
    if (hyper && hidden_.empty()) return wrong("has no Relu, expected one after the layer that the latent makes");
    return {};
  }

  /// Which octave and coordinate each number that `node` takes belongs to: 2^octave pi / S times the coordinate.
  Status recognise(const Node& node, const Rows& rows, const Array& angles, const Numbers& points) {
    Wave wave{node.outputs[0], rows, {}};
    const auto width = static_cast<std::size_t>(rows.width);
    for (std::size_t column = 0; column < width; ++column) {
      // The coordinate that it is a multiple of; the multiple from the point where that coordinate is largest.
      int found = -1;
      double factor = 0.0;
      for (std::size_t axis = 0; axis < 3 && found < 0; ++axis) {
        std::size_t best = 0;
        for (std::size_t n = 1; n < kTrialPoints; ++n)
          if (std::abs(points[3 * n + axis]) > std::abs(points[3 * best + axis])) best = n;
        factor = angles.values[best * width + column] / points[3 * best + axis];
        bool fits = true;
        for (std::size_t n = 0; n < kTrialPoints; ++n) {
          const double expected = factor * points[3 * n + axis];
          fits = fits && std::abs(angles.values[n * width + column] - expected) <= 1e-4 * (1e-3 + std::abs(expected));
        }
        if (fits) found = static_cast<int>(axis);
      }
      if (found < 0)
        return wrong(text(node) + " takes something else than a multiple of one coordinate at column " +
                     std::to_string(column));
      const double lowest = std::numbers::pi / manifest_.position_scale_m;
      const double octave = std::log2(std::abs(factor) / lowest);
      const int whole = static_cast<int>(std::lround(std::clamp(octave, -1e3, 1e3)));
      if (!(factor > 0.0) || std::abs(octave - whole) > 1e-4 || whole < 0 || whole >= manifest_.encoding_octaves) {
        return wrong(text(node) + " turns by " + std::to_string(factor) + " rad a metre at column " +
                     std::to_string(column) +
                     ", expected 2^l pi / position_scale_m for l < encoding_octaves: " + std::to_string(lowest) +
                     " doubled up to " + std::to_string(manifest_.encoding_octaves - 1) + " times");
      }
      wave.columns.push_back(3 + 6 * whole + (node.type == "Cos" ? 3 : 0) + found);
    }
    waves_.push_back(std::move(wave));
    return {};
  }

  int input_of(std::size_t layer) const { return layer < hidden_.size() ? hidden_[layer].node->inputs[0] : output_; }
  int width_of(std::size_t layer) const { return layer < hidden_.size() ? hidden_[layer].rows.width : 1; }
  Error unsteady(std::size_t layer) const {
    return wrong("layer " + std::to_string(layer) + " changes its shape with more than the number of points");
  }

  /// The encoding's results as `values` [points][waves' columns] says.
  std::map<int, Array> encoded(std::int64_t points, const Numbers& values) const {
    std::map<int, Array> replaced;
    const std::size_t all = values.size() / static_cast<std::size_t>(points);
    std::size_t first = 0;
    for (const Wave& wave : waves_) {
      Array array{wave.rows.of(points), {}, false};
      for (std::size_t n = 0; n < static_cast<std::size_t>(points); ++n) {
        const auto from = values.begin() + static_cast<std::ptrdiff_t>(n * all + first);
        array.values.insert(array.values.end(), from, from + wave.rows.width);
      }
      first += static_cast<std::size_t>(wave.rows.width);
      replaced[wave.slot] = std::move(array);
    }
    return replaced;
  }

  static void resize(Dense* layer, int inputs, int outputs) {
    layer->inputs = inputs;
    layer->outputs = outputs;
    layer->weight.assign(static_cast<std::size_t>(inputs) * static_cast<std::size_t>(outputs), 0.0f);
    layer->bias.assign(static_cast<std::size_t>(outputs), 0.0f);
  }
  static float& at(Dense* layer, int output, int input) {
    return layer->weight[static_cast<std::size_t>(output) * static_cast<std::size_t>(layer->inputs) +
                         static_cast<std::size_t>(input)];
  }

  /// kConcatenated: the layer on [z, p, sin, cos].
  Status read_first(Dense* layer) {
    const int latent_n = manifest_.latent_size, width = width_of(0);
    resize(layer, latent_n + 3 + 6 * manifest_.encoding_octaves, width);
    std::vector<int> columns;
    for (const Wave& wave : waves_) columns.insert(columns.end(), wave.columns.begin(), wave.columns.end());

    // Rows: nothing, a metre along each axis, each encoded number alone.
    const auto rows = static_cast<std::int64_t>(4 + columns.size());
    const Numbers nothing(static_cast<std::size_t>(latent_n), 0.0);
    Numbers points(static_cast<std::size_t>(3 * rows), 0.0),
        values(columns.size() * static_cast<std::size_t>(rows), 0.0);
    for (std::size_t axis = 0; axis < 3; ++axis) points[3 * (1 + axis) + axis] = 1.0;
    for (std::size_t i = 0; i < columns.size(); ++i) values[(4 + i) * columns.size() + i] = 1.0;
    const Result<Evaluation> parts = evaluate(nothing, points, encoded(rows, values));
    if (!parts) return parts.failure();
    const auto answers = rows_at(*parts, input_of(0), rows, width);
    if (!answers) return unsteady(0);
    const auto difference = [&](std::size_t row, int i) {
      return (*answers)[row * static_cast<std::size_t>(width) + static_cast<std::size_t>(i)] -
             (*answers)[static_cast<std::size_t>(i)];
    };
    for (int i = 0; i < width; ++i) {
      layer->bias[static_cast<std::size_t>(i)] = static_cast<float>((*answers)[static_cast<std::size_t>(i)]);
      for (int axis = 0; axis < 3; ++axis)
        at(layer, i, latent_n + axis) = static_cast<float>(difference(1 + static_cast<std::size_t>(axis), i));
      for (std::size_t k = 0; k < columns.size(); ++k)  // a column that is there twice counts twice
        at(layer, i, latent_n + columns[k]) += static_cast<float>(difference(4 + k, i));
    }
    for (int k = 0; k < latent_n; ++k) {
      Numbers latent = nothing;
      latent[static_cast<std::size_t>(k)] = 1.0;
      const Result<Evaluation> part = evaluate(latent, {0.0, 0.0, 0.0}, encoded(1, Numbers(columns.size(), 0.0)));
      if (!part) return part.failure();
      const auto answer = rows_at(*part, input_of(0), 1, width);
      if (!answer) return unsteady(0);
      for (int i = 0; i < width; ++i)
        at(layer, i, k) =
            static_cast<float>((*answer)[static_cast<std::size_t>(i)] - (*answers)[static_cast<std::size_t>(i)]);
    }
    return {};
  }

  /// kHyper: what the latent makes the first layer of. With the centre at 0 it is W1(z) p / S + b1(z).
  Status read_generator(Dense* generator) {
    const int z_n = manifest_.latent_size - 3, width = width_of(0);
    const double scale = manifest_.position_scale_m;
    resize(generator, z_n, 4 * width);
    const Numbers points{0.0, 0.0, 0.0, scale, 0.0, 0.0, 0.0, scale, 0.0, 0.0, 0.0, scale};
    Numbers base;  // W1 [width][3] and b1 [width] of z = 0
    for (int k = -1; k < z_n; ++k) {
      Numbers latent(static_cast<std::size_t>(manifest_.latent_size), 0.0);
      if (k >= 0) latent[static_cast<std::size_t>(3 + k)] = 1.0;
      const Result<Evaluation> part = evaluate(latent, points);
      if (!part) return part.failure();
      const auto answer = rows_at(*part, input_of(0), 4, width);
      if (!answer) return unsteady(0);
      Numbers made;
      for (std::size_t i = 0; i < static_cast<std::size_t>(width); ++i)
        for (std::size_t axis = 0; axis < 3; ++axis)
          made.push_back((*answer)[(1 + axis) * static_cast<std::size_t>(width) + i] - (*answer)[i]);
      made.insert(made.end(), answer->begin(), answer->begin() + width);
      for (int i = 0; i < 4 * width; ++i) {
        const double value = made[static_cast<std::size_t>(i)];
        if (k < 0) {
          generator->bias[static_cast<std::size_t>(i)] = static_cast<float>(value);
        } else {
          at(generator, i, k) = static_cast<float>(value - base[static_cast<std::size_t>(i)]);
        }
      }
      if (k < 0) base = made;
    }
    return {};
  }

  /// The layer behind hidden_[before].
  Status read_layer(std::size_t before, Dense* layer) {
    const Rows& hidden = hidden_[before].rows;
    const int inputs = hidden.width, outputs = width_of(before + 1);
    resize(layer, inputs, outputs);
    const std::int64_t rows = inputs + 1;  // nothing, then each input alone
    Array units{hidden.of(rows), Numbers(static_cast<std::size_t>(rows * inputs), 0.0), false};
    for (std::size_t k = 0; k < static_cast<std::size_t>(inputs); ++k)
      units.values[(k + 1) * static_cast<std::size_t>(inputs) + k] = 1.0;
    const Result<Evaluation> parts =
        evaluate(Numbers(static_cast<std::size_t>(manifest_.latent_size), 0.0),
                 Numbers(static_cast<std::size_t>(3 * rows), 0.0), {{hidden_[before].node->outputs[0], units}});
    if (!parts) return parts.failure();
    const auto answers = rows_at(*parts, input_of(before + 1), rows, outputs);
    if (!answers) return unsteady(before + 1);
    for (int i = 0; i < outputs; ++i) {
      const double bias = (*answers)[static_cast<std::size_t>(i)];
      layer->bias[static_cast<std::size_t>(i)] = static_cast<float>(bias);
      for (int k = 0; k < inputs; ++k)
        at(layer, i, k) = static_cast<float>((*answers)[static_cast<std::size_t>((k + 1) * outputs + i)] - bias);
    }
    return {};
  }

  /// s by the formulas that stand at DecoderWeights.
  static double value_of(const DecoderWeights& weights, const Numbers& latent, const double* point) {
    Numbers x;
    const auto apply = [](const Dense& layer, const Numbers& in) {
      Numbers out(layer.bias.begin(), layer.bias.end());
      for (std::size_t i = 0; i < out.size(); ++i)
        for (std::size_t j = 0; j < in.size(); ++j) out[i] += double{layer.weight[i * in.size() + j]} * in[j];
      return out;
    };
    const auto bend = [](Numbers& values) {
      for (double& value : values) value = std::max(value, 0.0);
    };
    if (weights.kind == DecoderKind::kHyper) {
      const Numbers made = apply(weights.generator, Numbers(latent.begin() + 3, latent.end()));
      const std::size_t width = made.size() / 4;
      for (std::size_t i = 0; i < width; ++i) {
        x.push_back(made[3 * width + i]);
        for (std::size_t axis = 0; axis < 3; ++axis)
          x[i] += made[3 * i + axis] * (point[axis] - latent[axis]) / weights.position_scale_m;
      }
      bend(x);
    } else {
      x = latent;
      x.insert(x.end(), point, point + 3);
      for (int octave = 0; octave < weights.encoding_octaves; ++octave) {
        const double factor = std::ldexp(std::numbers::pi, octave) / weights.position_scale_m;
        for (int axis = 0; axis < 3; ++axis) x.push_back(std::sin(factor * point[axis]));
        for (int axis = 0; axis < 3; ++axis) x.push_back(std::cos(factor * point[axis]));
      }
    }
    for (std::size_t i = 0; i < weights.layers.size(); ++i) {
      x = apply(weights.layers[i], x);
      if (i + 1 < weights.layers.size()) bend(x);
    }
    return x[0];
  }

  Status compare(const DecoderWeights& weights) const {
    constexpr std::int64_t kPoints = 48;
    Random random(2, Stream("gatefield.model_trial"));
    for (int trial = 0; trial < 3; ++trial) {
      Numbers latent, points, answers;
      for (int i = 0; i < manifest_.latent_size; ++i) latent.push_back(random.normal());
      const double reach_m = std::min(manifest_.max_depth_m, 2.0 * manifest_.position_scale_m);
      for (int i = 0; i < 3 * kPoints; ++i) points.push_back(random.uniform(-reach_m, reach_m));
      const Result<Evaluation> evaluation = evaluate(latent, points);
      if (!evaluation) return evaluation.failure();
      const auto graphs = rows_at(*evaluation, output_, kPoints, 1);
      if (!graphs) return unsteady(hidden_.size());
      double largest = 1.0;
      for (std::size_t n = 0; n < kPoints; ++n) {
        answers.push_back(value_of(weights, latent, &points[3 * n]));
        largest = std::max(largest, std::abs(answers.back()));
      }
      for (std::size_t n = 0; n < kPoints; ++n) {
        if (!std::isfinite(answers[n]) || !(std::abs(answers[n] - (*graphs)[n]) <= kTolerance * largest)) {
          return wrong("computes something else than a " +
                       std::string(weights.kind == DecoderKind::kHyper ? "HYPER" : "CONCATENATED") + " decoder of " +
                       std::to_string(hidden_.size() + 1) + " layers: the graph gives " + std::to_string((*graphs)[n]) +
                       " m where layers with its weights give " + std::to_string(answers[n]) +
                       " m; expected plain layers with Relu between them, without skips or products");
        }
      }
    }
    return {};
  }

  const std::filesystem::path& file_;
  const Graph& graph_;
  const bool repeated_;
  const Manifest& manifest_;
  int output_ = -1;
  std::vector<Hidden> hidden_;
  std::vector<Wave> waves_;
};

}  // namespace

Result<DecoderWeights> read_decoder(const std::filesystem::path& file, const Graph& graph, bool latent_repeated,
                                    const Manifest& manifest) {
  return Reader(file, graph, latent_repeated, manifest).read();
}

}  // namespace gatefield::model
