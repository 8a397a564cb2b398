#include "server/service/stand_by.h"

#include <pthread.h>

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

#include "common/base/logging.h"
#include "common/base/text.h"

namespace gatefield::service {
namespace {

using Kind = protocol::PilotRecord::Kind;

constexpr std::size_t kMaxRequests = 1024;  // that an endpoint hears of, too
constexpr std::size_t kMaxStates = 1024;    // a second at the fastest rate that is expected
constexpr std::size_t kMaxCommands = 64;
constexpr std::chrono::microseconds kClocksDrift{100};  // from record to record, far more than two clocks do
constexpr std::chrono::seconds kSayReady{1};

template <typename T>
void keep_newest(std::deque<T>* kept, std::size_t most) {
  while (kept->size() > most) kept->pop_front();
}

}  // namespace

StandBy::StandBy(Parts parts)
    : parts_(std::move(parts)), waits_until_(parts_.clock->now() + kLeaderComes), looked_(parts_.clock->now()) {}

StandBy::~StandBy() { stop(); }

void StandBy::start() {
  thread_ = std::thread([this] { run(); });
}

void StandBy::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  news_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void StandBy::run() {
  pthread_setname_np(pthread_self(), "stand-by");
  for (;;) {
    {
      std::unique_lock lock(mutex_);
      news_.wait_for(lock, kLookEvery);
      if (stopping_) return;
    }
    look();
  }
}

bool StandBy::holds_back() const {
  const std::lock_guard lock(mutex_);
  if (fallen_ || ours_first_) return false;
  return leader_there_ || parts_.clock->now() < waits_until_;
}

std::size_t StandBy::ready() const {
  const std::lock_guard lock(mutex_);
  return static_cast<std::size_t>(
      std::count_if(followed_.begin(), followed_.end(), [](const auto& one) { return one.second.pilot != nullptr; }));
}

// ---- what comes -----------------------------------------------------------------------------------------------------

void StandBy::on_leader(bool there, bool ours_first) {
  {
    const std::lock_guard lock(mutex_);
    leader_there_ = there;
    ours_first_ = ours_first;
    if (there) fallen_ = false;
    waits_until_ = Stamp{0};
  }
  news_.notify_all();
}

void StandBy::on_request(const protocol::SessionRequest& request) {
  const std::lock_guard lock(mutex_);
  std::erase_if(requests_,
                [&](const auto& one) { return one.vehicle == request.vehicle && one.request == request.request; });
  requests_.push_back(request);
  keep_newest(&requests_, kMaxRequests);
}

void StandBy::on_gone(const std::string& vehicle, std::uint64_t request) {
  const std::lock_guard lock(mutex_);
  std::erase_if(requests_, [&](const auto& one) { return one.vehicle == vehicle && one.request == request; });
  const auto found = followed_.find(vehicle);
  if (found == followed_.end() || found->second.record.request != request || found->second.taking) return;
  if (found->second.pilot) over_.push_back(vehicle);
  followed_.erase(found);
}

void StandBy::on_record(const protocol::PilotRecord& record) {
  {
    const std::lock_guard lock(mutex_);
    const Stamp now = parts_.clock->now();
    fallen_ = false;
    auto found = followed_.find(record.vehicle);
    if (found != followed_.end() && found->second.taking) return;
    if (found != followed_.end() && (found->second.record.session != record.session || record.kind == Kind::kOver)) {
      if (found->second.pilot) over_.push_back(record.vehicle);
      followed_.erase(found);
      found = followed_.end();
    }
    if (record.kind == Kind::kOver) return;
    const bool fresh = found == followed_.end();
    Followed& followed = fresh ? followed_[record.vehicle] : found->second;
    const std::chrono::nanoseconds ahead = now - record.written;
    followed.clock_ahead = fresh ? ahead : std::min(followed.clock_ahead + kClocksDrift, ahead);
    followed.record = record;
    followed.record_came = now;
    followed.handed_over |= record.kind == Kind::kHandOver;
    if (!followed.handed_over) return;
  }
  news_.notify_all();
}

void StandBy::on_command(const protocol::ThrustRateCommand& command) {
  const std::lock_guard lock(mutex_);
  const auto found = followed_.find(command.vehicle);
  if (found == followed_.end() || found->second.taking || found->second.record.session != command.session) return;
  Followed& followed = found->second;
  followed.commanded = true;
  followed.quiet = std::chrono::nanoseconds{0};
  followed.commands.push_back(command);
  keep_newest(&followed.commands, kMaxCommands);
}

bool StandBy::on_state(const protocol::VehicleState& state) {
  const std::lock_guard lock(mutex_);
  const auto found = followed_.find(state.vehicle);
  if (found == followed_.end()) return false;
  Followed& followed = found->second;
  if (followed.taking || followed.record.session != state.session) return true;
  const Stamp now = parts_.clock->now();
  // One that was silent hears nothing either, and its leader first has to hear it again.
  if (followed.states.empty() || now - followed.states.back().came > kStatesCome)
    followed.quiet = std::chrono::nanoseconds{0};
  followed.states.push_back({state, now});
  keep_newest(&followed.states, kMaxStates);
  return true;
}

bool StandBy::on_depth(protocol::DepthFrame& frame) {
  const std::lock_guard lock(mutex_);
  const auto found = followed_.find(frame.vehicle);
  if (found == followed_.end()) return false;
  Followed& followed = found->second;
  if (followed.taking || followed.record.session != frame.session) return true;
  if (!followed.frame) followed.frame.emplace();
  std::swap(*followed.frame, frame);  // the buffer of the one before goes back
  followed.frame_came = parts_.clock->now();
  return true;
}

// ---- following ------------------------------------------------------------------------------------------------------

const protocol::SessionRequest* StandBy::request_of(const protocol::PilotRecord& record) const {
  const auto found = std::find_if(requests_.begin(), requests_.end(), [&](const auto& request) {
    return request.vehicle == record.vehicle && request.request == record.request;
  });
  return found == requests_.end() ? nullptr : &*found;
}

void StandBy::tend() {
  struct New {
    protocol::PilotRecord record;
    protocol::SessionRequest request;
    std::chrono::nanoseconds clock_ahead{0};
  };
  std::vector<New> fresh;
  std::vector<protocol::PilotRecord> ready;
  std::vector<std::string> over;
  {
    const std::lock_guard lock(mutex_);
    const Stamp now = parts_.clock->now();
    std::erase_if(followed_, [&](const auto& one) {
      const auto& [vehicle, followed] = one;
      if (followed.taking || now - followed.record_came < kForgotten) return false;
      if (followed.pilot) over_.push_back(vehicle);
      return true;
    });
    over.swap(over_);
    // Again and again: the leader may have lost sight of us since.
    if (now >= next_ready_) {
      next_ready_ = now + kSayReady;
      for (const auto& [vehicle, followed] : followed_)
        if (followed.pilot && !followed.taking) ready.push_back(followed.record);
    }
    int places = parts_.max_vehicles;
    for (const auto& [vehicle, followed] : followed_) places -= followed.pilot ? 1 : 0;
    for (const auto& [vehicle, followed] : followed_) {
      if (followed.pilot || followed.impossible || places <= 0 || parts_.flown(vehicle)) continue;
      const protocol::SessionRequest* const request = request_of(followed.record);
      if (request == nullptr) continue;  // the client's word comes by itself
      fresh.push_back({followed.record, *request, followed.clock_ahead});
      --places;
    }
  }
  for (const std::string& vehicle : over) parts_.forget(vehicle);
  for (const protocol::PilotRecord& one : ready) tell(one, Kind::kReady);
  for (const New& one : fresh) make_ready(one.record.vehicle, one.record, one.request, one.clock_ahead);
}

void StandBy::make_ready(const std::string& vehicle, const protocol::PilotRecord& record,
                         const protocol::SessionRequest& request, std::chrono::nanoseconds clock_ahead) {
  auto made = parts_.make(request, record);
  Status possible = made ? Status() : Status(made.failure());
  // What would not work later is found now.
  const std::string_view bytes(reinterpret_cast<const char*>(record.pilot.data()), record.pilot.size());
  if (possible) possible = made.value()->restore(bytes, clock_ahead);
  if (possible) possible = parts_.transport->follow(vehicle, record.request, made.value()->take_overs());
  bool kept = false;
  {
    const std::lock_guard lock(mutex_);
    const auto found = followed_.find(vehicle);
    if (found != followed_.end() && found->second.record.session == record.session) {
      found->second.impossible = !possible;
      if (possible) found->second.pilot = std::move(made).value();
      kept = true;
    } else if (possible) {
      over_.push_back(vehicle);
    }
  }
  if (!possible)
    log::warn("vehicle " + vehicle + ": can't stand by for it: " + possible.error());
  else if (kept)
    log::info("vehicle " + vehicle + ": stands by for session " + std::to_string(record.session));
  if (!possible || !kept) return;
  tell(record, Kind::kReady);
  news_.notify_all();  // it may have been handed over already
}

void StandBy::tell(const protocol::PilotRecord& of, Kind kind) {
  protocol::PilotRecord record;
  record.vehicle = of.vehicle;
  record.session = of.session;
  record.request = of.request;
  record.kind = kind;
  record.take_overs = of.take_overs + (kind == Kind::kTaken ? 1 : 0);
  record.written = parts_.clock->now();
  parts_.transport->tell(record);
}

// ---- taking over ----------------------------------------------------------------------------------------------------

bool StandBy::must_be_taken(const Followed& followed, Stamp now, std::string* why) const {
  if (!followed.pilot || followed.taking) return false;
  if (followed.handed_over) {
    *why = "its leader handed it over";
    return true;
  }
  const bool states_come = !followed.states.empty() && now - followed.states.back().came <= kStatesCome;
  if (!followed.commanded || !states_come) return false;
  if (!leader_there_) {
    *why = "its leader is gone";
    return true;
  }
  *why = "its leader sent no command for " + text(std::round(1e3 * seconds(followed.quiet))) + " ms";
  return followed.quiet >= kSilence;
}

void StandBy::look() {
  struct Due {
    std::string vehicle, why;
    Followed* followed;
  };
  std::vector<Due> due;
  {
    const std::lock_guard lock(mutex_);
    const Stamp now = parts_.clock->now();
    const auto awake = std::min<std::chrono::nanoseconds>(now - looked_, kAwake);
    looked_ = now;
    for (auto& [vehicle, followed] : followed_) {
      followed.quiet += awake;
      std::string why;
      if (!must_be_taken(followed, now, &why)) continue;
      followed.taking = true;  // stays where it is, and nobody else touches it
      fallen_ = true;
      due.push_back({vehicle, std::move(why), &followed});
    }
  }
  for (const Due& one : due) {
    take(one.vehicle, one.followed, one.why);
    const std::lock_guard lock(mutex_);
    followed_.erase(one.vehicle);
  }
}

void StandBy::take(const std::string& vehicle, Followed* followed, const std::string& why) {
  const Stamp begin = parts_.clock->now();
  pilot::Pilot& pilot = *followed->pilot;
  const auto& bytes = followed->record.pilot;
  const Status restored =
      pilot.restore({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, followed->clock_ahead);
  // It flies in any case: without the record it goes on at the gate that the states name.
  if (!restored) log::error("vehicle " + vehicle + ": the leader's record is not used: " + restored.error());
  for (const protocol::ThrustRateCommand& command : followed->commands) pilot.stepping().sent_elsewhere(command);
  const std::uint64_t known = pilot.intake().state().states.order.last_sequence();
  for (const State& one : followed->states)
    if (one.state.sequence > known) pilot.intake().take_state(one.state, one.came);
  if (followed->frame && followed->frame->sequence > pilot.intake().state().frames.order.last_sequence())
    pilot.intake().take_depth(*followed->frame, followed->frame_came);
  parts_.take_over({followed->pilot, why});
  tell(followed->record, Kind::kTaken);
  log::info("vehicle " + vehicle + ": takes over session " + std::to_string(pilot.session()) + ", " + why + " (" +
            text(std::round(1e4 * seconds(parts_.clock->now() - begin)) / 10) + " ms)");
}

}  // namespace gatefield::service
