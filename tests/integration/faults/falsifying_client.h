#pragma once

#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "gatefield/sdk/client.h"

namespace gatefield::test {

/// What a program gets wrong between its vehicle and the client. What is empty is left as it is.
struct Falsification {
  /// The state, in whatever is given to the client.
  std::function<QuadrotorState(const QuadrotorState&)> state;
  /// The clock, in all stamps.
  std::function<Stamp(Stamp)> clock;
  /// The image, sent in metres.
  std::function<void(std::vector<float>*)> metres;
  /// The image, sent in counts.
  std::function<void(std::vector<std::uint16_t>*)> counts;
  /// Called before each state is sent, with the client that really sends, and with the stamp and state that will be.
  std::function<void(sdk::Client*, Stamp, const QuadrotorState&)> before_state;
};

/// A client that passes on what it is given, falsified. Thread-safe and real-time safe as what it passes on to, as far
/// as the falsification is.
class FalsifyingClient final : public sdk::Client {
 public:
  FalsifyingClient(std::unique_ptr<sdk::Client> client, Falsification falsification)
      : client_(std::move(client)), falsification_(std::move(falsification)) {}

  protocol::SessionReply session() const override { return client_->session(); }

  std::uint64_t send_depth(Stamp stamp, std::span<const float> depth_m) override {
    std::vector<float> image(depth_m.begin(), depth_m.end());
    if (falsification_.metres) falsification_.metres(&image);
    return client_->send_depth(clock(stamp), image);
  }
  std::uint64_t send_depth_counts(Stamp stamp, std::span<const std::uint16_t> counts) override {
    std::vector<std::uint16_t> image(counts.begin(), counts.end());
    if (falsification_.counts) falsification_.counts(&image);
    return client_->send_depth_counts(clock(stamp), image);
  }
  std::uint64_t send_state(Stamp stamp, const QuadrotorState& state, bool thrust_known) override {
    if (falsification_.before_state) falsification_.before_state(client_.get(), clock(stamp), told(state));
    return client_->send_state(clock(stamp), told(state), thrust_known);
  }
  sdk::Setpoint play(Stamp now, const QuadrotorState& state, std::chrono::nanoseconds period) override {
    return client_->play(clock(now), told(state), period);
  }
  void applied(Stamp now, const std::optional<sdk::Setpoint>& setpoint) override {
    client_->applied(clock(now), setpoint);
  }

  std::optional<protocol::ThrustRateCommand> newest() override { return client_->newest(); }
  std::optional<protocol::ThrustRateCommand> wait_for_answer(std::uint64_t state_sequence,
                                                             std::chrono::milliseconds timeout) override {
    return client_->wait_for_answer(state_sequence, timeout);
  }
  protocol::Problems problems() const override { return client_->problems(); }
  std::optional<sdk::ProblemChange> problem_change() override { return client_->problem_change(); }
  std::optional<sdk::SessionChange> session_change() override { return client_->session_change(); }
  sdk::LinkStatistics statistics() const override { return client_->statistics(); }
  std::optional<protocol::Telemetry> telemetry() override { return client_->telemetry(); }

 private:
  Stamp clock(Stamp stamp) const { return falsification_.clock ? falsification_.clock(stamp) : stamp; }
  QuadrotorState told(const QuadrotorState& state) const {
    return falsification_.state ? falsification_.state(state) : state;
  }

  std::unique_ptr<sdk::Client> client_;
  Falsification falsification_;
};

}  // namespace gatefield::test
