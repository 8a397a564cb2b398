#include "common/dds/server_listing.h"

#include <algorithm>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "common/base/clock.h"
#include "common/dds/convert.h"
#include "common/dds/participant.h"
#include "common/dds/reader.h"
#include "gatefield_idl/gatefieldPubSubTypes.h"

namespace gatefield::dds {
namespace {

using StatusReader = Reader<wire::ServerStatusPubSubType>;

constexpr std::chrono::milliseconds kPoll{20};

class Listing {
 public:
  Status open(std::uint32_t domain, const NetworkOptions& network) {
    if (!network.security.empty()) {
      auto read = read_credentials(network.security, {Role::kTool, ""});
      if (!read) return read.failure().within("", "network.");
      credentials_ = std::move(read).value();
    }
    TransportOptions transport;
    transport.network = network;
    auto participant = Participant::open(
        domain, "gatefield-tool", "gatefield-tool", transport, [](const PeerEvent&) {}, {}, {},
        credentials_ ? &*credentials_ : nullptr);
    if (auto s = keep(std::move(participant), &participant_); !s) return s;
    const StatusReader::Callbacks on_status{
        [this](wire::ServerStatus* sample, const Origin& origin) { hear(*sample, origin.participant); }, nullptr,
        [] {}};
    return keep(StatusReader::open(participant_.get(), Topic::kServerStatus, on_status), &reader_);
  }

  std::vector<protocol::ServerStatus> heard() const {
    std::vector<protocol::ServerStatus> servers;
    const std::lock_guard lock(mutex_);
    for (const auto& [name, status] : heard_) servers.push_back(status);
    return servers;
  }

 private:
  void hear(const wire::ServerStatus& sample, const ParticipantId& from) {
    protocol::ServerStatus status;
    if (!from_wire(sample, &status)) return;
    if (credentials_ && !bears(from, mark_of({Role::kServer, status.name}))) return;
    const std::lock_guard lock(mutex_);
    heard_[status.name] = std::move(status);
  }

  std::optional<Credentials> credentials_;
  mutable std::mutex mutex_;
  std::map<std::string, protocol::ServerStatus> heard_;
  std::unique_ptr<Participant> participant_;
  std::unique_ptr<StatusReader> reader_;  // last: goes first, and its callbacks with it
};

}  // namespace

Result<std::vector<protocol::ServerStatus>> list_servers(std::uint32_t domain, const NetworkOptions& network,
                                                         std::chrono::milliseconds wait,
                                                         const std::atomic<bool>* cancel) {
  Listing listing;
  if (auto opened = listing.open(domain, network); !opened) return opened.failure();
  const MonotonicClock clock;
  for (const Stamp deadline = clock.now() + wait; clock.now() < deadline && (cancel == nullptr || !*cancel);)
    std::this_thread::sleep_for(std::min<Stamp>(kPoll, deadline - clock.now()));
  return listing.heard();
}

}  // namespace gatefield::dds
