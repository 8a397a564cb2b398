#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "server/training/learn/batches.h"
#include "server/training/learn/designs.h"

namespace gatefield::training {

/// A parameter as the exporter needs it.
struct NamedTensor {
  std::vector<std::int64_t> shape;
  std::vector<float> values;
};
/// By dotted name, e.g. "second.conv1.weight", "decoder.generator.bias".
using Weights = std::map<std::string, NamedTensor>;

struct TrainerOptions {
  Design design = designs().front();
  bool freeze_decoders = false;   ///< second stage: only the encoder learns
  std::uint64_t total_steps = 0;  ///< the learning rate's cosine ends here
  std::uint64_t warmup_steps = 300;
  double learning_rate = 2e-3;
  double weight_decay = 1e-2;
  double average_decay = 0.999;  ///< of the running average of the weights, which is what is exported
  int threads = 1;               ///< of libtorch's operators
  bool allow_bf16 = true;        ///< used only where the CPU has it
  std::uint64_t seed = 1;
};

inline constexpr int kPlainOctaves = 4;
inline constexpr double kPlainScale_m = 5.0;  ///< S of the plain decoder's positional encoding
inline constexpr double kHyperScale_m = 1.0;

/// Means over one step. Metres where the name says so.
struct StepLosses {
  double total = 0.0;
  double field_m = 0.0;         ///< L1 of the field over all query points, weighted by 1 / distance
  double box_m = 0.0;           ///< the same over points within 1.2 m of the gate's centre
  double constant_m = 0.0;      ///< what the best constant would score in place of field_m
  double center_m = 0.0;        ///< error per axis, after the second look
  double first_center_m = 0.0;  ///< error per axis of the first look
  double segmentation = 0.0;
  double normal = 0.0;
  double depth = 0.0;
  double validity = 0.0;
  double predicted_error = 0.0;  ///< |log predicted - log true|
};

/// Networks, losses and optimiser. All randomness comes from the seed and the batches.
/// Thread-safe: no. libtorch's exceptions stop here.
class Trainer {
 public:
  static Result<std::unique_ptr<Trainer>> create(const TrainerOptions& options);
  ~Trainer();

  /// One optimiser step. Cuts the crops that depend on the first look.
  /// Errors: a loss that isn't finite (the step is not taken), an error inside libtorch.
  Result<StepLosses> step(const BatchOptions& batch_options, Batch* batch);

  std::uint64_t steps() const noexcept;
  bool bf16() const noexcept;

  /// Weights, running average, optimiser state and step count; replaces the file in one go.
  Status save(const std::filesystem::path& file) const;
  /// Errors: missing or foreign file, other networks.
  Status load(const std::filesystem::path& file);

  /// Begins with the averaged weights of another checkpoint, wherever name and shape agree (the others keep their
  /// random start); step count and optimiser stay fresh. @return names of the parameters that were not taken.
  Result<std::vector<std::string>> start_from(const std::filesystem::path& file);
  /// The design that a checkpoint belongs to. Errors: missing or foreign file.
  static Result<Design> design_of(const std::filesystem::path& file);
  const Design& design() const noexcept;
  /// The averaged weights of a checkpoint, whatever was frozen when it was made. Errors: missing or foreign file.
  static Result<Weights> weights_of(const std::filesystem::path& file);

  /// The running average of all weights (single precision), as exported.
  Weights weights() const;

  // The averaged networks in single precision, for one image each: what the exported files are held against.
  std::array<float, 3> first_look(std::span<const float> input, std::span<const float> anchors) const;
  std::vector<float> second_look(std::span<const float> crop, std::span<const float> context) const;
  std::vector<float> plain(std::span<const float> image) const;
  /// @param latent  the decoder's condition as it stands in the bundle, @param points_C [N][3]
  std::vector<float> decode(std::span<const float> latent, std::span<const float> points_C) const;

 private:
  struct State;
  explicit Trainer(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace gatefield::training
