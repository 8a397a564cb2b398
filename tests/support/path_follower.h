#pragma once

#include <Eigen/Geometry>
#include <mutex>
#include <vector>

#include "common/scene/world.h"
#include "gatefield/sdk/client.h"

namespace gatefield::test {

/// A client that needs no server: a geometric controller that follows a smooth closed path through given gates, so that
/// the simulator can be tested on its own, whichever part of a setpoint its vehicle follows. It stands in for the
/// planner and is allowed to know the gates.
class PathFollower final : public sdk::Client {
 public:
  struct Options {
    double speed_m_s = 4.0;
    std::uint64_t silent_from = UINT64_MAX;      ///< states from this sequence number on get no answer
    std::chrono::milliseconds answer_delay{0};   ///< wall clock that an answer takes
    bool stand_still = false;                    ///< hovers at the start
    std::vector<sdk::ProblemChange> problems{};  ///< told one by one, one per answer
    std::vector<sdk::SessionChange> sessions{};  ///< the same
  };

  /// @param gates  as the path shall run through them, in order, round and round
  PathFollower(const scene::World& gates, const QuadrotorModel& model, const Options& options);

  protocol::SessionReply session() const override;
  std::uint64_t send_depth(Stamp stamp, std::span<const float> depth_m) override;
  std::uint64_t send_depth_counts(Stamp stamp, std::span<const std::uint16_t> counts) override;
  std::uint64_t send_state(Stamp stamp, const QuadrotorState& state, bool thrust_known) override;
  std::optional<protocol::ThrustRateCommand> newest() override;
  std::optional<protocol::ThrustRateCommand> wait_for_answer(std::uint64_t state_sequence,
                                                             std::chrono::milliseconds timeout) override;
  sdk::Setpoint play(Stamp now, const QuadrotorState& state, std::chrono::nanoseconds period) override;
  void applied(Stamp, const std::optional<sdk::Setpoint>&) override {}
  sdk::LinkStatistics statistics() const override;
  protocol::Problems problems() const override { return 0; }
  std::optional<sdk::ProblemChange> problem_change() override;
  std::optional<sdk::SessionChange> session_change() override;
  std::optional<protocol::Telemetry> telemetry() override { return std::nullopt; }

  /// What came in, for tests.
  struct Received {
    std::vector<Stamp> states, frames;
    std::size_t valid_pixels = 0;  ///< over all frames
    QuadrotorState first;          ///< the first state
    bool thrust_known = false;     ///< of the newest state
  };
  Received received() const;

 private:
  void take_frame(Stamp stamp, std::size_t valid_pixels);
  protocol::ThrustRateCommand command() const;

  QuadrotorModel model_;
  Options options_;
  std::vector<Eigen::Vector3d> path_W_;  ///< closed, every kSpacing_m
  std::size_t nearest_ = 0;
  bool located_ = false;
  mutable std::mutex mutex_;
  Received received_;
  std::uint64_t fresh_ = 0, taken_ = 0;
  std::size_t told_ = 0, told_sessions_ = 0;
  std::optional<Eigen::Vector3d> hold_W_;
  Stamp last_answered_{0};
};

}  // namespace gatefield::test
