#include "server/training/evaluation/no_gate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>

#include "server/training/evaluation/no_gate_report.h"

namespace gatefield::training {
namespace {

using testing::HasSubstr;

GateLook look(double validity, double predicted_m, double residual_m, bool taken) {
  return {validity, predicted_m, residual_m, taken};
}

/// Ten frames without a gate, two places each, ten with one.
NoGateResult result() {
  NoGateResult out;
  for (int i = 0; i < 10; ++i) {
    NoGateFrame frame;
    frame.name = "f" + std::to_string(i);
    frame.free = look(i < 3 ? 0.9 : 0.1, i < 5 ? 0.05 : 0.5, 0.2, i < 2);
    frame.told = {look(0.8, 0.1, 0.1, i == 0), look(0.1, 0.4, 0.3, i == 0)};
    out.frames.push_back(frame);
    NoGateFrame gate;
    gate.free = look(0.95, 0.04, 0.05, true);
    gate.told = {look(0.6 + 0.04 * i, 0.03, 0.04, i > 0)};
    out.gates.push_back(gate);
  }
  return out;
}

TEST(NoGateReport, CountsWhatADecisionImaginesAndKeeps) {
  const NoGateResult r = result();
  const auto taken = [](const GateLook& l) { return l.taken; };
  const Imagined free = count(r, false, taken);
  EXPECT_EQ(free.imagined, 2u);
  EXPECT_EQ(free.looks, 10u);
  EXPECT_DOUBLE_EQ(free.kept, 1.0);
  EXPECT_NEAR(free.interval.low, 0.057, 0.001);  // Wilson's of 2 of 10
  EXPECT_NEAR(free.interval.high, 0.510, 0.001);
  const Imagined told = count(r, true, taken);
  EXPECT_EQ(told.imagined, 2u);
  EXPECT_EQ(told.looks, 20u);
  EXPECT_DOUBLE_EQ(told.kept, 0.9);
  // Both are of one frame of ten: the interval is that of frames, far wider than 2 of 20 would have.
  EXPECT_EQ(told.interval.low, 0.0);
  EXPECT_NEAR(told.interval.high, 0.3, 0.06);
  const Imagined none = count(r, true, [](const GateLook&) { return false; });
  EXPECT_NEAR(none.interval.high, wilson(0, 10).high, 1e-12);
}

TEST(NoGateReport, AllThreeTogetherRefuseWhatOneAloneLetsThrough) {
  const NoGateResult r = result();
  const JointThresholds best = best_joint(r, false, 0.95);
  const auto pass = [&](const GateLook& l) { return best.pass(l); };
  EXPECT_EQ(count(r, false, pass).imagined, 0u);
  EXPECT_GE(count(r, false, pass).kept, 0.95);
}

TEST(NoGateReport, HasEveryDecisionAndEveryNumber) {
  const std::string page = to_markdown(result());
  EXPECT_THAT(page, HasSubstr("what the product takes** | 2 of 10: 20.0 (5.7 to 51.0) | 100.0 |"));
  EXPECT_THAT(page, HasSubstr("validity >= 0.5 (the bundle's) alone | 3 of 10"));
  EXPECT_THAT(page, HasSubstr("at least one of the 20 waypoints becomes a gate: 1 of 10"));
  EXPECT_THAT(page, HasSubstr("| residual | with |"));
  NoGateResult without = result();
  without.gates.clear();
  EXPECT_THAT(to_markdown(without), HasSubstr("what the product takes"));
}

TEST(NoGate, LooksAtFramesAndAtGatesWhateverTheThreads) {
  const auto folder = std::filesystem::temp_directory_path() / ("gatefield_no_gate_" + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "camera.txt") << "width_px 160\nheight_px 90\nfx_px 84.3\nfy_px 81.2\ncx_px 80\ncy_px 45\n";
  for (const char* name : {"a.raw", "b.raw"}) {
    std::ofstream image(folder / name, std::ios::binary);
    for (int i = 0; i < 160 * 90; ++i) {
      const int mm = 3000 + (i % 160) * (name[0] == 'a' ? 5 : 9);
      image.put(static_cast<char>(mm & 255)).put(static_cast<char>(mm >> 8));
    }
  }
  NoGateOptions options;
  options.frames.folder = folder;
  options.bundle = std::filesystem::path(GATEFIELD_SOURCE_DIR) / "deploy/models/race";
  options.places = 4;
  options.gates = 12;
  options.gate_seed = 1'000'003;
  const auto one = evaluate_no_gate(options);
  ASSERT_TRUE(one.ok()) << one.error();
  options.threads = 2;
  const auto two = evaluate_no_gate(options);
  ASSERT_TRUE(two.ok()) << two.error();
  EXPECT_EQ(to_markdown(*one), to_markdown(*two));

  ASSERT_EQ(one->frames.size(), 2u);
  ASSERT_EQ(one->frames[0].told.size(), 4u);
  EXPECT_EQ(one->frames[1].name, "b.raw");
  EXPECT_DOUBLE_EQ(one->frames[0].returns, 1.0);
  // Bare walls are no gates, and most gates are.
  const auto taken = [](const GateLook& l) { return l.taken; };
  EXPECT_EQ(count(*one, false, taken).imagined, 0u);
  EXPECT_EQ(count(*one, true, taken).imagined, 0u);
  EXPECT_GE(count(*one, true, taken).kept, 0.75);
  for (const NoGateFrame& gate : one->gates)
    if (gate.told[0].taken) EXPECT_TRUE(std::isfinite(gate.told[0].residual_m));

  ASSERT_TRUE(write_no_gate_report(*one, folder / "report").ok());
  for (const char* name : {"no-gate.md", "no-gate-looks.csv", "no-gate-roc.csv"})
    EXPECT_TRUE(std::filesystem::is_regular_file(folder / "report" / name)) << name;
  options.frames.folder = folder / "nowhere";
  EXPECT_THAT(evaluate_no_gate(options).error(), HasSubstr("nowhere"));
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace gatefield::training
