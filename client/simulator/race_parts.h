#pragma once

#include <atomic>

#include "client/simulator/depth_sensor.h"
#include "client/simulator/estimator.h"
#include "client/simulator/flight_controller_in_loop.h"
#include "client/simulator/judged_vehicle.h"
#include "client/simulator/server_news.h"
#include "client/simulator/shutter.h"
#include "client/simulator/simulation.h"
#include "client/simulator/snapshot_keeper.h"

namespace gatefield::simulator {

/// What a race is made of, whichever clock it runs by. lockstep_race.h and real_time_race.h run it.
struct RaceParts {
  const config::Scenario& scenario;
  const Options& options;
  sdk::Client& client;
  const std::atomic<bool>& stop;
  const ProgressFunction& on_progress;  ///< may be empty
  JudgedVehicle& vehicle;
  Shutter& shutter;
  DepthSensor& sensor;
  Estimator& estimator;
  SnapshotKeeper& snapshots;
  ServerNews& news;
  FlightControllerInLoop* firmware;  ///< null: none flies the vehicle
};

/// Has the firmware armed and brought to hover, where one flies the vehicle, which is held at the start meanwhile. Ends
/// the race when the firmware does not get there, or when a person does.
/// @param pass  what lets a step of time pass after each of the firmware's
template <typename Pass>
void make_ready(const RaceParts& race, Pass&& pass) {
  FlightControllerInLoop* const firmware = race.firmware;
  while (firmware != nullptr && !firmware->ready() && firmware->well() && !race.stop) {
    firmware->stand(race.vehicle.truth());
    pass();
  }
  if (race.stop) race.vehicle.stop(Outcome::kInterrupted);
  if (firmware != nullptr && !firmware->well()) race.vehicle.stop(Outcome::kFlightControllerLost);
}

inline constexpr Stamp kProgressPeriod = std::chrono::milliseconds(100);

}  // namespace gatefield::simulator
