#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "common/base/clock.h"
#include "common/base/random.h"
#include "common/scene/depth_camera.h"
#include "common/vehicle/quadrotor.h"

namespace gatefield::simulator {

/// A slow link between vehicle and server, in simulated time: what the vehicle sends reaches the planner late, or not
/// at all. Its answers come as late as the states did, so that the whole delay lies on the way there.
///
/// Each state (with its answer) and each frame is late by the delay and by a jitter, uniform and in whole milliseconds;
/// what a newer one of its kind has overtaken is lost. A message is lost with the given probability each way: a state
/// on its way there, its answer on the way back, a frame. The draws of a message do not depend on what becomes of it,
/// so that the next one's are the same in any case. Same seed and sequence of calls, same link. During an outage
/// nothing gets through, nor does what was on its way when it began. Thread-safe: no.   Real-time safe: no.
class SimulatedLink {
 public:
  struct Options {
    Stamp delay{0};
    Stamp jitter{0};
    double loss = 0.0;  ///< each way
    Stamp outage_begin{0};
    Stamp outage{0};  ///< for so long; 0: none
  };
  struct State {
    Stamp stamp{0};
    QuadrotorState state;
  };
  struct Frame {
    Stamp stamp{0};
    scene::DepthImage metres;
    std::vector<std::uint16_t> counts;
  };

  SimulatedLink(const Options& options, std::uint64_t seed);

  /// Of a race with this seed, since the race began: between kFirstOutage and kLastOutage, uniform.
  static Stamp outage_begin(std::uint64_t seed);
  static constexpr Stamp kFirstOutage = std::chrono::seconds(2), kLastOutage = std::chrono::seconds(8);

  /// What the vehicle took itself for at all times before the race.
  void begin(const QuadrotorState& estimate);
  /// The vehicle's estimate of this millisecond. @pre begin() was called, and this is called once a millisecond
  void remember(const QuadrotorState& estimate);

  /// Sends the state that the planner sees now, which is the delay old.
  void send_state(Stamp now);
  /// Sends a frame that is out now.
  /// @param stamp  that it carries
  void send_frame(Stamp now, Stamp stamp, const scene::DepthImage& metres, const std::vector<std::uint16_t>& counts);

  /// The newest state that is there by now; it has overtaken the older ones. Empty: none came since.
  std::optional<State> take_state(Stamp now);
  /// The next frame that is there by now, older ones first; those that a newer one has overtaken are lost.
  std::optional<Frame> take_frame(Stamp now);

 private:
  struct Passage {
    bool lost = false;
    Stamp jitter{0};
  };
  template <typename Message>
  struct OnTheWay {
    Stamp arrival;  // on the vehicle's own time scale
    Message message;
  };
  Passage pass(int ways);
  bool cut(Stamp from, Stamp until) const noexcept {
    return options_.outage > Stamp{0} && until >= options_.outage_begin &&
           from < options_.outage_begin + options_.outage;
  }

  Options options_;
  Random random_;
  std::deque<QuadrotorState> past_;     // front: what the planner sees now
  std::deque<OnTheWay<State>> states_;  // by stamp
  std::deque<OnTheWay<Frame>> frames_;
};

}  // namespace gatefield::simulator
