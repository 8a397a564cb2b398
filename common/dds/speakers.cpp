#include "common/dds/speakers.h"

#include <algorithm>
#include <utility>

namespace gatefield::dds {

bool Speakers::Allowance::take(double amount, double per_s, Stamp now) noexcept {
  left = std::min(per_s, left + per_s * seconds(now - since));
  since = now;
  if (left < amount) return false;
  left -= amount;
  return true;
}

Speakers::Asker* Speakers::asker(const ParticipantId& from, Stamp now) {
  const auto found = std::find_if(askers_.begin(), askers_.end(), [&](const Asker& one) { return one.from == from; });
  if (found != askers_.end()) return &*found;
  if (askers_.size() >= kMaxRemembered) return nullptr;
  askers_.push_back({from, {limits_.requests_per_s, now}, {limits_.bytes_per_s, now}});
  return &askers_.back();
}

Speakers::Claim* Speakers::find(const ParticipantId& from, std::string_view vehicle) {
  const auto found = std::find_if(claims_.begin(), claims_.end(),
                                  [&](const Claim& claim) { return claim.from == from && claim.vehicle == vehicle; });
  return found == claims_.end() ? nullptr : &*found;
}

SampleFault Speakers::may_ask(const ParticipantId& from, std::string_view vehicle, Stamp now) {
  const std::lock_guard lock(mutex_);
  Asker* const who = asker(from, now);
  if (who == nullptr) return SampleFault::kTooManyNames;
  if (!who->requests.take(1.0, limits_.requests_per_s, now)) return SampleFault::kTooOften;
  if (find(from, vehicle) != nullptr) return SampleFault::kNone;
  const auto names =
      std::count_if(claims_.begin(), claims_.end(), [&](const Claim& claim) { return claim.from == from; });
  if (static_cast<std::size_t>(names) >= limits_.names || claims_.size() >= kMaxRemembered)
    return SampleFault::kTooManyNames;
  claims_.push_back({from, std::string(vehicle), 0, {}});
  return SampleFault::kNone;
}

bool Speakers::claim(const ParticipantId& from, std::string_view vehicle, std::uint64_t number,
                     const Instance& instance) {
  const std::lock_guard lock(mutex_);
  const bool taken = number != 0 && std::any_of(claims_.begin(), claims_.end(), [&](const Claim& claim) {
                       return claim.vehicle == vehicle && claim.number == number && claim.from != from;
                     });
  if (Claim* const own = find(from, vehicle); own != nullptr) {
    own->instance = instance;
    if (!taken) own->number = number;
  }
  return !taken;
}

std::optional<Speakers::Claim> Speakers::release(const ParticipantId& from, const Instance& instance) {
  const std::lock_guard lock(mutex_);
  const auto found = std::find_if(claims_.begin(), claims_.end(),
                                  [&](const Claim& claim) { return claim.from == from && claim.instance == instance; });
  if (found == claims_.end()) return std::nullopt;
  Claim released = std::move(*found);
  claims_.erase(found);
  return released;
}

std::vector<Speakers::Claim> Speakers::forget(const ParticipantId& from) {
  const std::lock_guard lock(mutex_);
  std::erase_if(askers_, [&](const Asker& one) { return one.from == from; });
  const auto first =
      std::stable_partition(claims_.begin(), claims_.end(), [&](const Claim& claim) { return claim.from != from; });
  std::vector<Claim> gone(std::make_move_iterator(first), std::make_move_iterator(claims_.end()));
  claims_.erase(first, claims_.end());
  return gone;
}

void Speakers::bind(std::string_view vehicle, std::uint64_t number) {
  const std::lock_guard lock(mutex_);
  const auto found = std::find_if(claims_.begin(), claims_.end(), [&](const Claim& claim) {
    return claim.vehicle == vehicle && claim.number == number;
  });
  if (found == claims_.end()) return;
  auto [session, fresh] = sessions_.try_emplace(std::string(vehicle));
  if (fresh || session->second.owner != found->from) session->second = {found->from, {}};
}

void Speakers::unbind(std::string_view vehicle) {
  const std::lock_guard lock(mutex_);
  if (const auto found = sessions_.find(vehicle); found != sessions_.end()) sessions_.erase(found);
}

SampleFault Speakers::may_speak(const ParticipantId& from, std::string_view vehicle, std::size_t bytes, Stamp now) {
  const std::lock_guard lock(mutex_);
  const auto found = vehicle.empty() ? std::find_if(sessions_.begin(), sessions_.end(),
                                                    [&](const auto& session) { return session.second.owner == from; })
                                     : sessions_.find(vehicle);
  if (found == sessions_.end()) return find(from, vehicle) ? SampleFault::kElsewhere : SampleFault::kStranger;
  if (found->second.owner != from) return SampleFault::kStranger;
  Asker* const who = asker(from, now);
  const bool often = who == nullptr || !found->second.samples.take(1.0, limits_.samples_per_s, now);
  return often || !who->bytes.take(static_cast<double>(bytes), limits_.bytes_per_s, now) ? SampleFault::kTooOften
                                                                                         : SampleFault::kNone;
}

bool Speakers::may_send_fragments(const ParticipantId& from, std::uint32_t sample_bytes) const {
  if (sample_bytes <= limits_.fragmented_bytes) return true;
  const std::lock_guard lock(mutex_);
  return std::any_of(sessions_.begin(), sessions_.end(),
                     [&](const auto& session) { return session.second.owner == from; });
}

}  // namespace gatefield::dds
