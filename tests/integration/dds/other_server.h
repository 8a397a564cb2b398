#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <thread>

#include "common/dds/record_convert.h"
#include "common/dds/server_endpoint.h"
#include "common/dds/writer.h"
#include "gatefield_idl/serversPubSubTypes.h"
#include "tests/integration/dds/attacked_flight.h"

/// Another server of the domain, and what somebody says to servers in a server's name.
namespace gatefield::dds {

/// Counts what it hears of other servers.
struct OtherServer : ServerHandler {
  void on_session_request(const protocol::SessionRequest&, const Status&) override {}
  void on_state(const protocol::VehicleState&) override {}
  void on_depth(protocol::DepthFrame&) override {}
  void on_vehicle_gone(const std::string&, std::uint64_t) override {}
  void on_rejected(Topic, const std::string&, const Error&) override {}
  void on_namesake(const ParticipantId&) override { ++namesakes; }
  void on_leader(const std::optional<ParticipantId>& leader, bool) override { leaders += leader ? 1 : 0; }
  void on_record(const protocol::PilotRecord&) override { ++records; }
  void on_leader_command(const protocol::ThrustRateCommand& command) override {
    ++(command.plan_step == kStrangersMark ? forged_commands : commands);
  }

  std::atomic<int> namesakes{0}, leaders{0}, records{0}, commands{0}, forged_commands{0};
};

inline bool within_5s(const std::function<bool()>& condition) {
  for (int i = 0; i < 500 && !condition(); ++i) std::this_thread::sleep_for(10ms);
  return condition();
}

inline protocol::PilotRecord record_of(const std::string& vehicle, std::uint64_t session, std::uint64_t request,
                                       protocol::PilotRecord::Kind kind) {
  protocol::PilotRecord record;
  record.vehicle = vehicle;
  record.session = session;
  record.request = request;
  record.kind = kind;
  if (kind <= protocol::PilotRecord::Kind::kHandOver) record.pilot = {1, 2, 3};
  return record;
}

inline void say(Writer<wire::PilotRecordPubSubType>* records, const protocol::PilotRecord& record,
                const ParticipantId& to) {
  records->write([&](wire::PilotRecord* sample) {
    to_wire(record, sample);
    sample->to() = to.bytes;
  });
}

inline void say(Writer<wire::ThrustRateCommandPubSubType>* commands, std::uint64_t session, std::uint64_t sequence) {
  protocol::ThrustRateCommand command = test::good_command("victim", 1000 + sequence);
  command.session = session;
  command.plan_step = kStrangersMark;
  commands->write([&](auto* sample) { to_wire(command, sample); });
}

}  // namespace gatefield::dds
