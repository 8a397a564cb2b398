#include "server/training/learn/train_loop.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cinttypes>
#include <cstdio>
#include <fstream>
#include <vector>

#include "common/base/progress_line.h"
#include "common/base/whole_file.h"
#include "server/training/learn/export.h"

namespace gatefield::training {
namespace {

constexpr const char* kLogHeader =
    "step,images,learning_time_s,images_per_s,total,field_m,box_m,constant_m,center_m,first_center_m,segmentation,"
    "normal,depth,validity,"
    "predicted_error\n";
constexpr std::uint64_t kLogEverySteps = 100;
/// A plateau at the constant's level is normal at first (docs/training.md); after this many images it is worth a
/// warning.
constexpr std::uint64_t kPlateauImages = 60'000;

/// Running sums of a log line.
struct Mean {
  StepLosses sum;
  int count = 0;
  void add(const StepLosses& x) {
    sum.total += x.total;
    sum.field_m += x.field_m;
    sum.box_m += x.box_m;
    sum.constant_m += x.constant_m;
    sum.center_m += x.center_m;
    sum.first_center_m += x.first_center_m;
    sum.segmentation += x.segmentation;
    sum.normal += x.normal;
    sum.depth += x.depth;
    sum.validity += x.validity;
    sum.predicted_error += x.predicted_error;
    ++count;
  }
};

/// Keeps the log's lines up to `step` (a resumed run writes the later ones again) and returns the learning time so far.
Result<double> cut_log(const std::filesystem::path& file, std::uint64_t step) {
  std::string kept = kLogHeader;
  double learning_time_s = 0.0;
  if (std::ifstream in(file); in) {
    std::string line;
    std::getline(in, line);
    while (std::getline(in, line)) {
      unsigned long long line_step = 0;
      unsigned long long images = 0;
      double time_s = 0.0;
      if (std::sscanf(line.c_str(), "%llu,%llu,%lf", &line_step, &images, &time_s) != 3 || line_step > step) break;
      kept += line + "\n";
      learning_time_s = time_s;
    }
  }
  if (const Status written = write_file(file, kept); !written) return written.failure().within("log ");
  return learning_time_s;
}

}  // namespace

int images_per_step(const TrainRun& run) noexcept {
  return run.design.plain() ? std::max(1, run.batch * run.crops_per_image / 2) : run.batch;
}

Result<bool> train(const TrainRun& run) {
  using Clock = std::chrono::steady_clock;
  if (run.data.empty()) return Error{"no data set is given"};
  std::vector<Dataset> datasets;
  datasets.reserve(run.data.size());
  std::vector<Source> sources;
  std::string said;
  for (const TrainRun::Data& data : run.data) {
    if (!(data.part > 0.0))
      return Error{"part of data set '" + data.file.string() + "' is " + std::to_string(data.part) +
                   ", expected more than 0"};
    if (!(data.round_part >= 0.0 && data.round_part <= 1.0))
      return Error{"part of round gates is " + std::to_string(data.round_part) + ", expected 0 to 1"};
    if (data.file.empty()) {
      sources.push_back({nullptr, data.part, run.seed, data.round_part});
      said += "images rendered as they are needed; ";
      if (data.round_part > 0.0) said += fmt::format("{:.0f} % of their gates round; ", 100.0 * data.round_part);
      continue;
    }
    auto dataset = Dataset::open(data.file);
    if (!dataset) return dataset.failure();
    if (dataset->size() == 0) return Error{"data set " + data.file.string() + " has no samples"};
    datasets.push_back(std::move(dataset).value());
    sources.push_back({&datasets.back(), data.part, 0});
    said += data.file.string() + ": " + std::to_string(datasets.back().size()) + " images; ";
  }

  const int images = images_per_step(run);
  TrainerOptions options;
  options.design = run.design;
  options.freeze_decoders = run.freeze_decoders;
  options.total_steps = run.images / static_cast<std::uint64_t>(images);
  options.learning_rate = run.learning_rate;
  options.threads = run.torch_threads;
  options.allow_bf16 = run.allow_bf16;
  options.seed = run.seed;
  auto created = Trainer::create(options);
  if (!created) return created.failure();
  Trainer& trainer = **created;

  std::error_code code;
  std::filesystem::create_directories(run.folder, code);
  if (code) return Error{"folder " + run.folder.string() + " can't be made: " + code.message()};
  const std::filesystem::path checkpoint = run.folder / "checkpoint.pt";
  const std::filesystem::path log_file = run.folder / "log.csv";
  if (std::filesystem::exists(checkpoint)) {
    if (const Status loaded = trainer.load(checkpoint); !loaded) return loaded.failure();
  } else if (!run.start_from.empty()) {
    const auto left = trainer.start_from(run.start_from);
    if (!left) return left.failure();
    if (!left->empty()) {
      std::string names;
      for (const std::string& name : *left) names += (names.empty() ? "" : ", ") + name;
      std::printf("starts from %s, but for %s\n", run.start_from.c_str(), names.c_str());
    }
  }
  const auto cut = cut_log(log_file, trainer.steps());
  if (!cut) return cut.failure();
  const double earlier_s = *cut;
  if (trainer.steps() >= options.total_steps) {
    std::printf("%s: all %" PRIu64 " steps are done\n", run.folder.c_str(), trainer.steps());
    return true;
  }

  ProgressLine progress("train");
  progress.say(said + "step " + std::to_string(trainer.steps()) + " of " + std::to_string(options.total_steps) + "; " +
               (trainer.bf16() ? "bfloat16" : "single precision"));

  BatchOptions batch_options;
  batch_options.images = images;
  batch_options.crops_per_image = run.crops_per_image;
  batch_options.points = run.points;
  batch_options.design = run.design;
  batch_options.noise = run.noise;
  batch_options.seed = run.seed;
  BatchQueue queue(sources, batch_options, trainer.steps(), run.data_threads);

  const auto save = [&]() -> Status {
    if (const Status saved = trainer.save(checkpoint); !saved) return saved;
    if (run.bundle_folder.empty()) return {};
    return export_bundle(trainer.weights(), run.design, run.name, run.bundle_folder);
  };

  const auto begun = Clock::now();
  const std::uint64_t first_step = trainer.steps();
  auto saved_at = begun;
  auto rate_from = begun;
  std::uint64_t rate_step = trainer.steps();
  double images_per_s = 0.0;
  bool warned = false;
  Mean mean;
  std::ofstream log(log_file, std::ios::app);
  while (trainer.steps() < options.total_steps && !stop_requested) {
    auto batch = queue.next();
    const auto losses = trainer.step(batch_options, batch.get());
    queue.recycle(std::move(batch));
    if (!losses) return losses.failure();
    mean.add(*losses);

    const std::uint64_t step = trainer.steps();
    const auto now = Clock::now();
    if (step % kLogEverySteps == 0 || step == options.total_steps) {
      images_per_s = static_cast<double>((step - rate_step) * static_cast<std::uint64_t>(images)) /
                     std::chrono::duration<double>(now - rate_from).count();
      rate_from = now;
      rate_step = step;
      const double n = mean.count;
      const std::uint64_t passes = step * static_cast<std::uint64_t>(images);
      log << fmt::format(
                 "{},{},{:.1f},{:.0f},{:.5f},{:.5f},{:.5f},{:.5f},{:.5f},{:.5f},{:.5f},{:.5f},{:.5f},{:.5f},{:.5f}\n",
                 step, passes, earlier_s + std::chrono::duration<double>(now - begun).count(), images_per_s,
                 mean.sum.total / n, mean.sum.field_m / n, mean.sum.box_m / n, mean.sum.constant_m / n,
                 mean.sum.center_m / n, mean.sum.first_center_m / n, mean.sum.segmentation / n, mean.sum.normal / n,
                 mean.sum.depth / n, mean.sum.validity / n, mean.sum.predicted_error / n)
          << std::flush;
      if (!log) return Error{"log " + log_file.string() + " can't be written (disk full?)"};
      const double part = static_cast<double>(step) / static_cast<double>(options.total_steps);
      const double per_step_s =
          std::chrono::duration<double>(now - begun).count() / static_cast<double>(step - first_step);
      const std::string text =
          fmt::format("{:.0f} img/s  field {:.3f} m (constant {:.3f})  box {:.3f} m  centre {:.3f} m  first {:.3f} m",
                      images_per_s, mean.sum.field_m / n, mean.sum.constant_m / n, mean.sum.box_m / n,
                      mean.sum.center_m / n, mean.sum.first_center_m / n);
      progress.show(part, per_step_s * static_cast<double>(options.total_steps - step), text);
      if (!warned && passes > kPlateauImages && mean.sum.field_m > 0.9 * mean.sum.constant_m) {
        progress.say("warning: after " + std::to_string(passes) +
                     " images the field's error is still at the level of a constant; data set, labels or learning rate "
                     "are suspect");
        warned = true;
      }
      mean = {};
    }
    if (std::chrono::duration<double>(now - saved_at).count() > run.checkpoint_every_s) {
      if (const Status saved = save(); !saved) return saved.failure();
      saved_at = Clock::now();
    }
  }
  if (const Status saved = save(); !saved) return saved.failure();
  const bool complete = trainer.steps() >= options.total_steps;
  progress.say(complete ? "training complete"
                        : "stopped at step " + std::to_string(trainer.steps()) + "; the same command continues");
  return complete;
}

}  // namespace gatefield::training
