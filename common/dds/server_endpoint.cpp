#include "common/dds/server_endpoint.h"

#include <algorithm>
#include <deque>
#include <mutex>
#include <optional>
#include <set>
#include <shared_mutex>
#include <string_view>
#include <thread>
#include <unordered_map>

#include "common/base/clock.h"
#include "common/dds/convert.h"
#include "common/dds/participant.h"
#include "common/dds/partners.h"
#include "common/dds/reader.h"
#include "common/dds/request_type.h"
#include "common/dds/sample_drops.h"
#include "common/dds/speakers.h"
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
using StatusWriter = Writer<wire::ServerStatusPubSubType>;
using StatusReader = Reader<wire::ServerStatusPubSubType>;

Error unreadable() { return Error("the sample is no sample of this topic's type"); }

// Refusals that are kept for clients that are slow to hear them.
constexpr std::size_t kKeptRefusals = 32;

Speakers::Instance instance_of(const Origin& origin) {
  Speakers::Instance instance;
  for (std::size_t i = 0; i < instance.size(); ++i) instance[i] = origin.instance.value[i];
  return instance;
}

class Server final : public ServerEndpoint {
 public:
  Server(std::string name, ServerHandler* handler, const TransportOptions& transport, const PartnerNames& partners)
      : name_(std::move(name)),
        handler_(handler),
        drops_(transport.on_samples_dropped),
        partners_(name_, partners, handler, &drops_) {}

  Status open(std::uint32_t domain, const TransportOptions& transport) {
    if (auto s = read_security(transport.network.security); !s) return s;
    auto participant = Participant::open(
        domain, "gatefield-server " + name_, partners_.pairing().announcement(), transport,
        [this](const PeerEvent& event) { on_peer(event); }, {},
        [this](const ParticipantId& from, std::uint32_t bytes) { return speakers_.may_send_fragments(from, bytes); },
        credentials_ ? &*credentials_ : nullptr);
    if (auto s = keep(std::move(participant), &participant_); !s) return s;

    // Writers first: an answer must be possible when the first request comes in.
    if (auto s = keep(ReplyWriter::open(participant_.get(), Topic::kSessionReply), &replies_); !s) return s;
    if (auto s = keep(TelemetryWriter::open(participant_.get(), Topic::kTelemetry), &telemetry_); !s) return s;
    if (auto s = keep(StatusWriter::open(participant_.get(), Topic::kServerStatus), &status_); !s) return s;

    const auto on_unreadable = [this](Topic topic) {
      return [this, topic] { handler_->on_rejected(topic, "", unreadable()); };
    };
    const auto admits = [this](Topic topic) {
      return [this, topic](std::string_view vehicle, const ParticipantId& from, std::size_t bytes) {
        return this->admits(topic, vehicle, from, bytes);
      };
    };
    StatusReader::Callbacks on_status{
        [this](wire::ServerStatus* sample, const Origin& origin) { this->on_status(*sample, origin); }, nullptr,
        on_unreadable(Topic::kServerStatus)};
    if (auto s = keep(StatusReader::open(participant_.get(), Topic::kServerStatus, on_status), &others_); !s) return s;
    StateReader::Callbacks on_state{[this](wire::VehicleState* sample, const Origin&) { this->on_state(*sample); },
                                    nullptr, on_unreadable(Topic::kVehicleState), admits(Topic::kVehicleState)};
    if (auto s = keep(StateReader::open(participant_.get(), Topic::kVehicleState, on_state), &states_); !s) return s;
    DepthReader::Callbacks on_depth{[this](wire::DepthFrame* sample, const Origin&) { this->on_depth(sample); },
                                    nullptr, on_unreadable(Topic::kDepthFrame), admits(Topic::kDepthFrame)};
    if (auto s = keep(DepthReader::open(participant_.get(), Topic::kDepthFrame, on_depth), &frames_); !s) return s;
    RequestReader::Callbacks on_request{
        [this](wire::SessionRequest* sample, const Origin& origin) { this->on_request(*sample, origin); },
        [this](const Origin& origin) { on_withdrawn(origin); }, on_unreadable(Topic::kSessionRequest),
        admits(Topic::kSessionRequest)};
    if (auto s = partners_.open(participant_.get()); !s) return s;
    return keep(RequestReader::open(participant_.get(), Topic::kSessionRequest, on_request), &requests_);
  }

  ~Server() override {
    // Nothing may call the handler any more; then tell the vehicles by withdrawing their replies.
    requests_.reset();
    frames_.reset();
    states_.reset();
    others_.reset();
    partners_.close();
    if (replies_) {
      for (const auto& [vehicle, writer] : commands_) replies_->withdraw(vehicle);
      if (!commands_.empty()) replies_->flush(200);
    }
    commands_.clear();
    replies_.reset();
    telemetry_.reset();
    status_.reset();
    participant_.reset();
  }

  Status publish(const protocol::SessionReply& reply) override {
    if (auto good = protocol::validate(reply); !good) return good.failure().within("session reply: ");
    if (!reply.accepted)
      forget_old_refusals(reply.vehicle);
    else if (auto followed = follow(reply.vehicle, reply.request, 0); !followed)
      return followed;
    // The writer keeps a limited number of vehicles apart, and a withdrawn one's place is free only when every client
    // has heard of it: after many short visits that takes a moment.
    for (int attempt = 0; attempt < 50; ++attempt) {
      if (replies_->write([&](wire::SessionReply* sample) {
            to_wire(reply, sample);
            if (reply.accepted) sample->heir() = partners_.heir();
          }))
        return {};
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return Error{"the reply to " + reply.vehicle + " could not be sent"};
  }

  Status follow(const std::string& vehicle, std::uint64_t request, std::uint32_t take_overs) override {
    if (auto opened = open_commands(vehicle, take_overs); !opened) return opened;
    speakers_.bind(vehicle, request);  // before it is heard of: the answer is a state
    return {};
  }

  bool publish(const protocol::PilotRecord& record) override { return partners_.publish(record); }

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

  bool publish(const protocol::ServerStatus& status) noexcept override {
    try {
      if (!protocol::validate(status).ok()) return false;
    } catch (...) {
      return false;
    }
    return status_->write([&](wire::ServerStatus* sample) { to_wire(status, sample); });
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
    speakers_.unbind(vehicle);
    partners_.withdraw(vehicle);
    replies_->withdraw(vehicle);
    telemetry_->withdraw(vehicle);
  }

 private:
  Status read_security(const std::string& folder) {
    if (folder.empty()) return {};
    auto read = read_credentials(folder, {Role::kServer, name_});
    if (!read) return read.failure().within("", "network.");
    credentials_ = std::move(read).value();
    return {};
  }

  /// In a closed domain the certificate has to be of a server of that name.
  bool may_bear(const ParticipantId& peer, const std::string& server) const {
    return !credentials_ || bears(peer, mark_of({Role::kServer, server}));
  }

  /// Of every sample that comes, before it is kept. A request whose name is none is told as one that was rejected.
  bool admits(Topic topic, std::string_view vehicle, const ParticipantId& from, std::size_t bytes) {
    const bool disposal = bytes == 0;
    if (!disposal && vehicle.empty()) {
      handler_->on_rejected(topic, "", unreadable());
      return false;
    }
    SampleFault fault = SampleFault::kNone;
    if (topic != Topic::kSessionRequest) {
      fault = speakers_.may_speak(from, vehicle, bytes, clock_.now());
    } else if (!disposal) {
      if (!protocol::is_name(vehicle)) {
        handler_->on_rejected(topic, "", protocol::validate_name("vehicle", std::string(vehicle)).failure());
        return false;
      }
      fault = credentials_ && !bears(from, mark_of({Role::kVehicle, std::string(vehicle)}))
                  ? SampleFault::kNotItsName
                  : speakers_.may_ask(from, vehicle, clock_.now());
    }
    if (fault != SampleFault::kNone && fault != SampleFault::kElsewhere) drops_.count(fault, topic, vehicle, from);
    return fault == SampleFault::kNone;
  }

  // The vehicle's command writer, if it has none yet. It is made without the lock: that takes the middleware a while,
  // and commands of the other vehicles go out meanwhile.
  Status open_commands(const std::string& vehicle, std::uint32_t strength) {
    {
      const std::shared_lock lock(commands_mutex_);
      if (commands_.contains(vehicle)) return {};
    }
    auto qos = writer_qos(Topic::kCommand, participant_->transport());
    qos.ownership_strength().value = strength;
    auto writer = CommandWriter::open(participant_.get(), topic_name(Topic::kCommand), qos, command_partition(vehicle));
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
      if (commands_.contains(oldest) || std::find(refused_.begin(), refused_.end(), oldest) != refused_.end()) return;
    }
    replies_->withdraw(oldest);
  }

  // Who announces our name may be an honest server or somebody who wants us away: we serve, and people are told.
  // Clients know servers apart by their participants.
  void on_peer(const PeerEvent& event) {
    partners_.on_peer(event, [this, &event](const std::string& server) { return may_bear(event.peer, server); });
    if (event.gone) return forget_peer(event.peer);
    if (!partners_.pairing().is_namesake(event.user_data) || !may_bear(event.peer, name_)) return;
    {
      const std::lock_guard lock(namesakes_mutex_);
      if (!namesakes_.insert(event.peer).second) return;  // is announced again and again
    }
    handler_->on_namesake(event.peer);
  }

  void forget_peer(const ParticipantId& peer) {
    {
      const std::lock_guard lock(namesakes_mutex_);
      namesakes_.erase(peer);
    }
    for (const Speakers::Claim& gone : speakers_.forget(peer))
      if (gone.number != 0) handler_->on_vehicle_gone(gone.vehicle, gone.number);
  }

  void on_withdrawn(const Origin& origin) {
    const auto gone = speakers_.release(origin.participant, instance_of(origin));
    if (gone && gone->number != 0) handler_->on_vehicle_gone(gone->vehicle, gone->number);
  }

  void on_request(const wire::SessionRequest& sample, const Origin& origin) {
    const Status verdict = from_wire(sample, &request_);
    if (!speakers_.claim(origin.participant, request_.vehicle, request_.request, instance_of(origin)))
      return drops_.count(SampleFault::kStranger, Topic::kSessionRequest, request_.vehicle, origin.participant);
    handler_->on_session_request(request_, verdict);
    // Has said so itself: that its request is withdrawn is no news then.
    if (request_.action == protocol::SessionRequest::Action::kLeave)
      speakers_.release(origin.participant, instance_of(origin));
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

  void on_status(const wire::ServerStatus& sample, const Origin& origin) {
    if (origin.participant == own_id()) return;
    const Status verdict = from_wire(sample, &other_);
    if (verdict.ok())
      handler_->on_server_status(origin.participant, other_);
    else
      reject(Topic::kServerStatus, "", verdict);
  }

  ParticipantId own_id() const { return id_of(participant_->raw()->guid().guidPrefix); }

  void reject(Topic topic, const std::string& vehicle, const Status& verdict) {
    const bool named = protocol::validate_name("vehicle", vehicle).ok();
    handler_->on_rejected(topic, named ? vehicle : std::string(), verdict.failure());
  }

  const std::string name_;
  ServerHandler* const handler_;
  const MonotonicClock clock_;
  std::optional<Credentials> credentials_;  // of a domain that is closed to strangers
  Speakers speakers_;
  SampleDrops drops_;
  Partners partners_;

  std::mutex namesakes_mutex_;
  std::set<ParticipantId> namesakes_;  // servers of our name

  std::unique_ptr<Participant> participant_;  // before readers and writers, which go first

  std::shared_mutex commands_mutex_;
  std::unordered_map<std::string, std::shared_ptr<CommandWriter>> commands_;
  std::deque<std::string> refused_;

  // Each used by the callbacks of one reader only, which take turns.
  protocol::SessionRequest request_;
  protocol::VehicleState state_;
  protocol::DepthFrame frame_;
  protocol::ServerStatus other_;

  std::unique_ptr<ReplyWriter> replies_;
  std::unique_ptr<TelemetryWriter> telemetry_;
  std::unique_ptr<StatusWriter> status_;
  std::unique_ptr<StatusReader> others_;
  std::unique_ptr<StateReader> states_;
  std::unique_ptr<DepthReader> frames_;
  std::unique_ptr<RequestReader> requests_;
};

}  // namespace

Result<std::unique_ptr<ServerEndpoint>> ServerEndpoint::create(std::uint32_t domain, const std::string& server_name,
                                                               ServerHandler* handler,
                                                               const TransportOptions& transport,
                                                               const PartnerNames& partners) {
  if (auto good = protocol::validate_name("server", server_name); !good) return good.failure();
  for (const std::string& partner : {partners.heir, partners.leader})
    if (auto good = protocol::validate_name("partner", partner); !partner.empty() && !good) return good.failure();
  auto server = std::make_unique<Server>(server_name, handler, transport, partners);
  if (auto opened = server->open(domain, transport); !opened) return opened.failure();
  return std::unique_ptr<ServerEndpoint>(std::move(server));
}

}  // namespace gatefield::dds
