#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <queue>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "common/dds/server_endpoint.h"
#include "tests/support/dds_domain.h"
#include "tests/support/messages.h"

namespace gatefield::test {

/// A server that does what the test says, on a thread of its own, over real DDS.
class ScriptedServer : private dds::ServerHandler {
 public:
  using OnRequest = std::function<std::optional<protocol::SessionReply>(const protocol::SessionRequest&)>;
  using OnState = std::function<std::optional<protocol::ThrustRateCommand>(const protocol::VehicleState&)>;

  ScriptedServer(const std::string& name, OnRequest on_request, OnState on_state)
      : on_request_(std::move(on_request)), on_state_(std::move(on_state)) {
    auto endpoint = dds::ServerEndpoint::create(own_domain(), name, this);
    EXPECT_TRUE(endpoint.ok()) << (endpoint.ok() ? "" : endpoint.error());
    endpoint_ = std::move(endpoint).value();
    worker_ = std::thread([this] { work(); });
  }

  ~ScriptedServer() override {
    put([this] { stop_ = true; });
    worker_.join();
    endpoint_.reset();
  }

  void send(const protocol::SessionReply& reply) {
    put([this, reply] { EXPECT_TRUE(endpoint_->publish(reply).ok()); });
  }
  void send(const protocol::ThrustRateCommand& command) {
    put([this, command] { endpoint_->publish(command); });
  }
  void send(const protocol::Telemetry& telemetry) {
    put([this, telemetry] { endpoint_->publish(telemetry); });
  }

  template <typename Condition>
  bool wait(Condition&& condition, std::chrono::milliseconds limit = std::chrono::milliseconds(5000)) {
    std::unique_lock lock(seen_mutex_);
    return seen_changed_.wait_for(lock, limit, condition);
  }
  // Under wait() only.
  std::vector<protocol::SessionRequest> requests;
  std::vector<protocol::VehicleState> states;
  std::vector<protocol::DepthFrame> frames;
  std::vector<std::string> gone;

 private:
  void put(std::function<void()> job) {
    {
      const std::lock_guard lock(jobs_mutex_);
      jobs_.push(std::move(job));
    }
    jobs_changed_.notify_all();
  }
  template <typename Change>
  void see(Change&& change) {
    {
      const std::lock_guard lock(seen_mutex_);
      change();
    }
    seen_changed_.notify_all();
  }
  void work() {
    while (!stop_) {
      std::function<void()> job;
      {
        std::unique_lock lock(jobs_mutex_);
        jobs_changed_.wait(lock, [&] { return !jobs_.empty(); });
        job = std::move(jobs_.front());
        jobs_.pop();
      }
      job();
    }
  }

  void on_session_request(const protocol::SessionRequest& request, const Status& verdict) override {
    EXPECT_TRUE(verdict.ok()) << verdict.error();
    see([&] { requests.push_back(request); });
    put([this, request] {
      if (request.action == protocol::SessionRequest::Action::kLeave) return endpoint_->drop_vehicle(request.vehicle);
      const auto reply = on_request_(request);
      if (reply) {
        EXPECT_TRUE(endpoint_->publish(*reply).ok());
      }
    });
  }
  void on_state(const protocol::VehicleState& state) override {
    see([&] { states.push_back(state); });
    put([this, state] {
      if (const auto command = on_state_(state)) endpoint_->publish(*command);
    });
  }
  void on_depth(protocol::DepthFrame& frame) override {
    see([&] { frames.push_back(frame); });
  }
  void on_vehicle_gone(const std::string& vehicle, std::uint64_t) override {
    see([&] { gone.push_back(vehicle); });
  }
  void on_rejected(dds::Topic topic, const std::string& vehicle, const Error& why) override {
    ADD_FAILURE() << dds::topic_name(topic) << " " << vehicle << ": " << why.message;
  }

  OnRequest on_request_;
  OnState on_state_;
  std::unique_ptr<dds::ServerEndpoint> endpoint_;
  bool stop_ = false;
  std::mutex jobs_mutex_;
  std::condition_variable jobs_changed_;
  std::queue<std::function<void()>> jobs_;
  std::mutex seen_mutex_;
  std::condition_variable seen_changed_;
  std::thread worker_;
};

inline ScriptedServer::OnRequest accept_as(std::uint64_t session, const std::string& server = "planner-1") {
  return [=](const protocol::SessionRequest& request) {
    auto reply = good_reply(request.vehicle, request.request);
    reply.session = session;
    reply.server = server;
    return std::optional(reply);
  };
}

}  // namespace gatefield::test
