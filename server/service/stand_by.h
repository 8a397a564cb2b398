#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "common/base/clock.h"
#include "server/pilot/pilot.h"
#include "server/service/transport.h"

namespace gatefield::service {

/// The heir's side of a hot stand-by: follows a leader's vehicles, and takes one over when the leader's commands for it
/// stop, or when the leader hands it over.
///
/// A vehicle is followed once its request was heard from the client and a record of its pilot from the leader. Its
/// pilot is made then, and waits. What comes after the newest record is kept: states, the newest depth frame, the
/// leader's commands. At the take-over the pilot is set to the record and fed all of it, so it begins where the leader
/// was.
///
/// Commands have stopped when none came for kSilence although states come and this thread was awake: a vehicle that
/// says nothing gets no commands, and a stand-by that was held up itself has only not read them yet.
///
/// The leader serves those who want to join, and this server doesn't (holds_back()), while the leader is there and has
/// not fallen: it fell when a vehicle was taken over from it, and is there again when it writes a record. One that was
/// never seen is waited for kLeaderComes. Of two that stand by for each other one has the newcomers.
///
/// Thread-safe: yes. tend() by housekeeping alone, look() by one thread.
class StandBy {
 public:
  static constexpr std::chrono::milliseconds kSilence{60};  ///< three control periods of the shipped profiles
  static constexpr std::chrono::milliseconds kStatesCome{40};
  static constexpr std::chrono::milliseconds kLookEvery{5};
  static constexpr std::chrono::milliseconds kAwake{25};  ///< that one look counts for at most
  static constexpr std::chrono::milliseconds kLeaderComes{3000};
  static constexpr std::chrono::seconds kForgotten{10};  ///< without a record

  /// What came over, and is ready to fly.
  struct Taken {
    std::shared_ptr<pilot::Pilot> pilot;
    std::string why;  ///< for the log
  };
  struct Parts {
    const Clock* clock = nullptr;
    Transport* transport = nullptr;
    /// A pilot for the session of this record, which another server began.
    std::function<Result<std::shared_ptr<pilot::Pilot>>(const protocol::SessionRequest&, const protocol::PilotRecord&)>
        make;
    std::function<bool(const std::string& vehicle)> flown;   ///< from here, still: is not made ready yet
    std::function<void(const Taken&)> take_over;             ///< begins to serve it
    std::function<void(const std::string& vehicle)> forget;  ///< is followed no more
    int max_vehicles = 8;
  };
  explicit StandBy(Parts parts);
  ~StandBy();  ///< stop()

  void start();
  void stop();

  bool holds_back() const;
  std::size_t ready() const;  ///< vehicles that could be taken over now

  // ---- what comes
  /// @param ours_first  it stands by for us, too, and newcomers are ours
  void on_leader(bool there, bool ours_first = false);
  /// A client's that wants to join, which the leader answers.
  void on_request(const protocol::SessionRequest& request);
  void on_gone(const std::string& vehicle, std::uint64_t request);
  void on_record(const protocol::PilotRecord& record);
  void on_command(const protocol::ThrustRateCommand& command);
  /// @return false: the vehicle is not followed
  bool on_state(const protocol::VehicleState& state);
  bool on_depth(protocol::DepthFrame& frame);

  /// Makes pilots for vehicles that are new, forgets those that are over.
  void tend();
  /// Takes over what has to be.
  void look();

 private:
  struct State {
    protocol::VehicleState state;
    Stamp came{0};
  };
  struct Followed {
    protocol::PilotRecord record;  ///< the newest with a pilot in it
    Stamp record_came{0};
    std::chrono::nanoseconds clock_ahead{0};  ///< of the leader's, as the fastest record says
    std::shared_ptr<pilot::Pilot> pilot;      ///< null: not made yet
    bool impossible = false;                  ///< can't be followed: told once
    bool handed_over = false;
    bool taking = false;                ///< being taken over
    bool commanded = false;             ///< the leader has commanded it
    std::chrono::nanoseconds quiet{0};  ///< without a command, although states came and we were awake
    std::deque<State> states;           ///< the newest, of all
    std::optional<protocol::DepthFrame> frame;
    Stamp frame_came{0};
    std::deque<protocol::ThrustRateCommand> commands;
  };
  bool must_be_taken(const Followed& followed, Stamp now, std::string* why) const;
  void take(const std::string& vehicle, Followed* followed, const std::string& why);
  void make_ready(const std::string& vehicle, const protocol::PilotRecord& record,
                  const protocol::SessionRequest& request, std::chrono::nanoseconds clock_ahead);
  const protocol::SessionRequest* request_of(const protocol::PilotRecord& record) const;
  void tell(const protocol::PilotRecord& of, protocol::PilotRecord::Kind kind);
  void run();

  const Parts parts_;
  mutable std::mutex mutex_;
  std::condition_variable news_;
  bool stopping_ = false;
  bool leader_there_ = false;
  bool ours_first_ = false;
  bool fallen_ = false;
  Stamp waits_until_{0};  // for a leader that is not there
  Stamp looked_{0};
  Stamp next_ready_{0};
  std::deque<protocol::SessionRequest> requests_;  // in the order of coming
  std::map<std::string, Followed> followed_;       // by vehicle
  std::vector<std::string> over_;                  // that the transport is to forget
  std::thread thread_;
};

}  // namespace gatefield::service
