#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "server/training/data/dataset.h"
#include "server/training/evaluation/approach.h"
#include "server/training/evaluation/held_out.h"
#include "server/training/evaluation/two_gates.h"

namespace gatefield::training {

/// A folder or file and what reports call it.
struct Named {
  std::string name;
  std::filesystem::path path;

  Named() = default;
  /// Called by its folder's or file's own name.
  Named(const std::filesystem::path& from);  // NOLINT(google-explicit-constructor): a path is all that most need
  Named(std::string called, std::filesystem::path from) : name(std::move(called)), path(std::move(from)) {}
  /// "name=path", or just "path".
  static Named parse(const std::string& text);
};

/// How well bundles do on images that no training saw, through the same encoder, kernels, fit and memory as the server
/// runs.
struct EvaluateOptions {
  Named bundle;
  std::vector<Named> against;   ///< the same for other bundles, side by side
  std::vector<Named> datasets;  ///< of other seeds than the training sets'
  std::uint64_t limit = 0;      ///< images of each set, from the first on; 0 = all
  double prior_sigma_m = 0.1;   ///< noise of the prior, per axis
  double noise_scale = 1.0;     ///< of the simulated sensor
  std::uint64_t seed = 99;
  int threads = 1;
  TwoGatesOptions two_gates;  ///< count 0: left out
  ApproachOptions approach;   ///< count 0: left out
};

/// Says which option is wrong and why.
Status validate(const EvaluateOptions& options);

struct Evaluation {
  struct Bundle {
    std::string name;
    double validity_threshold = 0.5;
    double encode_median_ms = 0.0, encode_p99_ms = 0.0;  ///< with a prior, this machine and moment
    double first_encode_median_ms = 0.0;
  };
  struct Set {
    std::string name;
    DatasetKind kind = DatasetKind::kSimulation;
    HeldOut frames;
  };
  EvaluateOptions options;
  std::vector<Bundle> bundles;              ///< [0] is options.bundle, then those it is compared with
  std::vector<Set> sets;                    ///< as options.datasets
  std::vector<TwoGatesResult> two_gates;    ///< [bundle], or empty
  std::vector<ApproachFlights> approaches;  ///< [bundle], or empty
};

/// Depends on the options alone, not on the number of threads (but for the times).
/// @param progress called from this thread a few times a second with the part done; returns false to stop
/// Errors: options, a bundle or data set that can't be read, an empty set; "evaluation stopped".
Result<Evaluation> evaluate(const EvaluateOptions& options, const std::function<bool(double)>& progress = {});

}  // namespace gatefield::training
