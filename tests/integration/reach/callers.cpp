// Many light participants in one process: each asks a planning server to join, and waits for its reply, whichever.
//   callers --domain 7 --count 50 --name west [--wait 30] [--stay 0] [--peer ..] [--discovery-server ..]
// Says "answered 50 of 50 after 3.2 s"; exit code 0 when all were.

#include <CLI/CLI.hpp>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "common/base/clock.h"
#include "common/dds/client_endpoint.h"
#include "common/dds/network_arguments.h"
#include "tests/support/messages.h"

namespace gatefield::test {
namespace {

using namespace std::chrono_literals;

class Caller final : private dds::ClientHandler {
 public:
  Caller(std::string name, std::atomic<int>* answered) : name_(std::move(name)), answered_(answered) {}
  bool call(std::uint32_t domain, const dds::TransportOptions& transport) {
    auto opened = dds::ClientEndpoint::create(domain, name_, this, transport);
    if (!opened) {
      std::fprintf(stderr, "%s: %s\n", name_.c_str(), opened.error().c_str());
      return false;
    }
    endpoint_ = std::move(opened).value();
    return endpoint_->publish(good_request(name_)).ok();
  }

 private:
  void on_reply(const protocol::SessionReply&, const dds::ParticipantId&) override {
    if (!heard_.exchange(true)) ++*answered_;
  }
  void on_command(const protocol::ThrustRateCommand&, const dds::ParticipantId&) override {}
  void on_telemetry(const protocol::Telemetry&) override {}
  void on_rejected(dds::Topic, const std::string&) override {}

  const std::string name_;
  std::atomic<int>* const answered_;
  std::atomic<bool> heard_{false};
  std::unique_ptr<dds::ClientEndpoint> endpoint_;
};

}  // namespace
}  // namespace gatefield::test

int main(int argc, char** argv) {
  using namespace gatefield;
  std::uint32_t domain = 0;
  int count = 1;
  std::string name = "caller";
  double wait_s = 30.0, stay_s = 0.0;
  dds::TransportOptions transport;
  CLI::App app;
  app.add_option("--domain", domain);
  app.add_option("--count", count);
  app.add_option("--name", name);
  app.add_option("--wait", wait_s);
  app.add_option("--stay", stay_s);
  dds::add_network_options(&app, &transport.network);
  CLI11_PARSE(app, argc, argv);

  std::atomic<int> answered{0};
  std::vector<std::unique_ptr<test::Caller>> callers;
  const Stamp begin = MonotonicClock().now();
  for (int i = 0; i < count; ++i) {
    callers.push_back(std::make_unique<test::Caller>(name + std::to_string(i), &answered));
    if (!callers.back()->call(domain, transport)) return 2;
  }
  while (answered < count && seconds(MonotonicClock().now() - begin) < wait_s)
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  std::printf("answered %d of %d after %.1f s\n", answered.load(), count, seconds(MonotonicClock().now() - begin));
  std::fflush(stdout);
  std::this_thread::sleep_for(std::chrono::duration<double>(stay_s));
  return answered == count ? 0 : 1;
}
