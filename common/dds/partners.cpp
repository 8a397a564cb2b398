#include "common/dds/partners.h"

#include <utility>

#include "common/dds/convert.h"
#include "common/dds/record_convert.h"

namespace gatefield::dds {
namespace {

constexpr int kLastWords_ms = 500;

bool to_leader(protocol::PilotRecord::Kind kind) {
  return kind == protocol::PilotRecord::Kind::kReady || kind == protocol::PilotRecord::Kind::kTaken;
}

}  // namespace

Partners::Partners(const std::string& name, const PartnerNames& names, ServerHandler* handler, SampleDrops* drops)
    : names_(names), pairing_(name, names), handler_(handler), drops_(drops) {}

Status Partners::open(Participant* participant) {
  participant_ = participant;
  self_ = id_of(participant->raw()->guid().guidPrefix);
  if (names_.heir.empty() && names_.leader.empty()) return {};
  if (auto s = keep(Writer<wire::PilotRecordPubSubType>::open(participant, Topic::kPilotRecord), &out_); !s) return s;
  Records::Callbacks callbacks;
  callbacks.sample = [this](wire::PilotRecord* sample, const Origin& origin) {
    on_record(*sample, origin.participant);
  };
  callbacks.unreadable = [this] {
    handler_->on_rejected(Topic::kPilotRecord, "", Error("the sample is no sample of this topic's type"));
  };
  callbacks.admits = [this](std::string_view vehicle, const ParticipantId& from, std::size_t bytes) {
    if (from == pairing_.leader() || from == pairing_.heir()) return true;
    if (bytes != 0 && from != self_) drops_->count(SampleFault::kStranger, Topic::kPilotRecord, vehicle, from);
    return false;
  };
  if (auto s = keep(Records::open(participant, Topic::kPilotRecord, std::move(callbacks)), &in_); !s) return s;
  return names_.leader.empty() ? Status() : listen();
}

/// To what the leader tells its vehicles, all of them.
Status Partners::listen() {
  Commands::Callbacks callbacks;
  callbacks.sample = [this](wire::ThrustRateCommand* sample, const Origin&) { on_command(*sample); };
  callbacks.unreadable = [this] {
    handler_->on_rejected(Topic::kCommand, "", Error("the sample is no sample of this topic's type"));
  };
  callbacks.admits = [this](std::string_view, const ParticipantId& from, std::size_t) {
    return from == pairing_.leader();
  };
  return keep(Commands::open(participant_, Topic::kCommand, std::move(callbacks), command_partition("*")), &commands_);
}

void Partners::close() {
  in_.reset();
  commands_.reset();
  if (out_) out_->flush(kLastWords_ms);
  out_.reset();
}

void Partners::on_peer(const PeerEvent& event, const std::function<bool(const std::string& server)>& may_bear) {
  if (!event.gone && !may_bear(Pairing::server_in(event.user_data))) return;
  const Pairing::Change change =
      event.gone ? pairing_.gone(event.peer) : pairing_.appeared(event.peer, event.user_data);
  if (change.heir) handler_->on_heir(pairing_.heir());
  if (change.leader) handler_->on_leader(pairing_.leader(), pairing_.goes_first());
}

protocol::ParticipantBytes Partners::heir() const {
  const auto heir = pairing_.heir();
  return heir ? heir->bytes : protocol::ParticipantBytes{};
}

bool Partners::publish(const protocol::PilotRecord& record) {
  const auto to = to_leader(record.kind) ? pairing_.leader() : pairing_.heir();
  if (!out_ || !to || !protocol::validate(record).ok()) return false;
  return out_->write([&](wire::PilotRecord* sample) {
    to_wire(record, sample);
    sample->to() = to->bytes;
  });
}

void Partners::withdraw(const std::string& vehicle) {
  if (out_) out_->withdraw(vehicle);
}

void Partners::on_record(const wire::PilotRecord& sample, const ParticipantId& from) {
  if (sample.to() != self_.bytes) return;  // another stand-by's
  if (const Status verdict = from_wire(sample, &record_); !verdict)
    return handler_->on_rejected(Topic::kPilotRecord, "", verdict.failure().within("record of a pilot: "));
  if (from != (to_leader(record_.kind) ? pairing_.heir() : pairing_.leader()))
    return drops_->count(SampleFault::kStranger, Topic::kPilotRecord, record_.vehicle, from);
  handler_->on_record(record_);
}

void Partners::on_command(const wire::ThrustRateCommand& sample) {
  const Status verdict = from_wire(sample, &command_);
  if (verdict.ok())
    handler_->on_leader_command(command_);
  else
    handler_->on_rejected(Topic::kCommand, "", verdict.failure());
}

}  // namespace gatefield::dds
