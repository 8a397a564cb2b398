#include "server/app/trace.h"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "common/base/logging.h"
#include "common/trace/trace.h"
#include "server/planner/rollout_batch.h"

namespace gatefield::app {
namespace {

constexpr std::uint64_t kEvery = 5;  ///< steps
constexpr int kRollouts = 64;

struct CloseFile {
  void operator()(std::FILE* file) const noexcept { std::fclose(file); }
};

/// Keeps some rollouts of a step.
class Keeper final : public planner::RolloutObserver {
 public:
  explicit Keeper(int samples) : every_(std::max(1, samples / kRollouts)) {}

  void see(const planner::RolloutBatch& batch, int first) noexcept override {
    for (int m = 0; m < batch.samples; ++m) {
      if ((first + m) % every_ != 0) continue;
      trace::Rollout rollout;
      for (int k = 0; k < batch.steps; ++k) {
        const auto at = [&](int channel) { return static_cast<double>(batch.states.row(k, channel)[m]); };
        rollout.p_W.emplace_back(at(kernels::kPx), at(kernels::kPy), at(kernels::kPz));
        rollout.field_m.push_back(batch.field != nullptr ? static_cast<double>(batch.field_row(k)[m])
                                                         : std::numeric_limits<double>::quiet_NaN());
      }
      rollouts.push_back(std::move(rollout));
    }
  }

  std::vector<trace::Rollout> rollouts;

 private:
  int every_;
};

class Tracer final : public pilot::StepObserver {
 public:
  Tracer(std::string name, std::FILE* file, int samples, bool rollouts)
      : name_(std::move(name)), file_(file), keeper_(samples), rollouts_(rollouts) {}

  planner::RolloutObserver* rollouts(std::uint64_t step) noexcept override {
    keeper_.rollouts.clear();
    return file_ && rollouts_ && step % kEvery == 0 ? &keeper_ : nullptr;
  }

  void made(const pilot::StepRecord& record) noexcept override {
    if (!file_) return;
    trace::Step step;
    step.stamp = record.stamp;
    step.waypoint = record.waypoint;
    step.hold = record.input.hold;
    step.seen = record.target.seen;
    step.p_W = record.input.start.p_WB;
    step.center_W = record.target.center_W;
    step.axis_W = record.target.axis_W;
    step.center_sigma_m = record.target.center_sigma_m;
    step.axis_sigma_rad = record.target.axis_sigma_rad;
    step.field_age_s = record.input.field_age_s;
    step.lowest_field_m = record.plan.lowest_field_m;
    step.rollouts = std::move(keeper_.rollouts);
    const std::string text = trace::to_text(step);
    const bool whole = std::fwrite(text.data(), 1, text.size(), file_.get()) == text.size();
    // Whoever hears the answer may read the file.
    if (std::fflush(file_.get()) != 0 || !whole) give_up(errno);
  }

 private:
  /// A trace with a hole in it is worse than a short one.
  void give_up(int reason) noexcept {
    log::error("trace " + name_ + " ends here, it can't be written: " + std::strerror(reason));
    file_.reset();
  }

  const std::string name_;
  std::unique_ptr<std::FILE, CloseFile> file_;
  Keeper keeper_;
  bool rollouts_;
};

}  // namespace

Result<std::unique_ptr<pilot::StepObserver>> make_tracer(const protocol::SessionRequest& request,
                                                         const planner::Profile& profile, const TraceOptions& options) {
  const std::filesystem::path file = options.folder / (request.vehicle + ".trace");
  std::FILE* const opened = std::fopen(file.c_str(), "wb");
  if (opened == nullptr)
    return Error{"trace " + file.string() + " can't be written, expected a folder that the server may write to",
                 ErrorCode::kUnreadable};
  return std::unique_ptr<pilot::StepObserver>(
      std::make_unique<Tracer>(file.string(), opened, profile.samples, options.rollouts));
}

}  // namespace gatefield::app
