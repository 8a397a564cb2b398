// A server for the program named by the argument, which must send sent_state() and end well: sdk_package_echo <program>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "tests/integration/sdk/scripted_server.h"
#include "tests/integration/sdk_package/layout/messages.h"
#include "tests/support/dds_domain.h"
#include "tests/support/process.h"

namespace gatefield {
namespace {

using namespace std::chrono_literals;

std::string program;

TEST(Layout, AStateArrivesAsItWasSentAndItsAnswerToo) {
  test::ScriptedServer server("planner-1", test::accept_as(50), [](const protocol::VehicleState& state) {
    auto command = test::good_command(state.vehicle, state.sequence);
    command.session = state.session;
    command.answers_sequence = state.sequence;
    command.answers_stamp = command.plan_start = state.stamp;
    for (int k = 0; k < command.steps; ++k) command.rotor_thrust_n[static_cast<std::size_t>(k)] = answered_thrust_n(k);
    return std::optional(command);
  });
  test::Process client(program, {std::to_string(test::own_domain())},
                       std::filesystem::path(program).replace_extension(".out"));
  const auto code = client.wait(30s);
  EXPECT_EQ(code, 0) << client.output();
  server.wait([&] {
    EXPECT_FALSE(server.states.empty());
    for (const auto& heard : server.states) {
      EXPECT_TRUE(same(heard.state, sent_state<QuadrotorState>()));
    }
    if (!server.requests.empty()) {
      const Eigen::Isometry3d expected = forward_camera_mount(0.25, {0.125, 0, -0.0625});
      EXPECT_TRUE(server.requests[0].camera.X_BC.isApprox(expected, 1e-12));
    }
    return true;
  });
}

}  // namespace
}  // namespace gatefield

int main(int argc, char** argv) {
  ::testing::InitGoogleTest(&argc, argv);
  if (argc != 2) return 64;
  gatefield::program = argv[1];
  return RUN_ALL_TESTS();
}
