// The files of docs/flight-controllers.md, as the page shows them.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "client/bridge/config/config.h"
#include "tests/examples/page.h"

namespace gatefield::bridge {
namespace {

TEST(FlightControllersPage, TheConfigurationsLoad) {
  const auto folder = std::filesystem::temp_directory_path() / ("gatefield-bridge-page-" + std::to_string(getpid()));
  test::write_files(test::shown_files(std::filesystem::path(GATEFIELD_SOURCE_DIR) / "docs/flight-controllers.md"),
                    folder);
  const auto config = load_config(folder / "my/bridge.txt", Firmware::kMavlink);
  const auto px4 = load_config(folder / "my/px4.txt", Firmware::kPx4);
  std::filesystem::remove_all(folder);
  ASSERT_TRUE(config) << config.error();
  ASSERT_TRUE(px4) << px4.error();
  EXPECT_FALSE(config->safety.needs_depth);
  EXPECT_EQ(std::get<MavlinkConfig>(config->firmware).radio.kill, 7);
}

TEST(BetaflightRacerPage, TheConfigurationLoads) {
  const auto folder = std::filesystem::temp_directory_path() / ("gatefield-racer-page-" + std::to_string(getpid()));
  test::write_files(test::shown_files(std::filesystem::path(GATEFIELD_SOURCE_DIR) / "docs/betaflight-racer.md"),
                    folder);
  const auto config = load_config(folder / "my/racer.txt", Firmware::kBetaflight);
  std::filesystem::remove_all(folder);
  ASSERT_TRUE(config) << config.error();
  EXPECT_EQ(config->sources.states->pose, "/mocap/racer/pose");
  EXPECT_EQ(std::get<betaflight::Options>(config->firmware).receiver, betaflight::Options::Receiver::kOverride);
}

}  // namespace
}  // namespace gatefield::bridge
