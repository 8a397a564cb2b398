#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <shared_mutex>
#include <string>
#include <thread>
#include <variant>
#include <vector>

#include "common/base/clock.h"
#include "common/base/rate_limiter.h"
#include "common/base/result.h"
#include "common/protocol/messages.h"
#include "server/perception/gate_sensor.h"
#include "server/pilot/pilot.h"
#include "server/planner/planner.h"
#include "server/planner/profile.h"
#include "server/service/figures.h"
#include "server/service/hand_over.h"
#include "server/service/neighbours.h"
#include "server/service/room.h"
#include "server/service/stand_by.h"
#include "server/service/transport.h"
#include "server/service/workers.h"

namespace gatefield::service {

using Profiles = std::map<std::string, planner::Profile>;  ///< by name

struct ServiceOptions {
  std::string name = "gatefield";  ///< told in every reply
  int max_vehicles = 8;            ///< sessions at once, 1 to 256
  int control_threads = 0;         ///< 0 = default_control_threads()
  int perception_threads = 1;
  bool realtime = false;          ///< SCHED_FIFO for the control threads
  kernels::Crew* crew = nullptr;  ///< that the planners of `factories` share their blocks through; may be null
  std::vector<int> cores;         ///< that control threads are bound to; empty: none
  std::string isa;                ///< instruction set of the kernels
  std::uint64_t model_hash = 0;
  Profiles profiles;
  double utilisation = 0.0;   ///< part of the cores that vehicles may take (RoomOptions); 0: only max_vehicles counts
  double cores_usable = 0.0;  ///< of this process; 0 = usable_cores()
  Costs costs;                ///< what vehicles cost, as far as it is known
  /// Requests that ask for more are treated as if they asked for this: who may displace whom is the operator's to say.
  std::uint8_t max_priority = protocol::kMaxPriority;
  std::chrono::nanoseconds stale_after = std::chrono::seconds(1);     ///< without a state, the name may be taken over
  std::chrono::nanoseconds abandon_after = std::chrono::seconds(10);  ///< without a state, a real-time session ends
  std::chrono::nanoseconds abandon_lockstep_after = std::chrono::seconds(60);  ///< simulators may be paused
  std::chrono::nanoseconds telemetry_period = std::chrono::milliseconds(500);
  std::chrono::nanoseconds figures_period = std::chrono::milliseconds(500);
  bool has_heir = false;   ///< was told of a stand-by
  bool stands_by = false;  ///< is one
};

/// What the service makes pilots from, one of each a session; the error is what the vehicle is refused with. Tests put
/// their own in.
struct Factories {
  template <typename T>
  using Make = std::function<Result<std::unique_ptr<T>>(const protocol::SessionRequest&)>;

  template <typename T>
  using MakeBy = std::function<Result<std::unique_ptr<T>>(const planner::Profile&, const protocol::SessionRequest&)>;

  MakeBy<planner::Planner> planner;
  Make<perception::GateSensor> sensor;
  MakeBy<pilot::StepObserver> observer;  ///< may be empty: nobody looks at steps
};

/// The planning service: who may join, whose samples go where, and who is told what.
///
/// Sessions. A request to join is refused with a code and a sentence, or answered with a session number that goes into
/// every later sample: 64 random bits, never 0, so that nobody guesses another's. The same request again gets the same
/// reply again. kBusyName (a session that is heard of has the name) and kBusyServer may be gone a moment later, see
/// may_pass(); other refusals will not go away by themselves. A refusal carries the version of who asked. A session
/// ends when the vehicle leaves, when its request is withdrawn (the middleware says so), when another request with its
/// name comes after `stale_after` without a state, and after `abandon_after` without one. Whenever the server ends a
/// session by itself it says so with a refusal of the request that was accepted (kAbandoned, kLeaving): the client then
/// joins anew.
///
/// Room. Newcomers are admitted while those who fly keep their deadlines (Room); a refusal for want of room says what
/// is taken and when to ask again, and a newcomer displaces vehicles of lower priority. When ticks are late for long
/// the newest vehicle of the lowest priority is sent away, never one that races unless a vehicle of higher priority
/// suffers. Servers of a domain tell each other how much room they have, and the one with most answers first
/// (Neighbours); the others answer a moment later, and so become spares.
///
/// Telemetry goes out every `telemetry_period`, and at once when a session has a problem (PlannerHealth::problems) that
/// was not told yet: no command need go out for that. The log has a line when a session's problems change, one a second
/// at most.
///
/// Several servers. One that has an heir writes its pilots down for it (HandOver); one that stands by follows those of
/// its leader and takes them over (StandBy), and answers no request while the leader does. Who took a session over has
/// it for good: the other one lets go as soon as it hears so. A vehicle that is handed over is told with an accepted
/// reply of code kLeaving, and flies on.
///
/// A session is a pilot::Pilot here; nothing in this folder knows how to fly.
///
/// on_*() may be called from any thread; they store what came and return (requests wait for housekeeping). Without
/// start() nothing runs by itself: tests call housekeep() and serve the pilots themselves.
class Service {
 public:
  Service(ServiceOptions options, Factories factories, const Clock* clock, Transport* transport);
  ~Service();  ///< stop()
  Service(const Service&) = delete;
  Service& operator=(const Service&) = delete;

  /// Starts the control, perception and housekeeping threads.
  void start();
  /// Ends all threads. Vehicles that the heir is ready for are handed over, the others are told that the server is
  /// leaving. Nothing is sent afterwards.
  void stop();

  // ---- from the transport -----------------------------------------------------------------------------------------
  /// @param verdict  what was wrong with the request on its way here, if anything
  void on_request(const protocol::SessionRequest& request, const Status& verdict = {});
  void on_state(const protocol::VehicleState& state);
  /// May swap the frame's pixels for another buffer.
  void on_depth(protocol::DepthFrame& frame);
  /// The client that sent this request is gone.
  void on_gone(const std::string& vehicle, std::uint64_t request);
  /// Another server of the domain says how it is.
  void on_server_status(const protocol::ParticipantBytes& from, const protocol::ServerStatus& status);
  enum class Kind { kState, kDepth, kOther };
  /// A sample was refused on its way here; `vehicle` may be empty or unknown.
  void on_rejected(Kind kind, const std::string& vehicle, const Error& why);

  // ---- from the transport, of other servers: those that the options say there are -----------------------------------
  void on_heir(bool there);
  /// @param ours_first  the other one stands by for us, too, and newcomers are ours
  void on_leader(bool there, bool ours_first = false);
  void on_record(const protocol::PilotRecord& record);
  /// What the leader tells a vehicle.
  void on_leader_command(const protocol::ThrustRateCommand& command);

  // ---- from whoever runs the server -------------------------------------------------------------------------------
  /// Sessions that begin from now on have these; those that there are keep what they began with. Any thread.
  void set_profiles(Profiles profiles);
  /// From now on newcomers are refused (kBusyServer), other servers are told, and each vehicle is handed over when
  /// the heir is ready for it. Any thread.
  void drain();

  // ---- for housekeeping and tests ---------------------------------------------------------------------------------
  /// Answers requests, ends sessions that nobody uses, sends telemetry, writes the log. Called by one thread.
  void housekeep();
  std::shared_ptr<pilot::Pilot> session_of(const std::string& vehicle) const;
  std::size_t sessions() const;
  /// drain() was called, and the last vehicle has left.
  bool drained() const { return draining_.load(std::memory_order_relaxed) && sessions() == 0; }
  /// Writes its pilots down for the heir, as its thread does. @pre has_heir
  void write_down() { hand_over_->follow(pilots()); }
  /// Takes over what has to be, as its thread does. @pre stands_by
  void look_after() { stand_by_->look(); }
  /// Samples for vehicles that have no session here.
  std::uint64_t strays() const noexcept { return strays_.load(std::memory_order_relaxed); }
  /// The newest that housekeeping has made: how old they are says whether it still runs. Any thread.
  std::shared_ptr<const Figures> figures() const;
  /// Why real-time scheduling was not granted, after start(); empty when it was or was not asked for.
  std::string realtime_complaint() const;

 private:
  struct Asked {
    protocol::SessionRequest request;
    Status verdict;
    bool waited = false;  ///< other servers had their time to answer
  };
  struct Waiting {
    Asked asked;
    Stamp at;
  };
  /// A session that has to end for another one.
  struct Ending {
    std::shared_ptr<pilot::Pilot> pilot;
    std::string why;
    Error told;
    double retry_after_s = 0.0;
  };
  struct Gone {
    std::string vehicle;
    std::uint64_t request;
  };
  struct NewHeir {};
  struct TakenAway {
    std::string vehicle;
    std::uint64_t session;
    std::uint32_t take_overs;
  };
  using Item = std::variant<Asked, Gone, Profiles, NewHeir, TakenAway>;

  /// What was told of a session's problems.
  struct Told {
    std::uint64_t session = 0;
    protocol::Problems sent = 0;   ///< in the newest telemetry
    protocol::Problems found = 0;  ///< since the last log
    protocol::Problems logged = 0;
  };

  /// For housekeeping. Left out, and not even made, when so many wait already.
  template <typename Make>
  void enqueue(std::size_t most, Make&& make) {
    {
      const std::lock_guard lock(queue_mutex_);
      if (stopping_ || queue_.size() >= most) return;
      queue_.push_back(make());
    }
    queue_filled_.notify_one();
  }
  std::vector<std::shared_ptr<pilot::Pilot>> pilots() const;
  void answer(const Asked& asked);
  Status check_profile(const protocol::SessionRequest& request) const;
  /// @pre check_profile(request)
  Result<pilot::PilotParts> parts_for(const protocol::SessionRequest& request) const;
  void accept(pilot::PilotParts parts);
  void serve(const std::shared_ptr<pilot::Pilot>& pilot);
  std::uint64_t new_session() const;
  void refuse(const protocol::SessionRequest& request, const Error& why, double retry_after_s = 0.0);
  void tell_no(const protocol::SessionRequest& request, const Error& why, double retry_after_s = 0.0);
  protocol::SessionReply reply_to(pilot::Pilot& pilot) const;
  /// @param why   for the log
  /// @param told  what the vehicle hears of it; empty = nothing
  void end(const std::shared_ptr<pilot::Pilot>& pilot, const std::string& why, const std::optional<Error>& told = {},
           double retry_after_s = 0.0);
  void detach(const pilot::Pilot& pilot);
  void stray(const std::string& vehicle, const char* what);
  void tell(const std::vector<std::shared_ptr<pilot::Pilot>>& pilots, Stamp now);
  void log_problems(const std::string& vehicle, protocol::Problems found, protocol::Problems* logged);
  void make_figures(const std::vector<std::shared_ptr<pilot::Pilot>>& pilots, Stamp now);
  void run();

  // ---- heir and leader (succession.cpp)
  StandBy::Parts stand_by_parts();
  bool left_to_the_leader(const Asked& asked);
  bool held_back() const { return stand_by_ && stand_by_->holds_back(); }
  void take_over(const StandBy::Taken& taken);
  void give_over_those_that_can_be();
  void give_over(const std::shared_ptr<pilot::Pilot>& pilot);
  void let_go(const TakenAway& taken);
  void taken_away(const protocol::PilotRecord& record);
  bool is_ours(const protocol::PilotRecord& record);
  bool heard(const pilot::Pilot& pilot) const;
  void fill_succession(Figures* figures) const;

  // ---- who may join (admission.cpp)
  static RoomOptions room_options(const ServiceOptions& options);
  std::uint8_t priority_of(const protocol::SessionRequest& request) const;
  protocol::ServerStatus status() const;
  bool left_to_others(const Asked& asked, Stamp now);
  void answer_those_that_waited(Stamp now);
  void forget_waiting(const std::string& vehicle, std::uint64_t request);
  Room::Newcomer newcomer(const protocol::SessionRequest& request) const;
  Result<std::vector<Ending>> place_for(const protocol::SessionRequest& request, const pilot::Pilot* live,
                                        Stamp now) const;
  void refuse_for_want_of_room(const protocol::SessionRequest& request, const Error& why);
  void watch_room(const std::vector<std::shared_ptr<pilot::Pilot>>& pilots, Stamp now);
  void log_late_ticks(Stamp now);
  void fill_room(Figures* figures) const;

  const ServiceOptions options_;
  Profiles profiles_;  // housekeeping
  const Factories factories_;
  const Clock* const clock_;
  Transport* const transport_;

  mutable std::shared_mutex sessions_mutex_;  // receiving threads look up, housekeeping changes
  std::map<std::string, std::shared_ptr<pilot::Pilot>> sessions_;

  std::mutex queue_mutex_;
  std::condition_variable queue_filled_;
  std::deque<Item> queue_;
  std::atomic<bool> stopping_{false};  // changed under the queue's mutex

  std::atomic<std::uint64_t> strays_{0};
  RateLimiter stray_log_;
  RateLimiter refusal_log_;
  Stamp next_telemetry_{0};
  Stamp next_log_{0};
  std::map<std::string, Told> told_;  // by vehicle

  Room room_;  // housekeeping
  Neighbours neighbours_;
  std::vector<Waiting> waiting_;  // housekeeping: requests that are left to other servers for a moment
  std::atomic<bool> draining_{false};
  Stamp next_room_{0};
  RateLimiter late_log_{std::chrono::seconds(2)};
  std::uint64_t sessions_shed_ = 0, sessions_displaced_ = 0;

  Figures::Totals ended_;  // housekeeping: of sessions that are over
  std::uint64_t sessions_begun_ = 0;
  ByCode requests_refused_{};
  Stamp next_figures_{0};
  mutable std::mutex figures_mutex_;
  std::shared_ptr<const Figures> figures_ = std::make_shared<Figures>();

  std::atomic<std::uint64_t> taken_over_{0}, handed_over_{0};  // sessions
  std::unique_ptr<HandOver> hand_over_;                        // null: has no heir
  std::unique_ptr<StandBy> stand_by_;                          // null: stands by for nobody

  std::unique_ptr<ControlPool> control_;
  std::unique_ptr<PerceptionPool> perception_;
  std::thread housekeeper_;
};

}  // namespace gatefield::service
