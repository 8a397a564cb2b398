#include "common/dds/record_convert.h"

namespace gatefield::dds {

static_assert(wire::PILOT_RECORD_VERSION == protocol::kPilotRecordVersion);
static_assert(wire::PILOT_BYTES == protocol::kMaxPilotBytes);

void to_wire(const protocol::PilotRecord& in, wire::PilotRecord* out) {
  out->vehicle() = in.vehicle;
  out->version(in.version);
  out->session(in.session);
  out->request(in.request);
  out->kind(static_cast<std::uint8_t>(in.kind));
  out->take_overs(in.take_overs);
  out->written_ns(in.written.count());
  out->pilot() = in.pilot;
}

Status from_wire(const wire::PilotRecord& in, protocol::PilotRecord* out) {
  out->version = in.version();
  out->vehicle = in.vehicle().c_str();
  out->session = in.session();
  out->request = in.request();
  out->kind = static_cast<protocol::PilotRecord::Kind>(in.kind());
  out->take_overs = in.take_overs();
  out->written = Stamp(in.written_ns());
  out->pilot = in.pilot();
  return protocol::validate(*out);
}

}  // namespace gatefield::dds
