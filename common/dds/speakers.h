#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/clock.h"
#include "common/dds/participant_id.h"
#include "common/dds/sample_fault.h"

namespace gatefield::dds {

/// What one participant may take of a server.
struct SpeakerLimits {
  std::size_t names = 8;                      ///< vehicles that it asks for at the same time
  double requests_per_s = 100;                ///< requests; as many may come at once
  double samples_per_s = 4'000;               ///< states and depth frames of a vehicle with a session; as many at once
  double bytes_per_s = 1e9;                   ///< of those, of all its vehicles together; as many at once
  std::uint32_t fragmented_bytes = 64 << 10;  ///< size of a sample in fragments, of one without a session
};
/// Requests that a server remembers, of all participants together.
inline constexpr std::size_t kMaxRemembered = 1024;

/// Who may speak for which vehicle: a session is bound to the participant that asked for it. States, depth and goodbyes
/// of any other are strangers', and so is a request whose number is another participant's. Knows nothing of DDS but
/// what a participant is called.
///
/// A request is asked for (may_ask()), claimed once it was read (claim()), and its session bound when it is accepted
/// (bind()). Numbers are drawn at random, so whoever says one first has drawn it.
///
/// Thread-safe: yes; a mutex is held for a search among those who are there.   Real-time safe: no. may_ask() allocates
/// for a new name only, the other questions don't.
class Speakers {
 public:
  using Instance = std::array<std::uint8_t, 16>;  ///< of a request, as the middleware names it when it is withdrawn
  struct Claim {
    ParticipantId from;
    std::string vehicle;
    std::uint64_t number = 0;  ///< 0: not read yet
    Instance instance{};
  };
  explicit Speakers(const SpeakerLimits& limits = {}) : limits_(limits) {}

  // ---- requests
  SampleFault may_ask(const ParticipantId& from, std::string_view vehicle, Stamp now);
  /// @return false: the number was another participant's before
  bool claim(const ParticipantId& from, std::string_view vehicle, std::uint64_t number, const Instance& instance);
  /// The request is withdrawn. @return what it was; empty: somebody else's, or not heard of
  std::optional<Claim> release(const ParticipantId& from, const Instance& instance);
  /// The participant is gone. @return its requests
  std::vector<Claim> forget(const ParticipantId& from);

  // ---- sessions
  /// The vehicle's session is that of this request, and of who claimed it.
  void bind(std::string_view vehicle, std::uint64_t number);
  void unbind(std::string_view vehicle);
  /// @param vehicle  empty: any of its own
  SampleFault may_speak(const ParticipantId& from, std::string_view vehicle, std::size_t bytes, Stamp now);
  bool may_send_fragments(const ParticipantId& from, std::uint32_t sample_bytes) const;

 private:
  /// So much a second, and no more at once than in a second.
  struct Allowance {
    double left = 0.0;
    Stamp since{0};
    bool take(double amount, double per_s, Stamp now) noexcept;
  };
  struct Asker {
    ParticipantId from;
    Allowance requests, bytes;
  };
  struct Session {
    ParticipantId owner;
    Allowance samples;
  };
  Asker* asker(const ParticipantId& from, Stamp now);
  Claim* find(const ParticipantId& from, std::string_view vehicle);

  const SpeakerLimits limits_;
  mutable std::mutex mutex_;
  std::vector<Claim> claims_;
  std::vector<Asker> askers_;
  std::map<std::string, Session, std::less<>> sessions_;  // by vehicle
};

}  // namespace gatefield::dds
