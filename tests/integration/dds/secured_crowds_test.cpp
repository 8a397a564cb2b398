// The column "with security" of docs/security.md: a member that says too much, too large, or what ends a library.

#include <atomic>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "common/dds/library_log.h"
#include "tests/integration/dds/forged_packet.h"
#include "tests/integration/dds/other_server.h"
#include "tests/integration/dds/oversized_states.h"
#include "tests/integration/dds/secured_flight.h"

namespace gatefield::dds {
namespace {

/// A vehicle of the domain means ill.
class SecuredCrowds : public SecuredFlight {
 protected:
  void SetUp() override {
    SecuredFlight::SetUp();
    own_ = credentials_of(keys(), Role::kVehicle, "rival");
    rival_ = std::make_unique<Stranger>(std::string(), &own_);
  }
  void TearDown() override {
    rival_.reset();
    SecuredFlight::TearDown();
  }
  Credentials own_;
  std::unique_ptr<Stranger> rival_;
};

TEST_F(SecuredCrowds, RequestsUnderOtherNamesAreNotTaken) {
  auto requests = rival_->writer<wire::SessionRequestPubSubType>(Topic::kSessionRequest);
  ASSERT_TRUE(within_5s([&] { return requests->readers() > 0; }));
  for (std::uint64_t i = 0; i < 400; ++i) {
    const std::string name = "crowd-" + std::to_string(i);
    requests->write([&](auto* sample) { to_wire(test::good_request(name, i + 1), sample); });
    if (i % 20 == 0) std::this_thread::sleep_for(10ms);
  }
  const auto newcomer = join("newcomer");
  expect_unharmed(fly(newcomer.get()));
  EXPECT_EQ(service_->sessions(), 2u) << "victim and newcomer";
  EXPECT_NE(told_of(Topic::kSessionRequest).find("certificate is another vehicle's"), std::string::npos) << told();
}

TEST_F(SecuredCrowds, StatesUnderManyNamesLeaveRoomForNewcomers) {
  std::vector<std::unique_ptr<Writer<wire::VehicleStatePubSubType>>> writers;
  for (int crowd = 0; crowd < 20; ++crowd) {
    writers.push_back(rival_->writer<wire::VehicleStatePubSubType>(Topic::kVehicleState));
    const auto& states = writers.back();
    EXPECT_TRUE(within_5s([&] { return states->readers() > 0; }));
    for (std::uint64_t i = 0; i < 250; ++i) {
      const std::string name = "crowd-" + std::to_string(crowd) + "-" + std::to_string(i);
      states->write([&](auto* sample) { to_wire(test::good_state(name, i + 1), sample); });
    }
  }
  const auto newcomer = join("newcomer");
  expect_unharmed(fly(newcomer.get()));
  EXPECT_NE(told_of(Topic::kVehicleState), "");
}

TEST_F(SecuredCrowds, SamplesTooLargeFillNoLog) {
  std::atomic<int> lines{0};
  set_library_log([&](const std::string&) { ++lines; });
  {
    const OversizedStates states(rival_->participant(), "victim");
    ASSERT_TRUE(within_5s([&] { return states.readers() > 0; }));
    expect_unharmed(fly(victim_.get(), [&](std::uint64_t) { states.write(50); }));
  }
  EXPECT_LE(lines, 4) << "a line a second";
  set_library_log({});
}

TEST_F(SecuredCrowds, ThePacketThatEndsTheLibraryIsDropped) {
  expect_unharmed(fly(victim_.get(), [&](std::uint64_t sequence) {
    if (sequence % 5 == 0) send_to_all(test::deadly_packet());
  }));
  EXPECT_NE(packets_told().find("submessage 128"), std::string::npos) << packets_told();
  EXPECT_GT(victim_->statistics().packets_dropped, 0u);
}

}  // namespace
}  // namespace gatefield::dds
