// How fast the wire is on this machine: two processes, the product's endpoints and QoS.
//   gatefield-dds-bench [seconds per measurement, 5 unless told]
// Measures, over shared memory and over UDP on the loopback: state to command and back at 500 Hz while 60 depth frames
// of 160 x 90 a second go by, and the depth frames one way (both processes read the same monotonic clock).

#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <thread>
#include <vector>

#include "common/base/clock.h"
#include "common/dds/client_endpoint.h"
#include "common/dds/server_endpoint.h"
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
    print(shared_memory ? "state to command, 500 Hz, shared memory" : "state to command, 500 Hz, UDP", round_trip_s_);
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
  if (argc > 3)  // the other process: <seconds> <domain> <1 = shared memory>
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
  return code;
}
