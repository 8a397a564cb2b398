// gatefield-identify: how a vehicle behind a flight controller follows what it is asked for, from a recorded flight.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <string>
#include <utility>
#include <vector>

#include "common/base/text.h"
#include "common/config/locate.h"
#include "common/config/vehicle.h"
#include "server/tools/identify.h"

namespace gatefield {
namespace {

/// Where the vehicle's file has no limit of its own: most that anybody asks a racer for.
constexpr double kAskedAtMost_rad_s = 12.0;

int fail(const std::string& what) {
  std::cerr << "gatefield-identify: " << what << '\n';
  return 2;
}

int run(const std::filesystem::path& file, const std::string& vehicle_name, double from_s, double to_s) {
  const auto vehicle_file = config::find_config("vehicles", vehicle_name);
  if (!vehicle_file) return fail(vehicle_file.error());
  const auto vehicle = config::load_vehicle(*vehicle_file);
  if (!vehicle) return fail(vehicle.error());
  const Actuation told = config::driven_by(*vehicle, Actuation::Kind::kBodyRates);
  auto read = tools::read_recording(file);
  if (!read) return fail(read.error());
  std::vector<tools::RecordedState> recording = std::move(read).value();
  std::erase_if(recording, [&](const tools::RecordedState& state) {
    return seconds(state.stamp) < from_s || seconds(state.stamp) > to_s;
  });
  if (recording.size() < 2)
    return fail(file.string() + ": nothing lies between --from " + brief(from_s) + " s and --to " + brief(to_s) +
                " s, expected some seconds of flight");
  const Eigen::Vector3d limit = vehicle->quadrotor.body_rate_max_rad_s;
  const Eigen::Vector3d at_most = (limit.array() > 0.0).select(limit, Eigen::Vector3d::Constant(kAskedAtMost_rad_s));
  const tools::Identified found = tools::identify(recording, vehicle->quadrotor, told, at_most);
  std::cout << "# " << file.string() << ": " << fixed(found.flown_s, 1) << " s of flight, told: " << vehicle_name
            << '\n'
            << tools::vehicle_lines(found, vehicle->quadrotor, told);
  return 0;
}

}  // namespace
}  // namespace gatefield

int main(int argc, char** argv) {
  CLI::App app{
      "Finds lags and limits of body rates and the factor of thrust in a recorded flight, as lines for a vehicle "
      "file.\n"
      "Example: gatefield-sim --actuation body-rates --csv flight.csv && gatefield-identify flight.csv"};
  std::string file, vehicle = "racer-rates";
  double from_s = -1e9, to_s = 1e9;
  app.add_option("file", file, "Table of the flight, as gatefield-sim --csv writes it (docs/flight-controllers.md)")
      ->required();
  app.add_option("--vehicle", vehicle, "Vehicle as it was told: a file or a short name")->capture_default_str();
  app.add_option("--from", from_s, "Read from this time on, s: what is left out is take-off and landing");
  app.add_option("--to", to_s, "Read up to this time, s");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  return gatefield::run(file, vehicle, from_s, to_s);
}
