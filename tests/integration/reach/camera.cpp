// A client with a large depth camera that stands still: depth and states in real time, until it is killed or told to
// leave. What it shows is an empty room.
//   camera --domain 7 --name camera1 [--width 640 --height 480] [--rate 60] [--seconds 5] [--bad] [--wait 20] [--peer ..]
// Says "joined", and "heard 123 commands" when it leaves by itself. --bad: every tenth state is one that no vehicle is
// in. Exit codes: 0, 3 no server.

#include <CLI/CLI.hpp>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>
#include <thread>
#include <vector>

#include "common/base/clock.h"
#include "common/dds/network_arguments.h"
#include "gatefield/sdk/client.h"
#include "tests/support/messages.h"

namespace {

using namespace gatefield;

struct Arguments {
  sdk::Options session;
  int width_px = 640, height_px = 480;
  double depth_rate_hz = 60.0, state_rate_hz = 100.0;
  double length_s = 1e6;
  double wait_s = 20.0;  // for a server
  bool bad = false;
};

void declare(CLI::App* app, Arguments* a) {
  app->add_option("--domain", a->session.domain);
  app->add_option("--name", a->session.vehicle);
  app->add_option("--width", a->width_px);
  app->add_option("--height", a->height_px);
  app->add_option("--rate", a->depth_rate_hz);
  app->add_option("--state-rate", a->state_rate_hz);
  app->add_option("--seconds", a->length_s);
  app->add_flag("--bad", a->bad);
  app->add_option("--wait", a->wait_s);
  dds::add_network_options(app, &a->session.network);
}

QuadrotorState worse(QuadrotorState state, std::uint64_t i) {
  if (i % 20 == 0) state.p_WB.x() = std::numeric_limits<double>::quiet_NaN();
  if (i % 20 == 10) state.p_WB.x() += 50.0;
  return state;
}

int run(Arguments a) {
  CameraModel& camera = a.session.camera;
  const double factor = static_cast<double>(a.width_px) / camera.width_px;
  camera.fx_px *= factor;
  camera.fy_px *= factor;
  camera.cx_px = 0.5 * a.width_px;
  camera.cy_px = 0.5 * a.height_px;
  camera.width_px = a.width_px;
  camera.height_px = a.height_px;
  a.session.course = test::good_request().course;
  a.session.connect_timeout = std::chrono::milliseconds(std::lround(1000 * a.wait_s));
  auto client = sdk::Client::connect(a.session);
  if (!client) {
    std::fprintf(stderr, "camera: %s\n", client.error().c_str());
    return 3;
  }
  std::printf("joined\n");
  std::fflush(stdout);
  const MonotonicClock clock;
  const std::vector<float> room(static_cast<std::size_t>(a.width_px) * static_cast<std::size_t>(a.height_px), 8.0F);
  QuadrotorState state;
  state.p_WB = {0, -2, 1.5};
  const Stamp begin = clock.now();
  Stamp next_frame = begin, next_state = begin;
  for (std::uint64_t i = 1; seconds(clock.now() - begin) < a.length_s;) {
    const Stamp now = clock.now();
    if (a.depth_rate_hz > 0 && now >= next_frame) {
      client.value()->send_depth(now, room);
      next_frame += from_seconds(1.0 / a.depth_rate_hz);
    }
    if (now >= next_state) {
      client.value()->send_state(now, a.bad && i % 10 == 0 ? worse(state, i) : state);
      next_state += from_seconds(1.0 / a.state_rate_hz);
      ++i;
    }
    std::this_thread::sleep_for(std::min(next_frame, next_state) - clock.now());
  }
  std::printf("heard %llu commands\n", static_cast<unsigned long long>(client.value()->statistics().commands));
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  CLI::App app;
  declare(&app, &arguments);
  CLI11_PARSE(app, argc, argv);
  return run(arguments);
}
