#include "server/training/evaluation/evaluate.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>

#include "common/model/bundle.h"
#include "server/perception/depth_encoder.h"
#include "server/perception/gate_memory.h"
#include "server/perception/hourglass_fit.h"
#include "server/training/data/sampling.h"

namespace gatefield::training {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kMixPoints = 192;
constexpr std::size_t kBoxPoints = 256;
// A place counts as empty when no gate is nearer; nearer ones can be found by looking again around a corrected centre.
constexpr double kEmptyRadius_m = 2.0;
constexpr double kFailedCenter_m = 10.0;  // a field without a gate counts as this far off
constexpr double kFailedNormal_deg = 90.0;
constexpr double kDegree = std::numbers::pi / 180.0;

double quantile(std::vector<double> values, double part) {
  if (values.empty()) return 0.0;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(part * static_cast<double>(values.size() - 1) + 0.5);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

double mean(const std::vector<double>& values) {
  return values.empty() ? 0.0 : std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

/// The camera looking level along the world's x axis: the fit turns its starting poses about the vertical.
const Eigen::Isometry3d& level_camera() {
  static const Eigen::Isometry3d X_WC = forward_camera_mount(0.0);
  return X_WC;
}

/// Query points and their true values, split by axis as the decoder takes them.
struct Points {
  std::vector<float> x, y, z, truth_m, value_m;

  void set(const std::vector<float>& points_C, const std::vector<float>& sdf_m) {
    const std::size_t n = sdf_m.size();
    for (auto* axis : {&x, &y, &z, &value_m}) axis->resize(n);
    for (std::size_t i = 0; i < n; ++i) {
      const Eigen::Vector3d p_W =
          level_camera() * Eigen::Vector3d(points_C[3 * i], points_C[3 * i + 1], points_C[3 * i + 2]);
      x[i] = static_cast<float>(p_W.x());
      y[i] = static_cast<float>(p_W.y());
      z[i] = static_cast<float>(p_W.z());
    }
    truth_m = sdf_m;
  }
};

struct Accumulated {
  std::vector<double> all, near, box, sign, center, normal, latent_center, valid;
  std::vector<float> truth_all, truth_near, truth_box;
  int fitted = 0;
};

double constant_error(std::vector<float> truth) {
  if (truth.empty()) return 0.0;
  const auto middle = truth.begin() + static_cast<std::ptrdiff_t>(truth.size() / 2);
  std::nth_element(truth.begin(), middle, truth.end());
  const float constant = *middle;
  double sum = 0.0;
  for (const float value : truth) sum += std::abs(value - constant);
  return sum / static_cast<double>(truth.size());
}

double constant_sign_percent(const std::vector<float>& truth) {
  if (truth.empty()) return 0.0;
  const auto positive = std::count_if(truth.begin(), truth.end(), [](float value) { return value > 0.0f; });
  const double part = static_cast<double>(positive) / static_cast<double>(truth.size());
  return 100.0 * std::max(part, 1.0 - part);
}

std::vector<double> ranks(const std::vector<double>& values) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return values[a] < values[b]; });
  std::vector<double> out(values.size());
  for (std::size_t i = 0; i < order.size(); ++i) out[order[i]] = static_cast<double>(i);
  return out;
}

double spearman(const std::vector<double>& a, const std::vector<double>& b) {
  if (a.size() < 3) return 0.0;
  const std::vector<double> ra = ranks(a);
  const std::vector<double> rb = ranks(b);
  const double middle = 0.5 * static_cast<double>(a.size() - 1);
  double ab = 0.0, aa = 0.0, bb = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    ab += (ra[i] - middle) * (rb[i] - middle);
    aa += (ra[i] - middle) * (ra[i] - middle);
    bb += (rb[i] - middle) * (rb[i] - middle);
  }
  return ab / std::sqrt(aa * bb);
}

ValidityResult roc(std::vector<double> positives, std::vector<double> negatives, double threshold) {
  ValidityResult out;
  out.positives = static_cast<int>(positives.size());
  out.negatives = static_cast<int>(negatives.size());
  out.threshold = threshold;
  if (positives.empty() || negatives.empty()) return out;
  std::sort(positives.begin(), positives.end());
  std::sort(negatives.begin(), negatives.end());
  const auto above = [](const std::vector<double>& sorted, double limit) {
    return static_cast<double>(sorted.end() - std::lower_bound(sorted.begin(), sorted.end(), limit)) /
           static_cast<double>(sorted.size());
  };
  out.recall = above(positives, threshold);
  out.false_positive_rate = above(negatives, threshold);
  const auto rank =
      std::min(negatives.size() - 1, static_cast<std::size_t>(0.99 * static_cast<double>(negatives.size())));
  out.threshold_at_1_percent = std::nextafter(negatives[rank], 2.0);
  out.recall_at_1_percent = above(positives, out.threshold_at_1_percent);
  double pairs = 0.0;
  for (const double positive : positives) {
    pairs += static_cast<double>(std::lower_bound(negatives.begin(), negatives.end(), positive) - negatives.begin());
  }
  out.area = pairs / (static_cast<double>(positives.size()) * static_cast<double>(negatives.size()));
  return out;
}

/// The groups that a gate at this place belongs to.
std::vector<std::string> groups_of(const GateLabel& gate) {
  const double distance = gate.p_CG.norm();
  std::vector<std::string> out = {"all"};
  if (distance >= 1.0 && distance < 2.0) out.emplace_back("1 to 2 m");
  if (distance >= 2.0 && distance < 4.0) out.emplace_back("2 to 4 m");
  if (distance >= 4.0 && distance < 7.0) out.emplace_back("4 to 7 m");
  const double axis =
      std::acos(std::min(1.0f, std::abs((gate.q_CG * Eigen::Vector3f::UnitX()).dot(gate.p_CG.normalized())))) / kDegree;
  if (distance >= 1.0 && distance < 4.0 && axis < 60.0 && gate.visible_fraction >= 0.5f) out.emplace_back("core");
  return out;
}

const std::vector<std::string> kModes = {"prior", "first"};
const std::vector<std::string> kGroups = {"1 to 2 m", "2 to 4 m", "4 to 7 m", "core", "all"};

}  // namespace

Result<Evaluation> evaluate(const EvaluateOptions& options, const std::function<bool(double)>& progress) {
  const auto bundle = model::Bundle::read(options.bundle);
  if (!bundle) return Error{bundle.error()};
  auto created = perception::DepthEncoder::create(*bundle);
  if (!created) return Error{created.error()};
  perception::DepthEncoder& encoder = **created;
  const auto dataset = Dataset::open(options.dataset_file);
  if (!dataset) return Error{dataset.error()};
  const bool two_look = bundle->manifest().encoder_kind == "two_look";
  const std::uint64_t total = options.limit > 0 ? std::min(options.limit, dataset->size()) : dataset->size();
  if (total == 0) return Error{"data set " + options.dataset_file.string() + " has no samples"};

  std::map<std::pair<std::string, std::string>, Accumulated> sums;
  std::vector<double> valid_scores, empty_scores, predicted_m, true_box_m, encode_ms, first_ms;
  scene::SensorNoise noise;
  noise.scale = options.noise_scale;
  const CameraModel& camera = dataset_camera();
  std::vector<float> image(kImageSize_px);
  std::vector<float> mix_C(3 * kMixPoints), mix_m(kMixPoints), box_C(3 * kBoxPoints), box_m(kBoxPoints);
  Points mix, box;
  perception::DecodedField field;

  for (std::uint64_t index = 0; index < total; ++index) {
    if (progress && index % 20 == 0 && !progress(static_cast<double>(index) / static_cast<double>(total))) {
      return Error{"evaluation stopped"};
    }
    const SampleView sample = dataset->at(index);
    Random random(options.seed, index);
    draw_noisy(sample, noise, &random, image);

    // A prior where no gate is: validity must say so.
    {
      const int u = static_cast<int>(random.below(kImageWidth_px));
      const int v = static_cast<int>(random.below(kImageHeight_px));
      const double seen = image[static_cast<std::size_t>(v * kImageWidth_px + u)];
      const Eigen::Vector3d empty_C = camera.ray_C(u, v) * (seen > 0.5 ? seen : random.uniform(1.0, 8.0));
      const bool clear = std::all_of(
          sample.gates.begin(), sample.gates.begin() + sample.gate_count,
          [&](const GateLabel& gate) { return (gate.p_CG.cast<double>() - empty_C).norm() > kEmptyRadius_m; });
      if (clear) {
        const auto encoding = encoder.encode(image, camera, empty_C);
        empty_scores.push_back(encoding ? encoding->validity : 0.0);
      }
    }
    const GateLabel* gate = sample.target();
    if (gate == nullptr) continue;
    sample_points(SamplingMix{}, camera, gate->shape, gate->X_CG(), &random, mix_C, mix_m);
    sample_box(1.0, gate->shape, gate->X_CG(), &random, box_C, box_m);
    mix.set(mix_C, mix_m);
    box.set(box_C, box_m);
    const auto near_n = static_cast<std::size_t>(SamplingMix{}.near_surface * kMixPoints);
    Eigen::Vector3d prior_C = gate->p_CG.cast<double>();
    for (int axis = 0; axis < 3; ++axis) prior_C[axis] += options.prior_sigma_m * random.normal();

    for (const std::string& mode : kModes) {
      const bool with_prior = mode == "prior";
      const auto begun = Clock::now();
      const auto encoding = encoder.encode(image, camera, with_prior ? std::optional(prior_C) : std::nullopt);
      (with_prior ? encode_ms : first_ms)
          .push_back(std::chrono::duration<double, std::milli>(Clock::now() - begun).count());
      double center_error = kFailedCenter_m;
      double normal_error = kFailedNormal_deg;
      double all = 0.0, near = 0.0, in_box = 0.0, right_sign = 0.0;
      bool fitted = false;
      if (encoding) {
        kernels::fold(bundle->decoder(), encoding->latent, level_camera(), &field.decoder);
        field.evaluate(mix.x, mix.y, mix.z, mix.value_m);
        field.evaluate(box.x, box.y, box.z, box.value_m);
        for (std::size_t i = 0; i < kMixPoints; ++i) {
          const double error = std::abs(mix.value_m[i] - mix.truth_m[i]);
          all += error / kMixPoints;
          if (i < near_n) near += error / static_cast<double>(near_n);
        }
        for (std::size_t i = 0; i < kBoxPoints; ++i) {
          in_box += std::abs(box.value_m[i] - box.truth_m[i]) / kBoxPoints;
          right_sign += (box.value_m[i] > 0.0f) == (box.truth_m[i] > 0.0f) ? 100.0 / kBoxPoints : 0.0;
        }
        // The plain encoder gives no centre to start from; there the prior does.
        const Eigen::Vector3d around_C = two_look ? encoding->center_C.cast<double>() : prior_C;
        const auto fit = perception::fit_hourglass(field, gate->shape, bundle->manifest().cone_angle_rad,
                                                   level_camera() * around_C, Eigen::Vector3d::UnitX());
        if (fit.ok) {
          fitted = true;
          center_error = (level_camera().inverse() * fit.X_WG.translation() - gate->p_CG.cast<double>()).norm();
          const Eigen::Vector3d axis_C = level_camera().linear().transpose() * fit.X_WG.linear().col(0);
          const double cosine = std::abs(axis_C.dot((gate->q_CG * Eigen::Vector3f::UnitX()).cast<double>()));
          normal_error = std::acos(std::min(1.0, cosine)) / kDegree;
        }
      }
      if (with_prior) {
        valid_scores.push_back(encoding ? encoding->validity : 0.0);
        if (encoding) {
          predicted_m.push_back(encoding->predicted_error_m);
          true_box_m.push_back(in_box);
        }
      }
      for (const std::string& group : groups_of(*gate)) {
        Accumulated& sum = sums[{mode, group}];
        sum.all.push_back(all);
        sum.near.push_back(near);
        sum.box.push_back(in_box);
        sum.sign.push_back(right_sign);
        sum.center.push_back(center_error);
        sum.normal.push_back(normal_error);
        sum.latent_center.push_back(encoding ? (encoding->center_C - gate->p_CG).norm() : kFailedCenter_m);
        sum.valid.push_back(encoding && encoding->validity >= bundle->manifest().validity_threshold ? 100.0 : 0.0);
        sum.fitted += fitted ? 1 : 0;
        sum.truth_all.insert(sum.truth_all.end(), mix_m.begin(), mix_m.end());
        sum.truth_near.insert(sum.truth_near.end(), mix_m.begin(), mix_m.begin() + static_cast<std::ptrdiff_t>(near_n));
        sum.truth_box.insert(sum.truth_box.end(), box_m.begin(), box_m.end());
      }
    }
  }

  Evaluation out;
  for (const std::string& mode : kModes) {
    for (const std::string& group : kGroups) {
      const auto found = sums.find({mode, group});
      if (found == sums.end()) continue;
      const Accumulated& sum = found->second;
      GroupResult row;
      row.mode = mode;
      row.group = group;
      row.count = static_cast<int>(sum.all.size());
      row.all_m = mean(sum.all);
      row.near_m = mean(sum.near);
      row.box_m = mean(sum.box);
      row.sign_percent = mean(sum.sign);
      row.constant_all_m = constant_error(sum.truth_all);
      row.constant_near_m = constant_error(sum.truth_near);
      row.constant_box_m = constant_error(sum.truth_box);
      row.constant_sign_percent = constant_sign_percent(sum.truth_box);
      row.center_median_m = quantile(sum.center, 0.5);
      row.center_p90_m = quantile(sum.center, 0.9);
      row.normal_median_deg = quantile(sum.normal, 0.5);
      row.normal_p90_deg = quantile(sum.normal, 0.9);
      row.fitted_percent = 100.0 * sum.fitted / std::max(1, row.count);
      row.latent_center_median_m = quantile(sum.latent_center, 0.5);
      row.valid_percent = mean(sum.valid);
      out.groups.push_back(row);
    }
  }
  out.validity = roc(valid_scores, empty_scores, bundle->manifest().validity_threshold);
  out.error_correlation = spearman(predicted_m, true_box_m);
  out.box_m = mean(true_box_m);
  const double limit = quantile(predicted_m, 0.8);
  std::vector<double> kept;
  for (std::size_t i = 0; i < predicted_m.size(); ++i) {
    if (predicted_m[i] <= limit) kept.push_back(true_box_m[i]);
  }
  out.box_without_worst_fifth_m = mean(kept);
  out.encode_median_ms = quantile(encode_ms, 0.5);
  out.encode_p99_ms = quantile(encode_ms, 0.99);
  out.first_encode_median_ms = quantile(first_ms, 0.5);
  return out;
}

std::string to_text(const Evaluation& evaluation) {
  std::string out;
  char line[320];
  std::snprintf(line, sizeof line, "%-6s %-9s %6s  %-26s %-26s %7s %7s  %15s  %15s  %9s %7s\n", "mode", "gate at",
                "images", "field all / near / box, m", "  the best constant's", "sign %", "const.", "centre med/p90",
                "normal med/p90", "network's", "valid");
  out += line;
  for (const GroupResult& row : evaluation.groups) {
    std::snprintf(line, sizeof line,
                  "%-6s %-9s %6d  %6.3f / %6.3f / %6.3f     %6.3f / %6.3f / %6.3f     %6.1f  %6.1f  %6.3f / %6.3f  "
                  "%6.1f / %6.1f  %9.3f %6.1f%%\n",
                  row.mode.c_str(), row.group.c_str(), row.count, row.all_m, row.near_m, row.box_m, row.constant_all_m,
                  row.constant_near_m, row.constant_box_m, row.sign_percent, row.constant_sign_percent,
                  row.center_median_m, row.center_p90_m, row.normal_median_deg, row.normal_p90_deg,
                  row.latent_center_median_m, row.valid_percent);
    out += line;
  }
  const ValidityResult& v = evaluation.validity;
  std::snprintf(line, sizeof line,
                "validity: %d gates with a prior, %d places without a gate; at threshold %.2f recall %.1f %%, false "
                "positives %.2f %%; at 1 %% false "
                "positives (threshold %.2f) recall %.1f %%; area under the curve %.4f\n",
                v.positives, v.negatives, v.threshold, 100.0 * v.recall, 100.0 * v.false_positive_rate,
                v.threshold_at_1_percent, 100.0 * v.recall_at_1_percent, v.area);
  out += line;
  std::snprintf(
      line, sizeof line,
      "predicted error: Spearman %.2f with the true box error; without the worst fifth box %.3f instead of %.3f m\n",
      evaluation.error_correlation, evaluation.box_without_worst_fifth_m, evaluation.box_m);
  out += line;
  std::snprintf(line, sizeof line,
                "encoder: %.2f ms median, %.2f ms p99 with a prior; %.2f ms median without (one thread)\n",
                evaluation.encode_median_ms, evaluation.encode_p99_ms, evaluation.first_encode_median_ms);
  out += line;
  return out;
}

Status write_csv(const Evaluation& evaluation, const std::filesystem::path& file) {
  std::ofstream out(file, std::ios::trunc);
  out << "mode,group,count,all_m,near_m,box_m,sign_percent,constant_all_m,constant_near_m,constant_box_m,constant_sign_"
         "percent,"
         "center_median_m,center_p90_m,normal_median_deg,normal_p90_deg,fitted_percent,latent_center_median_m,valid_"
         "percent\n";
  for (const GroupResult& row : evaluation.groups) {
    out << row.mode << ',' << row.group << ',' << row.count;
    for (const double value :
         {row.all_m, row.near_m, row.box_m, row.sign_percent, row.constant_all_m, row.constant_near_m,
          row.constant_box_m, row.constant_sign_percent, row.center_median_m, row.center_p90_m, row.normal_median_deg,
          row.normal_p90_deg, row.fitted_percent, row.latent_center_median_m, row.valid_percent}) {
      char text[32];
      std::snprintf(text, sizeof text, ",%.4f", value);
      out << text;
    }
    out << '\n';
  }
  out.close();
  if (!out) return Error{file.string() + " can't be written"};
  return {};
}

}  // namespace gatefield::training
