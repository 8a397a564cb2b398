#include "common/protocol/pilot_record.h"

#include "common/protocol/validate.h"

namespace gatefield::protocol {
namespace {

bool has_pilot(PilotRecord::Kind kind) {
  return kind == PilotRecord::Kind::kFollow || kind == PilotRecord::Kind::kHandOver;
}

}  // namespace

Status validate(const PilotRecord& record) {
  if (record.version != kPilotRecordVersion)
    return Error::invalid("version", std::to_string(record.version), std::to_string(kPilotRecordVersion),
                          ErrorCode::kVersion);
  if (auto s = validate_name("vehicle", record.vehicle); !s) return s;
  if (record.session == 0) return Error::invalid("session", "0", "the number of an accepted session");
  if (record.request == 0) return Error::invalid("request", "0", "the number of the request that was accepted");
  if (record.kind > PilotRecord::Kind::kTaken)
    return Error::invalid("kind", std::to_string(static_cast<int>(record.kind)), "0 to 4");
  if (record.take_overs > kMaxTakeOvers)
    return Error::invalid("take_overs", std::to_string(record.take_overs), "at most " + std::to_string(kMaxTakeOvers));
  if (record.written < Stamp{0})
    return Error::invalid("written", std::to_string(record.written.count()), "a time of at least 0 ns");
  const std::size_t bytes = record.pilot.size();
  if (has_pilot(record.kind) ? bytes == 0 || bytes > kMaxPilotBytes : bytes != 0)
    return Error::invalid("pilot", std::to_string(bytes) + " bytes",
                          has_pilot(record.kind) ? "1 to " + std::to_string(kMaxPilotBytes) : "none of this kind");
  return {};
}

}  // namespace gatefield::protocol
