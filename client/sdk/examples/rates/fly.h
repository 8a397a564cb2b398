#pragma once

#include <gatefield/sdk/client.h>

/// The loop of a client whose vehicle has a flight controller. `vehicle` is yours: its clock, camera, state estimate
/// and the way to the flight controller.
/// @param period    how often the flight controller gets something new; 2 to 20 ms
/// @param lockstep  the vehicle is simulated and waits for the server (Options::timing kLockstep)
template <typename Vehicle>
void fly_by_rates(gatefield::sdk::Client& client, Vehicle& vehicle, std::chrono::nanoseconds period, bool lockstep) {
  while (vehicle.flying()) {
    const gatefield::Stamp now = vehicle.now();
    if (vehicle.has_frame()) client.send_depth(vehicle.frame_stamp(), vehicle.depth_m());
    const gatefield::QuadrotorState state = vehicle.state();  // of its rotors nothing needs to be known
    const std::uint64_t sequence = client.send_state(now, state, /*thrust_known=*/false);
    if (lockstep) client.wait_for_answer(sequence, std::chrono::seconds(2));
    const gatefield::sdk::Setpoint setpoint = client.play(now, state, period);
    vehicle.command(setpoint.collective_thrust_n, setpoint.body_rates_rad_s);  // held until the next turn
    vehicle.sleep_until(now + period);
  }
}
