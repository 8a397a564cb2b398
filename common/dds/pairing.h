#pragma once

#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "common/dds/participant_id.h"

namespace gatefield::dds {

/// Which servers one has to do with, by name; empty: none.
struct PartnerNames {
  std::string heir = {};    ///< goes on with our sessions when we fall silent: one that says it stands by for us
  std::string leader = {};  ///< whose sessions we go on with when it falls silent
};

/// Who in the domain is our heir, and who our leader: the first participant that announces the name that we were told,
/// as long as it is there; then the next one. Who wasn't told of a heir has none, whatever anybody announces.
///
/// Two servers that stand by for each other are a pair of equals: each follows what the other one flies, and the one
/// whose name comes first in the alphabet serves those who want to join.
///
/// A server announces itself in its participant's user data: "gatefield-server:NAME:serving", and one that stands by
/// "gatefield-server:NAME:standby-of:LEADER".
///
/// Thread-safe: yes; a mutex is held for a comparison of names.
class Pairing {
 public:
  /// @param name  our own
  Pairing(std::string name, PartnerNames partners) : name_(std::move(name)), partners_(std::move(partners)) {}

  std::string announcement() const;
  /// The server that a participant says it is; empty: none.
  static std::string server_in(const std::string& announcement);
  /// Whether another participant that announces this has our name.
  bool is_namesake(const std::string& announcement) const;

  struct Change {
    bool heir = false, leader = false;  ///< is another one now, or none
  };
  Change appeared(const ParticipantId& peer, const std::string& announcement);
  Change gone(const ParticipantId& peer);

  /// @pre there is a leader: it stands by for us, too, and newcomers are ours
  bool goes_first() const;

  std::optional<ParticipantId> heir() const { return first(heirs_); }
  std::optional<ParticipantId> leader() const { return first(leaders_); }

 private:
  using Candidates = std::vector<ParticipantId>;  // in the order of their coming
  static bool add(Candidates* to, const ParticipantId& peer);
  static bool remove(Candidates* from, const ParticipantId& peer);
  std::optional<ParticipantId> first(const Candidates& of) const;

  const std::string name_;
  const PartnerNames partners_;
  mutable std::mutex mutex_;
  Candidates heirs_, leaders_;
  std::vector<ParticipantId> equals_;  // of the leaders, those that stand by for us
};

}  // namespace gatefield::dds
