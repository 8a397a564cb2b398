#include "server/training/commands/stereo_command.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>
#include <thread>

#include "common/base/progress_line.h"
#include "server/training/commands/command.h"
#include "server/training/data/contact_sheet.h"
#include "server/training/data/flights.h"
#include "server/training/learn/train_loop.h"

namespace gatefield::training {

int stereo_file(const std::filesystem::path& file, std::uint64_t seed, std::uint64_t count, int threads,
                std::uint64_t rooms) {
  if (const Status made = make_folder(file.parent_path()); !made) return fail(made.error());
  FlightOptions options;
  options.seed = seed;
  options.count = count;
  options.rooms = rooms;
  options.threads = threads;
  ProgressLine line("stereo");
  const Status made = generate_flights(file, options, [&](const Progress& progress) {
    line.show(static_cast<double>(progress.done_n) / static_cast<double>(std::max<std::uint64_t>(1, progress.total_n)),
              progress.time_left_s, fmt::format("{:.1f} pairs/s", progress.rate_hz));
    return !stop_requested;
  });
  if (stop_requested) return stopped("stereo");
  if (!made) return fail(made.error());
  line.say(file.string() + ": " + std::to_string(count) + " pairs, seed " + std::to_string(seed) + ", " +
           std::to_string(rooms) + " rooms");
  return 0;
}

void add_stereo_command(CLI::App* app, int* exit_code) {
  struct Options {
    std::filesystem::path file, sheet_file;
    std::uint64_t pairs = 3000, seed = kStereoTrainSeed, rooms = 25;
    int threads = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
    int sheet = 64;
  };
  const auto options = std::make_shared<Options>();
  auto* command =
      app->add_subcommand("stereo", "Fly through rooms with the second depth sensor (continues a file that is there)");
  command->add_option("--out", options->file, "the data set's file")->required();
  command->add_option("--pairs", options->pairs, "how many measured images with their truth")
      ->capture_default_str()
      ->check(CLI::Range(1, 10'000'000));
  command->add_option("--seed", options->seed, "names rooms, textures, courses and placements; other seeds share none")
      ->capture_default_str();
  command->add_option("--rooms", options->rooms, "how many rooms; every 40 frames another one, or other placements")
      ->capture_default_str()
      ->check(CLI::Range(1, 1'000'000));
  command->add_option("--threads", options->threads)->capture_default_str()->check(CLI::Range(1, 256));
  command->add_option("--contact-sheet", options->sheet_file, "also write a PNG of some images");
  command->add_option("--contact-sheet-images", options->sheet)->capture_default_str()->check(CLI::Range(1, 1000));
  command->callback([options, exit_code] {
    *exit_code = stereo_file(options->file, options->seed, options->pairs, options->threads, options->rooms);
    if (*exit_code != 0 || options->sheet_file.empty()) return;
    const auto dataset = Dataset::open(options->file);
    if (!dataset) {
      *exit_code = fail(dataset.error());
      return;
    }
    const Status written = write_contact_sheet(*dataset, options->sheet, {}, options->sheet_file);
    if (!written) *exit_code = fail(written.error());
  });
}

}  // namespace gatefield::training
