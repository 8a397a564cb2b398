#include "common/dds/convert.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <limits>
#include <thread>

#include "common/base/random.h"
#include "common/dds/record_convert.h"
#include "common/dds/wire_type.h"
#include "gatefield_idl/gatefieldPubSubTypes.h"
#include "gatefield_idl/serversPubSubTypes.h"
#include "tests/support/allocation_trap.h"
#include "tests/support/messages.h"

namespace gatefield::dds {
namespace {

using eprosima::fastrtps::rtps::InstanceHandle_t;
using eprosima::fastrtps::rtps::SerializedPayload_t;

// Through the domain type, the wire type, its bytes, and back.
template <typename Generated>
typename Generated::type through_bytes(typename Generated::type* sample) {
  WireType<Generated> type;
  SerializedPayload_t payload(type.getSerializedSizeProvider(sample)());
  EXPECT_TRUE(type.serialize(sample, &payload));
  typename Generated::type back;
  EXPECT_TRUE(type.deserialize(&payload, &back));
  return back;
}

template <typename Generated, typename Message>
Message round_trip(const Message& message) {
  typename Generated::type sample;
  to_wire(message, &sample);
  Message back;
  const Status verdict = from_wire(through_bytes<Generated>(&sample), &back);
  EXPECT_TRUE(verdict.ok()) << verdict.error();
  return back;
}

void expect_same(const protocol::PlannerHealth& a, const protocol::PlannerHealth& b) {
  EXPECT_EQ(a.solve_time_s, b.solve_time_s);
  EXPECT_EQ(a.effective_samples, b.effective_samples);
  EXPECT_EQ(a.lowest_field_m, b.lowest_field_m);
  EXPECT_EQ(a.latent_age_s, b.latent_age_s);
  EXPECT_EQ(a.state_age_s, b.state_age_s);
  EXPECT_EQ(a.target_waypoint, b.target_waypoint);
  EXPECT_EQ(a.lap, b.lap);
  EXPECT_EQ(a.course_done, b.course_done);
  EXPECT_EQ(a.degraded, b.degraded);
  EXPECT_EQ(a.problems, b.problems);
}

TEST(Convert, SessionRequestComesBackAsItWas) {
  protocol::SessionRequest in = test::good_request();
  in.quadrotor.rotor_spin = {-1, -1, 1, 1};
  in.actuation.kind = Actuation::Kind::kBodyRates;
  in.actuation.thrust_time_constant_s = 0.03;
  in.actuation.rate_time_constant_s = {0.04, 0.05, 0.12};
  in.quadrotor.drag_kg_s = {0.125, 0.25, 0.375};
  in.course.closed = false;
  for (Waypoint& waypoint : in.course.waypoints) waypoint.gate.opening = GateShape::Opening::kRound;
  const auto out = round_trip<wire::SessionRequestPubSubType>(in);
  EXPECT_EQ(out.version, in.version);
  EXPECT_EQ(out.vehicle, in.vehicle);
  EXPECT_EQ(out.request, in.request);
  EXPECT_EQ(out.action, in.action);
  EXPECT_EQ(out.timing, in.timing);
  EXPECT_EQ(out.profile, in.profile);
  EXPECT_EQ(out.seed, in.seed);
  EXPECT_EQ(out.speed_limit_m_s, in.speed_limit_m_s);
  EXPECT_EQ(out.priority, in.priority);
  EXPECT_EQ(out.quadrotor.mass_kg, in.quadrotor.mass_kg);
  EXPECT_EQ(out.quadrotor.inertia_kg_m2, in.quadrotor.inertia_kg_m2);
  EXPECT_EQ(out.quadrotor.rotor_position_B_m, in.quadrotor.rotor_position_B_m);
  EXPECT_EQ(out.quadrotor.rotor_spin, in.quadrotor.rotor_spin);
  EXPECT_EQ(out.quadrotor.torque_per_thrust_m, in.quadrotor.torque_per_thrust_m);
  EXPECT_EQ(out.quadrotor.thrust_min_n, in.quadrotor.thrust_min_n);
  EXPECT_EQ(out.quadrotor.thrust_max_n, in.quadrotor.thrust_max_n);
  EXPECT_EQ(out.quadrotor.thrust_rate_max_n_s, in.quadrotor.thrust_rate_max_n_s);
  EXPECT_EQ(out.quadrotor.rotor_time_constant_s, in.quadrotor.rotor_time_constant_s);
  EXPECT_EQ(out.quadrotor.drag_kg_s, in.quadrotor.drag_kg_s);
  EXPECT_EQ(out.quadrotor.collision_radius_m, in.quadrotor.collision_radius_m);
  EXPECT_EQ(out.quadrotor.body_rate_max_rad_s, in.quadrotor.body_rate_max_rad_s);
  EXPECT_EQ(out.actuation.kind, in.actuation.kind);
  EXPECT_EQ(out.actuation.thrust_time_constant_s, in.actuation.thrust_time_constant_s);
  EXPECT_EQ(out.actuation.rate_time_constant_s, in.actuation.rate_time_constant_s);
  EXPECT_EQ(out.camera.metres_per_count, in.camera.metres_per_count);
  EXPECT_EQ(out.camera.distortion_model, in.camera.distortion_model);
  EXPECT_EQ(out.camera.distortion, in.camera.distortion);
  EXPECT_EQ(out.camera.width_px, in.camera.width_px);
  EXPECT_EQ(out.camera.height_px, in.camera.height_px);
  EXPECT_EQ(out.camera.fx_px, in.camera.fx_px);
  EXPECT_EQ(out.camera.fy_px, in.camera.fy_px);
  EXPECT_EQ(out.camera.cx_px, in.camera.cx_px);
  EXPECT_EQ(out.camera.cy_px, in.camera.cy_px);
  EXPECT_EQ(out.camera.min_depth_m, in.camera.min_depth_m);
  EXPECT_EQ(out.camera.max_depth_m, in.camera.max_depth_m);
  EXPECT_EQ(out.camera.rate_hz, in.camera.rate_hz);
  EXPECT_TRUE(out.camera.X_BC.isApprox(in.camera.X_BC, 1e-14));
  ASSERT_EQ(out.course.waypoints.size(), in.course.waypoints.size());
  for (std::size_t i = 0; i < in.course.waypoints.size(); ++i) {
    EXPECT_EQ(out.course.waypoints[i].p_W, in.course.waypoints[i].p_W);
    EXPECT_EQ(out.course.waypoints[i].direction_W, in.course.waypoints[i].direction_W);
    EXPECT_EQ(out.course.waypoints[i].gate_id, in.course.waypoints[i].gate_id);
    EXPECT_EQ(out.course.waypoints[i].gate.opening, in.course.waypoints[i].gate.opening);
    EXPECT_EQ(out.course.waypoints[i].gate.inner_half_m, in.course.waypoints[i].gate.inner_half_m);
    EXPECT_EQ(out.course.waypoints[i].gate.outer_half_m, in.course.waypoints[i].gate.outer_half_m);
    EXPECT_EQ(out.course.waypoints[i].gate.thickness_m, in.course.waypoints[i].gate.thickness_m);
  }
  EXPECT_EQ(out.course.laps, in.course.laps);
  EXPECT_EQ(out.course.closed, in.course.closed);
  EXPECT_EQ(out.course.floor_z_m, in.course.floor_z_m);
}

TEST(Convert, SessionReplyComesBackAsItWas) {
  protocol::SessionReply in = test::good_reply();
  in.reason = std::string(protocol::kMaxReasonLength, 'r');
  in.code = ErrorCode::kBusyServer;
  in.field = std::string(protocol::kMaxFieldLength, 'f');
  in.value = "3";
  in.expected = "4";
  const auto out = round_trip<wire::SessionReplyPubSubType>(in);
  EXPECT_EQ(out.version, in.version);
  EXPECT_EQ(out.vehicle, in.vehicle);
  EXPECT_EQ(out.request, in.request);
  EXPECT_EQ(out.accepted, in.accepted);
  EXPECT_EQ(out.reason, in.reason);
  EXPECT_EQ(out.server, in.server);
  EXPECT_EQ(out.session, in.session);
  EXPECT_EQ(out.control_period_s, in.control_period_s);
  EXPECT_EQ(out.plan_step_s, in.plan_step_s);
  EXPECT_EQ(out.plan_steps, in.plan_steps);
  EXPECT_EQ(out.model_hash, in.model_hash);
  EXPECT_EQ(out.code, in.code);
  EXPECT_EQ(out.field, in.field);
  EXPECT_EQ(out.value, in.value);
  EXPECT_EQ(out.expected, in.expected);
}

TEST(Convert, VehicleStateComesBackAsItWas) {
  const protocol::VehicleState in = test::good_state();
  const auto out = round_trip<wire::VehicleStatePubSubType>(in);
  EXPECT_EQ(out.vehicle, in.vehicle);
  EXPECT_EQ(out.session, in.session);
  EXPECT_EQ(out.sequence, in.sequence);
  EXPECT_EQ(out.stamp, in.stamp);
  EXPECT_EQ(out.state.p_WB, in.state.p_WB);
  EXPECT_EQ(out.state.v_WB, in.state.v_WB);
  EXPECT_EQ(out.state.q_WB.coeffs(), in.state.q_WB.coeffs());
  EXPECT_EQ(out.state.w_WB_B, in.state.w_WB_B);
  EXPECT_EQ(out.state.thrust_n, in.state.thrust_n);
  EXPECT_EQ(out.state.thrust_command_n, in.state.thrust_command_n);
  EXPECT_EQ(out.thrust_known, in.thrust_known);
  EXPECT_EQ(out.round_trip, in.round_trip);
  EXPECT_EQ(out.depth_sequence, in.depth_sequence);
  EXPECT_EQ(out.heard_waypoint, in.heard_waypoint);
  EXPECT_EQ(out.heard_lap, in.heard_lap);
  EXPECT_EQ(out.asked.by, in.asked.by);
  EXPECT_EQ(out.asked.command, in.asked.command);
}

TEST(Convert, AQuaternionNearOneIsNormalised) {
  protocol::VehicleState in = test::good_state();
  in.state.q_WB.coeffs() *= 1.0009;
  const auto out = round_trip<wire::VehicleStatePubSubType>(in);
  EXPECT_NEAR(out.state.q_WB.norm(), 1.0, 1e-15);
}

TEST(Convert, CommandComesBackAsItWas) {
  for (const int steps : {1, 20, protocol::kMaxPlanSteps}) {
    const protocol::ThrustRateCommand in = test::good_command("drone", 3, steps);
    const auto out = round_trip<wire::ThrustRateCommandPubSubType>(in);
    EXPECT_EQ(out.vehicle, in.vehicle);
    EXPECT_EQ(out.session, in.session);
    EXPECT_EQ(out.sequence, in.sequence);
    EXPECT_EQ(out.answers_sequence, in.answers_sequence);
    EXPECT_EQ(out.answers_stamp, in.answers_stamp);
    EXPECT_EQ(out.plan_start, in.plan_start);
    EXPECT_EQ(out.plan_step, in.plan_step);
    EXPECT_EQ(out.validity, in.validity);
    ASSERT_EQ(out.steps, in.steps);
    for (std::size_t k = 0; k < static_cast<std::size_t>(steps); ++k) {
      EXPECT_EQ(out.thrust_rate_n_s[k], in.thrust_rate_n_s[k]);
      EXPECT_EQ(out.rotor_thrust_n[k], in.rotor_thrust_n[k]);
      EXPECT_EQ(out.collective_thrust_n[k], in.collective_thrust_n[k]);
      EXPECT_EQ(out.body_rates_rad_s[k], in.body_rates_rad_s[k]);
    }
    expect_same(out.health, in.health);
    EXPECT_STREQ(out.isa.data(), in.isa.data());
  }
}

TEST(Convert, AnIsaOfFullLengthStaysTerminated) {
  protocol::ThrustRateCommand in = test::good_command();
  std::memcpy(in.isa.data(), "fifteen-letters", 16);
  EXPECT_STREQ(round_trip<wire::ThrustRateCommandPubSubType>(in).isa.data(), "fifteen-letters");
}

TEST(Convert, APlanOfTwentyStepsFitsOneDatagram) {
  wire::ThrustRateCommandPubSubType type;
  wire::ThrustRateCommand sample;
  to_wire(test::good_command(std::string(63, 'x')), &sample);
  // 1400 bytes less the RTPS header, timestamp, inline QoS of a keyed sample and a heartbeat
  EXPECT_LT(type.getSerializedSizeProvider(&sample)(), 1400u - 150u);
}

TEST(Convert, ServerStatusComesBackAsItWas) {
  const protocol::ServerStatus in = test::good_status();
  const auto out = round_trip<wire::ServerStatusPubSubType>(in);
  EXPECT_EQ(out.version, in.version);
  EXPECT_EQ(out.name, in.name);
  EXPECT_EQ(out.room_cores, in.room_cores);
  EXPECT_EQ(out.sessions, in.sessions);
  EXPECT_EQ(out.accepts, in.accepts);
  EXPECT_EQ(out.isa, in.isa);
  EXPECT_EQ(out.model_hash, in.model_hash);
}

TEST(Convert, TelemetryComesBackAsItWas) {
  const protocol::Telemetry in = test::good_telemetry();
  const auto out = round_trip<wire::TelemetryPubSubType>(in);
  EXPECT_EQ(out.vehicle, in.vehicle);
  EXPECT_EQ(out.session, in.session);
  EXPECT_EQ(out.server_stamp, in.server_stamp);
  expect_same(out.health, in.health);
  EXPECT_EQ(out.states_received, in.states_received);
  EXPECT_EQ(out.states_rejected, in.states_rejected);
  EXPECT_EQ(out.frames_received, in.frames_received);
  EXPECT_EQ(out.frames_rejected, in.frames_rejected);
  EXPECT_EQ(out.frames_invalid, in.frames_invalid);
  EXPECT_EQ(out.commands_sent, in.commands_sent);
  EXPECT_EQ(out.deadlines_missed, in.deadlines_missed);
  EXPECT_EQ(out.encode_time_s, in.encode_time_s);
  EXPECT_EQ(out.last_code, in.last_code);
  EXPECT_EQ(out.last_field, in.last_field);
  EXPECT_EQ(out.last_value, in.last_value);
  EXPECT_EQ(out.last_expected, in.last_expected);
  EXPECT_EQ(out.last_reason, in.last_reason);
  EXPECT_EQ(out.isa, in.isa);
}

TEST(Convert, DepthFrameComesBackAsItWas) {
  const protocol::DepthFrame in = test::good_frame("drone", 4);
  wire::DepthFrame sample;
  header_to_wire(in, &sample);
  sample.pixels() = in.pixels;
  wire::DepthFrame received = through_bytes<wire::DepthFramePubSubType>(&sample);
  protocol::DepthFrame out;
  ASSERT_TRUE(from_wire(&received, &out).ok());
  EXPECT_EQ(out.vehicle, in.vehicle);
  EXPECT_EQ(out.session, in.session);
  EXPECT_EQ(out.sequence, in.sequence);
  EXPECT_EQ(out.stamp, in.stamp);
  EXPECT_EQ(out.width_px, in.width_px);
  EXPECT_EQ(out.height_px, in.height_px);
  EXPECT_EQ(out.encoding, in.encoding);
  EXPECT_EQ(out.pixels, in.pixels);
}

TEST(Convert, PilotRecordComesBackAsItWas) {
  const protocol::PilotRecord in = test::good_record();
  const auto back = round_trip<wire::PilotRecordPubSubType>(in);
  EXPECT_EQ(back.vehicle, in.vehicle);
  EXPECT_EQ(back.session, in.session);
  EXPECT_EQ(back.request, in.request);
  EXPECT_EQ(back.kind, in.kind);
  EXPECT_EQ(back.take_overs, in.take_overs);
  EXPECT_EQ(back.written, in.written);
  EXPECT_EQ(back.pilot, in.pilot);
}

TEST(Hostile, RecordsOfAnotherVersionAreRefused) {
  wire::PilotRecord sample;
  to_wire(test::good_record(), &sample);
  sample.version(wire::PILOT_RECORD_VERSION + 1);
  protocol::PilotRecord out;
  const Status verdict = from_wire(sample, &out);
  ASSERT_FALSE(verdict.ok());
  EXPECT_EQ(verdict.failure().code, ErrorCode::kVersion);
}

TEST(Hostile, CountsBeyondTheirBoundsAreNamed) {
  wire::SessionRequest request;
  to_wire(test::good_request(), &request);
  request.course().waypoints().resize(1000);
  protocol::SessionRequest out_request;
  Status verdict = from_wire(request, &out_request);
  ASSERT_FALSE(verdict.ok());
  EXPECT_NE(verdict.error().find("course.waypoints is 1000"), std::string::npos) << verdict.error();

  wire::ThrustRateCommand command;
  to_wire(test::good_command(), &command);
  command.plan().resize(65);
  protocol::ThrustRateCommand out_command;
  verdict = from_wire(command, &out_command);
  ASSERT_FALSE(verdict.ok());
  EXPECT_NE(verdict.error().find("steps is 65"), std::string::npos) << verdict.error();
  command.plan().clear();
  EXPECT_FALSE(from_wire(command, &out_command).ok());
}

TEST(Hostile, NumbersThatFitNoIntAreRefused) {
  wire::SessionRequest request;
  to_wire(test::good_request(), &request);
  request.camera().width_px(0xffffffffu);
  protocol::SessionRequest out;
  EXPECT_FALSE(from_wire(request, &out).ok());
  to_wire(test::good_request(), &request);
  request.course().laps(0x80000001u);
  EXPECT_FALSE(from_wire(request, &out).ok());
  wire::SessionReply reply;
  to_wire(test::good_reply(), &reply);
  reply.plan_steps(0xffffffffu);
  protocol::SessionReply out_reply;
  EXPECT_FALSE(from_wire(reply, &out_reply).ok());
}

TEST(Hostile, AMountingThatIsNoRotationIsRefused) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const std::array<double, 4>& q :
       {std::array<double, 4>{0, 0, 0, 0}, {0, 0, 0, 2}, {nan, 0, 0, 1}, {1e300, 1e300, 1e300, 1e300}}) {
    wire::SessionRequest request;
    to_wire(test::good_request(), &request);
    request.camera().q_BC(q);
    protocol::SessionRequest out;
    const Status verdict = from_wire(request, &out);
    ASSERT_FALSE(verdict.ok());
    EXPECT_NE(verdict.error().find("camera.X_BC"), std::string::npos) << verdict.error();
  }
}

TEST(Hostile, FramesThatContradictThemselvesAreRefused) {
  const auto verdict = [](auto&& spoil) {
    wire::DepthFrame sample;
    const auto good = test::good_frame();
    header_to_wire(good, &sample);
    sample.pixels() = good.pixels;
    spoil(&sample);
    protocol::DepthFrame out;
    return from_wire(&sample, &out);
  };
  EXPECT_TRUE(verdict([](wire::DepthFrame*) {}).ok());
  EXPECT_FALSE(verdict([](wire::DepthFrame* f) { f->width_px(161); }).ok());
  EXPECT_FALSE(verdict([](wire::DepthFrame* f) { f->width_px(0); }).ok());
  // 0x10000 * 0x10000 * 2 is 0 in 32 bits
  EXPECT_FALSE(verdict([](wire::DepthFrame* f) {
                 f->width_px(0x10000);
                 f->height_px(0x10000);
                 f->pixels().clear();
               }).ok());
  EXPECT_FALSE(verdict([](wire::DepthFrame* f) { f->encoding(7); }).ok());
  EXPECT_FALSE(verdict([](wire::DepthFrame* f) { f->pixels().clear(); }).ok());
}

// Any bytes at all: reading them may fail, and what is read may be refused, but nothing throws and nothing is let
// through unchecked.
template <typename Generated, typename Message>
void fuzz(const Message& good, std::uint64_t seed) {
  WireType<Generated> type;
  typename Generated::type sample;
  if constexpr (std::is_same_v<Message, protocol::DepthFrame>) {
    header_to_wire(good, &sample);
    sample.pixels() = good.pixels;
  } else {
    to_wire(good, &sample);
  }
  SerializedPayload_t original(type.getSerializedSizeProvider(&sample)());
  ASSERT_TRUE(type.serialize(&sample, &original));

  Random random(seed);
  int read = 0;
  for (int round = 0; round < 3000; ++round) {
    SerializedPayload_t bytes(original.length);
    bytes.length = original.length;
    std::copy(original.data, original.data + original.length, bytes.data);
    const int kind = round % 3;
    if (kind == 0) bytes.length = random.below(original.length);  // cut off
    if (kind == 1)                                                // a few bytes changed, near the front mostly
      for (std::uint32_t i = 0; i < 1 + random.below(6); ++i)
        bytes.data[random.below(1 + random.below(original.length))] = static_cast<std::uint8_t>(random.bits());
    if (kind == 2) {  // noise after a good name, or from the start
      bytes.length = 4 + random.below(original.length - 4);
      for (std::uint32_t i = random.chance(0.5) ? 16 : 0; i < bytes.length; ++i)
        bytes.data[i] = static_cast<std::uint8_t>(random.bits());
    }
    typename Generated::type out;
    InstanceHandle_t handle;
    if (!type.deserialize(&bytes, &out)) continue;
    ++read;
    type.getKey(&out, &handle, false);
    Message message;
    Status verdict;
    if constexpr (std::is_same_v<Message, protocol::DepthFrame>)
      verdict = from_wire(&out, &message);
    else
      verdict = from_wire(out, &message);
    if constexpr (!std::is_same_v<Message, protocol::DepthFrame>) {
      EXPECT_EQ(verdict.ok(), protocol::validate(message).ok());
    }
  }
  EXPECT_GT(read, 100) << "the noise never got as far as the conversion";
}

TEST(Hostile, AnyBytesAreReadOrRefusedWithoutAnException) {
  fuzz<wire::SessionRequestPubSubType>(test::good_request(), 1);
  fuzz<wire::SessionReplyPubSubType>(test::good_reply(), 2);
  fuzz<wire::VehicleStatePubSubType>(test::good_state(), 3);
  fuzz<wire::ThrustRateCommandPubSubType>(test::good_command(), 4);
  fuzz<wire::TelemetryPubSubType>(test::good_telemetry(), 5);
  fuzz<wire::ServerStatusPubSubType>(test::good_status(), 6);
  fuzz<wire::DepthFramePubSubType>(test::good_frame(), 6);
  fuzz<wire::PilotRecordPubSubType>(test::good_record(), 7);
}

TEST(WireType, KeysMayBeComputedByManyThreads) {
  // One type object serves all command writers of a server, and each vehicle's control thread publishes when it likes.
  WireType<wire::ThrustRateCommandPubSubType> type;
  const auto key_of = [&](const std::string& vehicle) {
    wire::ThrustRateCommand sample;
    sample.vehicle() = vehicle;
    InstanceHandle_t handle;
    EXPECT_TRUE(type.getKey(&sample, &handle, false));
    return handle;
  };
  std::atomic<int> wrong{0};
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back([&, i] {
      const std::string vehicle = std::string("drone-number-") + static_cast<char>('a' + i);
      const InstanceHandle_t expected = key_of(vehicle);
      for (int round = 0; round < 100000; ++round)
        if (!(key_of(vehicle) == expected)) ++wrong;
    });
  }
  for (auto& thread : threads) thread.join();
  EXPECT_EQ(wrong, 0);
}

TEST(RealTime, ACommandIsCheckedAndConvertedWithoutAllocating) {
  const protocol::ThrustRateCommand command = test::good_command("a-vehicle-with-a-rather-long-name");
  wire::ThrustRateCommand sample;
  to_wire(command, &sample);  // the first one makes room for the plan
  protocol::ThrustRateCommand back;
  ASSERT_TRUE(from_wire(sample, &back).ok());

  const test::AllocationTrap trap;
  const bool good = protocol::validate(command).ok();
  to_wire(command, &sample);
  const bool read = from_wire(sample, &back).ok();
  EXPECT_EQ(trap.count(), 0u);
  EXPECT_TRUE(good && read);
}

TEST(RealTime, AStateIsConvertedAndCheckedWithoutAllocating) {
  wire::VehicleState sample;
  to_wire(test::good_state("a-vehicle-with-a-rather-long-name"), &sample);
  protocol::VehicleState state;
  ASSERT_TRUE(from_wire(sample, &state).ok());
  const test::AllocationTrap trap;
  const bool good = from_wire(sample, &state).ok();
  EXPECT_EQ(trap.count(), 0u);
  EXPECT_TRUE(good);
}

}  // namespace
}  // namespace gatefield::dds
