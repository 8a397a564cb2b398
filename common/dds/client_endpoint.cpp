#include "common/dds/client_endpoint.h"

#include <optional>

#include "common/dds/convert.h"
#include "common/dds/participant.h"
#include "common/dds/reader.h"
#include "common/dds/writer.h"
#include "gatefield_idl/gatefieldPubSubTypes.h"

namespace gatefield::dds {
namespace {

using ReplyReader = Reader<wire::SessionReplyPubSubType>;
using CommandReader = Reader<wire::ThrustRateCommandPubSubType>;
using TelemetryReader = Reader<wire::TelemetryPubSubType>;
using RequestWriter = Writer<wire::SessionRequestPubSubType>;
using StateWriter = Writer<wire::VehicleStatePubSubType>;
using DepthWriter = Writer<wire::DepthFramePubSubType>;

class Endpoint final : public ClientEndpoint {
 public:
  Endpoint(std::string vehicle, ClientHandler* handler) : vehicle_(std::move(vehicle)), handler_(handler) {}

  Status open(std::uint32_t domain, const TransportOptions& transport) {
    if (auto s = read_security(transport.network.security); !s) return s;
    auto participant = Participant::open(
        domain, "gatefield-client " + vehicle_, "gatefield-client:" + vehicle_, transport, [](const PeerEvent&) {}, {},
        {}, credentials_ ? &*credentials_ : nullptr);
    if (auto s = keep(std::move(participant), &participant_); !s) return s;

    const auto unreadable = [this](Topic topic) {
      return [this, topic] { handler_->on_rejected(topic, "the sample is no sample of this topic's type"); };
    };
    // Readers first: the answer to a request must find one. Replies and telemetry of all vehicles come by; only our own
    // are kept, so that a stranger's can't fill our places for them, nor our counters.
    const auto own = [this](std::string_view vehicle, const ParticipantId&, std::size_t) {
      return vehicle == vehicle_;
    };
    const auto ours = [this](std::string_view vehicle, const ParticipantId& from, std::size_t) {
      return vehicle == vehicle_ && handler_->hears(from);
    };
    ReplyReader::Callbacks on_reply_sample{[this](wire::SessionReply* sample, const Origin& origin) {
                                             receive<protocol::SessionReply>(
                                                 Topic::kSessionReply, *sample, &reply_,
                                                 [&](const auto& reply) { on_reply(reply, origin.participant); });
                                           },
                                           nullptr, unreadable(Topic::kSessionReply), own};
    if (auto s = keep(ReplyReader::open(participant_.get(), Topic::kSessionReply, on_reply_sample), &replies_); !s)
      return s;
    CommandReader::Callbacks on_command{[this](wire::ThrustRateCommand* sample, const Origin& origin) {
                                          receive<protocol::ThrustRateCommand>(
                                              Topic::kCommand, *sample, &command_, [&](const auto& command) {
                                                handler_->on_command(command, origin.participant);
                                              });
                                        },
                                        nullptr, unreadable(Topic::kCommand), ours};
    if (auto s = keep(CommandReader::open(participant_.get(), Topic::kCommand, on_command, command_partition(vehicle_)),
                      &commands_);
        !s)
      return s;
    TelemetryReader::Callbacks on_telemetry{[this](wire::Telemetry* sample, const Origin&) {
                                              receive<protocol::Telemetry>(
                                                  Topic::kTelemetry, *sample, &telemetry_,
                                                  [this](const auto& telemetry) { handler_->on_telemetry(telemetry); });
                                            },
                                            nullptr, unreadable(Topic::kTelemetry), ours};
    if (auto s = keep(TelemetryReader::open(participant_.get(), Topic::kTelemetry, on_telemetry), &telemetries_); !s)
      return s;

    if (auto s = keep(StateWriter::open(participant_.get(), Topic::kVehicleState), &states_); !s) return s;
    if (auto s = keep(DepthWriter::open(participant_.get(), Topic::kDepthFrame), &frames_); !s) return s;
    return keep(RequestWriter::open(participant_.get(), Topic::kSessionRequest), &requests_);
  }

  ~Endpoint() override {
    replies_.reset();
    commands_.reset();
    telemetries_.reset();
    if (requests_) {
      requests_->withdraw(vehicle_);
      requests_->flush(200);
    }
    requests_.reset();
    frames_.reset();
    states_.reset();
    participant_.reset();
  }

  Status publish(const protocol::SessionRequest& request) override {
    if (auto good = protocol::validate(request); !good) return good;
    if (auto own = is_own(request.vehicle); !own) return own;
    if (!requests_->write([&](wire::SessionRequest* sample) { to_wire(request, sample); }))
      return Error{"the session request of " + vehicle_ + " could not be sent"};
    return {};
  }

  bool publish(const protocol::VehicleState& state) override {
    return states_->write([&](wire::VehicleState* sample) { to_wire(state, sample); });
  }

  bool publish(protocol::DepthFrame& frame) override {
    return frames_->write(
        [&](wire::DepthFrame* sample) {
          header_to_wire(frame, sample);
          sample->pixels().swap(frame.pixels);
        },
        [&](wire::DepthFrame* sample) { sample->pixels().swap(frame.pixels); });
  }

 private:
  Status read_security(const std::string& folder) {
    if (folder.empty()) return {};
    auto read = read_credentials(folder, {Role::kVehicle, vehicle_});
    if (!read) return read.failure().within("", "network.");
    credentials_ = std::move(read).value();
    return {};
  }

  void on_reply(const protocol::SessionReply& reply, const ParticipantId& from) {
    if (!credentials_ || bears(from, mark_of({Role::kServer, reply.server}))) return handler_->on_reply(reply, from);
    handler_->on_rejected(Topic::kSessionReply,
                          "server is \"" + reply.server + "\", expected the name that its certificate has");
  }

  Status is_own(const std::string& vehicle) const {
    if (vehicle == vehicle_) return {};
    return Error{"vehicle is \"" + vehicle + "\", expected \"" + vehicle_ + "\", the name this endpoint was made for"};
  }

  template <typename Message, typename Sample, typename Deliver>
  void receive(Topic topic, const Sample& sample, Message* message, Deliver&& deliver) {
    const Status verdict = from_wire(sample, message);
    if (verdict.ok())
      deliver(*message);
    else
      handler_->on_rejected(topic, verdict.error());
  }

  const std::string vehicle_;
  ClientHandler* const handler_;
  std::optional<Credentials> credentials_;  // of a domain that is closed to strangers
  std::unique_ptr<Participant> participant_;

  // Each used by the callbacks of one reader only, which take turns.
  protocol::SessionReply reply_;
  protocol::ThrustRateCommand command_;
  protocol::Telemetry telemetry_;

  std::unique_ptr<ReplyReader> replies_;
  std::unique_ptr<CommandReader> commands_;
  std::unique_ptr<TelemetryReader> telemetries_;
  std::unique_ptr<RequestWriter> requests_;
  std::unique_ptr<StateWriter> states_;
  std::unique_ptr<DepthWriter> frames_;
};

}  // namespace

Result<std::unique_ptr<ClientEndpoint>> ClientEndpoint::create(std::uint32_t domain, const std::string& vehicle,
                                                               ClientHandler* handler,
                                                               const TransportOptions& transport) {
  if (auto good = protocol::validate_name("vehicle", vehicle); !good) return good.failure();
  auto endpoint = std::make_unique<Endpoint>(vehicle, handler);
  if (auto opened = endpoint->open(domain, transport); !opened) return opened.failure();
  return std::unique_ptr<ClientEndpoint>(std::move(endpoint));
}

}  // namespace gatefield::dds
