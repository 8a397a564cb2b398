#include "server/service/service.h"

#include <pthread.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>

#include "common/protocol/validate.h"

namespace gatefield::service {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t kLongestQueue = 256;
constexpr auto kHousekeepingPeriod = 50ms;
constexpr std::chrono::nanoseconds kLogPeriod = 1s;

/// Numbers of one server's life never meet those of another's: a client that missed a restart is told apart.
std::uint64_t random_session_base() {
  std::random_device device;
  return (std::uint64_t{device()} << 32 | std::uint64_t{device()}) & 0x7fff'ffff'ffff'0000ull;
}

std::string text(double value) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%g", value);
  return buffer;
}

}  // namespace

Service::Service(ServiceOptions options, Factories factories, const Clock* clock, Transport* transport)
    : options_(std::move(options)),
      factories_(std::move(factories)),
      clock_(clock),
      transport_(transport),
      first_session_(random_session_base()) {}

Service::~Service() { stop(); }

Status Service::start() {
  std::vector<std::unique_ptr<perception::DepthEncoder>> encoders;
  for (int i = 0; i < std::max(1, options_.perception_threads); ++i) {
    auto encoder = factories_.encoder();
    if (!encoder) return Error{encoder.error()};
    encoders.push_back(std::move(encoder).value());
  }
  const int threads = options_.control_threads > 0 ? options_.control_threads : default_control_threads();
  control_ = std::make_unique<ControlPool>(
      ControlPool::Options{threads, options_.realtime, options_.crew, options_.cores}, clock_, transport_);
  perception_ = std::make_unique<PerceptionPool>(std::move(encoders), [this](const Session& session) {
    if (session.lockstep()) control_->wake(&session);
  });
  housekeeper_ = std::thread([this] { run(); });
  return {};
}

void Service::stop() {
  {
    const std::lock_guard lock(queue_mutex_);
    if (stopped_) return;
    stopped_ = true;
    stopping_ = true;
  }
  leaving_.store(true, std::memory_order_relaxed);
  queue_filled_.notify_all();
  if (housekeeper_.joinable()) housekeeper_.join();
  // Vehicles hear of it before the threads end: their own fallback is then a matter of the reply, not of a time-out.
  std::map<std::string, std::shared_ptr<Session>> ending;
  {
    const std::unique_lock lock(sessions_mutex_);
    ending.swap(sessions_);
  }
  for (const auto& [vehicle, session] : ending) {
    detach(*session);
    tell_no(session->request(), "server " + options_.name + " is leaving");
  }
  if (control_) control_->stop();
  if (perception_) perception_->stop();
}

std::string Service::realtime_complaint() const { return control_ ? control_->complaint() : std::string(); }

// ---- from the transport ---------------------------------------------------------------------------------------------

void Service::on_request(const protocol::SessionRequest& request, const Status& verdict) {
  {
    const std::lock_guard lock(queue_mutex_);
    if (stopping_ || queue_.size() >= kLongestQueue) return;  // clients ask again when they hear nothing
    queue_.emplace_back(Asked{request, verdict});
  }
  queue_filled_.notify_one();
}

void Service::on_gone(const std::string& vehicle, std::uint64_t request) {
  {
    const std::lock_guard lock(queue_mutex_);
    if (stopping_ || queue_.size() >= 2 * kLongestQueue) return;  // the session then ends for want of states
    queue_.emplace_back(Gone{vehicle, request});
  }
  queue_filled_.notify_one();
}

void Service::on_state(const protocol::VehicleState& state) {
  const std::shared_ptr<Session> session = session_of(state.vehicle);
  if (!session) return stray(state.vehicle, "state");
  const Session::Intake intake = session->take_state(state);
  if (intake == Session::Intake::kRejected || !session->lockstep() || !control_) return;
  control_->wake(session.get());
  if (session->frame_due()) perception_->wake();
}

void Service::on_depth(protocol::DepthFrame& frame) {
  const std::shared_ptr<Session> session = session_of(frame.vehicle);
  if (!session) return stray(frame.vehicle, "depth");
  const Session::Intake intake = session->take_depth(frame);
  if (!control_) return;
  // In lockstep a step may be waiting for just this frame, which will not come again.
  if (intake == Session::Intake::kRejected && session->lockstep()) control_->wake(session.get());
  if (intake == Session::Intake::kTaken && session->frame_due()) perception_->wake();
}

void Service::on_rejected(Kind kind, const std::string& vehicle, const std::string& reason) {
  const std::shared_ptr<Session> session = vehicle.empty() ? nullptr : session_of(vehicle);
  if (session && kind == Kind::kState) return session->note_rejected_state(reason);
  if (session && kind == Kind::kDepth) return session->note_rejected_frame(reason);
  strays_.fetch_add(1, std::memory_order_relaxed);
  unsigned held = 0;
  if (stray_log_.admit(clock_->now(), &held))
    log::warn("dropped a sample: " + reason + (held ? " (and " + std::to_string(held) + " others)" : ""));
}

void Service::stray(const std::string& vehicle, const char* what) {
  strays_.fetch_add(1, std::memory_order_relaxed);
  unsigned held = 0;
  if (leaving_.load(std::memory_order_relaxed) || !stray_log_.admit(clock_->now(), &held)) return;
  log::warn(std::string("dropped a ") + what + " of \"" + vehicle + "\", which has no session here" +
            (held ? " (and " + std::to_string(held) + " others)" : ""));
}

std::shared_ptr<Session> Service::session_of(const std::string& vehicle) const {
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
  for (;;) {
    std::variant<Asked, Gone> item;
    {
      const std::lock_guard lock(queue_mutex_);
      if (queue_.empty()) break;
      item = std::move(queue_.front());
      queue_.pop_front();
    }
    if (const auto* const asked = std::get_if<Asked>(&item)) {
      answer(*asked);
    } else {
      const Gone& gone = std::get<Gone>(item);
      const std::shared_ptr<Session> session = session_of(gone.vehicle);
      if (session && session->request().request == gone.request) end(session, "its client is gone", "");
    }
  }

  const Stamp now = clock_->now();
  std::vector<std::shared_ptr<Session>> all;
  {
    const std::shared_lock lock(sessions_mutex_);
    for (const auto& [vehicle, session] : sessions_) all.push_back(session);
  }
  for (const auto& session : all) {
    const auto limit = session->lockstep() ? options_.abandon_lockstep_after : options_.abandon_after;
    const auto silent = now - session->last_heard();
    if (silent <= limit) continue;
    const std::string why = "no state came for " + text(seconds(limit)) + " s";
    end(session, why, "session ended: " + why);
  }
  if (now >= next_telemetry_) {
    next_telemetry_ = now + options_.telemetry_period;
    protocol::Telemetry telemetry;
    for (const auto& session : all) {
      if (session_of(session->vehicle()) != session) continue;
      session->fill(now, &telemetry);
      transport_->send(telemetry);
    }
  }
  if (now >= next_log_) {
    next_log_ = now + kLogPeriod;
    for (const auto& session : all)
      if (const auto text_of = session->rejections()) log::warn("vehicle " + session->vehicle() + ": " + *text_of);
  }
}

void Service::answer(const Asked& asked) {
  const protocol::SessionRequest& request = asked.request;
  if (!protocol::validate_name("vehicle", request.vehicle).ok()) {
    unsigned held = 0;
    if (refusal_log_.admit(clock_->now(), &held))
      log::warn("dropped a session request: " + protocol::validate_name("vehicle", request.vehicle).error());
    return;
  }
  if (!asked.verdict) return refuse(request, asked.verdict.error());
  if (const Status status = protocol::validate(request); !status) return refuse(request, status.error());

  std::shared_ptr<Session> live = session_of(request.vehicle);
  if (request.action == protocol::SessionRequest::Action::kLeave) {
    if (live && live->request().request == request.request) end(live, "it left", "");
    return;
  }
  if (live && live->request().request == request.request) return transport_->send(reply_to(*live));

  const Stamp now = clock_->now();
  const auto stale = [&](const Session& session) { return now - session.last_heard() > options_.stale_after; };
  if (live && !stale(*live))
    return refuse(request, "busy: vehicle \"" + request.vehicle + "\" has a session whose last state came " +
                               text(std::round(1e3 * seconds(now - live->last_heard()))) +
                               " ms ago, expected none for " + text(seconds(options_.stale_after)) +
                               " s before another client takes it over");
  const auto profile = options_.profiles.find(request.profile);
  if (profile == options_.profiles.end()) {
    std::string known;
    for (const auto& [name, unused] : options_.profiles) known += (known.empty() ? "" : ", ") + name;
    return refuse(request, "profile is \"" + request.profile + "\", expected one of: " + known);
  }
  auto planner = factories_.planner(profile->second, request);
  if (!planner) return refuse(request, planner.error());

  if (!live && sessions() >= static_cast<std::size_t>(options_.max_vehicles)) {
    // One that nobody hears of makes room.
    std::shared_ptr<Session> oldest;
    {
      const std::shared_lock lock(sessions_mutex_);
      for (const auto& [vehicle, session] : sessions_)
        if (stale(*session) && (!oldest || session->last_heard() < oldest->last_heard())) oldest = session;
    }
    if (!oldest)
      return refuse(request, "busy: the server flies " + std::to_string(sessions()) +
                                 " vehicles, which is its limit (--max-vehicles)");
    end(oldest, "its place was needed and no state came of late",
        "session ended: no state came and its place was needed");
  }
  if (live) {
    log::info("vehicle " + request.vehicle + ": taken over by request " + std::to_string(request.request) +
              ", no state came for " + text(seconds(now - live->last_heard())) + " s");
    detach(*live);
  }
  accept(request, profile->second, std::move(planner).value());
}

void Service::accept(const protocol::SessionRequest& request, const planner::Profile& profile,
                     std::unique_ptr<planner::Planner> planner) {
  SessionParts parts;
  parts.request = request;
  parts.id = first_session_ + ++sessions_made_;
  parts.planner = std::move(planner);
  parts.memory = factories_.memory(request);
  parts.sight = options_.sight;
  parts.isa = options_.isa;
  parts.clock = clock_;
  auto session = std::make_shared<Session>(std::move(parts));
  {
    const std::unique_lock lock(sessions_mutex_);
    sessions_[request.vehicle] = session;
  }
  transport_->send(reply_to(*session));
  if (control_) {
    perception_->add(session);
    control_->add(session);
  }
  log::info("vehicle " + request.vehicle + ": session " + std::to_string(session->id()) + ", profile " + profile.name +
            ", " + (session->lockstep() ? "lockstep" : "real time at " + text(profile.control_rate_hz) + " Hz") + ", " +
            std::to_string(request.course.waypoints.size()) + " waypoints, " + std::to_string(request.course.laps) +
            " laps");
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

void Service::refuse(const protocol::SessionRequest& request, const std::string& reason) {
  tell_no(request, reason);
  unsigned held = 0;
  if (refusal_log_.admit(clock_->now(), &held))
    log::warn("vehicle " + request.vehicle + ": refused, " + reason +
              (held ? " (and " + std::to_string(held) + " others)" : ""));
}

void Service::tell_no(const protocol::SessionRequest& request, const std::string& reason) {
  protocol::SessionReply reply;
  reply.vehicle = request.vehicle;
  reply.request = request.request;
  reply.accepted = false;
  reply.reason = reason.substr(0, protocol::kMaxReasonLength);
  reply.server = options_.name;
  transport_->send(reply);
}

protocol::SessionReply Service::reply_to(const Session& session) const {
  const planner::Profile& profile = options_.profiles.at(session.request().profile);
  protocol::SessionReply reply;
  reply.vehicle = session.vehicle();
  reply.request = session.request().request;
  reply.accepted = true;
  reply.server = options_.name;
  reply.session = session.id();
  reply.control_period_s = seconds(session.control_period());
  reply.plan_step_s = profile.step_s;
  reply.plan_steps = profile.steps;
  reply.model_hash = options_.model_hash;
  return reply;
}

void Service::end(const std::shared_ptr<Session>& session, const std::string& why, const std::string& told) {
  {
    const std::unique_lock lock(sessions_mutex_);
    const auto found = sessions_.find(session->vehicle());
    if (found != sessions_.end() && found->second == session) sessions_.erase(found);
  }
  detach(*session);
  if (!told.empty()) tell_no(session->request(), told);
  transport_->forget(session->vehicle());
  log::info("vehicle " + session->vehicle() + ": session " + std::to_string(session->id()) + " ended, " + why);
}

void Service::detach(const Session& session) {
  if (!control_) return;
  control_->remove(&session);
  perception_->remove(&session);
}

}  // namespace gatefield::service
