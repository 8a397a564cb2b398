#include "server/baseline/sensors.h"

#include <gmock/gmock.h>

#include "common/config/locate.h"
#include "server/perception/sight.h"
#include "tests/unit/server/baseline/fixtures.h"

namespace gatefield::baseline {
namespace {

using namespace std::chrono_literals;

class Eyes : public testing::Test {
 protected:
  Eyes() {
    scenario_ = config::load_scenario(config::find_config("scenarios", "circle-0.55m").value()).value();
    request_.course = scenario_.track.course;
    request_.camera = scenario_.vehicle.camera;
    request_.seed = 11;  // the planner's
    scenario_.seed = 3;
    world_ = config::perturbed_world(scenario_.track, scenario_.perturbation, scenario_.seed);
  }
  void open(Kind kind) {
    sensor_ = make_sensor(kind, request_, scenario_);
    records_ = std::make_unique<gates::GateRecords>(request_.course);
  }
  /// What a camera sees `distance_m` in front of the gate, off its axis by `yaw`; `away`: turned round.
  /// @return whether the gate was seen, and taken into the memory
  bool look(double distance_m, bool away = false) {
    const Eigen::Isometry3d X_WG = config::gates_by_waypoint(world_, request_.course)[gate_].X_WG;
    Eigen::Matrix3d R_GC;
    R_GC << 0, 0, 1, -1, 0, 0, 0, -1, 0;
    if (away) R_GC = Eigen::AngleAxisd(3.14159, Eigen::Vector3d::UnitZ()).toRotationMatrix() * R_GC;
    Eigen::Isometry3d X_WC = X_WG * Eigen::Translation3d(-distance_m, 0.3, 0);
    X_WC.linear() = X_WG.linear() * R_GC;
    scene::DepthImage image;
    scene::DepthCamera(world_).render(request_.camera, X_WC, &image);
    const auto seen = sensor_->look({image.depth_m, request_.camera, X_WC}, records_->expectation(gate_),
                                    perception::Where::kExpected);
    return seen && perception::remember(*seen, gate_, capture_ += 16ms, sensor_.get(), records_.get());
  }
  gates::RememberedGate remembered(std::uint32_t waypoint) const {
    gates::Snapshot snapshot;
    records_->snapshot(waypoint, waypoint, &snapshot);
    return snapshot.gates[0];
  }
  double error_m() const { return (remembered(0).center_W - world_.gates[0].X_WG.translation()).norm(); }

  std::uint32_t gate_ = 0;
  config::Scenario scenario_;
  protocol::SessionRequest request_;
  scene::World world_;
  std::unique_ptr<perception::GateSensor> sensor_;
  std::unique_ptr<gates::GateRecords> records_;
  Stamp capture_{0};
};

TEST_F(Eyes, TheTruthIsRevealedOnlyOnceTheCameraShowsIt) {
  open(Kind::kTruePose);
  EXPECT_FALSE(look(3.0, true)) << "behind the camera";
  EXPECT_FALSE(look(14.0)) << "out of range";
  EXPECT_FALSE(records_->seen(0));
  EXPECT_NEAR(error_m(), 0.55, 0.3) << "the waypoint until then";
  EXPECT_TRUE(look(4.0));
  EXPECT_TRUE(records_->seen(0));
  EXPECT_LT(error_m(), 1e-6);
}

TEST_F(Eyes, TheFieldIsTheHourglassOfTheBelievedPose) {
  open(Kind::kTruePose);
  ASSERT_TRUE(look(4.0));
  const Eigen::Vector3f p = (world_.gates[0].X_WG * Eigen::Vector3d(-1.0, 0.2, 0.1)).cast<float>();
  float s = 0.0f;
  remembered(0).field->evaluate({&p.x(), 1}, {&p.y(), 1}, {&p.z(), 1}, {&s, 1});
  EXPECT_NEAR(s, guide_sdf(GateShape{}, {-1.0, 0.2, 0.1}), 1e-5);
}

TEST_F(Eyes, AFieldIsMadeAnewFromItsPoseAndTakesNoLatent) {
  open(Kind::kTruePose);
  ASSERT_TRUE(look(4.0));
  const perception::FieldSource source = sensor_->source_of(*remembered(0).field);
  const auto again = sensor_->restore(source, GateShape{});
  ASSERT_TRUE(again.ok());
  const float x = 5.2f, y = 0.3f, z = 1.4f;
  float before = 0.0f, after = 1.0f;
  remembered(0).field->evaluate({&x, 1}, {&y, 1}, {&z, 1}, {&before, 1});
  (*again)->evaluate({&x, 1}, {&y, 1}, {&z, 1}, {&after, 1});
  EXPECT_EQ(before, after);
  EXPECT_FALSE(sensor_->restore({source.X_WF, {0.1f}}, GateShape{}).ok());
}

TEST_F(Eyes, TheClassicalDetectorMovesTheBeliefTowardsTheGate) {
  open(Kind::kClassical);
  const double before_m = error_m();
  for (const double distance_m : {4.5, 4.3, 4.1, 3.9}) look(distance_m);
  EXPECT_TRUE(records_->seen(0));
  EXPECT_LT(error_m(), 0.1);
  EXPECT_GT(before_m, 0.4);
}

TEST_F(Eyes, RoundGatesAmongSquareOnesHaveTheirOwnField) {
  scenario_ = config::load_scenario(config::find_config("scenarios", "mixed-0.3m").value()).value();
  scenario_.seed = 3;
  request_.course = scenario_.track.course;
  world_ = config::perturbed_world(scenario_.track, scenario_.perturbation, scenario_.seed);
  for (const Kind kind : {Kind::kTruePose, Kind::kClassical}) {
    open(kind);
    for (gate_ = 0; gate_ < 2; ++gate_) {
      ASSERT_TRUE(look(3.0)) << name(kind) << ", gate " << gate_;
      const gates::RememberedGate gate = remembered(gate_);
      const Eigen::Isometry3d& X_WG = world_.gates[gate_].X_WG;
      EXPECT_LT((gate.center_W - X_WG.translation()).norm(), 0.1) << name(kind) << ", gate " << gate_;
      // The corner, 0.57 m from the axis: open in a square, frame of a ring.
      const Eigen::Vector3f p_W = (X_WG * Eigen::Vector3d(0, 0.4, 0.4)).cast<float>();
      float s = 0.0f;
      gate.field->evaluate({&p_W.x(), 1}, {&p_W.y(), 1}, {&p_W.z(), 1}, {&s, 1});
      EXPECT_EQ(s > 0.0f, gate_ == 0) << name(kind) << ", gate " << gate_;
    }
  }
}

TEST_F(Eyes, AGateThatIsPassedBothWaysIsOneTrueGate) {
  scenario_ = config::load_scenario(config::find_config("scenarios", "there-and-back").value()).value();
  scenario_.perturbation.position_m = 0.5;
  request_.course = scenario_.track.course;
  world_ = config::perturbed_world(scenario_.track, scenario_.perturbation, scenario_.seed);
  ASSERT_LT(world_.gates.size(), request_.course.waypoints.size());
  open(Kind::kTruePose);
  const gates::Passages& passages = records_->passages();
  const std::vector<scene::Gate> passed = config::gates_by_waypoint(world_, request_.course);
  for (std::uint32_t i = 0; i < passages.waypoints(); ++i) {
    gate_ = i;
    EXPECT_TRUE(look(3.0)) << "waypoint " << i;
    const gates::RememberedGate gate = remembered(i);
    EXPECT_LT((gate.center_W - passed[i].X_WG.translation()).norm(), 1e-6) << "waypoint " << i;
    EXPECT_GT(passages.turned(i, gate.axis_W).dot(passed[i].X_WG.linear().col(0)), 0.999) << "waypoint " << i;
  }
}

TEST_F(Eyes, WithoutVisionNothingIsEverSeen) {
  open(Kind::kNone);
  EXPECT_FALSE(look(3.0));
  EXPECT_FALSE(records_->seen(0));
}

TEST(Kinds, HaveNames) {
  for (const Kind kind : {Kind::kNone, Kind::kTruePose, Kind::kClassical}) EXPECT_EQ(*parse_kind(name(kind)), kind);
  EXPECT_THAT(parse_kind("LEARNED").error(), testing::HasSubstr("expected NONE, TRUE_POSE or CLASSICAL"));
}

}  // namespace
}  // namespace gatefield::baseline
