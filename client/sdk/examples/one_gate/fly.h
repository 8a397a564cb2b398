#pragma once

#include <gatefield/sdk/client.h>

/// The loop of a client. `vehicle` is yours: its clock, camera, state estimate and motors (vehicle.h has a simulated
/// one).
/// @param period    how often the motors get something new; 1 to 20 ms
/// @param lockstep  the vehicle is simulated and waits for the server (Options::timing kLockstep)
template <typename Vehicle>
void fly(gatefield::sdk::Client& client, Vehicle& vehicle, std::chrono::nanoseconds period, bool lockstep) {
  while (vehicle.flying()) {
    const gatefield::Stamp now = vehicle.now();
    if (vehicle.has_frame()) client.send_depth(vehicle.frame_stamp(), vehicle.depth_m());
    const gatefield::QuadrotorState state = vehicle.state();  // thrust_command_n: what apply() was given last
    const std::uint64_t sequence = client.send_state(now, state);
    if (lockstep) client.wait_for_answer(sequence, std::chrono::seconds(2));
    const gatefield::sdk::Setpoint setpoint = client.play(now, state, period);
    vehicle.apply(setpoint.rotor_thrust_n);  // held until the next turn
    vehicle.sleep_until(now + period);
  }
}
