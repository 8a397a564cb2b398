#include "server/baseline/perception.h"

#include <gmock/gmock.h>

#include "common/config/locate.h"
#include "tests/unit/server/baseline/fixtures.h"

namespace gatefield::baseline {
namespace {

using Outcome = perception::GateMemory::Outcome;
using namespace std::chrono_literals;

class Eyes : public testing::Test {
 protected:
  Eyes() {
    scenario_ = config::load_scenario(config::find_config("scenarios", "circle-0.55m").value()).value();
    request_.course = scenario_.track.course;
    request_.camera = scenario_.vehicle.camera;
    request_.seed = 3;
    world_ = config::perturbed_world(scenario_.track, scenario_.perturbation, request_.seed);
  }
  /// What a camera sees `distance_m` in front of the gate, off its axis by `yaw`; `away`: turned round.
  Outcome look(Kind kind, service::Memory* memory, double distance_m, bool away = false) {
    const Eigen::Isometry3d& X_WG = world_.gates[gate_].X_WG;
    Eigen::Matrix3d R_GC;
    R_GC << 0, 0, 1, -1, 0, 0, 0, -1, 0;
    if (away) R_GC = Eigen::AngleAxisd(3.14159, Eigen::Vector3d::UnitZ()).toRotationMatrix() * R_GC;
    X_WC_ = X_WG * Eigen::Translation3d(-distance_m, 0.3, 0);
    X_WC_.linear() = X_WG.linear() * R_GC;
    scene::DepthImage image;
    scene::DepthCamera(world_).render(request_.camera, X_WC_, &image);
    const auto encoding =
        make_encoder(kind, request_.course)
            ->encode(image.depth_m, request_.camera, X_WC_.inverse() * memory->expected_center_W(gate_));
    return encoding ? memory->observe(gate_, *encoding, X_WC_, capture_ += 16ms) : Outcome::kNotValid;
  }
  double error_m(const service::Memory& memory) const {
    perception::MemorySnapshot snapshot;
    memory.snapshot(0, 1, &snapshot);
    return (snapshot.gates[0].center_W - world_.gates[0].X_WG.translation()).norm();
  }

  std::uint32_t gate_ = 0;
  config::Scenario scenario_;
  protocol::SessionRequest request_;
  scene::World world_;
  Eigen::Isometry3d X_WC_ = Eigen::Isometry3d::Identity();
  Stamp capture_{0};
};

TEST_F(Eyes, TheTruthIsRevealedOnlyOnceTheCameraShowsIt) {
  const auto memory = make_memory(Kind::kTruePose, request_, scenario_);
  EXPECT_EQ(look(Kind::kTruePose, memory.get(), 3.0, true), Outcome::kNotValid) << "behind the camera";
  EXPECT_EQ(look(Kind::kTruePose, memory.get(), 14.0), Outcome::kNotValid) << "out of range";
  EXPECT_FALSE(memory->seen(0));
  EXPECT_NEAR(error_m(*memory), 0.55, 0.3) << "the waypoint until then";
  EXPECT_EQ(look(Kind::kTruePose, memory.get(), 4.0), Outcome::kTaken);
  EXPECT_TRUE(memory->seen(0));
  EXPECT_LT(error_m(*memory), 1e-6);
}

TEST_F(Eyes, TheFieldIsTheHourglassOfTheBelievedPose) {
  const auto memory = make_memory(Kind::kTruePose, request_, scenario_);
  ASSERT_EQ(look(Kind::kTruePose, memory.get(), 4.0), Outcome::kTaken);
  perception::MemorySnapshot snapshot;
  memory->snapshot(0, 1, &snapshot);
  const Eigen::Vector3f p = (world_.gates[0].X_WG * Eigen::Vector3d(-1.0, 0.2, 0.1)).cast<float>();
  float s = 0.0f;
  snapshot.gates[0].field.evaluate({&p.x(), 1}, {&p.y(), 1}, {&p.z(), 1}, {&s, 1});
  EXPECT_NEAR(s, guide_sdf(GateShape{}, {-1.0, 0.2, 0.1}), 1e-5);
}

TEST_F(Eyes, TheClassicalDetectorMovesTheBeliefTowardsTheGate) {
  const auto memory = make_memory(Kind::kClassical, request_, scenario_);
  const double before_m = error_m(*memory);
  for (const double distance_m : {4.5, 4.3, 4.1, 3.9}) look(Kind::kClassical, memory.get(), distance_m);
  EXPECT_TRUE(memory->seen(0));
  EXPECT_LT(error_m(*memory), 0.1);
  EXPECT_GT(before_m, 0.4);
}

TEST_F(Eyes, RoundGatesAmongSquareOnesHaveTheirOwnField) {
  scenario_ = config::load_scenario(config::find_config("scenarios", "mixed-0.3m").value()).value();
  request_.course = scenario_.track.course;
  world_ = config::perturbed_world(scenario_.track, scenario_.perturbation, request_.seed);
  for (const Kind kind : {Kind::kTruePose, Kind::kClassical}) {
    const auto memory = make_memory(kind, request_, scenario_);
    for (gate_ = 0; gate_ < 2; ++gate_) {
      ASSERT_EQ(look(kind, memory.get(), 3.0), Outcome::kTaken) << name(kind) << ", gate " << gate_;
      perception::MemorySnapshot snapshot;
      memory->snapshot(gate_, gate_, &snapshot);
      const perception::RememberedGate& gate = snapshot.gates[0];
      const Eigen::Isometry3d& X_WG = world_.gates[gate_].X_WG;
      EXPECT_LT((gate.center_W - X_WG.translation()).norm(), 0.1) << name(kind) << ", gate " << gate_;
      // The corner, 0.57 m from the axis: open in a square, frame of a ring.
      const Eigen::Vector3f p_W = (X_WG * Eigen::Vector3d(0, 0.4, 0.4)).cast<float>();
      float s = 0.0f;
      gate.field.evaluate({&p_W.x(), 1}, {&p_W.y(), 1}, {&p_W.z(), 1}, {&s, 1});
      EXPECT_EQ(s > 0.0f, gate_ == 0) << name(kind) << ", gate " << gate_;
    }
  }
}

TEST_F(Eyes, WithoutVisionNothingIsEverSeen) {
  const auto memory = make_memory(Kind::kNone, request_, scenario_);
  EXPECT_EQ(look(Kind::kNone, memory.get(), 3.0), Outcome::kNotValid);
  EXPECT_FALSE(memory->seen(0));
}

TEST(Kinds, HaveNames) {
  for (const Kind kind : {Kind::kNone, Kind::kTruePose, Kind::kClassical}) EXPECT_EQ(*parse_kind(name(kind)), kind);
  EXPECT_THAT(parse_kind("LEARNED").error(), testing::HasSubstr("expected NONE, TRUE_POSE or CLASSICAL"));
}

}  // namespace
}  // namespace gatefield::baseline
