// The part of the service that deals with its heir and its leader: what they say, and whose a vehicle is.

#include <memory>
#include <string>
#include <utility>

#include "common/base/logging.h"
#include "common/protocol/validate.h"
#include "server/service/service.h"

namespace gatefield::service {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t kMaxQueue = 512;
constexpr std::chrono::nanoseconds kHeard =
    200ms;  // since its newest state: five times what one takes to come, and more

}  // namespace

StandBy::Parts Service::stand_by_parts() {
  StandBy::Parts parts;
  parts.clock = clock_;
  parts.transport = transport_;
  parts.max_vehicles = options_.max_vehicles;
  parts.make = [this](const protocol::SessionRequest& request,
                      const protocol::PilotRecord& record) -> Result<std::shared_ptr<pilot::Pilot>> {
    if (const Status known = check_profile(request); !known) return known.failure();
    auto made = parts_for(request);
    if (!made) return made.failure();
    made.value().session = record.session;
    made.value().take_overs = record.take_overs + 1;
    return std::make_shared<pilot::Pilot>(std::move(made).value());
  };
  parts.flown = [this](const std::string& vehicle) { return session_of(vehicle) != nullptr; };
  parts.take_over = [this](const StandBy::Taken& taken) { take_over(taken); };
  parts.forget = [this](const std::string& vehicle) {
    if (!session_of(vehicle)) transport_->forget(vehicle);  // else it has joined here meanwhile
  };
  return parts;
}

// ---- from the transport ---------------------------------------------------------------------------------------------

void Service::on_heir(bool there) {
  if (!hand_over_) return;
  hand_over_->heir(there);
  enqueue(kMaxQueue, [] { return NewHeir{}; });
}

void Service::on_leader(bool there, bool ours_first) {
  if (stand_by_) stand_by_->on_leader(there, ours_first);
}

void Service::on_record(const protocol::PilotRecord& record) {
  using Said = protocol::PilotRecord::Kind;
  switch (record.kind) {
    case Said::kReady:
      if (hand_over_) hand_over_->ready(record.vehicle, record.session);
      return;
    case Said::kTaken:
      return taken_away(record);  // if it is lost, it is said again
    case Said::kFollow:
    case Said::kHandOver:
      if (stand_by_ && !is_ours(record)) stand_by_->on_record(record);
      return;
    case Said::kOver:
      if (stand_by_) stand_by_->on_record(record);
      return;
  }
}

void Service::taken_away(const protocol::PilotRecord& record) {
  enqueue(kMaxQueue, [&] { return TakenAway{record.vehicle, record.session, record.take_overs}; });
}

/// Two write down the same session when the one from whom it was taken comes back to life: whose it is says the number
/// of take-overs. Of two sessions of one vehicle the one that is heard has it, and the other one is a spare. He who
/// hasn't the vehicle hears of it, and lets go.
bool Service::is_ours(const protocol::PilotRecord& record) {
  const std::shared_ptr<pilot::Pilot> own = session_of(record.vehicle);
  if (!own) return false;
  if (own->request().request != record.request)
    return true;  // another client of that name: the session here ends first
  const bool same = own->session() == record.session;
  if (same && record.take_overs > own->take_overs()) {
    taken_away(record);
    return false;
  }
  if (!same && !heard(*own)) return true;
  protocol::PilotRecord taken = record;
  taken.kind = protocol::PilotRecord::Kind::kTaken;
  taken.take_overs = own->take_overs();
  taken.pilot.clear();
  taken.written = clock_->now();
  transport_->tell(taken);
  return true;
}

/// Its vehicle sends states, and they are ours.
bool Service::heard(const pilot::Pilot& pilot) const {
  const pilot::Account& account = pilot.account();
  return account.states_received.load(std::memory_order_relaxed) >
             account.states_rejected.load(std::memory_order_relaxed) &&
         clock_->now() - pilot.intake().last_heard() <= kHeard;
}

void Service::on_leader_command(const protocol::ThrustRateCommand& command) {
  if (stand_by_) stand_by_->on_command(command);
}

// ---- from whoever runs the server -----------------------------------------------------------------------------------

void Service::drain() {
  draining_.store(true, std::memory_order_relaxed);
  queue_filled_.notify_one();
}

// ---- whose a vehicle is ---------------------------------------------------------------------------------------------

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

/// On the stand-by's thread.
void Service::take_over(const StandBy::Taken& taken) {
  serve(taken.pilot);
  taken_over_.fetch_add(1, std::memory_order_relaxed);
}

void Service::give_over_those_that_can_be() {
  if (!hand_over_) return;
  for (const auto& pilot : pilots())
    if (hand_over_->is_ready(*pilot)) give_over(pilot);
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

/// Another server says that it flies the session, after one take-over more. It may be wrong about why it had to, but
/// the vehicle must have one pilot, and takes the heir's commands as soon as ours stop.
void Service::let_go(const TakenAway& taken) {
  const std::shared_ptr<pilot::Pilot> pilot = session_of(taken.vehicle);
  if (!pilot || pilot->session() != taken.session) return;
  const bool is_heard = heard(*pilot);
  if (is_heard && pilot->take_overs() >= taken.take_overs) return;
  // One of which no good state came heard our acceptance as a spare's.
  const pilot::Account& account = pilot->account();
  const bool spare = account.states_received.load(std::memory_order_relaxed) ==
                     account.states_rejected.load(std::memory_order_relaxed);
  std::optional<Error> told;
  if (spare) told = Error("the vehicle is flown by another server", ErrorCode::kLeaving);
  end(pilot, "its stand-by flies it", told);
}

void Service::fill_succession(Figures* figures) const {
  figures->taken_over = taken_over_.load(std::memory_order_relaxed);
  figures->handed_over = handed_over_.load(std::memory_order_relaxed);
  figures->heir_there = hand_over_ && hand_over_->heir_there();
  figures->stands_by_for = stand_by_ ? stand_by_->ready() : 0;
}

}  // namespace gatefield::service
