#include "server/training/commands/fit_noise_command.h"

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <vector>

#include "common/base/progress_line.h"
#include "common/base/whole_file.h"
#include "common/config/sensor_noise_file.h"
#include "server/training/commands/command.h"
#include "server/training/commands/frame_options.h"
#include "server/training/data/noise_fit.h"
#include "server/training/data/plain_fit.h"
#include "server/training/data/sensor_figures.h"
#include "server/training/learn/train_loop.h"

namespace gatefield::training {
namespace {

struct Options {
  std::filesystem::path frames, recording, out, page;
  NoiseFitOptions fit;
  FrameOptions camera;
  double decimation = 1.0;
  bool figures = false;
};

Status save(const std::filesystem::path& file, const scene::SensorNoise& noise, const std::string& head,
            const std::vector<FittedParameter>& parameters) {
  if (const Status made = make_folder(file.parent_path()); !made) return made;
  std::vector<config::NoiseRemark> remarks{{"", head}};
  for (const FittedParameter& parameter : parameters) remarks.push_back({parameter.field, parameter.says});
  return config::save_sensor_noise(file, noise, remarks);
}

int run_plain(const Options& options) {
  const auto frames = find_frames(options.camera.folder(options.frames));
  if (!frames) return fail(frames.error());
  const auto fit = fit_plain(*frames, {options.decimation, options.fit.baseline_m});
  if (!fit) return fail(fit.error());
  std::printf("%s\n%s", to_text(*fit).c_str(), to_markdown(*fit).c_str());
  if (!options.out.empty()) {
    const std::string head = "fitted to " + std::to_string(fit->recorded.frames) + " frames of " +
                             options.frames.filename().string() + " by gatefield-train fit-noise";
    if (const Status written = save(options.out, fit->noise, head, fit->parameters); !written)
      return fail(written.error());
  }
  if (options.page.empty()) return 0;
  const Status written = write_file(options.page, to_markdown(*fit));
  return written ? 0 : fail(written.error());
}

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
    const Status written = save(options.out, fit.noise,
                                "fitted to " + options.recording.filename().string() + ", " +
                                    std::to_string(fit.frames) + " frames, by gatefield-train fit-noise",
                                fit.parameters);
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
  auto* command = app->add_subcommand("fit-noise",
                                      "Fit the simulated sensor's noise: the measured model to plain frames without a "
                                      "gate, the first model to a recording with the truth");
  command->add_option(
      "folder", options->frames,
      "folder of plain depth frames (16-bit PNG or .raw): the measured model, active_stereo, is fitted");
  add_frame_options(command, &options->camera);
  command
      ->add_option("--decimation", options->decimation, "of plain frames: the sensor's own images are this much finer")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 16.0));
  command->add_option("--page", options->page, "of plain frames: write the table of recorded and drawn ones here");
  command->add_option("--recording", options->recording, "data set with measured depth: the first model is fitted");
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
  command->callback([options, exit_code] {
    if (options->frames.empty() == options->recording.empty()) {
      *exit_code = fail("fit-noise needs either a folder of frames or --recording SET, and not both");
    } else {
      *exit_code = options->frames.empty() ? run(*options) : run_plain(*options);
    }
  });
}

}  // namespace gatefield::training
