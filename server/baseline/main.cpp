// gatefield-baseline-server: the planning service of gatefield-server with other eyes, to see what the learned field is
// worth. For evaluation alone: it is built with the simulator and not installed.

#include <CLI/CLI.hpp>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "common/config/locate.h"
#include "common/config/scenario.h"
#include "server/app/program.h"
#include "server/baseline/sensors.h"

namespace gatefield::baseline {
namespace {

Result<app::Eyes> other_eyes(const std::string& perception, const std::string& scenario_name,
                             const std::optional<std::uint64_t>& world_seed) {
  const auto kind = parse_kind(perception);
  if (!kind) return kind.failure().within("--perception: ");
  const auto file = config::find_config("scenarios", scenario_name);
  if (!file) return file.failure().within("--scenario: ");
  auto read = config::load_scenario(*file);
  if (!read) return read.failure();
  if (world_seed) read.value().seed = *world_seed;
  const auto scenario = std::make_shared<const config::Scenario>(std::move(read).value());
  app::Eyes eyes;
  eyes.words = std::string("perception ") + name(*kind);
  eyes.warnings = {"for evaluation alone: " + eyes.words + ", " + scenario_name};
  if (*kind == Kind::kTruePose) eyes.warnings.front() += ", world seed " + std::to_string(scenario->seed);
  eyes.model_hash = 1 + static_cast<std::uint64_t>(*kind);
  eyes.cone_angle_rad = kGuideConeAngle_rad;
  eyes.blind = *kind == Kind::kNone;
  eyes.sensor = [kind = *kind,
                 scenario](const protocol::SessionRequest& request) -> Result<std::unique_ptr<perception::GateSensor>> {
    return make_sensor(kind, request, *scenario);
  };
  return eyes;
}

}  // namespace
}  // namespace gatefield::baseline

int main(int argc, char** argv) {
  using namespace gatefield;
  CLI::App app{"The planning service with other eyes than the learned field's, for evaluation alone (docs/racing.md).",
               "gatefield-baseline-server"};
  std::string perception, scenario;
  std::optional<std::uint64_t> world_seed;
  app.add_option("--perception", perception,
                 "NONE: gates are where the course says. TRUE_POSE: the true gates, once the depth camera shows them. "
                 "CLASSICAL: a detector in the depth image")
      ->required();
  app.add_option("--scenario", scenario, "What is flown: the true gates are drawn from it")
      ->required()
      ->type_name("NAME|FILE");
  app.add_option(
      "--world-seed", world_seed,
      "TRUE_POSE: the true gates are those of this seed (gatefield-sim --seed); the scenario's, if not given");
  app::Options options;
  options.threads = 1;
  options.max_vehicles = 1;
  app::add_options(&app, &options);
  return app::run_program(&app, argc, argv, [&] {
    return app::serve("gatefield-baseline-server", options,
                      [&](const kernels::Backend&) { return baseline::other_eyes(perception, scenario, world_seed); });
  });
}
