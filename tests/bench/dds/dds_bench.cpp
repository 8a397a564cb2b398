// How fast the wire is on this machine: two processes, the product's endpoints and QoS.
//   gatefield-dds-bench [seconds per measurement, 5 unless told] [file for results as JSON]
// Measures, over shared memory and over UDP on the loopback: state to command and back at 500 Hz while 60 depth frames
// of 160 x 90 a second go by, and the depth frames one way (both processes read the same monotonic clock). Then the
// same with the real server beside this program: state in to command out at 50 Hz, a gate in sight, the race profile (M
// = 2048), and what the server itself says that its step took.

#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "common/base/clock.h"
#include "common/dds/client_endpoint.h"
#include "common/dds/server_endpoint.h"
#include "common/geometry/gate.h"
#include "common/vehicle/quadrotor.h"
#include "tests/support/dds_domain.h"
#include "tests/support/messages.h"

namespace gatefield {
namespace {

using namespace std::chrono_literals;

Stamp now() { return MonotonicClock().now(); }

void print(const char* what, std::vector<double> values_s) {
  if (values_s.empty()) {
    std::printf("%-44s nothing arrived\n", what);
    return;
  }
  std::sort(values_s.begin(), values_s.end());
  const auto at = [&](double q) { return 1e6 * values_s[static_cast<std::size_t>(q * double(values_s.size() - 1))]; };
  std::printf("%-44s n %6zu   p50 %7.0f us   p99 %7.0f us   p99.9 %7.0f us   max %7.0f us\n", what, values_s.size(),
              at(0.5), at(0.99), at(0.999), at(1.0));
  std::fflush(stdout);
}

std::string results;  // entries of "benchmarks", as gatefield-bench report reads them

void keep(const std::string& name, std::vector<double> values_s, std::vector<double> steps_s) {
  if (values_s.empty()) return;
  std::sort(values_s.begin(), values_s.end());
  std::sort(steps_s.begin(), steps_s.end());
  const auto at = [](const std::vector<double>& sorted, double q) {
    return sorted.empty() ? 0.0 : 1e6 * sorted[static_cast<std::size_t>(q * double(sorted.size() - 1))];
  };
  char entry[400];
  std::snprintf(
      entry, sizeof entry,
      "%s{\"name\": \"dds/%s\", \"p50_us\": %.1f, \"p99_us\": %.1f, \"p999_us\": %.1f, \"step_p50_us\": %.1f}",
      results.empty() ? "" : ",\n", name.c_str(), at(values_s, 0.5), at(values_s, 0.99), at(values_s, 0.999),
      at(steps_s, 0.5));
  results += entry;
}

// Answers every state with a plan of 20 steps, from a thread of its own as the planner does.
class Responder : public dds::ServerHandler {
 public:
  int run(std::uint32_t domain, bool shared_memory, double length_s) {
    auto opened = dds::ServerEndpoint::create(domain, "bench", this, {.shared_memory = shared_memory});
    if (!opened.ok()) {
      std::fprintf(stderr, "%s\n", opened.error().c_str());
      return 1;
    }
    const auto endpoint = std::move(opened).value();
    auto command = test::good_command("bench");
    const Stamp end = now() + from_seconds(length_s);
    while (now() < end) {
      std::unique_lock lock(mutex_);
      changed_.wait_for(lock, 100ms, [&] { return request_ != 0 || state_ != 0; });
      const std::uint64_t request = std::exchange(request_, 0);
      const std::uint64_t state = std::exchange(state_, 0);
      lock.unlock();
      if (request != 0 && !endpoint->publish(test::good_reply("bench", request)).ok()) return 1;
      if (state != 0) {
        command.sequence = command.answers_sequence = state;
        endpoint->publish(command);
      }
    }
    print(shared_memory ? "depth 160 x 90, one way, shared memory" : "depth 160 x 90, one way, UDP", depth_s_);
    return 0;
  }

 private:
  void on_session_request(const protocol::SessionRequest& request, const Status&) override {
    const std::lock_guard lock(mutex_);
    request_ = request.request;
    changed_.notify_one();
  }
  void on_state(const protocol::VehicleState& state) override {
    const std::lock_guard lock(mutex_);
    state_ = state.sequence;
    changed_.notify_one();
  }
  void on_depth(protocol::DepthFrame& frame) override {
    if (frame.sequence > 10) depth_s_.push_back(seconds(now() - frame.stamp));
  }
  void on_vehicle_gone(const std::string&, std::uint64_t) override {}
  void on_rejected(dds::Topic topic, const std::string&, const std::string& reason) override {
    std::fprintf(stderr, "%s: %s\n", dds::topic_name(topic), reason.c_str());
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::uint64_t request_ = 0, state_ = 0;
  std::vector<double> depth_s_;
};

/// Answers of a real server in lockstep: each state is answered once, so that no wait for a control tick is in it.
class Flyer : public dds::ClientHandler {
 public:
  int run(std::uint32_t domain, bool shared_memory, double length_s) {
    auto opened = dds::ClientEndpoint::create(domain, "bench", this, {.shared_memory = shared_memory});
    if (!opened.ok()) {
      std::fprintf(stderr, "%s\n", opened.error().c_str());
      return 1;
    }
    const auto endpoint = std::move(opened).value();
    auto request = test::good_request("bench");
    request.course.waypoints = {{{3, 0, 1.5}, {1, 0, 0}}, {{8, 0, 1.5}, {1, 0, 0}}};
    if (!endpoint->publish(request).ok()) return 1;
    for (int i = 0; i < 400 && session_ == 0; ++i) std::this_thread::sleep_for(50ms);
    if (session_ == 0) {
      std::fprintf(stderr, "no answer from gatefield-server\n");
      return 1;
    }
    auto state = test::good_state("bench");
    state.session = session_;
    state.state = QuadrotorState{};
    state.state.p_WB = {0, 0, 1.5};
    state.state.v_WB = {1, 0, 0};
    state.state.thrust_n = state.state.thrust_command_n = hover_thrust_n(request.quadrotor);
    state.thrust_known = true;
    state.round_trip = Stamp(0);
    state.heard_waypoint = state.heard_lap = 0;
    state.depth_sequence = 1;
    auto frame = test::good_frame("bench", 1);
    frame.session = session_;
    draw(request.camera, &frame);
    const auto states = static_cast<std::uint64_t>(50 * length_s);
    sent_ = std::vector<std::atomic<std::int64_t>>(states + 1);
    Stamp next = now();
    for (std::uint64_t i = 1; i <= states; ++i) {
      state.sequence = i;
      state.stamp = Stamp(1'000'000'000 + static_cast<std::int64_t>(i) * 20'000'000);
      if (i == 1) {
        frame.stamp = state.stamp;
        endpoint->publish(frame);
      }
      sent_[i] = now().count();
      endpoint->publish(state);
      next += 20ms;
      std::this_thread::sleep_for(next - now());
    }
    std::this_thread::sleep_for(200ms);
    const std::lock_guard lock(mutex_);
    const char* const how = shared_memory ? "shared memory" : "UDP";
    const std::string name = std::string("state to command, real server, M = 2048, ") + how;
    print(name.c_str(), round_trip_s_);
    print("  of it the step", step_s_);
    keep(name, round_trip_s_, step_s_);
    return 0;
  }

 private:
  /// A frame 3 m before the vehicle, before a wall at 8 m.
  static void draw(const CameraModel& camera, protocol::DepthFrame* frame) {
    frame->width_px = static_cast<std::uint32_t>(camera.width_px);
    frame->height_px = static_cast<std::uint32_t>(camera.height_px);
    frame->encoding = protocol::DepthEncoding::kMillimetres16;
    frame->pixels.clear();
    const GateShape shape;
    for (int v = 0; v < camera.height_px; ++v) {
      for (int u = 0; u < camera.width_px; ++u) {
        const Eigen::Vector3d origin_B = camera.X_BC.translation(), ray_B = camera.X_BC.linear() * camera.ray_C(u, v);
        const double t = (3.0 - origin_B.x()) / ray_B.x(), wall = (8.0 - origin_B.x()) / ray_B.x();
        const double r = transverse_distance(shape, origin_B + t * ray_B);
        const auto mm = static_cast<std::uint16_t>(
            1e3 * (r >= shape.inner_half_m && r <= shape.outer_half_m ? t : std::min(wall, 9.9)));
        frame->pixels.push_back(static_cast<std::uint8_t>(mm & 0xff));
        frame->pixels.push_back(static_cast<std::uint8_t>(mm >> 8));
      }
    }
  }
  void on_reply(const protocol::SessionReply& reply) override {
    if (!reply.accepted) std::fprintf(stderr, "refused: %s\n", reply.reason.c_str());
    if (reply.accepted) session_ = reply.session;
  }
  void on_command(const protocol::ThrustRateCommand& command) override {
    const Stamp heard = now();
    const std::lock_guard lock(mutex_);
    if (command.answers_sequence >= sent_.size() || command.answers_sequence <= 25) return;  // warm by then
    round_trip_s_.push_back(seconds(heard - Stamp(sent_[command.answers_sequence])));
    step_s_.push_back(command.health.solve_time_s);
  }
  void on_telemetry(const protocol::Telemetry&) override {}
  void on_rejected(dds::Topic topic, const std::string& reason) override {
    std::fprintf(stderr, "%s: %s\n", dds::topic_name(topic), reason.c_str());
  }

  std::atomic<std::uint64_t> session_{0};
  std::vector<std::atomic<std::int64_t>> sent_;
  std::mutex mutex_;
  std::vector<double> round_trip_s_, step_s_;
};

class Asker : public dds::ClientHandler {
 public:
  int run(std::uint32_t domain, bool shared_memory, double length_s) {
    auto opened = dds::ClientEndpoint::create(domain, "bench", this, {.shared_memory = shared_memory});
    if (!opened.ok()) {
      std::fprintf(stderr, "%s\n", opened.error().c_str());
      return 1;
    }
    const auto endpoint = std::move(opened).value();
    if (!endpoint->publish(test::good_request("bench")).ok()) return 1;
    for (int i = 0; i < 100 && !accepted_; ++i) std::this_thread::sleep_for(50ms);
    if (!accepted_) {
      std::fprintf(stderr, "no answer from the other process\n");
      return 1;
    }
    const auto states = static_cast<std::uint64_t>(500 * length_s);
    sent_ = std::vector<std::atomic<std::int64_t>>(states + 1);
    round_trip_s_.reserve(states);
    auto state = test::good_state("bench");
    auto frame = test::good_frame("bench");
    frame.sequence = 0;
    Stamp next = now();
    for (std::uint64_t i = 1; i <= states; ++i) {
      if (i % 25 == 0 || i % 25 == 8 || i % 25 == 16) {  // 3 frames in 25 states of 2 ms: 60 a second
        ++frame.sequence;
        frame.stamp = now();
        endpoint->publish(frame);
      }
      state.sequence = i;
      sent_[i] = now().count();
      endpoint->publish(state);
      next += 2ms;
      std::this_thread::sleep_for(next - now());
    }
    std::this_thread::sleep_for(100ms);
    const std::lock_guard lock(mutex_);
    const char* const name =
        shared_memory ? "state to command, 500 Hz, shared memory" : "state to command, 500 Hz, UDP";
    print(name, round_trip_s_);
    keep(std::string(name) + " (wire alone)", round_trip_s_, {});
    return 0;
  }

 private:
  void on_reply(const protocol::SessionReply&) override { accepted_ = true; }
  void on_command(const protocol::ThrustRateCommand& command) override {
    const Stamp heard = now();
    const std::lock_guard lock(mutex_);
    if (command.answers_sequence < sent_.size() && command.answers_sequence > 250)  // the first half second warms up
      round_trip_s_.push_back(seconds(heard - Stamp(sent_[command.answers_sequence])));
  }
  void on_telemetry(const protocol::Telemetry&) override {}
  void on_rejected(dds::Topic topic, const std::string& reason) override {
    std::fprintf(stderr, "%s: %s\n", dds::topic_name(topic), reason.c_str());
  }

  std::atomic<bool> accepted_{false};
  std::vector<std::atomic<std::int64_t>> sent_;
  std::mutex mutex_;
  std::vector<double> round_trip_s_;
};

}  // namespace
}  // namespace gatefield

int main(int argc, char** argv) {
  using namespace gatefield;
  const double length_s = argc > 1 ? std::atof(argv[1]) : 5.0;
  if (!(length_s >= 1 && length_s <= 600)) {
    std::fprintf(stderr, "seconds per measurement is %s, expected 1 to 600\n", argv[1]);
    return 2;
  }
  if (argc == 4)  // the other process: <seconds> <domain> <1 = shared memory>
    return Responder().run(static_cast<std::uint32_t>(std::atoi(argv[2])), std::atoi(argv[3]) == 1, length_s);
  int code = 0;
  for (const bool shared_memory : {true, false}) {
    const std::uint32_t domain = test::own_domain();
    const pid_t other = fork();
    if (other == 0) {
      const std::string length = std::to_string(length_s + 3.5), number = std::to_string(domain);
      execl("/proc/self/exe", argv[0], length.c_str(), number.c_str(), shared_memory ? "1" : "0",
            static_cast<char*>(nullptr));
      _exit(127);
    }
    code |= Asker().run(domain, shared_memory, length_s);
    if (code != 0) kill(other, SIGTERM);
    int status = 0;
    waitpid(other, &status, 0);
    code |= WIFEXITED(status) ? WEXITSTATUS(status) : 1;
  }
  for (const bool shared_memory : {true, false}) {
    const std::uint32_t domain = test::own_domain();
    std::error_code failed;
    const auto server = std::filesystem::read_symlink("/proc/self/exe", failed).parent_path() / "gatefield-server";
    if (!std::filesystem::exists(server)) {
      std::fprintf(stderr, "%s is not built: state to command with the real server is not measured\n", server.c_str());
      break;
    }
    const pid_t other = fork();
    if (other == 0) {
      const std::string number = std::to_string(domain);
      execl(server.c_str(), server.c_str(), "--domain", number.c_str(), "--name", "bench", "--log-level", "error",
            shared_memory ? nullptr : "--no-shared-memory", static_cast<char*>(nullptr));
      _exit(127);
    }
    code |= Flyer().run(domain, shared_memory, length_s);
    kill(other, SIGTERM);
    waitpid(other, nullptr, 0);
  }
  if (argc == 3) {
    std::FILE* const file = std::fopen(argv[2], "w");
    if (file == nullptr || std::fprintf(file, "{\"benchmarks\": [\n%s\n]}\n", results.c_str()) < 0 ||
        std::fclose(file) != 0) {
      std::fprintf(stderr, "%s can't be written\n", argv[2]);
      return 1;
    }
  }
  return code;
}
