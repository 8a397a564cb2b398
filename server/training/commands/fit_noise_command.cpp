#include "server/training/commands/fit_noise_command.h"

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <vector>

#include "common/base/progress_line.h"
#include "common/config/sensor_noise_file.h"
#include "server/training/commands/command.h"
#include "server/training/data/noise_fit.h"
#include "server/training/data/sensor_figures.h"
#include "server/training/learn/train_loop.h"

namespace gatefield::training {
namespace {

struct Options {
  std::filesystem::path recording, out;
  NoiseFitOptions fit;
  bool figures = false;
};

int run(const Options& options) {
  const auto dataset = Dataset::open(options.recording);
  if (!dataset) return fail(dataset.error());
  NoiseFit fit;
  {
    ProgressLine line("fit-noise");
    const auto begun = std::chrono::steady_clock::now();
    auto fitted = fit_noise(*dataset, options.fit, [&](double part) {
      const double spent_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
      line.show(part, spent_s / part * (1.0 - part), "");
      return !stop_requested;
    });
    if (stop_requested) return stopped("fit-noise");
    if (!fitted) return fail(options.recording.string() + ": " + fitted.error());
    fit = std::move(fitted).value();
  }
  std::printf("%s", to_text(fit).c_str());
  if (!options.out.empty()) {
    if (const Status made = make_folder(options.out.parent_path()); !made) return fail(made.error());
    std::vector<config::NoiseRemark> remarks;
    remarks.push_back({"", "fitted to " + options.recording.filename().string() + ", " + std::to_string(fit.frames) +
                               " frames, by gatefield-train fit-noise"});
    for (const FittedParameter& parameter : fit.parameters) remarks.push_back({parameter.field, parameter.says});
    const Status written = config::save_sensor_noise(options.out, fit.noise, remarks);
    if (!written) return fail(written.error());
  }
  if (options.figures) {
    const auto figures = compare_sensors(*dataset, fit.noise, options.fit.max_frames);
    if (!figures) return fail(options.recording.string() + ": " + figures.error());
    std::printf("\n%s", to_text(*figures).c_str());
  }
  return 0;
}

}  // namespace

void add_fit_noise_command(CLI::App* app, int* exit_code) {
  const auto options = std::make_shared<Options>();
  auto* command = app->add_subcommand("fit-noise", "Fit the simulated sensor's noise to a recording");
  command->add_option("--recording", options->recording, "data set with measured depth")->required();
  command->add_option("--out", options->out, "file for scenarios (sensor_noise_file) and for training (--noise)");
  command->add_flag("--static", options->fit.static_scene,
                    "camera and scene stand still: what is seen most of the time is the truth");
  command->add_option("--baseline", options->fit.baseline_m, "of the camera, m")
      ->capture_default_str()
      ->check(CLI::Range(0.005, 1.0));
  command->add_option("--frames", options->fit.max_frames, "at most so many, evenly taken")
      ->capture_default_str()
      ->check(CLI::Range(1, 1'000'000));
  command->add_flag("--figures", options->figures,
                    "print the recording's errors by distance beside those of the fitted model (needs true depth)");
  command->callback([options, exit_code] { *exit_code = run(*options); });
}

}  // namespace gatefield::training
