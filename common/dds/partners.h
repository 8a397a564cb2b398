#pragma once

#include <functional>
#include <memory>
#include <string>

#include "common/dds/pairing.h"
#include "common/dds/participant.h"
#include "common/dds/reader.h"
#include "common/dds/sample_drops.h"
#include "common/dds/server_endpoint.h"
#include "common/dds/writer.h"
#include "gatefield_idl/gatefieldPubSubTypes.h"
#include "gatefield_idl/serversPubSubTypes.h"

/// Inside common/dds only.
namespace gatefield::dds {

/// What a server hears of its leader and its heir and tells them. Records and the leader's commands are taken from the
/// participants that Pairing adopted and from nobody else: what a leader says from ours, what an heir says from ours.
/// Opens nothing on the wire for a server that has neither.
/// Thread-safe: as ServerEndpoint.
class Partners {
 public:
  /// @param handler, drops  outlive this
  Partners(const std::string& name, const PartnerNames& names, ServerHandler* handler, SampleDrops* drops);

  const Pairing& pairing() const { return pairing_; }
  Status open(Participant* participant);
  /// Nothing is heard any more when this returns; what was told last is with the other one, or half a second passed.
  void close();

  /// @param may_bear  whether the participant may have this server's name
  void on_peer(const PeerEvent& event, const std::function<bool(const std::string& server)>& may_bear);
  /// Who goes on after us; all zero: nobody.
  protocol::ParticipantBytes heir() const;
  /// To the heir or to the leader, as the record's kind says. @return false: there is none, or the middleware refuses
  bool publish(const protocol::PilotRecord& record);
  /// Nothing more is said of this vehicle.
  void withdraw(const std::string& vehicle);

 private:
  using Records = Reader<wire::PilotRecordPubSubType>;
  using Commands = Reader<wire::ThrustRateCommandPubSubType>;

  Status listen();
  void on_record(const wire::PilotRecord& sample, const ParticipantId& from);
  void on_command(const wire::ThrustRateCommand& sample);

  const PartnerNames names_;
  Pairing pairing_;
  ServerHandler* const handler_;
  SampleDrops* const drops_;
  Participant* participant_ = nullptr;
  ParticipantId self_;

  // Each used by the callbacks of one reader only, which take turns.
  protocol::PilotRecord record_;
  protocol::ThrustRateCommand command_;

  std::unique_ptr<Writer<wire::PilotRecordPubSubType>> out_;
  std::unique_ptr<Records> in_;
  std::unique_ptr<Commands> commands_;
};

}  // namespace gatefield::dds
