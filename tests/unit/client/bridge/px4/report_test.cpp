#include "client/bridge/px4/report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bench.h"

namespace gatefield::bridge {
namespace {

using namespace std::chrono_literals;
using mavlink::CommandResult;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

TEST(Px4ReportSentences, NothingHeardNamesDomainAndNextStep) {
  Px4Config config;
  config.bus.domain = 7;
  EXPECT_THAT(complaints(Px4Report{}, {}, config),
              ElementsAre(HasSubstr("nothing of PX4 is heard in domain 7; check that its agent runs")));
  EXPECT_THAT(description(Px4Report{}, config), ElementsAre("no PX4 has been heard in domain 7"));
}

TEST(Px4ReportSentences, AnotherReleaseIsSeenByItsTopics) {
  BusReport bus;
  bus.offered = {"rt/fmu/out/vehicle_odometry", "rt/fmu/out/vehicle_status_v4"};
  EXPECT_THAT(complaints(Px4Report{}, bus, {}),
              ElementsAre("PX4 offers rt/fmu/out/vehicle_status_v4, expected rt/fmu/out/vehicle_status_v1; set the "
                          "release that PX4 has (now 1.16)"));
}

TEST(Px4ReportSentences, AnotherNamespaceIsSeenByItsTopics) {
  BusReport bus;
  bus.offered = {"rt/px4_1/fmu/out/vehicle_status_v1"};
  EXPECT_THAT(complaints(Px4Report{}, bus, {}), ElementsAre(HasSubstr("set the namespace")));
}

TEST(Px4ReportSentences, APx4WithoutTheTopicIsToldApartFromNone) {
  BusReport bus;
  bus.offered = {"rt/fmu/out/vehicle_odometry"};
  EXPECT_THAT(complaints(Px4Report{}, bus, {}), ElementsAre(HasSubstr("does not offer rt/fmu/out/vehicle_status_v1")));
}

TEST(Px4ReportSentences, AllIsWellWhenItIs) {
  Bench bench(bench_config());
  bench.run(1s);
  EXPECT_THAT(complaints(bench.report(), {}, bench_config()), IsEmpty());
  EXPECT_THAT(description(bench.report(), bench_config()),
              ElementsAre("PX4, system 1, in domain 0, release 1.16",
                          HasSubstr("its states are 0.0 ms old at least; it knows its agent's clock to 0.0 ms, round "
                                    "trip 0.8 ms")));
}

TEST(Px4ReportSentences, SilenceSaysThatPx4DoesNotComeBack) {
  Bench bench(bench_config());
  bench.run(1s);
  bench.controller.silent = true;
  bench.run(4s);
  EXPECT_THAT(complaints(bench.report(), {}, bench_config()),
              Contains(HasSubstr("silent for 4.0 s; when its agent was started again PX4 does not always come back")));
}

TEST(Px4ReportSentences, ClocksStatesStrangersAndRefusalsAreTold) {
  Bench bench(bench_config());
  bench.controller.stamps_off = -400ms;
  bench.run(1s);
  EXPECT_THAT(complaints(bench.report(), {}, bench_config()), Contains(HasSubstr("clock.error is 400 ms")));
  bench.controller.stamps_off = {};
  bench.controller.refuses[400] = CommandResult::kDenied;
  bench.run(2s);
  bench.fly(3s, 0, {0, 0, 0});
  px4::VehicleStatus other;
  other.timestamp = 1;
  other.system_id = 3;
  bench.controller.send(other);
  BusReport bus;
  bus.rejected = 2;
  bus.why = Error("of a reason");
  const auto sentences = complaints(bench.report(), bus, bench_config());
  EXPECT_THAT(sentences, Contains(HasSubstr("arming was refused: denied")));
  EXPECT_THAT(sentences, Contains(HasSubstr("vehicles 1 and 3 speak on the same topics")));
  EXPECT_THAT(sentences, Contains(HasSubstr("2 messages were refused, the last: of a reason")));
}

}  // namespace
}  // namespace gatefield::bridge
