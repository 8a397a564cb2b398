#include "common/dds/pairing.h"

#include <algorithm>
#include <string_view>

namespace gatefield::dds {
namespace {

// Who announces so under one name beyond these is not remembered.
constexpr std::size_t kMaxCandidates = 16;

constexpr std::string_view kServer = "gatefield-server:";

std::string server_named(const std::string& name) { return std::string(kServer) + name + ":"; }
std::string stands_by(const std::string& name, const std::string& leader) {
  return server_named(name) + "standby-of:" + leader;
}

}  // namespace

std::string Pairing::announcement() const {
  return partners_.leader.empty() ? server_named(name_) + "serving" : stands_by(name_, partners_.leader);
}

std::string Pairing::server_in(const std::string& announcement) {
  if (!announcement.starts_with(kServer)) return {};
  return announcement.substr(kServer.size(), announcement.find(':', kServer.size()) - kServer.size());
}

bool Pairing::is_namesake(const std::string& announcement) const {
  return announcement.starts_with(server_named(name_));
}

Pairing::Change Pairing::appeared(const ParticipantId& peer, const std::string& announcement) {
  const std::lock_guard lock(mutex_);
  Change change;
  if (!partners_.heir.empty() && announcement == stands_by(partners_.heir, name_)) change.heir = add(&heirs_, peer);
  if (!partners_.leader.empty() && announcement.starts_with(server_named(partners_.leader)))
    change.leader = add(&leaders_, peer);
  if (announcement == stands_by(partners_.leader, name_)) add(&equals_, peer);
  return change;
}

Pairing::Change Pairing::gone(const ParticipantId& peer) {
  const std::lock_guard lock(mutex_);
  remove(&equals_, peer);
  return {remove(&heirs_, peer), remove(&leaders_, peer)};
}

bool Pairing::goes_first() const {
  const std::lock_guard lock(mutex_);
  return !leaders_.empty() && name_ < partners_.leader &&
         std::find(equals_.begin(), equals_.end(), leaders_.front()) != equals_.end();
}

std::optional<ParticipantId> Pairing::first(const Candidates& of) const {
  const std::lock_guard lock(mutex_);
  return of.empty() ? std::nullopt : std::optional(of.front());
}

bool Pairing::add(Candidates* to, const ParticipantId& peer) {
  if (to->size() >= kMaxCandidates || std::find(to->begin(), to->end(), peer) != to->end()) return false;
  to->push_back(peer);
  return to->size() == 1;
}

bool Pairing::remove(Candidates* from, const ParticipantId& peer) {
  const auto found = std::find(from->begin(), from->end(), peer);
  if (found == from->end()) return false;
  const bool was_first = found == from->begin();
  from->erase(found);
  return was_first;
}

}  // namespace gatefield::dds
