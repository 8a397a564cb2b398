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
      transport_(transport) {
  if (options_.has_heir) hand_over_ = std::make_unique<HandOver>(clock_, transport_);
  if (!options_.stands_by) return;
  StandBy::Parts parts;
  parts.clock = clock_;
  parts.transport = transport_;
  parts.max_vehicles = options_.max_vehicles;
  parts.make = [this](const protocol::SessionRequest& request,
                      std::uint64_t session) -> Result<std::shared_ptr<pilot::Pilot>> {
    if (const Status known = check_profile(request); !known) return known.failure();
    auto made = parts_for(request);
    if (!made) return made.failure();
    made.value().session = session;
    return std::make_shared<pilot::Pilot>(std::move(made).value());
  };
  parts.take_over = [this](const StandBy::Taken& taken) { take_over(taken); };
  parts.forget = [this](const std::string& vehicle) {
    if (!session_of(vehicle)) transport_->forget(vehicle);  // else it has joined here meanwhile
  };
  stand_by_ = std::make_unique<StandBy>(std::move(parts));
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
  for (const auto& pilot : pilots())
    if (hand_over_ && hand_over_->is_ready(*pilot)) give_over(pilot);
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
  {
    const std::lock_guard lock(queue_mutex_);
    if (stopping_ || queue_.size() >= kMaxQueue) return;  // clients ask again when they hear nothing
    queue_.emplace_back(Asked{request, verdict});
  }
  queue_filled_.notify_one();
}

void Service::on_gone(const std::string& vehicle, std::uint64_t request) {
  {
    const std::lock_guard lock(queue_mutex_);
    if (stopping_ || queue_.size() >= 2 * kMaxQueue) return;  // the session then ends for want of states
    queue_.emplace_back(Gone{vehicle, request});
  }
  queue_filled_.notify_one();
}

void Service::drain() {
  draining_.store(true, std::memory_order_relaxed);
  queue_filled_.notify_one();
}

void Service::on_heir(bool there) {
  if (!hand_over_) return;
  hand_over_->heir(there);
  {
    const std::lock_guard lock(queue_mutex_);
    if (stopping_) return;
    queue_.emplace_back(NewHeir{});
  }
  queue_filled_.notify_one();
}

void Service::on_leader(bool there, bool ours_first) {
  if (stand_by_) stand_by_->on_leader(there, ours_first);
}

void Service::on_record(const protocol::PilotRecord& record) {
  using Said = protocol::PilotRecord::Kind;
  if (record.kind == Said::kReady && hand_over_) return hand_over_->ready(record.vehicle, record.session);
  if (record.kind == Said::kTaken && hand_over_) {
    {
      const std::lock_guard lock(queue_mutex_);
      if (stopping_ || queue_.size() >= 2 * kMaxQueue) return;  // it is said again
      queue_.emplace_back(TakenAway{record.vehicle, record.session});
    }
    return queue_filled_.notify_one();
  }
  if (record.kind > Said::kOver || !stand_by_) return;
  const std::shared_ptr<pilot::Pilot> own = session_of(record.vehicle);
  if (!own || record.kind == Said::kOver) return stand_by_->on_record(record);
  // A leader that comes back to life writes down what is flown from here; of another client of that name, the session
  // here ends first.
  // One that no state came for is not flown from here: the vehicle has another server, and keeps ours as a spare.
  const bool flown = own->account().states_received.load(std::memory_order_relaxed) > 0;
  if (!flown || own->request().request != record.request) return;
  protocol::PilotRecord taken = record;
  taken.kind = Said::kTaken;
  taken.pilot.clear();
  taken.written = clock_->now();
  transport_->tell(taken);
}

void Service::on_leader_command(const protocol::ThrustRateCommand& command) {
  if (stand_by_) stand_by_->on_command(command);
}

void Service::set_profiles(Profiles profiles) {
  {
    const std::lock_guard lock(queue_mutex_);
    if (stopping_) return;
    queue_.emplace_back(std::move(profiles));
  }
  queue_filled_.notify_one();
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
  if (draining_.load(std::memory_order_relaxed) && hand_over_)
    for (const auto& pilot : pilots())
      if (hand_over_->is_ready(*pilot)) give_over(pilot);

  const Stamp now = clock_->now();
  std::vector<std::shared_ptr<pilot::Pilot>> all = pilots();
  for (const auto& pilot : all) {
    const auto limit = pilot->lockstep() ? options_.abandon_lockstep_after : options_.abandon_after;
    const auto silent = now - pilot->intake().last_heard();
    if (silent <= limit) continue;
    const std::string why = "no state came for " + text(seconds(limit)) + " s";
    end(pilot, why, Error("session ended: " + why, ErrorCode::kAbandoned));
  }
  std::erase_if(all, [this](const auto& pilot) { return session_of(pilot->vehicle()) != pilot; });
  tell(all, now);
  if (now >= next_figures_) {
    next_figures_ = now + options_.figures_period;
    make_figures(all, now);
  }
}

std::vector<std::shared_ptr<pilot::Pilot>> Service::pilots() const {
  std::vector<std::shared_ptr<pilot::Pilot>> all;
  const std::shared_lock lock(sessions_mutex_);
  for (const auto& [vehicle, pilot] : sessions_) all.push_back(pilot);
  return all;
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
  made->taken_over = taken_over_.load(std::memory_order_relaxed);
  made->handed_over = handed_over_.load(std::memory_order_relaxed);
  made->heir_there = hand_over_ && hand_over_->heir_there();
  made->stands_by_for = stand_by_ ? stand_by_->ready() : 0;
  for (const auto& pilot : pilots) {
    Figures::Vehicle& vehicle = made->vehicles.emplace_back();
    pilot->fill(now, &vehicle.telemetry);
    vehicle.silent_s = seconds(now - pilot->intake().last_heard());
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
    if (const auto complaints = pilot->complaints()) log::warn("vehicle " + pilot->vehicle() + ": " + *complaints);
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
    if (live && live->request().request == request.request) end(live, "it left");
    return;
  }
  if (live && live->request().request == request.request) return transport_->send(reply_to(*live));
  if (draining_.load(std::memory_order_relaxed)) {
    unsigned held = 0;
    if (drain_log_.admit(clock_->now(), &held))
      log::info("vehicle " + request.vehicle + ": not answered, the server is being drained" + and_others(held));
    return;
  }

  const Stamp now = clock_->now();
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

  // One that nobody hears of makes room. It ends only when the vehicle can have its place, and a planner, which takes
  // time to make, is only made when there is a place.
  std::shared_ptr<pilot::Pilot> giving_way;
  if (!live && sessions() >= static_cast<std::size_t>(options_.max_vehicles)) {
    {
      const std::shared_lock lock(sessions_mutex_);
      for (const auto& [vehicle, pilot] : sessions_)
        if (stale(*pilot) && (!giving_way || silent(*pilot) > silent(*giving_way))) giving_way = pilot;
    }
    if (!giving_way)
      return refuse(request, Error("the server flies " + std::to_string(sessions()) +
                                       " vehicles, which is its limit (--max-vehicles)",
                                   ErrorCode::kBusyServer));
  }
  auto parts = parts_for(request);
  if (!parts) return refuse(request, parts.failure());
  if (giving_way)
    end(giving_way, "its place was needed and no state came of late",
        Error("session ended: no state came and its place was needed", ErrorCode::kAbandoned));
  if (live) {
    log::info("vehicle " + request.vehicle + ": taken over by request " + std::to_string(request.request) +
              ", no state came for " + text(seconds(silent(*live))) + " s");
    detach(*live);
  }
  accept(std::move(parts).value());
}

/// Who stands by knows what was asked, and says nothing to it: but for what is flown from here already.
bool Service::left_to_the_leader(const Asked& asked) {
  const protocol::SessionRequest& request = asked.request;
  if (!stand_by_) return false;
  if (request.action == protocol::SessionRequest::Action::kLeave)
    stand_by_->on_gone(request.vehicle, request.request);
  else if (asked.verdict && protocol::validate(request))
    stand_by_->on_request(request);
  const auto own = session_of(request.vehicle);
  return stand_by_->holds_back() && !(own && own->request().request == request.request);
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
  serve(pilot, 0);
  ++sessions_begun_;
  const planner::Profile& profile = profiles_.at(request.profile);
  log::info(
      "vehicle " + request.vehicle + ": session " + std::to_string(pilot->session()) + ", profile " + profile.name +
      ", " + (pilot->lockstep() ? "lockstep" : "real time at " + text(profile.control_rate_hz) + " Hz") + ", " +
      std::to_string(request.course.waypoints.size()) + " waypoints, " + std::to_string(request.course.laps) + " laps");
  warn_of_openings(request);
}

/// Any thread.
void Service::serve(const std::shared_ptr<pilot::Pilot>& pilot, std::uint32_t take_overs) {
  {
    const std::unique_lock lock(sessions_mutex_);
    sessions_[pilot->vehicle()] = pilot;
  }
  if (hand_over_) hand_over_->begin(*pilot, take_overs);
  if (control_) {
    control_->add(pilot);
    perception_->add(pilot);
  }
  // Last: the first state may come as soon as the vehicle hears of it, and has to find somebody to wake.
  transport_->send(reply_to(*pilot));
}

/// On the stand-by's thread.
void Service::take_over(const StandBy::Taken& taken) {
  serve(taken.pilot, taken.take_overs);
  taken_over_.fetch_add(1, std::memory_order_relaxed);
}

/// The heir flies it from here on. The vehicle hears of it first, and takes the heir's first command at once then.
void Service::give_over(const std::shared_ptr<pilot::Pilot>& pilot) {
  {
    const std::unique_lock lock(sessions_mutex_);
    sessions_.erase(pilot->vehicle());
  }
  protocol::SessionReply reply = reply_to(*pilot);
  reply.code = ErrorCode::kLeaving;
  transport_->send(reply);
  detach(*pilot);
  hand_over_->give(pilot.get());
  transport_->forget(pilot->vehicle());
  told_.erase(pilot->vehicle());
  handed_over_.fetch_add(1, std::memory_order_relaxed);
  log::info("vehicle " + pilot->vehicle() + ": session " + std::to_string(pilot->session()) + " handed over");
}

/// The heir says that it flies the session. It may be wrong about why it had to, but the vehicle must have one pilot,
/// and takes the heir's commands as soon as ours stop.
void Service::let_go(const TakenAway& taken) {
  const std::shared_ptr<pilot::Pilot> pilot = session_of(taken.vehicle);
  if (!pilot || pilot->session() != taken.session) return;
  // One that never sent a state here heard our acceptance as a spare's.
  const bool spare = pilot->account().states_received.load(std::memory_order_relaxed) == 0;
  std::optional<Error> told;
  if (spare) told = Error("the vehicle is flown by another server", ErrorCode::kLeaving);
  end(pilot, "its stand-by flies it", told);
}

void Service::warn_of_openings(const protocol::SessionRequest& request) const {
  const double trained_m = options_.model_gate_inner_half_m;
  for (std::size_t i = 0; trained_m > 0.0 && i < request.course.waypoints.size(); ++i) {
    const double inner_half_m = request.course.waypoints[i].gate.inner_half_m;
    if (std::abs(inner_half_m - trained_m) <= 0.1 * trained_m) continue;
    log::warn("vehicle " + request.vehicle + ": course.waypoints[" + std::to_string(i) + "].gate.inner_half_m is " +
              text(inner_half_m) + ", the model was trained for " + text(trained_m) +
              ": expect a field that is off by the difference");
    break;
  }
}

void Service::refuse(const protocol::SessionRequest& request, const Error& why) {
  ++requests_refused_[index(why.code)];
  tell_no(request, why);
  unsigned held = 0;
  if (refusal_log_.admit(clock_->now(), &held))
    log::warn("vehicle " + request.vehicle + ": refused, " + why.message + and_others(held));
}

void Service::tell_no(const protocol::SessionRequest& request, const Error& why) {
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

void Service::end(const std::shared_ptr<pilot::Pilot>& pilot, const std::string& why,
                  const std::optional<Error>& told) {
  {
    const std::unique_lock lock(sessions_mutex_);
    const auto found = sessions_.find(pilot->vehicle());
    if (found != sessions_.end() && found->second == pilot) sessions_.erase(found);
  }
  detach(*pilot);
  if (hand_over_) hand_over_->over(*pilot);
  if (told) tell_no(pilot->request(), *told);
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
}

}  // namespace gatefield::service
