#include "common/dds/server_endpoint.h"

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <map>
#include <mutex>
#include <shared_mutex>
#include <thread>
#include <unordered_map>
#include <vector>

#include "common/dds/convert.h"
#include "common/dds/participant.h"
#include "common/dds/reader.h"
#include "common/dds/request_type.h"
#include "common/dds/writer.h"
#include "gatefield_idl/gatefieldPubSubTypes.h"

namespace gatefield::dds {
namespace {

using RequestReader = Reader<wire::SessionRequestPubSubType, RequestType>;
using StateReader = Reader<wire::VehicleStatePubSubType>;
using DepthReader = Reader<wire::DepthFramePubSubType>;
using ReplyWriter = Writer<wire::SessionReplyPubSubType>;
using CommandWriter = Writer<wire::ThrustRateCommandPubSubType>;
using TelemetryWriter = Writer<wire::TelemetryPubSubType>;

// More requests than this from clients that never leave are not remembered (their going is not reported then).
constexpr std::size_t kMaxRemembered = 1024;

// Refusals that are kept for clients that are slow to hear them.
constexpr std::size_t kKeptRefusals = 32;

std::string announcement(const std::string& server, const char* phase) {
  return "gatefield-server:" + server + ":" + phase;
}

class Server final : public ServerEndpoint {
 public:
  Server(std::string name, ServerHandler* handler) : name_(std::move(name)), handler_(handler) {}

  Status open(std::uint32_t domain, const TransportOptions& transport) {
    auto participant = Participant::open(domain, "gatefield-server " + name_, announcement(name_, "starting"),
                                         transport, [this](const PeerEvent& event) { on_peer(event); });
    if (auto s = keep(std::move(participant), &participant_); !s) return s;
    if (auto alone = claim_name(domain); !alone) return alone;

    // Writers first: an answer must be possible when the first request comes in.
    if (auto s = keep(ReplyWriter::open(participant_.get(), Topic::kSessionReply), &replies_); !s) return s;
    if (auto s = keep(TelemetryWriter::open(participant_.get(), Topic::kTelemetry), &telemetry_); !s) return s;

    const auto unreadable = [this](Topic topic) {
      return [this, topic] { handler_->on_rejected(topic, "", Error("the sample is no sample of this topic's type")); };
    };
    StateReader::Callbacks on_state{[this](wire::VehicleState* sample, const Origin&) { this->on_state(*sample); },
                                    nullptr, unreadable(Topic::kVehicleState)};
    if (auto s = keep(StateReader::open(participant_.get(), Topic::kVehicleState, on_state), &states_); !s) return s;
    DepthReader::Callbacks on_depth{[this](wire::DepthFrame* sample, const Origin&) { this->on_depth(sample); },
                                    nullptr, unreadable(Topic::kDepthFrame)};
    if (auto s = keep(DepthReader::open(participant_.get(), Topic::kDepthFrame, on_depth), &frames_); !s) return s;
    RequestReader::Callbacks on_request{
        [this](wire::SessionRequest* sample, const Origin& origin) { this->on_request(*sample, origin); },
        [this](const Origin& origin) { on_withdrawn(origin); }, unreadable(Topic::kSessionRequest)};
    if (auto s = keep(RequestReader::open(participant_.get(), Topic::kSessionRequest, on_request), &requests_); !s)
      return s;
    return participant_->announce(announcement(name_, "serving"));
  }

  ~Server() override {
    // Nothing may call the handler any more; then tell the vehicles by withdrawing their replies.
    requests_.reset();
    frames_.reset();
    states_.reset();
    if (replies_) {
      for (const auto& [vehicle, writer] : commands_) replies_->withdraw(vehicle);
      if (!commands_.empty()) replies_->flush(200);
    }
    commands_.clear();
    replies_.reset();
    telemetry_.reset();
    participant_.reset();
  }

  Status publish(const protocol::SessionReply& reply) override {
    if (auto good = protocol::validate(reply); !good) return good.failure().within("session reply: ");
    if (!reply.accepted) {
      forget_old_refusals(reply.vehicle);
    } else if (auto opened = open_commands(reply.vehicle); !opened) {
      return opened;
    }
    // The writer keeps a limited number of vehicles apart, and a withdrawn one's place is free only when every client
    // has heard of it: after many short visits that takes a moment.
    for (int attempt = 0; attempt < 50; ++attempt) {
      if (replies_->write([&](wire::SessionReply* sample) { to_wire(reply, sample); })) return {};
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return Error{"the reply to " + reply.vehicle + " could not be sent"};
  }

  bool publish(const protocol::ThrustRateCommand& command) noexcept override {
    std::shared_ptr<CommandWriter> writer;
    {
      const std::shared_lock lock(commands_mutex_);
      const auto found = commands_.find(command.vehicle);
      if (found == commands_.end()) return false;
      writer = found->second;
    }
    // A refusal builds a sentence and may throw for want of memory; both mean that the command does not go out.
    try {
      if (!protocol::validate(command).ok()) return false;
    } catch (...) {
      return false;
    }
    return writer->write([&](wire::ThrustRateCommand* sample) { to_wire(command, sample); });
  }

  bool publish(const protocol::Telemetry& telemetry) noexcept override {
    try {
      if (!protocol::validate(telemetry).ok()) return false;
    } catch (...) {
      return false;
    }
    return telemetry_->write([&](wire::Telemetry* sample) { to_wire(telemetry, sample); });
  }

  void drop_vehicle(const std::string& vehicle) override {
    std::shared_ptr<CommandWriter> writer;  // goes outside the lock, and after a publish() that still uses it
    {
      const std::unique_lock lock(commands_mutex_);
      const auto found = commands_.find(vehicle);
      if (found == commands_.end()) return;
      writer = std::move(found->second);
      commands_.erase(found);
    }
    replies_->withdraw(vehicle);
    telemetry_->withdraw(vehicle);
  }

 private:
  enum class Phase { kStarting, kServing };

  struct Request {
    ParticipantId participant;
    eprosima::fastrtps::rtps::InstanceHandle_t instance;
    std::string vehicle;
    std::uint64_t number = 0;
  };

  // Of several servers of one name only one may answer. Everyone announces "starting", listens, and gives way to a
  // server that serves already, and to one that starts too and has the smaller GUID.
  Status claim_name(std::uint32_t domain) {
    const ParticipantId own = participant_->id();
    const auto must_yield = [&] {
      return std::any_of(peers_.begin(), peers_.end(),
                         [&](const auto& peer) { return peer.second == Phase::kServing || peer.first < own; });
    };
    std::unique_lock lock(peers_mutex_);
    // A serving peer decides at once; a starting one may only be a passer-by until it serves, so those are judged at
    // the end.
    peers_changed_.wait_for(lock, kDiscoveryWait, [&] {
      return std::any_of(peers_.begin(), peers_.end(), [](const auto& peer) { return peer.second == Phase::kServing; });
    });
    if (must_yield())
      return Error{"a server named \"" + name_ + "\" is already in domain " + std::to_string(domain) +
                   ", expected a name of its own for each server (or another domain)"};
    claimed_ = true;
    return {};
  }

  // The vehicle's command writer, if it has none yet. It is made without the lock: that takes the middleware a while,
  // and commands of the other vehicles go out meanwhile.
  Status open_commands(const std::string& vehicle) {
    {
      const std::shared_lock lock(commands_mutex_);
      if (commands_.count(vehicle) != 0) return {};
    }
    auto writer = CommandWriter::open(participant_.get(), Topic::kCommand, command_partition(vehicle));
    if (!writer.ok()) return writer.failure();
    std::shared_ptr<CommandWriter> made = std::move(writer).value();
    const std::unique_lock lock(commands_mutex_);
    commands_.try_emplace(vehicle, std::move(made));
    return {};
  }

  // A refusal stays with the writer, as every reply does, but no drop_vehicle() ends it. Kept are the newest few.
  void forget_old_refusals(const std::string& vehicle) {
    std::string oldest;
    {
      const std::unique_lock lock(commands_mutex_);
      refused_.push_back(vehicle);
      if (refused_.size() <= kKeptRefusals) return;
      oldest = std::move(refused_.front());
      refused_.pop_front();
      // It may have been accepted, or refused once more, since then.
      if (commands_.count(oldest) != 0 || std::find(refused_.begin(), refused_.end(), oldest) != refused_.end()) return;
    }
    replies_->withdraw(oldest);
  }

  void on_peer(const PeerEvent& event) {
    if (event.gone) {
      forget_peer(event.peer);
      return;
    }
    const bool starting = event.user_data == announcement(name_, "starting");
    const bool serving = event.user_data == announcement(name_, "serving");
    if (!starting && !serving) return;
    bool clash = false;
    {
      const std::lock_guard lock(peers_mutex_);
      peers_[event.peer] = serving ? Phase::kServing : Phase::kStarting;
      clash = claimed_ && serving;
    }
    peers_changed_.notify_all();
    // Two networks that were apart have met: nobody can tell who was first, so people have to.
    if (clash)
      handler_->on_rejected(Topic::kSessionReply, "",
                            Error("another server named \"" + name_ + "\" appeared in this domain; stop one of them"));
  }

  void forget_peer(const ParticipantId& peer) {
    std::vector<Request> gone;
    {
      const std::lock_guard lock(peers_mutex_);
      peers_.erase(peer);
    }
    peers_changed_.notify_all();
    {
      const std::lock_guard lock(remembered_mutex_);
      const auto first = std::stable_partition(remembered_.begin(), remembered_.end(),
                                               [&](const Request& r) { return !(r.participant == peer); });
      gone.assign(first, remembered_.end());
      remembered_.erase(first, remembered_.end());
    }
    for (const Request& request : gone) handler_->on_vehicle_gone(request.vehicle, request.number);
  }

  void on_withdrawn(const Origin& origin) {
    Request gone;
    {
      const std::lock_guard lock(remembered_mutex_);
      const auto found = std::find_if(remembered_.begin(), remembered_.end(), [&](const Request& r) {
        return r.participant == origin.participant && r.instance == origin.instance;
      });
      if (found == remembered_.end()) return;  // someone else's withdrawal, or it left before
      gone = *found;
      remembered_.erase(found);
    }
    handler_->on_vehicle_gone(gone.vehicle, gone.number);
  }

  void on_request(const wire::SessionRequest& sample, const Origin& origin) {
    const Status verdict = from_wire(sample, &request_);
    if (const auto name = protocol::validate_name("vehicle", request_.vehicle); !name) {
      handler_->on_rejected(Topic::kSessionRequest, "", name.failure());
      return;
    }
    if (verdict.ok()) remember(origin);
    handler_->on_session_request(request_, verdict);
  }

  void remember(const Origin& origin) {
    const std::lock_guard lock(remembered_mutex_);
    const auto found = std::find_if(remembered_.begin(), remembered_.end(), [&](const Request& r) {
      return r.participant == origin.participant && r.instance == origin.instance;
    });
    if (request_.action == protocol::SessionRequest::Action::kLeave) {
      if (found != remembered_.end()) remembered_.erase(found);  // has said so itself
    } else if (found != remembered_.end()) {
      found->number = request_.request;
    } else if (remembered_.size() < kMaxRemembered) {
      remembered_.push_back({origin.participant, origin.instance, request_.vehicle, request_.request});
    }
  }

  void on_state(const wire::VehicleState& sample) {
    const Status verdict = from_wire(sample, &state_);
    if (verdict.ok())
      handler_->on_state(state_);
    else
      reject(Topic::kVehicleState, state_.vehicle, verdict);
  }

  void on_depth(wire::DepthFrame* sample) {
    const Status verdict = from_wire(sample, &frame_);
    if (verdict.ok())
      handler_->on_depth(frame_);
    else
      reject(Topic::kDepthFrame, frame_.vehicle, verdict);
    frame_.pixels.swap(sample->pixels());  // the buffer goes back to where the next image is read into
  }

  void reject(Topic topic, const std::string& vehicle, const Status& verdict) {
    const bool named = protocol::validate_name("vehicle", vehicle).ok();
    handler_->on_rejected(topic, named ? vehicle : std::string(), verdict.failure());
  }

  const std::string name_;
  ServerHandler* const handler_;
  std::unique_ptr<Participant> participant_;

  std::mutex peers_mutex_;
  std::condition_variable peers_changed_;
  std::map<ParticipantId, Phase> peers_;  // servers of our name
  bool claimed_ = false;

  std::mutex remembered_mutex_;
  std::vector<Request> remembered_;

  std::shared_mutex commands_mutex_;
  std::unordered_map<std::string, std::shared_ptr<CommandWriter>> commands_;
  std::deque<std::string> refused_;

  // Each used by the callbacks of one reader only, which take turns.
  protocol::SessionRequest request_;
  protocol::VehicleState state_;
  protocol::DepthFrame frame_;

  std::unique_ptr<ReplyWriter> replies_;
  std::unique_ptr<TelemetryWriter> telemetry_;
  std::unique_ptr<StateReader> states_;
  std::unique_ptr<DepthReader> frames_;
  std::unique_ptr<RequestReader> requests_;
};

}  // namespace

Result<std::unique_ptr<ServerEndpoint>> ServerEndpoint::create(std::uint32_t domain, const std::string& server_name,
                                                               ServerHandler* handler,
                                                               const TransportOptions& transport) {
  if (auto good = protocol::validate_name("server", server_name); !good) return good.failure();
  auto server = std::make_unique<Server>(server_name, handler);
  if (auto opened = server->open(domain, transport); !opened) return opened.failure();
  return std::unique_ptr<ServerEndpoint>(std::move(server));
}

}  // namespace gatefield::dds
