#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "common/base/clock.h"
#include "server/pilot/pilot.h"
#include "server/service/transport.h"
#include "server/service/workers.h"

namespace gatefield::service {

/// The leader's side of a hot stand-by: writes its pilots down for the heir, while they fly, and hands them over for
/// good. Lockstep sessions have no heir: nobody loses anything while a simulator waits.
///
/// While an heir is there, each pilot is written down every kPeriod, on a thread of its own: between two of its frames
/// and two of its steps, which wait for that as long as saving takes.
///
/// Thread-safe: yes.
class HandOver {
 public:
  static constexpr std::chrono::milliseconds kPeriod{50};
  using Pilots = std::vector<std::shared_ptr<pilot::Pilot>>;

  HandOver(const Clock* clock, Transport* transport) : clock_(clock), transport_(transport) {}
  ~HandOver();  ///< stop()

  /// @param pilots  those that fly now @param control, perception  serve them, and outlive stop()
  void start(std::function<Pilots()> pilots, ControlPool* control, PerceptionPool* perception);
  void stop();

  /// The heir is there from now on, or another one is, or none.
  void heir(bool there);
  bool heir_there() const;
  /// The heir could go on with this session.
  void ready(const std::string& vehicle, std::uint64_t session);
  bool is_ready(const pilot::Pilot& pilot) const;

  /// The session is flown from here.
  void begin(const pilot::Pilot& pilot);
  /// Writes these down for the heir. @pre start() or nobody serves them
  void follow(const Pilots& pilots);
  /// The heir's from here on. @pre nobody serves it any more
  void give(pilot::Pilot* pilot);
  /// The session has ended: the heir forgets it, too.
  void over(const pilot::Pilot& pilot);

 private:
  struct Word {
    std::uint64_t session = 0;
    bool ready = false;
  };
  static protocol::PilotRecord record_of(const pilot::Pilot& pilot, protocol::PilotRecord::Kind kind);
  void run(const std::function<Pilots()>& pilots);

  const Clock* const clock_;
  Transport* const transport_;
  ControlPool* control_ = nullptr;
  PerceptionPool* perception_ = nullptr;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool stopping_ = false;
  bool heir_there_ = false;
  std::map<std::string, Word> words_;  // by vehicle
  std::thread thread_;
};

}  // namespace gatefield::service
