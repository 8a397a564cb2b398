// Sends one state, plays the plan that comes back, and looks at what it got. gatefield-layout <DDS domain>
#include <gatefield/sdk/client.h>

#include <cstdio>
#include <cstdlib>

#include "messages.h"

int main(int argc, char** argv) {
  using namespace gatefield;
  using namespace std::chrono_literals;
  if (argc != 2) return 64;
  sdk::Options options;
  options.domain = static_cast<std::uint32_t>(std::atoi(argv[1]));
  options.vehicle = "layout";
  options.timing = protocol::Timing::kLockstep;
  options.camera.X_BC = forward_camera_mount(0.25, {0.125, 0, -0.0625});
  options.course.waypoints = {{{5, 0, 1.5}, {1, 0, 0}}};
  auto connected = sdk::Client::connect(options);
  if (!connected) {
    std::fprintf(stderr, "%s\n", connected.error().c_str());
    return 1;
  }
  sdk::Client& client = **connected;
  const auto state = sent_state<QuadrotorState>();
  const auto command = client.wait_for_answer(client.send_state(1s, state), 5s);
  if (!command) {
    std::fprintf(stderr, "no answer\n");
    return 2;
  }
  for (int k = 0; k < command->steps; ++k)
    if (command->rotor_thrust_n[static_cast<std::size_t>(k)] != answered_thrust_n(k)) {
      std::fprintf(stderr, "interval %d came with other thrusts\n", k);
      return 3;
    }
  const sdk::Setpoint setpoint = client.play(command->plan_start, state, command->plan_step);
  if (setpoint.source != sdk::Setpoint::Source::kPlan || setpoint.rotor_thrust_n != answered_thrust_n(0)) {
    std::fprintf(stderr, "the setpoint is another one\n");
    return 4;
  }
}
