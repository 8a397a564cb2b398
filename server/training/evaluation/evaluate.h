#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "server/training/data/dataset.h"

namespace gatefield::training {

/// How well a bundle does on images that no training saw, through the same encoder and decoder as the server runs.
struct EvaluateOptions {
  std::filesystem::path bundle;
  std::filesystem::path dataset_file;  ///< of another seed than the training set
  std::uint64_t limit = 0;             ///< 0 = all samples
  double prior_sigma_m = 0.1;          ///< noise of the prior, per axis
  double noise_scale = 1.0;            ///< of the sensor
  std::uint64_t seed = 99;
};

/// Means over the samples of one group. Errors are means of |difference| in metres unless the name says otherwise.
struct GroupResult {
  std::string mode;   ///< "prior" (truth + noise says where to look) or "first" (the nearest gate in view)
  std::string group;  ///< by distance of the gate; "core" = 1 to 4 m, below 60 deg, at least half visible
  int count = 0;
  double all_m = 0.0;         ///< field, hybrid query points
  double near_m = 0.0;        ///< field, points about the surface
  double box_m = 0.0;         ///< field, |x|, |y|, |z| < 1 m in the gate's frame
  double sign_percent = 0.0;  ///< of the box's points
  double constant_all_m = 0.0, constant_near_m = 0.0, constant_box_m = 0.0,
         constant_sign_percent = 0.0;                ///< the best constant
  double center_median_m = 0.0, center_p90_m = 0.0;  ///< centre fitted to the field alone
  double normal_median_deg = 0.0, normal_p90_deg = 0.0;
  double fitted_percent = 0.0;  ///< fields in which a gate could be fitted at all; the others count as the worst
  double latent_center_median_m = 0.0;  ///< the centre that the encoder itself gives (two_look)
  double valid_percent = 0.0;           ///< validity above the bundle's threshold
};

struct ValidityResult {
  int positives = 0;
  int negatives = 0;
  double threshold = 0.5;
  double recall = 0.0;               ///< at the threshold, gates with a prior
  double false_positive_rate = 0.0;  ///< at the threshold, priors where no gate is
  double recall_at_1_percent = 0.0;  ///< recall where the false positive rate is 1 %
  double threshold_at_1_percent = 0.0;
  double area = 0.0;  ///< under the ROC curve
};

struct Evaluation {
  std::vector<GroupResult> groups;
  ValidityResult validity;
  double error_correlation = 0.0;  ///< Spearman's, predicted against true box error
  double box_m = 0.0;              ///< mode "prior", all distances
  double box_without_worst_fifth_m = 0.0;
  double encode_median_ms = 0.0, encode_p99_ms = 0.0;  ///< with a prior, this machine
  double first_encode_median_ms = 0.0;
};

/// @param progress called now and then with the part done; returns false to stop
Result<Evaluation> evaluate(const EvaluateOptions& options, const std::function<bool(double)>& progress = {});

/// The table for people, and the same as CSV.
std::string to_text(const Evaluation& evaluation);
Status write_csv(const Evaluation& evaluation, const std::filesystem::path& file);

}  // namespace gatefield::training
