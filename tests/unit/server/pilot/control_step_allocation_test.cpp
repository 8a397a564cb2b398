// The control step allocates nothing: what asks for memory is counted while a pilot with the real planner and
// a decoded field flies.

#include <gtest/gtest.h>

#include "common/base/random.h"
#include "server/kernels/backend.h"
#include "server/perception/learned/decoded_field.h"
#include "server/planner/planner.h"
#include "tests/support/allocation_trap.h"
#include "tests/unit/server/pilot/fakes.h"

namespace gatefield::pilot {
namespace {

using namespace std::chrono_literals;

/// Sees every gate where it is expected, with a decoder of the shape that ships.
class DecodedSensor final : public perception::GateSensor {
 public:
  DecodedSensor() {
    model::DecoderWeights weights;
    weights.kind = model::DecoderKind::kHyper;
    weights.latent_size = 3 + 8;
    weights.generator = dense(8, 4 * 32);
    weights.layers = {dense(32, 32), dense(32, 1)};
    decoder_ = kernels::best_backend().prepare(weights);
  }
  bool steerable() const noexcept override { return true; }
  std::optional<perception::Observation> look(const perception::View&, const gates::Expectation& gate,
                                              perception::Where) override {
    perception::Observation seen;
    seen.gate.X_WG.translation() = gate.center_W;
    return seen;
  }
  std::shared_ptr<const gates::Field> field(const Eigen::Isometry3d&, const Eigen::Isometry3d& X_WG,
                                            const GateShape&) override {
    const auto field = std::make_shared<perception::DecodedField>();
    kernels::fold(decoder_, std::vector<float>(11, 0.1f), X_WG, &field->decoder);
    return field;
  }
  perception::FieldSource source_of(const gates::Field&) const override { return {}; }
  Result<std::shared_ptr<const gates::Field>> restore(const perception::FieldSource&, const GateShape&) override {
    return std::shared_ptr<const gates::Field>();
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
  std::shared_ptr<const kernels::PreparedDecoder> decoder_;
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
  PilotParts parts;
  parts.request = testing::join_request("drone", 7, timing);
  parts.session = 1;
  auto planner =
      planner::Planner::create(profile, parts.request.quadrotor, parts.request.course, kGuideConeAngle_rad, 1);
  ASSERT_TRUE(planner.ok()) << planner.error();
  parts.planner = std::move(planner).value();
  parts.sensor = std::make_unique<DecodedSensor>();
  parts.isa = "any";
  parts.now = clock.now();
  const protocol::SessionRequest request = parts.request;
  Pilot pilot(std::move(parts));

  std::uint64_t commands = 0;
  std::size_t trapped = 0;
  for (std::uint64_t i = 1; i <= 60; ++i) {
    const Stamp stamp = 50s + static_cast<std::int64_t>(i) * 20ms;
    auto frame = testing::depth_frame(request, 1, i, stamp);
    pilot.intake().take_depth(frame, clock.now());
    auto state = testing::hover_state("drone", 1, i, stamp, {0.15 * static_cast<double>(i), 0, 1.5});  // through a gate
    state.state.v_WB = {7.5, 0, 0};
    state.depth_sequence = i;
    state.thrust_known = i % 2 == 0;
    state.round_trip = 20ms;
    if (i % 10 != 5) pilot.intake().take_state(state, clock.now());  // some are lost
    if (pilot.looking().due()) pilot.looking().look();
    const test::AllocationTrap trap;
    const Stepping::Answer answer = pilot.stepping().step(clock.now());
    pilot.stepping().solved(3ms);
    if (answer.command) pilot.stepping().sent(clock.now(), true);
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
}  // namespace gatefield::pilot
