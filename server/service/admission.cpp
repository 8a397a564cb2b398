// The part of the service that says who may join and who has to go: reads what the room needs to know, and does what
// it says.

#include <algorithm>
#include <string>
#include <utility>

#include "common/base/logging.h"
#include "common/base/text.h"
#include "server/service/processor_time.h"
#include "server/service/service.h"

namespace gatefield::service {
namespace {

using namespace std::chrono_literals;

constexpr std::chrono::nanoseconds kRoomPeriod = 250ms;
/// Refused for want of room: not before so long, and up to twice as long, so that not all come again at once.
constexpr double kRetryAfter_s = 1.0;
/// Sent away: what that brings shows first.
constexpr double kRetryAfterShed_s = 5.0;

double spread(double least_s, std::uint64_t number) {
  return least_s * (1.0 + static_cast<double>(number % 997) / 997.0);
}

bool racing(const protocol::PlannerHealth& health) {
  return !health.course_done && (health.lap > 0 || health.target_waypoint > 0);
}

}  // namespace

RoomOptions Service::room_options(const ServiceOptions& options) {
  return {options.utilisation, options.cores_usable > 0.0 ? options.cores_usable : usable_cores(),
          options.control_threads > 0 ? options.control_threads : default_control_threads(),
          options.perception_threads};
}

std::uint8_t Service::priority_of(const protocol::SessionRequest& request) const {
  return std::min(request.priority, options_.max_priority);
}

void Service::on_server_status(const protocol::ParticipantBytes& from, const protocol::ServerStatus& status) {
  neighbours_.hear(from, status, clock_->now());
}

protocol::ServerStatus Service::status() const {
  protocol::ServerStatus status;
  status.name = options_.name;
  status.accepts = !draining_.load(std::memory_order_relaxed) && !held_back();
  status.sessions = static_cast<std::uint32_t>(sessions());
  const bool full = status.sessions >= static_cast<std::uint32_t>(options_.max_vehicles);
  status.room_cores = full || !status.accepts ? 0.0 : std::min(room_.free(), protocol::kMaxRoom_cores);
  status.isa = options_.isa;
  status.model_hash = options_.model_hash;
  return status;
}

bool Service::left_to_others(const Asked& asked, Stamp now) {
  if (asked.waited) return false;
  const protocol::SessionRequest& request = asked.request;
  const auto waits = std::find_if(waiting_.begin(), waiting_.end(),
                                  [&](const Waiting& one) { return one.asked.request.vehicle == request.vehicle; });
  if (waits != waiting_.end() && waits->asked.request.request == request.request) return true;  // asks again
  const std::chrono::nanoseconds wait = neighbours_.wait(status(), now);
  if (waits != waiting_.end()) waiting_.erase(waits);
  constexpr std::size_t kMostWaiting = 256;
  if (wait <= 0ns || waiting_.size() >= kMostWaiting) return false;
  waiting_.push_back({asked, now + wait});
  waiting_.back().asked.waited = true;
  return true;
}

void Service::answer_those_that_waited(Stamp now) {
  std::vector<Waiting> due;
  const auto first =
      std::stable_partition(waiting_.begin(), waiting_.end(), [&](const Waiting& one) { return one.at > now; });
  due.assign(std::make_move_iterator(first), std::make_move_iterator(waiting_.end()));
  waiting_.erase(first, waiting_.end());
  for (const Waiting& one : due) answer(one.asked);
}

void Service::forget_waiting(const std::string& vehicle, std::uint64_t request) {
  std::erase_if(waiting_, [&](const Waiting& one) {
    return one.asked.request.vehicle == vehicle && one.asked.request.request == request;
  });
}

Room::Newcomer Service::newcomer(const protocol::SessionRequest& request) const {
  return {&profiles_.at(request.profile), request.camera.rate_hz, priority_of(request),
          request.timing == protocol::Timing::kRealTime, 0};
}

/// Who has to go so that this vehicle has a place; nobody when there is one.
/// @param live  its silent session of before, which it takes over
Result<std::vector<Service::Ending>> Service::place_for(const protocol::SessionRequest& request,
                                                        const pilot::Pilot* live, Stamp now) const {
  if (draining_.load(std::memory_order_relaxed))
    return Error("server " + options_.name + " takes no newcomers any more", ErrorCode::kBusyServer);
  std::vector<std::shared_ptr<pilot::Pilot>> all = pilots();
  std::vector<Ending> endings;
  std::size_t missing = 0;
  const auto most = static_cast<std::size_t>(options_.max_vehicles);
  if (live == nullptr && all.size() >= most) {
    missing = all.size() + 1 - most;
    // One that nobody hears of makes room before anybody else.
    const auto silent = [&](const auto& pilot) { return now - pilot->intake().last_heard(); };
    std::erase_if(all, [&](const auto& pilot) { return silent(pilot) <= options_.stale_after; });
    std::sort(all.begin(), all.end(), [&](const auto& a, const auto& b) { return silent(a) > silent(b); });
    for (; missing > 0 && endings.size() < all.size(); --missing)
      endings.push_back({all[endings.size()], "its place was needed and no state came of late",
                         Error("session ended: no state came and its place was needed", ErrorCode::kAbandoned), 0.0});
  }
  Room::Newcomer asks = newcomer(request);
  asks.places = missing;
  const Room::Answer answer = room_.ask(asks);
  if (!answer.fits)
    return Error(answer.why_not.empty() ? "the server flies " + std::to_string(sessions()) +
                                              " vehicles, which is its limit (--max-vehicles)"
                                        : answer.why_not,
                 ErrorCode::kBusyServer);
  for (const std::uint64_t session : answer.displaced)
    for (const auto& pilot : pilots())
      if (pilot->session() == session)
        endings.push_back({pilot, "vehicle " + request.vehicle + " of higher priority needs its place",
                           Error("session ended: a vehicle of higher priority needs its place", ErrorCode::kBusyServer),
                           spread(kRetryAfter_s, session)});
  return endings;
}

void Service::refuse_for_want_of_room(const protocol::SessionRequest& request, const Error& why) {
  refuse(request, why, spread(kRetryAfter_s, request.request));
}

void Service::watch_room(const std::vector<std::shared_ptr<pilot::Pilot>>& pilots, Stamp now) {
  if (now < next_room_) return;
  next_room_ = now + kRoomPeriod;
  std::vector<SessionReading> readings;
  for (const auto& pilot : pilots) {
    const pilot::Account& account = pilot->account();
    const auto value = [](const auto& counter) { return counter.load(std::memory_order_relaxed); };
    SessionReading& reading = readings.emplace_back();
    reading.session = pilot->session();
    reading.vehicle = pilot->vehicle();
    reading.profile = &pilot->stepping().planner().profile();
    reading.camera_rate_hz = pilot->request().camera.rate_hz;
    reading.priority = priority_of(pilot->request());
    reading.real_time = !pilot->lockstep();
    reading.heard = value(account.states_received) > value(account.states_rejected) &&
                    now - pilot->intake().last_heard() <= options_.stale_after;
    reading.racing = racing(pilot->health());
    reading.steps = account.steps.counts().all();
    reading.late = value(account.deadlines_missed);
    reading.narrow = value(account.ticks_narrow);
    reading.frames = value(account.frames_looked_at);
    reading.step_cpu = std::chrono::nanoseconds(value(account.step_cpu_ns));
    reading.look_cpu = std::chrono::nanoseconds(value(account.look_cpu_ns));
  }
  ServerReading server;
  if (control_) {
    const ControlPool::Spent spent = control_->spent();
    server = {processor_time_of_process(), spent.all, spent.helping, perception_->spent()};
  }
  room_.measure(now, readings, server);
  log_late_ticks(now);
  if (const auto shed = room_.shed(now))
    for (const auto& pilot : pilots)
      if (pilot->session() == shed->session) {
        ++sessions_shed_;
        log::warn("overload: vehicle " + pilot->vehicle() + " is sent away: " + shed->why);
        end(pilot, "overload", Error("session ended: " + shed->why, ErrorCode::kBusyServer),
            spread(kRetryAfterShed_s, shed->session));
      }
  transport_->tell_servers(status());
}

void Service::log_late_ticks(Stamp now) {
  const LateTicks& late = room_.late_ticks();
  unsigned held = 0;
  if (!late.closed() || !late_log_.admit(now, &held)) return;
  log::warn("deadlines: " + late.words() + ", the newest of vehicle " + room_.latest());
}

void Service::fill_room(Figures* figures) const {
  figures->room = {room_.most(), room_.taken(), room_.free(), {}};
  for (const auto& [name, profile] : profiles_)
    figures->room.cost_cores[name] = room_.cost_of(profile, default_camera().rate_hz).all();
  figures->sessions_shed = sessions_shed_;
  figures->sessions_displaced = sessions_displaced_;
}

}  // namespace gatefield::service
