#pragma once

#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "common/dds/client_endpoint.h"
#include "tests/bench/dds/wire.h"

namespace gatefield::bench {

/// A vehicle that stands 3 m before a gate, whatever it is told, and notes when its states were answered.
class Vehicle final : private dds::ClientHandler {
 public:
  struct Answer {
    double round_trip_s;  ///< from the state's leaving to the command's coming
    double step_s;        ///< what the server says that it took to plan
  };

  explicit Vehicle(std::string name);
  ~Vehicle() override;

  /// Asks to join. @return false when the wire can't be opened
  bool ask(const Wire& wire, protocol::Timing timing, const std::string& profile);
  /// Waits for the answer. @return false when there was none, or not the expected server's; stderr says so
  bool joined(std::chrono::nanoseconds timeout);

  /// Sends the next state. @return its number, from 1
  std::uint64_t send_state(Stamp stamp);
  void send_frame(Stamp stamp);

  /// Of the states from `first` on, in the order in which they were heard.
  std::vector<Answer> answers(std::uint64_t first) const;
  /// What the server last said of this vehicle.
  std::optional<protocol::Telemetry> told() const;

 private:
  void on_reply(const protocol::SessionReply& reply, const dds::ParticipantId& from) override;
  void on_command(const protocol::ThrustRateCommand& command, const dds::ParticipantId& from) override;
  void on_telemetry(const protocol::Telemetry& telemetry) override;
  void on_rejected(dds::Topic topic, const std::string& reason) override;

  struct Heard {
    std::uint64_t state;
    Answer answer;
  };
  /// States that may be under way; older ones are forgotten.
  static constexpr std::size_t kUnderWay = 1024;

  const std::string name_;
  protocol::VehicleState state_;
  protocol::DepthFrame frame_;
  mutable std::mutex mutex_;
  std::condition_variable replied_;
  std::optional<protocol::SessionReply> reply_;
  std::vector<Heard> heard_;
  std::optional<protocol::Telemetry> told_;
  std::vector<std::atomic<std::int64_t>> sent_;    // by number, modulo its size
  std::unique_ptr<dds::ClientEndpoint> endpoint_;  // last: it calls until it is gone
};

}  // namespace gatefield::bench
