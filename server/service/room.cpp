#include "server/service/room.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/base/text.h"

namespace gatefield::service {
namespace {

/// Averages forget within this time, s.
constexpr double kMemory_s = 1.0;
/// Fewer say nothing about what one costs.
constexpr std::uint64_t kEnough = 3;

std::string cores(double value) { return fixed(value, 2); }

}  // namespace

Room::Room(const RoomOptions& options, Costs costs)
    : options_(options),
      capacity_(capacity_of(options.utilisation > 0.0 ? options.utilisation : 1.0, options.cores,
                            options.control_threads, options.perception_threads)),
      costs_(std::move(costs)),
      most_(capacity_.all) {}

void Room::learn(const SessionReading& session, const SessionReading& before, double helped) {
  const std::uint64_t steps = session.steps - before.steps;
  if (steps >= kEnough)
    costs_.learn_step(*session.profile,
                      from_seconds(helped * seconds(session.step_cpu - before.step_cpu) / static_cast<double>(steps)));
  const std::uint64_t frames = session.frames - before.frames;
  if (frames >= kEnough) costs_.learn_look((session.look_cpu - before.look_cpu) / static_cast<std::int64_t>(frames));
}

void Room::measure(Stamp now, const std::vector<SessionReading>& sessions, const ServerReading& server) {
  const double passed_s = seconds(now - measured_at_);
  const bool first = measured_at_ == Stamp{0} || passed_s <= 0.0;
  const double weight = first ? 1.0 : 1.0 - std::exp(-passed_s / kMemory_s);

  std::map<std::uint64_t, History> kept;
  double own_s = 0.0;
  for (const SessionReading& session : sessions) {
    const auto found = histories_.find(session.session);
    History& history = kept[session.session];
    history = found != histories_.end() ? found->second : History{session, now, false, 0.0, 0.0};
    own_s += seconds(session.step_cpu - history.last.step_cpu);
  }
  // Nobody knows whose blocks helpers did: each step's part grows alike.
  const double helping_s = first ? 0.0 : seconds(server.helping - server_.helping);
  const double helped =
      own_s > 0.0 ? std::min(1.0 + helping_s / own_s, static_cast<double>(options_.control_threads)) : 1.0;

  if (!first) {
    const double other =
        seconds((server.process - server_.process) - (server.control_threads - server_.control_threads) -
                (server.perception_threads - server_.perception_threads)) /
        passed_s;
    other_ += weight * (std::max(0.0, other) - other_);
  }

  seats_.clear();
  LateTicks::Ticks ticks;
  std::uint64_t most_late = 0;
  std::size_t heard = 0, in_lockstep = 0;
  for (const SessionReading& session : sessions) {
    History& history = kept[session.session];
    const SessionReading before = std::exchange(history.last, session);
    if (session.heard && !before.heard) history.since = now;
    if (!first && passed_s > 0.0) {
      learn(session, before, helped);
      const double control = helped * seconds(session.step_cpu - before.step_cpu) / passed_s;
      const double perception = seconds(session.look_cpu - before.look_cpu) / passed_s;
      history.control += (history.measured ? weight : 1.0) * (control - history.control);
      history.perception += (history.measured ? weight : 1.0) * (perception - history.perception);
      history.measured = true;
    }
    if (session.real_time && session.heard) {
      const std::uint64_t late_now = session.late - before.late;
      ticks.all += session.steps - before.steps + late_now;
      ticks.late += late_now;
      ticks.narrow += session.narrow - before.narrow;
      if (late_now > most_late) {
        most_late = late_now;
        latest_ = session.vehicle;
      }
    }
    const bool young = now - history.since < kYoung;
    heard += session.heard ? 1 : 0;
    in_lockstep += session.real_time ? 0 : 1;
    if (!session.heard && !young) continue;
    Seat& seat = seats_.emplace_back();
    seat.session = session.session;
    seat.vehicle = session.vehicle;
    seat.priority = session.priority;
    seat.real_time = session.real_time;
    seat.racing = session.racing;
    seat.since = history.since;
    if (!session.real_time) continue;
    seat.need = {history.control, history.perception, 0.0};
    if (young) {
      const Need expected = costs_.of(*session.profile, session.camera_rate_hz);
      seat.need = {std::max(expected.control, seat.need.control), std::max(expected.perception, seat.need.perception),
                   expected.other};
    }
  }
  // Lockstep sends as fast as it is answered, and says nothing about what others will cost.
  if (!first && heard > 0 && in_lockstep == 0) costs_.learn_other(other_ / static_cast<double>(heard));
  late_ticks_.add(now, ticks);
  if (late_ticks_.closed())
    hold(now + kHold, std::max(taken(), kBlameless * capacity_.all));
  else if (!first && now >= held_until_)
    grow(passed_s);
  histories_ = std::move(kept);
  server_ = server;
  measured_at_ = now;
}

Need Room::load() const {
  Need load;
  for (const Seat& seat : seats_) load += seat.need;
  load.other += other_;
  return load;
}

void Room::hold(Stamp until, double taken) {
  if (!on()) return;
  most_ = std::min(most_, taken);
  held_until_ = std::max(held_until_, until);
}

void Room::grow(double passed_s) {
  most_ = std::min(capacity_.all, most_ + kGrowth_per_s * capacity_.all * passed_s);
  if (most_ < capacity_.all) return;
  shed_held_until_ = Stamp{0};
  hold_shed_ = kHoldShed;
}

double Room::left_by(const Need& load) const { return free_cores(capacity_, load) - (capacity_.all - most_); }

bool Room::closed() const {
  return taken() < kBlameless * capacity_.all ? late_ticks_.overloaded() : late_ticks_.closed();
}

double Room::free() const { return closed() && on() ? 0.0 : std::max(0.0, left_by(load())); }

double Room::taken() const {
  const Need taken = load();
  return taken.control + std::min(taken.perception, capacity_.perception) + taken.other;
}

std::string Room::occupied() const {
  const auto flying = std::count_if(seats_.begin(), seats_.end(), [](const Seat& seat) { return seat.real_time; });
  return "its " + std::to_string(flying) + (flying == 1 ? " vehicle takes " : " vehicles take ") + cores(taken()) +
         " of " + cores(most_) + " cores";
}

Room::Answer Room::ask(const Newcomer& newcomer) const {
  Answer answer;
  const auto flies = [](const Seat& seat) { return seat.real_time; };
  const bool judged = on() && newcomer.real_time && std::any_of(seats_.begin(), seats_.end(), flies);
  const Need need = costs_.of(*newcomer.profile, newcomer.camera_rate_hz);
  double lacking = 0.0;
  if (judged) {
    Need with = load();
    with += need;
    lacking = std::max(0.0, -left_by(with));
    if (closed()) lacking = std::max(lacking, need.all());  // it must not become more
  }
  if (lacking > 0.0 || newcomer.places > 0) {
    const auto going = displaced_by(seats_, newcomer.priority, lacking, newcomer.places);
    if (!going) {
      if (lacking <= 0.0) return answer;  // the caller knows why there is no place
      answer.why_not = "the server has no room: " + occupied() + ", profile " + newcomer.profile->name + " needs " +
                       cores(need.all());
      if (closed()) answer.why_not += ", and " + late_ticks_.words();
      return answer;
    }
    for (const std::size_t index : *going) answer.displaced.push_back(seats_[index].session);
  }
  answer.fits = true;
  return answer;
}

void Room::enter(const Newcomer& newcomer, std::uint64_t session, const std::string& vehicle, Stamp now) {
  SessionReading begun;
  begun.session = session;
  begun.vehicle = vehicle;
  histories_[session] = {begun, now, false, 0.0, 0.0};
  Seat seat{session, vehicle, newcomer.priority, newcomer.real_time, false, now, {}};
  if (newcomer.real_time) seat.need = costs_.of(*newcomer.profile, newcomer.camera_rate_hz);
  seats_.push_back(std::move(seat));
}

void Room::leave(std::uint64_t session) {
  std::erase_if(seats_, [session](const Seat& seat) { return seat.session == session; });
  histories_.erase(session);
}

std::optional<Room::Shed> Room::shed(Stamp now) {
  if (!on() || !late_ticks_.shed_due(now)) return std::nullopt;
  const auto next = shed_next(seats_);
  if (!next) return std::nullopt;
  const Seat& seat = seats_[*next];
  Shed shed{seat.session, late_ticks_.words() + ", and of " + std::to_string(seats_.size()) +
                              " vehicles this one has least priority or came last"};
  late_ticks_.shed(now);
  const bool on_the_way_back = shed_held_until_ > Stamp{0} && now >= shed_held_until_;
  if (on_the_way_back) hold_shed_ = std::min(2 * hold_shed_, kLongestHoldShed);
  shed_held_until_ = now + hold_shed_;
  hold(shed_held_until_, taken() - seat.need.all());
  return shed;
}

}  // namespace gatefield::service
