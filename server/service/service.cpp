#include "server/service/service.h"

#include <pthread.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>

#include "common/base/logging.h"
#include "common/base/text.h"
#include "common/protocol/validate.h"

namespace gatefield::service {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t kMaxQueue = 256;
constexpr auto kHousekeepingPeriod = 50ms;
constexpr std::chrono::nanoseconds kLogPeriod = 1s;

/// Ends a line of the log that stands for those that were held back.
std::string and_others(unsigned held) { return held ? " (and " + std::to_string(held) + " others)" : ""; }

/// Flies by another server: its samples carry that one's session, and no state has come with ours.
bool spare(pilot::Pilot* pilot) {
  const pilot::Account& account = pilot->account();
  const auto note = pilot->last_note();
  return note && note->code == ErrorCode::kWrongSession && account.states_received == account.states_rejected;
}

Figures::Totals totals_of(const pilot::Account& account) {
  const auto value = [](const auto& counter) { return counter.load(std::memory_order_relaxed); };
  Figures::Totals totals;
  totals.states_received = value(account.states_received);
  totals.states_rejected = value(account.states_rejected);
  totals.frames_received = value(account.frames_received);
  totals.frames_rejected = value(account.frames_rejected);
  totals.frames_invalid = value(account.frames_invalid);
  totals.commands_sent = value(account.commands_sent);
  totals.deadlines_missed = value(account.deadlines_missed);
  totals.ticks_narrow = value(account.ticks_narrow);
  for (std::size_t i = 0; i < totals.samples_refused.size(); ++i) totals.samples_refused[i] = value(account.noted[i]);
  totals.steps = account.steps.counts();
  return totals;
}

}  // namespace

Service::Service(ServiceOptions options, Factories factories, const Clock* clock, Transport* transport)
    : options_(std::move(options)),
      profiles_(options_.profiles),
      factories_(std::move(factories)),
      clock_(clock),
      transport_(transport),
      room_(room_options(options_), options_.costs) {
  if (options_.has_heir) hand_over_ = std::make_unique<HandOver>(clock_, transport_);
  if (options_.stands_by) stand_by_ = std::make_unique<StandBy>(stand_by_parts());
}

Service::~Service() { stop(); }

void Service::start() {
  const int threads = options_.control_threads > 0 ? options_.control_threads : default_control_threads();
  control_ = std::make_unique<ControlPool>(
      ControlPool::Options{threads, options_.realtime, options_.crew, options_.cores}, clock_, transport_);
  perception_ =
      std::make_unique<PerceptionPool>(options_.perception_threads, clock_, [this](const pilot::Pilot& pilot) {
        if (pilot.lockstep()) control_->wake(&pilot);
      });
  make_figures({}, clock_->now());
  if (hand_over_) hand_over_->start([this] { return pilots(); }, control_.get(), perception_.get());
  if (stand_by_) stand_by_->start();
  housekeeper_ = std::thread([this] { run(); });
}

void Service::stop() {
  {
    const std::lock_guard lock(queue_mutex_);
    if (stopping_.exchange(true)) return;
  }
  queue_filled_.notify_all();
  if (housekeeper_.joinable()) housekeeper_.join();
  if (stand_by_) stand_by_->stop();
  if (hand_over_) hand_over_->stop();
  give_over_those_that_can_be();
  // Vehicles hear of it before the threads end: their own fallback is then a matter of the reply, not of a time-out.
  std::map<std::string, std::shared_ptr<pilot::Pilot>> ending;
  {
    const std::unique_lock lock(sessions_mutex_);
    ending.swap(sessions_);
  }
  for (const auto& [vehicle, pilot] : ending) {
    detach(*pilot);
    if (hand_over_) hand_over_->over(*pilot);
    tell_no(pilot->request(), Error("server " + options_.name + " is leaving", ErrorCode::kLeaving));
  }
  if (control_) control_->stop();
  if (perception_) perception_->stop();
}

std::string Service::realtime_complaint() const { return control_ ? control_->complaint() : std::string(); }

// ---- from the transport ---------------------------------------------------------------------------------------------

void Service::on_request(const protocol::SessionRequest& request, const Status& verdict) {
  enqueue(kMaxQueue, [&] { return Asked{request, verdict}; });  // clients ask again when they hear nothing
}

void Service::on_gone(const std::string& vehicle, std::uint64_t request) {
  enqueue(2 * kMaxQueue, [&] { return Gone{vehicle, request}; });  // else the session ends for want of states
}

void Service::set_profiles(Profiles profiles) {
  enqueue(4 * kMaxQueue, [&] { return std::move(profiles); });
}

void Service::on_state(const protocol::VehicleState& state) {
  const std::shared_ptr<pilot::Pilot> pilot = session_of(state.vehicle);
  if (!pilot && stand_by_ && stand_by_->on_state(state)) return;
  if (!pilot) return stray(state.vehicle, "state");
  const pilot::Intake::Outcome outcome = pilot->intake().take_state(state, clock_->now());
  if (outcome == pilot::Intake::Outcome::kRejected || !pilot->lockstep() || !control_) return;
  control_->wake(pilot.get());
  if (pilot->looking().due()) perception_->wake();
}

void Service::on_depth(protocol::DepthFrame& frame) {
  const std::shared_ptr<pilot::Pilot> pilot = session_of(frame.vehicle);
  if (!pilot && stand_by_ && stand_by_->on_depth(frame)) return;
  if (!pilot) return stray(frame.vehicle, "depth");
  const pilot::Intake::Outcome outcome = pilot->intake().take_depth(frame, clock_->now());
  if (!control_) return;
  // In lockstep a step may be waiting for just this frame, which will not come again.
  if (outcome == pilot::Intake::Outcome::kRejected && pilot->lockstep()) control_->wake(pilot.get());
  if (outcome == pilot::Intake::Outcome::kTaken && pilot->looking().due()) perception_->wake();
}

void Service::on_rejected(Kind kind, const std::string& vehicle, const Error& why) {
  const std::shared_ptr<pilot::Pilot> pilot = vehicle.empty() ? nullptr : session_of(vehicle);
  if (pilot && kind == Kind::kState) return pilot->intake().note_rejected_state(why);
  if (pilot && kind == Kind::kDepth) return pilot->intake().note_rejected_frame(why);
  strays_.fetch_add(1, std::memory_order_relaxed);
  unsigned held = 0;
  if (stray_log_.admit(clock_->now(), &held)) log::warn("dropped a sample: " + why.message + and_others(held));
}

void Service::stray(const std::string& vehicle, const char* what) {
  strays_.fetch_add(1, std::memory_order_relaxed);
  unsigned held = 0;
  if (stopping_.load(std::memory_order_relaxed) || !stray_log_.admit(clock_->now(), &held)) return;
  log::warn(std::string("dropped a ") + what + " of \"" + vehicle + "\", which has no session here" + and_others(held));
}

std::shared_ptr<pilot::Pilot> Service::session_of(const std::string& vehicle) const {
  const std::shared_lock lock(sessions_mutex_);
  const auto found = sessions_.find(vehicle);
  return found == sessions_.end() ? nullptr : found->second;
}

std::vector<std::shared_ptr<pilot::Pilot>> Service::pilots() const {
  const std::shared_lock lock(sessions_mutex_);
  std::vector<std::shared_ptr<pilot::Pilot>> all;
  for (const auto& [vehicle, pilot] : sessions_) all.push_back(pilot);
  return all;
}

std::size_t Service::sessions() const {
  const std::shared_lock lock(sessions_mutex_);
  return sessions_.size();
}

// ---- housekeeping ---------------------------------------------------------------------------------------------------

void Service::run() {
  pthread_setname_np(pthread_self(), "housekeeping");
  for (;;) {
    {
      std::unique_lock lock(queue_mutex_);
      queue_filled_.wait_for(lock, kHousekeepingPeriod, [this] { return stopping_ || !queue_.empty(); });
      if (stopping_) return;
    }
    housekeep();
  }
}

void Service::housekeep() {
  // What comes meanwhile waits for the next turn: requests without end must not keep sessions from ending.
  decltype(queue_) queue;
  {
    const std::lock_guard lock(queue_mutex_);
    queue.swap(queue_);
  }
  for (auto& item : queue) {
    if (const auto* const asked = std::get_if<Asked>(&item)) {
      answer(*asked);
    } else if (const auto* const gone = std::get_if<Gone>(&item)) {
      forget_waiting(gone->vehicle, gone->request);
      if (stand_by_) stand_by_->on_gone(gone->vehicle, gone->request);
      const std::shared_ptr<pilot::Pilot> pilot = session_of(gone->vehicle);
      if (pilot && pilot->request().request == gone->request) end(pilot, "its client is gone");
    } else if (const auto* const taken = std::get_if<TakenAway>(&item)) {
      let_go(*taken);
    } else if (std::holds_alternative<NewHeir>(item)) {
      for (const auto& pilot : pilots()) transport_->send(reply_to(*pilot));
    } else {
      profiles_ = std::move(std::get<Profiles>(item));
    }
  }
  if (stand_by_) stand_by_->tend();
  if (draining_.load(std::memory_order_relaxed)) give_over_those_that_can_be();

  const Stamp now = clock_->now();
  answer_those_that_waited(now);
  std::vector<std::shared_ptr<pilot::Pilot>> all = pilots();
  for (const auto& pilot : all) {
    const auto limit = pilot->lockstep() ? options_.abandon_lockstep_after : options_.abandon_after;
    const auto silent = now - pilot->intake().last_heard();
    if (silent <= limit) continue;
    const std::string why = "no state came for " + text(seconds(limit)) + " s";
    end(pilot, why, Error("session ended: " + why, ErrorCode::kAbandoned));
  }
  const auto ended = [this](const auto& pilot) { return session_of(pilot->vehicle()) != pilot; };
  std::erase_if(all, ended);
  watch_room(all, now);
  std::erase_if(all, ended);
  tell(all, now);
  if (now >= next_figures_) {
    next_figures_ = now + options_.figures_period;
    make_figures(all, now);
  }
}

std::shared_ptr<const Figures> Service::figures() const {
  const std::lock_guard lock(figures_mutex_);
  return figures_;
}

void Service::make_figures(const std::vector<std::shared_ptr<pilot::Pilot>>& pilots, Stamp now) {
  auto made = std::make_shared<Figures>();
  made->made = now;
  made->step_since = std::min(now, control_ ? control_->step_since() : now);
  made->totals = ended_;
  made->sessions_begun = sessions_begun_;
  made->strays = strays();
  made->requests_refused = requests_refused_;
  fill_room(made.get());
  fill_succession(made.get());
  for (const auto& pilot : pilots) {
    Figures::Vehicle& vehicle = made->vehicles.emplace_back();
    pilot->fill(now, &vehicle.telemetry);
    vehicle.silent_s = seconds(now - pilot->intake().last_heard());
    vehicle.round_trip_s = 1e-9 * static_cast<double>(pilot->account().round_trip_ns.load(std::memory_order_relaxed));
    vehicle.lockstep = pilot->lockstep();
    made->totals += totals_of(pilot->account());
  }
  const std::lock_guard lock(figures_mutex_);
  figures_ = std::move(made);
}

void Service::tell(const std::vector<std::shared_ptr<pilot::Pilot>>& pilots, Stamp now) {
  const bool telemetry_due = now >= next_telemetry_;
  const bool log_due = now >= next_log_;
  if (telemetry_due) next_telemetry_ = now + options_.telemetry_period;
  if (log_due) next_log_ = now + kLogPeriod;
  protocol::Telemetry telemetry;
  for (const auto& pilot : pilots) {
    Told& told = told_[pilot->vehicle()];
    if (told.session != pilot->session()) told = {pilot->session()};
    const protocol::Problems problems = pilot->problems();
    told.found |= problems;
    if (telemetry_due || (problems & ~told.sent) != 0) {
      pilot->fill(now, &telemetry);
      transport_->send(telemetry);
      told.sent = problems;
    }
    if (!log_due) continue;
    log_problems(pilot->vehicle(), std::exchange(told.found, problems), &told.logged);
    if (const auto complaints = pilot->complaints(); complaints && !spare(pilot.get()))
      log::warn("vehicle " + pilot->vehicle() + ": " + *complaints);
  }
}

void Service::log_problems(const std::string& vehicle, protocol::Problems found, protocol::Problems* logged) {
  for (const protocol::Problem problem : protocol::list(found & ~*logged))
    log::warn("vehicle " + vehicle + ": " + std::string(protocol::name(problem)) + ": " +
              std::string(protocol::sentence(problem)));
  std::string over;
  for (const protocol::Problem problem : protocol::list(*logged & ~found))
    over += (over.empty() ? "" : ", ") + std::string(protocol::name(problem));
  if (!over.empty()) log::info("vehicle " + vehicle + ": no more " + over);
  *logged = found;
}

void Service::answer(const Asked& asked) {
  const protocol::SessionRequest& request = asked.request;
  if (const Status named = protocol::validate_name("vehicle", request.vehicle); !named) {
    unsigned held = 0;
    if (refusal_log_.admit(clock_->now(), &held))
      log::warn("dropped a session request: " + named.error() + and_others(held));
    return;
  }
  if (left_to_the_leader(asked)) return;
  if (!asked.verdict) return refuse(request, asked.verdict.failure());
  if (const Status status = protocol::validate(request); !status) return refuse(request, status.failure());

  std::shared_ptr<pilot::Pilot> live = session_of(request.vehicle);
  if (request.action == protocol::SessionRequest::Action::kLeave) {
    forget_waiting(request.vehicle, request.request);
    if (live && live->request().request == request.request) end(live, "it left");
    return;
  }
  if (live && live->request().request == request.request) return transport_->send(reply_to(*live));

  const Stamp now = clock_->now();
  if (left_to_others(asked, now)) return;
  const auto silent = [&](const pilot::Pilot& pilot) { return now - pilot.intake().last_heard(); };
  const auto stale = [&](const pilot::Pilot& pilot) { return silent(pilot) > options_.stale_after; };
  if (live && !stale(*live)) {
    const std::string none = "none for " + text(seconds(options_.stale_after)) + " s";
    Error busy("vehicle \"" + request.vehicle + "\" has a session whose last state came " +
                   text(std::round(1e3 * seconds(silent(*live)))) + " ms ago, expected " + none +
                   " before another client takes it over",
               ErrorCode::kBusyName, "vehicle");
    busy.value = "\"" + request.vehicle + "\"";
    busy.expected = "a name without a session, or whose session had no state: " + none;
    return refuse(request, busy);
  }
  if (const Status known = check_profile(request); !known) return refuse(request, known.failure());

  // Others end only when the vehicle can have their place, and a planner, which takes time to make, is only made when
  // there is a place.
  const auto place = place_for(request, live.get(), now);
  if (!place) return refuse_for_want_of_room(request, place.failure());
  auto parts = parts_for(request);
  if (!parts) return refuse(request, parts.failure());
  for (const Ending& ending : *place) {
    if (ending.told.code == ErrorCode::kBusyServer) ++sessions_displaced_;
    end(ending.pilot, ending.why, ending.told, ending.retry_after_s);
  }
  if (live) {
    log::info("vehicle " + request.vehicle + ": taken over by request " + std::to_string(request.request) +
              ", no state came for " + text(seconds(silent(*live))) + " s");
    detach(*live);
  }
  accept(std::move(parts).value());
}

Status Service::check_profile(const protocol::SessionRequest& request) const {
  if (profiles_.contains(request.profile)) return {};
  std::string known;
  for (const auto& [name, unused] : profiles_) known += (known.empty() ? "" : ", ") + name;
  return Error::invalid("profile", "\"" + request.profile + "\"", "one of: " + known, ErrorCode::kUnknownName);
}

Result<pilot::PilotParts> Service::parts_for(const protocol::SessionRequest& request) const {
  const planner::Profile& profile = profiles_.at(request.profile);
  auto planner = factories_.planner(profile, request);
  if (!planner) return planner.failure();
  auto sensor = factories_.sensor(request);
  if (!sensor) return sensor.failure();
  pilot::PilotParts parts;
  if (factories_.observer) {
    auto observer = factories_.observer(profile, request);
    if (!observer) return observer.failure();
    parts.observer = std::move(observer).value();
  }
  parts.request = request;
  parts.session = new_session();
  parts.planner = std::move(planner).value();
  parts.sensor = std::move(sensor).value();
  parts.isa = options_.isa;
  parts.model_hash = options_.model_hash;
  parts.now = clock_->now();
  return parts;
}

/// No session of this server or another has it, and nobody can tell it from those that went before.
std::uint64_t Service::new_session() const {
  std::random_device device;
  const std::shared_lock lock(sessions_mutex_);
  for (;;) {
    const std::uint64_t session = std::uint64_t{device()} << 32 | std::uint64_t{device()};
    const auto has_it = [session](const auto& entry) { return entry.second->session() == session; };
    if (session != 0 && std::none_of(sessions_.begin(), sessions_.end(), has_it)) return session;
  }
}

void Service::accept(pilot::PilotParts parts) {
  const auto pilot = std::make_shared<pilot::Pilot>(std::move(parts));
  const protocol::SessionRequest& request = pilot->request();
  serve(pilot);
  ++sessions_begun_;
  room_.enter(newcomer(request), pilot->session(), request.vehicle, clock_->now());
  const planner::Profile& profile = profiles_.at(request.profile);
  log::info(
      "vehicle " + request.vehicle + ": session " + std::to_string(pilot->session()) + ", profile " + profile.name +
      ", " + (pilot->lockstep() ? "lockstep" : "real time at " + text(profile.control_rate_hz) + " Hz") + ", " +
      std::to_string(request.course.waypoints.size()) + " waypoints, " + std::to_string(request.course.laps) + " laps");
  if (priority_of(request) != request.priority)
    log::warn("vehicle " + request.vehicle + ": priority " + std::to_string(request.priority) + " counts as " +
              std::to_string(priority_of(request)) + " (--max-priority)");
}

/// Any thread.
void Service::serve(const std::shared_ptr<pilot::Pilot>& pilot) {
  {
    const std::unique_lock lock(sessions_mutex_);
    sessions_[pilot->vehicle()] = pilot;
  }
  if (hand_over_) hand_over_->begin(*pilot);
  if (control_) {
    control_->add(pilot);
    perception_->add(pilot);
  }
  // Last: the first state may come as soon as the vehicle hears of it, and has to find somebody to wake.
  transport_->send(reply_to(*pilot));
}

void Service::refuse(const protocol::SessionRequest& request, const Error& why, double retry_after_s) {
  ++requests_refused_[index(why.code)];
  tell_no(request, why, retry_after_s);
  unsigned held = 0;
  if (refusal_log_.admit(clock_->now(), &held))
    log::warn("vehicle " + request.vehicle + ": refused, " + why.message + and_others(held));
}

void Service::tell_no(const protocol::SessionRequest& request, const Error& why, double retry_after_s) {
  protocol::SessionReply reply;
  reply.version = request.version;
  reply.vehicle = request.vehicle;
  reply.request = request.request;
  reply.accepted = false;
  reply.reason = shown(why.message, protocol::kMaxReasonLength);
  reply.code = why.code;
  reply.field = shown(why.field, protocol::kMaxFieldLength);
  reply.value = shown(why.value, protocol::kMaxFieldLength);
  reply.expected = shown(why.expected, protocol::kMaxFieldLength);
  reply.server = options_.name;
  reply.retry_after_s = retry_after_s;
  transport_->send(reply);
}

protocol::SessionReply Service::reply_to(pilot::Pilot& pilot) const {
  const planner::Profile& profile = pilot.stepping().planner().profile();
  protocol::SessionReply reply;
  reply.vehicle = pilot.vehicle();
  reply.request = pilot.request().request;
  reply.accepted = true;
  reply.server = options_.name;
  reply.session = pilot.session();
  reply.control_period_s = seconds(pilot.control_period());
  reply.plan_step_s = profile.step_s;
  reply.plan_steps = profile.steps;
  reply.model_hash = options_.model_hash;
  return reply;
}

void Service::end(const std::shared_ptr<pilot::Pilot>& pilot, const std::string& why, const std::optional<Error>& told,
                  double retry_after_s) {
  {
    const std::unique_lock lock(sessions_mutex_);
    const auto found = sessions_.find(pilot->vehicle());
    if (found != sessions_.end() && found->second == pilot) sessions_.erase(found);
  }
  detach(*pilot);
  if (hand_over_) hand_over_->over(*pilot);
  if (told) tell_no(pilot->request(), *told, retry_after_s);
  transport_->forget(pilot->vehicle());
  told_.erase(pilot->vehicle());
  log::info("vehicle " + pilot->vehicle() + ": session " + std::to_string(pilot->session()) + " ended, " + why);
}

/// Nothing counts in its account any more when this returns.
void Service::detach(const pilot::Pilot& pilot) {
  if (control_) {
    control_->remove(&pilot);
    perception_->remove(&pilot);
  }
  ended_ += totals_of(pilot.account());
  room_.leave(pilot.session());
}

}  // namespace gatefield::service
