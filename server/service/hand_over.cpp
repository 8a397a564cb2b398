#include "server/service/hand_over.h"

#include <pthread.h>

namespace gatefield::service {

using Kind = protocol::PilotRecord::Kind;

HandOver::~HandOver() { stop(); }

void HandOver::start(std::function<Pilots()> pilots, ControlPool* control, PerceptionPool* perception) {
  control_ = control;
  perception_ = perception;
  thread_ = std::thread([this, pilots = std::move(pilots)] { run(pilots); });
}

void HandOver::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void HandOver::run(const std::function<Pilots()>& pilots) {
  pthread_setname_np(pthread_self(), "hand-over");
  for (;;) {
    {
      std::unique_lock lock(mutex_);
      changed_.wait_for(lock, kPeriod, [this] { return stopping_; });
      if (stopping_) return;
      if (!heir_there_) continue;
    }
    follow(pilots());
  }
}

void HandOver::heir(bool there) {
  const std::lock_guard lock(mutex_);
  heir_there_ = there;
  for (auto& [vehicle, word] : words_) word.ready = false;
}

bool HandOver::heir_there() const {
  const std::lock_guard lock(mutex_);
  return heir_there_;
}

void HandOver::ready(const std::string& vehicle, std::uint64_t session) {
  const std::lock_guard lock(mutex_);
  const auto found = words_.find(vehicle);
  if (found != words_.end() && found->second.session == session) found->second.ready = true;
}

bool HandOver::is_ready(const pilot::Pilot& pilot) const {
  const std::lock_guard lock(mutex_);
  const auto found = words_.find(pilot.vehicle());
  return heir_there_ && found != words_.end() && found->second.session == pilot.session() && found->second.ready;
}

void HandOver::begin(const pilot::Pilot& pilot) {
  const std::lock_guard lock(mutex_);
  words_[pilot.vehicle()] = {pilot.session(), false};
}

protocol::PilotRecord HandOver::record_of(const pilot::Pilot& pilot, Kind kind) {
  protocol::PilotRecord record;
  record.vehicle = pilot.vehicle();
  record.session = pilot.session();
  record.request = pilot.request().request;
  record.kind = kind;
  record.take_overs = pilot.take_overs();
  return record;
}

void HandOver::follow(const Pilots& pilots) {
  for (const auto& pilot : pilots) {
    if (pilot->lockstep()) continue;
    std::string bytes;
    Stamp written{0};
    const auto save = [&] {
      written = clock_->now();
      bytes = pilot->save();
    };
    if (control_ == nullptr)
      save();
    else
      perception_->between_frames(pilot.get(), [&] { control_->between_steps(pilot.get(), save); });
    if (bytes.empty()) continue;  // it ended meanwhile
    protocol::PilotRecord record = record_of(*pilot, Kind::kFollow);
    record.written = written;
    record.pilot.assign(bytes.begin(), bytes.end());
    transport_->tell(record);
  }
}

void HandOver::give(pilot::Pilot* pilot) {
  protocol::PilotRecord record = record_of(*pilot, Kind::kHandOver);
  record.written = clock_->now();
  const std::string bytes = pilot->save();
  record.pilot.assign(bytes.begin(), bytes.end());
  transport_->tell(record);
}

void HandOver::over(const pilot::Pilot& pilot) {
  if (!pilot.lockstep() && heir_there()) transport_->tell(record_of(pilot, Kind::kOver));
  const std::lock_guard lock(mutex_);
  const auto found = words_.find(pilot.vehicle());
  if (found != words_.end() && found->second.session == pilot.session()) words_.erase(found);
}

}  // namespace gatefield::service
