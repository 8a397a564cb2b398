#include "server/training/commands/no_gate_command.h"

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>

#include "common/base/progress_line.h"
#include "common/config/sensor_noise_file.h"
#include "server/training/commands/command.h"
#include "server/training/evaluation/no_gate_report.h"
#include "server/training/learn/train_loop.h"

namespace gatefield::training {

void add_no_gate_options(CLI::App* command, NoGateArguments* arguments) {
  NoGateOptions& options = arguments->options;
  command->add_option(
      "--no-gate", arguments->frames,
      "folder of plain depth frames that show no gate (16-bit PNG or .raw): how often is one imagined?");
  add_frame_options(command, &arguments->camera);
  command->add_option("--places", options.places, "with --no-gate: waypoints told in each frame, one at a time")
      ->capture_default_str()
      ->check(CLI::Range(1, 10'000));
  command->add_option("--gates", options.gates, "with --no-gate: simulated images with a gate, for what refusing costs")
      ->capture_default_str()
      ->check(CLI::Range(0, 1'000'000));
  command->add_option("--noise", arguments->noise_file,
                      "with --no-gate: noise of these images, a file of fit-noise; not given: the first model's");
  command->add_option("--told-off", options.told_off_m, "with --no-gate: waypoints told there are off by up to this, m")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 5.0));
}

int run_no_gate(NoGateArguments arguments, const Named& bundle, int threads, std::uint64_t seed,
                const std::filesystem::path& out) {
  NoGateOptions& options = arguments.options;
  options.frames = arguments.camera.folder(arguments.frames);
  options.bundle = bundle;
  options.threads = threads;
  options.seed = seed;
  options.gate_seed = kHeldOutSeed;
  if (!arguments.noise_file.empty()) {
    const auto noise = config::load_sensor_noise(arguments.noise_file);
    if (!noise) return fail(noise.error());
    options.noise = *noise;
  }
  NoGateResult result;
  {
    ProgressLine line("evaluate");
    const auto begun = std::chrono::steady_clock::now();
    auto evaluated = evaluate_no_gate(options, [&](double part) {
      const double spent_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
      line.show(part, part > 0.0 ? spent_s / part * (1.0 - part) : 0.0, "");
      return !stop_requested;
    });
    if (stop_requested) {
      std::printf("evaluate stopped; nothing was written\n");
      return kStopped;
    }
    if (!evaluated) return fail(evaluated.error());
    result = std::move(evaluated).value();
  }
  std::printf("%s", to_markdown(result).c_str());
  if (out.empty()) return 0;
  const Status written = write_no_gate_report(result, out);
  return written ? 0 : fail(written.error());
}

}  // namespace gatefield::training
