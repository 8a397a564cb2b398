#include "server/app/trace.h"

#include <algorithm>
#include <cstdio>
#include <limits>

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

class TracedPlanner final : public planner::Planner {
 public:
  TracedPlanner(std::unique_ptr<planner::Planner> planner, std::FILE* file, bool rollouts)
      : planner_(std::move(planner)), file_(file), keeper_(planner_->profile().samples), rollouts_(rollouts) {}

  void plan(const planner::PlanInput& input, planner::Plan* plan) noexcept override {
    keeper_.rollouts.clear();
    planner_->watch(rollouts_ && input.step % kEvery == 0 ? &keeper_ : nullptr);
    planner_->plan(input, plan);

    trace::Step step;
    step.stamp = input.stamp;
    step.waypoint = input.waypoint;
    step.hold = input.hold;
    step.seen = input.target.seen;
    step.p_W = input.start.p_WB;
    step.center_W = input.target.center_W - input.target.moved_W;
    step.axis_W = input.target.axis_W;
    step.center_sigma_m = input.target.center_sigma_m;
    step.axis_sigma_rad = input.target.axis_sigma_rad;
    step.field_age_s = input.field_age_s;
    step.lowest_field_m = plan->lowest_field_m;
    step.rollouts = std::move(keeper_.rollouts);
    const std::string text = trace::to_text(step);
    std::fwrite(text.data(), 1, text.size(), file_.get());
    std::fflush(file_.get());  // whoever hears the answer may read the file
  }
  void reset() noexcept override { planner_->reset(); }
  const planner::Profile& profile() const noexcept override { return planner_->profile(); }

 private:
  std::unique_ptr<planner::Planner> planner_;
  std::unique_ptr<std::FILE, CloseFile> file_;
  Keeper keeper_;
  bool rollouts_;
};

}  // namespace

Result<std::unique_ptr<planner::Planner>> traced(Result<std::unique_ptr<planner::Planner>> planner,
                                                 const protocol::SessionRequest& request, const TraceOptions& options) {
  if (!planner || options.folder.empty()) return planner;
  const std::filesystem::path file = options.folder / (request.vehicle + ".trace");
  std::FILE* const opened = std::fopen(file.c_str(), "wb");
  if (opened == nullptr)
    return Error{"trace " + file.string() + " can't be written, expected a folder that the server may write to"};
  return std::unique_ptr<planner::Planner>(
      std::make_unique<TracedPlanner>(std::move(planner).value(), opened, options.rollouts));
}

}  // namespace gatefield::app
