// The control step allocates nothing: what asks for memory is counted while a session with the real planner and
// a decoded field flies.

#include <gtest/gtest.h>

#include "common/base/random.h"
#include "server/kernels/backend.h"
#include "server/planner/planner.h"
#include "tests/support/allocation_trap.h"
#include "tests/unit/server/service/fakes.h"

namespace gatefield::service {
namespace {

using namespace std::chrono_literals;

/// Knows every gate, with a decoder of the shape that ships.
class DecodedMemory final : public Memory {
 public:
  explicit DecodedMemory(Course course) : course_(std::move(course)) {
    model::DecoderWeights weights;
    weights.kind = model::DecoderKind::kHyper;
    weights.latent_size = 3 + 8;
    weights.generator = dense(8, 4 * 32);
    weights.layers = {dense(32, 32), dense(32, 1)};
    decoder_ = kernels::best_backend().prepare(weights);
  }
  Eigen::Vector3d expected_center_W(std::uint32_t waypoint) const noexcept override {
    return course_.waypoints[waypoint].p_W;
  }
  bool seen(std::uint32_t) const noexcept override { return true; }
  perception::GateMemory::Outcome observe(std::uint32_t, const perception::Encoding&, const Eigen::Isometry3d&,
                                          Stamp capture) override {
    capture_ = capture;
    return perception::GateMemory::Outcome::kTaken;
  }
  void snapshot(std::uint32_t target, std::uint32_t next, perception::MemorySnapshot* out) const override {
    const std::array<std::uint32_t, 2> waypoints{target, next};
    const std::vector<float> latent(11, 0.1f);
    for (std::size_t i = 0; i < 2; ++i) {
      out->gates[i].seen = true;
      out->gates[i].stamp = capture_;
      out->gates[i].center_W = course_.waypoints[waypoints[i]].p_W;
      kernels::fold(decoder_, latent, Eigen::Isometry3d(Eigen::Translation3d(out->gates[i].center_W)),
                    &out->gates[i].field.decoder);
    }
  }

 private:
  static model::Dense dense(int inputs, int outputs) {
    model::Dense layer;
    layer.inputs = inputs;
    layer.outputs = outputs;
    Random random(static_cast<std::uint64_t>(inputs), static_cast<std::uint64_t>(outputs));
    for (int i = 0; i < inputs * outputs; ++i) layer.weight.push_back(static_cast<float>(0.1 * random.normal()));
    layer.bias.assign(static_cast<std::size_t>(outputs), 0.05f);
    return layer;
  }
  Course course_;
  std::shared_ptr<const kernels::PreparedDecoder> decoder_;
  Stamp capture_{0};
};

TEST(ControlStep, TheTrapWorks) {
  const test::AllocationTrap trap;
  const auto memory = std::make_unique<int>(3);
  EXPECT_EQ(*memory, 3);
  EXPECT_EQ(trap.count(), 1u);
}

void fly(protocol::Timing timing) {
  planner::Profile profile = testing::small_profile();
  profile.samples = 256;
  ManualClock clock;
  clock.set(100s);
  SessionParts parts;
  parts.request = testing::join_request("drone", 7, timing);
  parts.id = 1;
  auto planner = planner::Planner::create(profile, parts.request.quadrotor, parts.request.course.waypoints[0].gate,
                                          kGuideConeAngle_rad, 1);
  ASSERT_TRUE(planner.ok()) << planner.error();
  parts.planner = std::move(planner).value();
  parts.memory = std::make_unique<DecodedMemory>(parts.request.course);
  parts.isa = "any";
  parts.clock = &clock;
  const protocol::SessionRequest request = parts.request;
  Session session(std::move(parts));
  testing::FakeEncoder encoder;

  std::uint64_t commands = 0;
  std::size_t trapped = 0;
  for (std::uint64_t i = 1; i <= 60; ++i) {
    const Stamp stamp = 50s + static_cast<std::int64_t>(i) * 20ms;
    auto frame = testing::depth_frame(request, 1, i, stamp);
    session.take_depth(frame);
    auto state = testing::hover_state("drone", 1, i, stamp, {0.15 * static_cast<double>(i), 0, 1.5});  // through a gate
    state.state.v_WB = {7.5, 0, 0};
    state.depth_sequence = i;
    state.thrust_known = i % 2 == 0;
    state.round_trip = 20ms;
    if (i % 10 != 5) session.take_state(state);  // some are lost
    if (session.frame_due()) session.perceive(encoder);
    const test::AllocationTrap trap;
    const Session::Answer answer = session.step(clock.now());
    if (answer.command) session.sent(clock.now(), true);
    if (i > 5) trapped += trap.count();  // warm by then
    commands += answer.command ? 1 : 0;
    clock.advance(20ms);
  }
  EXPECT_GE(commands, 50u);
  EXPECT_EQ(trapped, 0u);
}

TEST(ControlStep, AllocatesNothingInRealTime) { fly(protocol::Timing::kRealTime); }
TEST(ControlStep, AllocatesNothingInLockstep) { fly(protocol::Timing::kLockstep); }

}  // namespace
}  // namespace gatefield::service
