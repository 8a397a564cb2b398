#include "server/training/commands/generate_command.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <memory>
#include <thread>

#include "common/base/progress_line.h"
#include "common/config/sensor_noise_file.h"
#include "server/training/commands/command.h"
#include "server/training/commands/frame_options.h"
#include "server/training/data/backgrounds.h"
#include "server/training/data/contact_sheet.h"
#include "server/training/data/dataset.h"
#include "server/training/data/statistics.h"
#include "server/training/learn/train_loop.h"

namespace gatefield::training {

int generate_file(const std::filesystem::path& file, std::uint64_t seed, std::uint64_t count, int threads, int points,
                  double round_part) {
  if (const Status made = make_folder(file.parent_path()); !made) return fail(made.error());
  DatasetOptions options;
  options.seed = seed;
  options.count = count;
  options.threads = threads;
  options.points = points;
  options.round_part = round_part;
  ProgressLine line("generate");
  const Status made = generate_dataset(file, options, [&](const Progress& progress) {
    line.show(static_cast<double>(progress.done_n) / static_cast<double>(std::max<std::uint64_t>(1, progress.total_n)),
              progress.time_left_s, fmt::format("{:.0f} samples/s", progress.rate_hz));
    return !stop_requested;
  });
  if (stop_requested) return stopped("generate");
  if (!made) return fail(made.error());
  line.say(file.string() + ": " + std::to_string(count) + " samples, seed " + std::to_string(seed));
  return 0;
}

namespace {

/// `generate --backgrounds FOLDER`.
struct BackgroundArguments {
  std::filesystem::path frames, noise_file;
  FrameOptions camera;
};

int generate_before(const BackgroundArguments& arguments, const std::filesystem::path& file,
                    BackgroundOptions options) {
  options.noise.active_stereo.emplace();
  if (!arguments.noise_file.empty()) {
    const auto noise = config::load_sensor_noise(arguments.noise_file);
    if (!noise) return fail(noise.error());
    options.noise = *noise;
  }
  const auto frames = find_frames(arguments.camera.folder(arguments.frames));
  if (!frames) return fail(frames.error());
  const auto backgrounds = load_backgrounds(*frames);
  if (!backgrounds) return fail(backgrounds.error());
  if (const Status made = make_folder(file.parent_path()); !made) return fail(made.error());
  ProgressLine line("generate");
  const Status made = generate_on_backgrounds(file, *backgrounds, options, [&](const Progress& progress) {
    line.show(static_cast<double>(progress.done_n) / static_cast<double>(std::max<std::uint64_t>(1, progress.total_n)),
              progress.time_left_s, fmt::format("{:.0f} samples/s", progress.rate_hz));
    return !stop_requested;
  });
  if (stop_requested) return stopped("generate");
  if (!made) return fail(made.error());
  line.say(file.string() + ": " + std::to_string(options.count) + " samples before " +
           std::to_string(backgrounds->measured_m.size()) + " frames, seed " + std::to_string(options.seed));
  return 0;
}

}  // namespace

void add_generate_command(CLI::App* app, int* exit_code) {
  struct Options {
    std::filesystem::path file, sheet_file;
    std::uint64_t samples = 200'000, seed = kTrainSeed;
    int threads = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
    int sheet = 64;
    int points = 0;
    double round_part = 0.0;
    bool statistics = false;
    BackgroundArguments backgrounds;
  };
  const auto options = std::make_shared<Options>();
  auto* command = app->add_subcommand("generate", "Render a data set (continues a file that is there)");
  command->add_option("--out", options->file, "the data set's file")->required();
  command->add_option("--samples", options->samples, "how many images")
      ->capture_default_str()
      ->check(CLI::Range(1, 100'000'000));
  command->add_option("--seed", options->seed, "names the set; held-out sets need another one")->capture_default_str();
  command->add_option("--threads", options->threads)->capture_default_str()->check(CLI::Range(1, 256));
  command
      ->add_option("--points", options->points,
                   "also store query points and their field values for each image (the paper has 8192), for training "
                   "elsewhere; ours draws them afresh at every pass")
      ->capture_default_str()
      ->check(CLI::Range(0, 1'000'000));
  command->add_option("--round-part", options->round_part, "part of the gates whose opening is round")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1.0));
  command->add_flag("--statistics", options->statistics, "print what is in the set");
  command->add_option("--contact-sheet", options->sheet_file, "also write a PNG of some images");
  command->add_option("--contact-sheet-images", options->sheet)->capture_default_str()->check(CLI::Range(1, 1000));
  command->add_option("--backgrounds", options->backgrounds.frames,
                      "folder of plain depth frames without a gate (16-bit PNG or .raw): gates are rendered into them");
  command->add_option("--noise", options->backgrounds.noise_file,
                      "with --backgrounds: the sensor's noise on the gates, a file of fit-noise; not given: a D435's");
  add_frame_options(command, &options->backgrounds.camera);
  command->callback([options, exit_code] {
    if (options->backgrounds.frames.empty()) {
      *exit_code = generate_file(options->file, options->seed, options->samples, options->threads, options->points,
                                 options->round_part);
    } else if (options->points > 0) {
      *exit_code = fail("--points and --backgrounds are both given, expected one: points are drawn at every pass");
    } else {
      *exit_code = generate_before(options->backgrounds, options->file,
                                   {.seed = options->seed,
                                    .count = options->samples,
                                    .threads = options->threads,
                                    .round_part = options->round_part,
                                    .noise = {}});
    }
    if (*exit_code != 0 || (options->sheet_file.empty() && !options->statistics)) return;
    const auto dataset = Dataset::open(options->file);
    if (!dataset) {
      *exit_code = fail(dataset.error());
      return;
    }
    if (options->statistics) std::printf("%s", to_text(count_statistics(*dataset)).c_str());
    if (options->sheet_file.empty()) return;
    const Status written = write_contact_sheet(*dataset, options->sheet, {}, options->sheet_file);
    if (!written) *exit_code = fail(written.error());
  });
}

}  // namespace gatefield::training
