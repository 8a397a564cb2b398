#include "common/protocol/pilot_record.h"

#include <gtest/gtest.h>

namespace gatefield::protocol {
namespace {

using Kind = PilotRecord::Kind;

PilotRecord good(Kind kind = Kind::kFollow) {
  PilotRecord record;
  record.vehicle = "drone";
  record.session = 50;
  record.request = 7;
  record.kind = kind;
  if (kind <= Kind::kHandOver) record.pilot.resize(8000);
  return record;
}

std::string field_of(const PilotRecord& record) {
  const Status status = validate(record);
  return status.ok() ? "" : status.failure().field;
}

TEST(PilotRecord, OfEachKindIsTaken) {
  for (const Kind kind : {Kind::kFollow, Kind::kHandOver, Kind::kOver, Kind::kReady, Kind::kTaken})
    EXPECT_EQ(field_of(good(kind)), "") << static_cast<int>(kind);
}

TEST(PilotRecord, ThatIsWrongNamesItsField) {
  PilotRecord record = good();
  record.version = kPilotRecordVersion + 1;
  EXPECT_EQ(field_of(record), "version");
  record = good();
  record.vehicle = "a drone";
  EXPECT_EQ(field_of(record), "vehicle");
  record = good();
  record.session = 0;
  EXPECT_EQ(field_of(record), "session");
  record = good();
  record.request = 0;
  EXPECT_EQ(field_of(record), "request");
  record = good();
  record.kind = static_cast<Kind>(5);
  EXPECT_EQ(field_of(record), "kind");
  record = good();
  record.take_overs = kMaxTakeOvers + 1;
  EXPECT_EQ(field_of(record), "take_overs");
  record = good();
  record.written = Stamp{-1};
  EXPECT_EQ(field_of(record), "written");
}

TEST(PilotRecord, HasAPilotWhereItsKindSaysSo) {
  PilotRecord record = good();
  record.pilot.clear();
  EXPECT_EQ(field_of(record), "pilot");
  record.pilot.resize(kMaxPilotBytes + 1);
  EXPECT_EQ(field_of(record), "pilot");
  record = good(Kind::kTaken);
  record.pilot.resize(1);
  EXPECT_EQ(field_of(record), "pilot");
}

}  // namespace
}  // namespace gatefield::protocol
