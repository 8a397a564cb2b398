// The smallest client: joins a server, sends one depth frame and a hover state, prints the plan that comes back, plays
// it.
//   gatefield-minimal [DDS domain, 0 unless told]
#include <gatefield/sdk/client.h>

#include <cstdio>
#include <cstdlib>
#include <thread>
#include <vector>

int main(int argc, char** argv) {
  using namespace gatefield;
  sdk::Options options;
  options.domain = argc > 1 ? static_cast<std::uint32_t>(std::atoi(argv[1])) : 0;
  options.vehicle = "minimal";
  options.course.waypoints = {{{5, 0, 1.5}, {1, 0, 0}}};  // one gate, 5 m ahead

  auto connected = sdk::Client::connect(options);
  if (!connected.ok()) {
    std::fprintf(stderr, "%s\n", connected.error().c_str());
    return 1;
  }
  sdk::Client& client = **connected;
  std::printf("joined %s, a plan every %.0f ms\n", client.session().server.c_str(),
              1e3 * client.session().control_period_s);

  QuadrotorState state;  // hovering at 1.5 m, looking along x
  state.p_WB.z() = 1.5;
  state.thrust_n = state.thrust_command_n = hover_thrust_n(options.quadrotor);
  const MonotonicClock clock;
  const std::vector<float> nothing_seen(static_cast<std::size_t>(options.camera.width_px * options.camera.height_px));
  client.send_depth(clock.now(), nothing_seen);
  const auto command = client.wait_for_answer(client.send_state(clock.now(), state), std::chrono::seconds(2));
  if (!command) {
    std::fprintf(stderr, "no plan within 2 s\n");
    return 1;
  }
  std::printf("a plan of %d steps of %.0f ms\n", command->steps, 1e3 * seconds(command->plan_step));

  for (int tick = 0; tick < 10; ++tick) {  // what to give the motors, 100 times a second
    const sdk::Setpoint now = client.play(clock.now(), state, std::chrono::milliseconds(10));
    std::printf("%s %.2f N\n", now.source == sdk::Setpoint::Source::kPlan ? "plan" : "fallback",
                now.collective_thrust_n);
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
}
