#pragma once

#include <algorithm>
#include <functional>
#include <mutex>
#include <string>
#include <vector>

#include "server/service/service.h"
#include "server/service/transport.h"
#include "tests/unit/server/pilot/fakes.h"

/// A transport that keeps what is sent, and factories of stand-ins.
namespace gatefield::service::testing {

using namespace std::chrono_literals;
using namespace pilot::testing;

/// Keeps what was sent. Thread-safe.
class FakeTransport final : public Transport {
 public:
  void send(const protocol::SessionReply& reply) override {
    {
      const std::lock_guard lock(mutex_);
      replies_.push_back(reply);
    }
    if (answered) answered(reply);
  }
  std::function<void(const protocol::SessionReply&)> answered;  ///< called after each reply; set before any is sent
  bool send(const protocol::ThrustRateCommand& command) noexcept override {
    const std::lock_guard lock(mutex_);
    commands_.push_back(command);
    return true;
  }
  bool send(const protocol::Telemetry& telemetry) noexcept override {
    const std::lock_guard lock(mutex_);
    telemetries_.push_back(telemetry);
    return true;
  }
  void tell_servers(const protocol::ServerStatus& status) override {
    const std::lock_guard lock(mutex_);
    statuses_.push_back(status);
  }
  void forget(const std::string& vehicle) override {
    const std::lock_guard lock(mutex_);
    forgotten_.push_back(vehicle);
  }

  bool tell(const protocol::PilotRecord& record) override {
    {
      const std::lock_guard lock(mutex_);
      records_.push_back(record);
    }
    if (told) told(record);
    return true;
  }
  std::function<void(const protocol::PilotRecord&)> told;  ///< the other server; set before any is told
  Status follow(const std::string& vehicle, std::uint64_t, std::uint32_t) override {
    const std::lock_guard lock(mutex_);
    followed_.push_back(vehicle);
    return {};
  }

  std::vector<protocol::SessionReply> replies() const { return copy(replies_); }
  std::vector<protocol::PilotRecord> records() const { return copy(records_); }
  std::vector<std::string> followed() const { return copy(followed_); }
  std::vector<protocol::ThrustRateCommand> commands() const { return copy(commands_); }
  std::vector<protocol::Telemetry> telemetries() const { return copy(telemetries_); }
  std::vector<protocol::ServerStatus> statuses() const { return copy(statuses_); }
  std::vector<std::string> forgotten() const { return copy(forgotten_); }
  std::size_t commands_of(std::uint64_t session) const {
    const std::lock_guard lock(mutex_);
    return static_cast<std::size_t>(
        std::count_if(commands_.begin(), commands_.end(), [&](const auto& c) { return c.session == session; }));
  }
  std::size_t command_count() const {
    const std::lock_guard lock(mutex_);
    return commands_.size();
  }

 private:
  template <typename T>
  T copy(const T& value) const {
    const std::lock_guard lock(mutex_);
    return value;
  }
  mutable std::mutex mutex_;
  std::vector<protocol::SessionReply> replies_;
  std::vector<protocol::ThrustRateCommand> commands_;
  std::vector<protocol::Telemetry> telemetries_;
  std::vector<protocol::ServerStatus> statuses_;
  std::vector<std::string> forgotten_;
  std::vector<std::string> followed_;
  std::vector<protocol::PilotRecord> records_;
};

/// Fake planners and sensors for every session.
inline Factories fake_factories() {
  Factories factories;
  factories.planner = [](const planner::Profile& profile,
                         const protocol::SessionRequest& request) -> Result<std::unique_ptr<planner::Planner>> {
    return std::unique_ptr<planner::Planner>(
        std::make_unique<FakePlanner>(profile, request.quadrotor, std::make_shared<FakePlanner::Script>()));
  };
  factories.sensor = [](const protocol::SessionRequest&) -> Result<std::unique_ptr<perception::GateSensor>> {
    return std::unique_ptr<perception::GateSensor>(std::make_unique<FakeSensor>());
  };
  return factories;
}

}  // namespace gatefield::service::testing
