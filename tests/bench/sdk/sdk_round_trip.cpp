// A vehicle with a depth camera of 640 x 480 at 60 Hz that stands before a wall, in lockstep: from a state's leaving to
// the plan's being there, and what of it goes beyond the server's step. The frame has its state, and its answer, just
// before: looking at it is not measured. sdk_round_trip.py is the same in Python; compare.py runs both.
//   sdk_round_trip DOMAIN SECONDS      one line: processor time and wall time in seconds, then the rest of each round
//                                      trip in microseconds
// Exit codes: 0, 2 usage, 3 no server or no answer.

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <thread>
#include <vector>

#include "common/base/clock.h"
#include "common/geometry/camera.h"
#include "gatefield/sdk/client.h"

namespace {

using namespace gatefield;
using namespace std::chrono_literals;

constexpr int kWidth_px = 640, kHeight_px = 480;
constexpr std::uint16_t kWall_mm = 8000;
constexpr Stamp kPeriod{16'666'667};
constexpr int kWarm = 60;

double processor_s() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

int run(std::uint32_t domain, double length_s) {
  sdk::Options options;
  options.domain = domain;
  options.vehicle = "cpp";
  options.timing = protocol::Timing::kLockstep;
  options.camera = camera_from_fov(kWidth_px, kHeight_px, 1.5, 1.2);
  options.course.waypoints = {{{5, 0, 1.5}, {1, 0, 0}}};
  auto client = sdk::Client::connect(options);
  if (!client) {
    std::fprintf(stderr, "sdk_round_trip: %s\n", client.error().c_str());
    return 3;
  }
  const std::vector<std::uint16_t> wall(std::size_t{kWidth_px} * kHeight_px, kWall_mm);
  QuadrotorState state;
  state.p_WB = {0, 0, 1.5};
  const MonotonicClock clock;
  std::vector<double> beyond_us;
  double cpu_s = 0.0;
  Stamp begin{0}, next = clock.now();
  const auto turns = static_cast<int>(length_s / seconds(kPeriod));
  for (int turn = 0; turn < kWarm + turns; ++turn) {
    if (turn == kWarm) {
      cpu_s = processor_s();
      begin = clock.now();
    }
    const Stamp stamp = (turn + 1) * kPeriod;
    client.value()->send_depth_counts(stamp, wall);
    const auto seen = client.value()->wait_for_answer(client.value()->send_state(stamp, state), 2s);
    const Stamp left = clock.now();
    const auto plan = client.value()->wait_for_answer(client.value()->send_state(stamp + kPeriod / 2, state), 2s);
    const Stamp came = clock.now();
    if (!seen || !plan) {
      std::fprintf(stderr, "sdk_round_trip: no answer within 2 s\n");
      return 3;
    }
    if (turn >= kWarm) beyond_us.push_back(1e6 * (seconds(came - left) - plan->health.solve_time_s));
    next += kPeriod;
    std::this_thread::sleep_for(next - clock.now());
  }
  std::printf("%.6f %.6f", processor_s() - cpu_s, seconds(clock.now() - begin));
  for (const double value_us : beyond_us) std::printf(" %.1f", value_us);
  std::printf("\n");
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: sdk_round_trip DOMAIN SECONDS\n");
    return 2;
  }
  return run(static_cast<std::uint32_t>(std::atoi(argv[1])), std::atof(argv[2]));
}
