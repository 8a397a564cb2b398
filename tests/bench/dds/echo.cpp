#include "tests/bench/dds/echo.h"

#include <condition_variable>
#include <mutex>
#include <utility>
#include <vector>

#include "common/dds/server_endpoint.h"
#include "tests/support/messages.h"

namespace gatefield::bench {
namespace {

using namespace std::chrono_literals;

constexpr Stamp kLongestWait = 30s;  // for a client
constexpr Stamp kSilence = 1s;       // of a client that has gone
constexpr std::uint64_t kWarmFrames = 10;

class Echo final : private dds::ServerHandler {
 public:
  int run(const Wire& wire) {
    const auto endpoint = open<dds::ServerEndpoint>(wire, kServer, static_cast<dds::ServerHandler*>(this));
    if (!endpoint) return 1;
    auto command = test::good_command();
    std::unique_lock lock(mutex_);
    for (Stamp end = now() + kLongestWait; now() < end;) {
      if (!changed_.wait_for(lock, 100ms, [&] { return request_ != 0 || state_ != 0; })) continue;
      const std::uint64_t request = std::exchange(request_, 0);
      const std::uint64_t state = std::exchange(state_, 0);
      const std::string vehicle = vehicle_;
      lock.unlock();
      auto reply = test::good_reply(vehicle, request);
      reply.server = kServer;
      if (request != 0 && !endpoint->publish(reply).ok()) return 1;
      if (state != 0) {
        command.vehicle = vehicle;
        command.sequence = command.answers_sequence = state;
        endpoint->publish(command);
        end = now() + kSilence;
      }
      lock.lock();
    }
    for (const double under_way_s : under_way_s_) std::printf("%.9f\n", under_way_s);
    return 0;
  }

 private:
  void on_session_request(const protocol::SessionRequest& request, const Status&) override {
    const std::lock_guard lock(mutex_);
    vehicle_ = request.vehicle;
    request_ = request.request;
    changed_.notify_one();
  }
  void on_state(const protocol::VehicleState& state) override {
    const std::lock_guard lock(mutex_);
    state_ = state.sequence;
    changed_.notify_one();
  }
  void on_depth(protocol::DepthFrame& frame) override {
    const double under_way_s = seconds(now() - frame.stamp);
    const std::lock_guard lock(mutex_);
    if (frame.sequence > kWarmFrames) under_way_s_.push_back(under_way_s);
  }
  void on_vehicle_gone(const std::string&, std::uint64_t) override {}
  void on_rejected(dds::Topic topic, const std::string&, const Error& why) override {
    std::fprintf(stderr, "gatefield-dds-bench: %s: %s\n", dds::topic_name(topic), why.message.c_str());
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::string vehicle_;
  std::uint64_t request_ = 0, state_ = 0;
  std::vector<double> under_way_s_;
};

}  // namespace

int echo(const Wire& wire) { return Echo().run(wire); }

}  // namespace gatefield::bench
