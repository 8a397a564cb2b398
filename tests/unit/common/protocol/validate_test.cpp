#include "common/protocol/validate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "tests/support/messages.h"

namespace gatefield::protocol {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// One way to spoil a message, and what the refusal must name.
template <typename Message>
struct Spoiled {
  const char* name;
  std::function<void(Message*)> spoil;
  const char* names;
};

template <typename Message>
void expect_refused(const Message& good, const std::vector<Spoiled<Message>>& cases) {
  ASSERT_TRUE(validate(good).ok()) << validate(good).error();
  for (const auto& spoiled : cases) {
    Message message = good;
    spoiled.spoil(&message);
    const Status verdict = validate(message);
    ASSERT_FALSE(verdict.ok()) << spoiled.name << " was let through";
    EXPECT_NE(verdict.error().find(spoiled.names), std::string::npos) << spoiled.name << ": " << verdict.error();
    EXPECT_NE(verdict.error().find("expected"), std::string::npos) << spoiled.name << ": " << verdict.error();
    // What programs decide by: the path of the field alone, whatever words stand around it.
    const Error& failure = verdict.failure();
    EXPECT_NE(failure.code, ErrorCode::kOther) << spoiled.name;
    EXPECT_TRUE(!failure.field.empty() && failure.field.find_first_of(" ()") == std::string::npos)
        << spoiled.name << ": " << failure.field;
  }
}

template <typename Message>
void expect_accepted(const Message& good, const std::vector<std::function<void(Message*)>>& changes) {
  for (std::size_t i = 0; i < changes.size(); ++i) {
    Message message = good;
    changes[i](&message);
    EXPECT_TRUE(validate(message).ok()) << "change " << i << ": " << validate(message).error();
  }
}

TEST(ValidateServerStatus, NamesWhatIsWrong) {
  using S = ServerStatus;
  expect_refused<S>(test::good_status(), {{"version", [](S* s) { s->version = 1; }, "version is 1, expected 2"},
                                          {"name", [](S* s) { s->name = "pad 1"; }, "name is \"pad 1\""},
                                          {"room", [](S* s) { s->room_cores = -0.1; }, "room_cores is -0.1"},
                                          {"too much room", [](S* s) { s->room_cores = 1e9; }, "room_cores"},
                                          {"no number", [](S* s) { s->room_cores = kNan; }, "room_cores is nan"},
                                          {"sessions", [](S* s) { s->sessions = 1u << 20; }, "sessions"},
                                          {"isa", [](S* s) { s->isa = "avx\n"; }, "isa"},
                                          {"long isa", [](S* s) { s->isa = std::string(16, 'x'); }, "isa"}});
  expect_accepted<S>(test::good_status(), {[](S* s) { s->room_cores = 0; }, [](S* s) { s->accepts = false; }});
}

TEST(ValidateName, TakesWhatTheWireAllows) {
  EXPECT_TRUE(validate_name("vehicle", "a").ok());
  EXPECT_TRUE(validate_name("vehicle", "Drone_7.test-A").ok());
  EXPECT_TRUE(validate_name("vehicle", std::string(63, 'x')).ok());
}

TEST(ValidateName, RefusesTheRestAndShowsItOnlyWhenItIsHarmless) {
  EXPECT_FALSE(validate_name("vehicle", "").ok());
  EXPECT_FALSE(validate_name("vehicle", std::string(64, 'x')).ok());
  EXPECT_FALSE(validate_name("vehicle", "gr\xc3\xbcn").ok());
  EXPECT_FALSE(validate_name("vehicle", std::string("a\0b", 3)).ok());
  EXPECT_NE(validate_name("vehicle", "two words").error().find("\"two words\""), std::string::npos);
  EXPECT_EQ(validate_name("vehicle", "a\x1b[2Jb").error().find('\x1b'), std::string::npos);
}

TEST(ValidateRequest, RefusesEveryBadFieldByName) {
  using R = SessionRequest;
  expect_refused<R>(
      test::good_request(),
      {
          {"version", [](R* r) { r->version = 1; }, "version is 1"},
          {"name", [](R* r) { r->vehicle = std::string("a b"); }, "vehicle is"},
          {"request", [](R* r) { r->request = 0; }, "request is 0"},
          {"action", [](R* r) { r->action = static_cast<R::Action>(9); }, "action is 9"},
          {"timing", [](R* r) { r->timing = static_cast<Timing>(2); }, "timing is 2"},
          {"profile", [](R* r) { r->profile = std::string("../race"); }, "profile is"},
          {"slow", [](R* r) { r->speed_limit_m_s = 0.4; }, "speed_limit_m_s is 0.4"},
          {"fast", [](R* r) { r->speed_limit_m_s = 50.5; }, "speed_limit_m_s is 50.5"},
          {"speed NaN", [](R* r) { r->speed_limit_m_s = kNan; }, "speed_limit_m_s is"},
          {"speed negative", [](R* r) { r->speed_limit_m_s = -1; }, "speed_limit_m_s is -1"},
          {"priority", [](R* r) { r->priority = 10; }, "priority is 10, expected 0 to 9"},
          {"mass", [](R* r) { r->quadrotor.mass_kg = 0; }, "mass_kg"},
          {"thrust below weight", [](R* r) { r->quadrotor.thrust_max_n = 1.9; }, "thrust_max_n"},
          {"rates", [](R* r) { r->quadrotor.body_rate_max_rad_s.z() = 101; }, "body_rate_max_rad_s[2] is 101"},
          {"actuation", [](R* r) { r->actuation.kind = static_cast<Actuation::Kind>(2); }, "actuation.kind is 2"},
          {"lag of rotors", [](R* r) { r->actuation.thrust_time_constant_s = 0.1; },
           "actuation.thrust_time_constant_s is 0.1 s"},
          {"lag of a rate loop",
           [](R* r) {
             r->actuation.kind = Actuation::Kind::kBodyRates;
             r->actuation.thrust_time_constant_s = 0.03;
           },
           "actuation.rate_time_constant_s[0] is 0 s, expected 0.001 to 1 s"},
          {"counts", [](R* r) { r->camera.metres_per_count = 0; }, "camera.metres_per_count is 0"},
          {"distortion model", [](R* r) { r->camera.distortion_model = static_cast<CameraModel::Distortion>(7); },
           "camera.distortion_model is 7"},
          {"distortion", [](R* r) { r->camera.distortion[0] = -0.1; },
           "camera.distortion is one that moves a pixel by"},
          {"camera size", [](R* r) { r->camera.width_px = 8; }, "camera.width_px"},
          {"camera mounting", [](R* r) { r->camera.X_BC.linear().setZero(); }, "camera.X_BC"},
          {"no course", [](R* r) { r->course.waypoints.clear(); }, "course.waypoints is 0"},
          {"long course", [](R* r) { r->course.waypoints.resize(65); }, "course.waypoints is 65"},
          {"waypoint NaN", [](R* r) { r->course.waypoints[1].p_W.x() = kNan; }, "course.waypoints[1].p_W"},
          {"waypoint far", [](R* r) { r->course.waypoints[2].p_W.y() = 1e5; }, "course.waypoints[2].p_W"},
          {"direction", [](R* r) { r->course.waypoints[0].direction_W *= 1.01; }, "course.waypoints[0].direction_W"},
          {"direction NaN", [](R* r) { r->course.waypoints[0].direction_W.z() = kNan; },
           "course.waypoints[0].direction_W"},
          {"no laps", [](R* r) { r->course.laps = 0; }, "course.laps is 0"},
          {"many laps", [](R* r) { r->course.laps = 1001; }, "course.laps is 1001"},
          {"gate", [](R* r) { r->course.waypoints[1].gate.inner_half_m = 0; }, "course.waypoints[1].gate.inner_half_m"},
          {"narrow gate",
           [](R* r) {
             r->quadrotor.collision_radius_m = 0.2;
             r->course.waypoints[1].gate.inner_half_m = 0.2;
           },
           "course.waypoints[1].gate.inner_half_m is 0.2, expected more than the vehicle's collision_radius_m, 0.2 m"},
          {"opening", [](R* r) { r->course.waypoints[2].gate.opening = static_cast<GateShape::Opening>(2); },
           "course.waypoints[2].gate.opening is 2"},
      });
}

TEST(ValidateRequest, SaysWhichFieldAndThatAnotherVersionIsAnotherMatter) {
  SessionRequest request = test::good_request();
  request.course.waypoints[1].gate.thickness_m = 2;
  Error error = validate(request).failure();
  EXPECT_EQ(error.code, ErrorCode::kInvalid);
  EXPECT_EQ(error.field, "course.waypoints[1].gate.thickness_m");
  EXPECT_EQ(error.value, "2");
  EXPECT_EQ(error.expected, "0.005 to 1 m");
  request.version = 1;
  error = validate(request).failure();
  EXPECT_EQ(error.code, ErrorCode::kVersion);
  EXPECT_EQ(error.field, "version");
}

TEST(ValidateReply, ARefusalMayBeOfTheVersionOfWhoAsked) {
  SessionReply reply = test::good_reply();
  reply.version = 1;
  EXPECT_FALSE(validate(reply).ok());
  reply.accepted = false;
  reply.reason = "version is 1, expected 2";
  EXPECT_TRUE(validate(reply).ok());
}

TEST(ValidateRequest, TakesTheEdgesOfItsRanges) {
  using R = SessionRequest;
  expect_accepted<R>(test::good_request(), {
                                               [](R* r) { r->speed_limit_m_s = 0; },
                                               [](R* r) { r->speed_limit_m_s = 0.5; },
                                               [](R* r) { r->speed_limit_m_s = 50; },
                                               [](R* r) { r->priority = 0; },
                                               [](R* r) { r->priority = 9; },
                                               [](R* r) { r->course.waypoints.resize(64, r->course.waypoints[0]); },
                                               [](R* r) { r->course.waypoints.resize(1); },
                                               [](R* r) { r->course.laps = 1000; },
                                               // A goodbye needs no vehicle.
                                               [](R* r) {
                                                 r->action = R::Action::kLeave;
                                                 r->quadrotor.mass_kg = 0;
                                                 r->course.waypoints.clear();
                                               },
                                           });
}

TEST(ValidateReply, RefusesEveryBadFieldByName) {
  using R = SessionReply;
  expect_refused<R>(test::good_reply(),
                    {
                        {"version", [](R* r) { r->version = 0; }, "version is 0"},
                        {"name", [](R* r) { r->vehicle.clear(); }, "vehicle is"},
                        {"request", [](R* r) { r->request = 0; }, "request is 0"},
                        {"server", [](R* r) { r->server = "s p"; }, "server is"},
                        {"field", [](R* r) { r->field = std::string(128, 'f'); }, "field is 128 characters long"},
                        {"value", [](R* r) { r->value = "a\n"; }, "value is text with control characters"},
                        {"expected", [](R* r) { r->expected = "\x1b[2J"; }, "expected is text with control"},
                        {"session", [](R* r) { r->session = 0; }, "session is 0"},
                        {"period", [](R* r) { r->control_period_s = 0; }, "control_period_s is 0"},
                        {"step", [](R* r) { r->plan_step_s = kNan; }, "plan_step_s is"},
                        {"steps", [](R* r) { r->plan_steps = 65; }, "plan_steps is 65"},
                        {"retry", [](R* r) { r->retry_after_s = -1; }, "retry_after_s is -1"},
                        {"retry NaN", [](R* r) { r->retry_after_s = kNan; }, "retry_after_s is"},
                        {"retry never", [](R* r) { r->retry_after_s = 3601; }, "retry_after_s is 3601"},
                        {"silent refusal", [](R* r) { r->accepted = false; }, "reason is empty"},
                        {"long reason", [](R* r) { r->reason = std::string(512, 'x'); }, "reason is 512"},
                        {"escape", [](R* r) { r->reason = "a\x1b[31m"; }, "reason is text with control"},
                    });
  SessionReply refusal;
  refusal.vehicle = std::string("drone");
  refusal.request = 1;
  refusal.server = "s";
  refusal.reason = "no";
  EXPECT_TRUE(validate(refusal).ok()) << "a refusal needs no session";
}

TEST(ValidateState, RefusesEveryBadFieldByName) {
  using S = VehicleState;
  expect_refused<S>(
      test::good_state(),
      {
          {"name", [](S* s) { s->vehicle = std::string("/"); }, "vehicle is"},
          {"session", [](S* s) { s->session = 0; }, "session is 0"},
          {"sequence", [](S* s) { s->sequence = 0; }, "sequence is 0"},
          {"stamp", [](S* s) { s->stamp = Stamp(-1); }, "stamp is -1"},
          {"position NaN", [](S* s) { s->state.p_WB.y() = kNan; }, "p_WB is"},
          {"position far", [](S* s) { s->state.p_WB.z() = -1e5; }, "p_WB is"},
          {"velocity", [](S* s) { s->state.v_WB.x() = 200; }, "v_WB is"},
          {"velocity infinite", [](S* s) { s->state.v_WB.x() = -kInfinity; }, "v_WB is"},
          {"quaternion zero", [](S* s) { s->state.q_WB.coeffs().setZero(); }, "q_WB"},
          {"quaternion long", [](S* s) { s->state.q_WB.coeffs() *= 1.002; }, "q_WB"},
          {"quaternion short", [](S* s) { s->state.q_WB.coeffs() *= 0.998; }, "q_WB"},
          {"quaternion NaN", [](S* s) { s->state.q_WB.w() = kNan; }, "q_WB"},
          {"rates", [](S* s) { s->state.w_WB_B.z() = 201; }, "w_WB_B is"},
          {"thrust", [](S* s) { s->state.thrust_n[2] = kNan; }, "thrust_n is"},
          {"thrust command", [](S* s) { s->state.thrust_command_n[3] = kInfinity; }, "thrust_command_n is"},
          {"round trip", [](S* s) { s->round_trip = Stamp(-5); }, "round_trip is"},
          {"heard waypoint", [](S* s) { s->heard_waypoint = 65; }, "heard_waypoint is 65"},
          {"heard lap", [](S* s) { s->heard_lap = 1001; }, "heard_lap is 1001"},
          {"asked by", [](S* s) { s->asked.by = static_cast<AskedBy>(4); }, "asked_by is 4"},
          {"asked thrust", [](S* s) { s->asked.command[0] = kNan; }, "asked_collective_thrust_n is nan"},
          {"asked thrust huge", [](S* s) { s->asked.command[0] = 4.1e4; }, "asked_collective_thrust_n is 41000"},
          {"asked rates", [](S* s) { s->asked.command[3] = -kInfinity; }, "asked_body_rates_rad_s is"},
          {"asked rates huge", [](S* s) { s->asked.command[1] = 201; }, "asked_body_rates_rad_s is"},
      });
  expect_accepted<S>(test::good_state(), {
                                             [](S* s) { s->state.q_WB.coeffs() *= 1.0009; },
                                             [](S* s) { s->stamp = Stamp(0); },
                                             [](S* s) { s->round_trip = Stamp(0); },
                                         });
}

TEST(ValidateDepth, HoldsTheFrameAgainstTheCamera) {
  const CameraModel camera = default_camera();
  const auto refused = [&](auto&& spoil, const char* names) {
    DepthFrame frame = test::good_frame();
    spoil(&frame);
    const Status verdict = validate(frame, camera);
    ASSERT_FALSE(verdict.ok()) << names;
    EXPECT_NE(verdict.error().find(names), std::string::npos) << verdict.error();
  };
  EXPECT_TRUE(validate(test::good_frame(), camera).ok());
  refused([](DepthFrame* f) { f->vehicle = std::string(""); }, "vehicle is");
  refused([](DepthFrame* f) { f->session = 0; }, "session is 0");
  refused([](DepthFrame* f) { f->sequence = 0; }, "sequence is 0");
  refused([](DepthFrame* f) { f->stamp = Stamp(-2); }, "stamp is -2");
  refused([](DepthFrame* f) { std::swap(f->width_px, f->height_px); }, "size is 90 x 160 px, expected 160 x 90 px");
  refused([](DepthFrame* f) { f->width_px = 0xffffffffu; }, "size is");
  refused([](DepthFrame* f) { f->encoding = static_cast<DepthEncoding>(2); }, "encoding is 2");
  refused([](DepthFrame* f) { f->pixels.pop_back(); }, "pixels is 28799 bytes, expected 28800");
  refused([](DepthFrame* f) { f->encoding = DepthEncoding::kMetres32; }, "pixels is 28800 bytes, expected 57600");
}

TEST(ValidateCommand, RefusesEveryBadFieldByName) {
  using C = ThrustRateCommand;
  expect_refused<C>(
      test::good_command(),
      {
          {"name", [](C* c) { c->vehicle = std::string(" "); }, "vehicle is"},
          {"session", [](C* c) { c->session = 0; }, "session is 0"},
          {"sequence", [](C* c) { c->sequence = 0; }, "sequence is 0"},
          {"answers", [](C* c) { c->answers_sequence = 0; }, "answers_sequence is 0"},
          {"start", [](C* c) { c->plan_start = Stamp(-1); }, "plan_start is"},
          {"start without end", [](C* c) { c->plan_start = Stamp::max(); }, "plan_start is"},
          {"step short", [](C* c) { c->plan_step = Stamp(999'999); }, "plan_step is"},
          {"step long", [](C* c) { c->plan_step = Stamp(200'000'001); }, "plan_step is"},
          {"validity", [](C* c) { c->validity = Stamp(10'000'000'001); }, "validity is"},
          {"validity negative", [](C* c) { c->validity = Stamp(-1); }, "validity is"},
          {"no steps", [](C* c) { c->steps = 0; }, "steps is 0"},
          {"many steps", [](C* c) { c->steps = 65; }, "steps is 65"},
          {"rate", [](C* c) { c->thrust_rate_n_s[19][0] = kNan; }, "step 19: thrust_rate_n_s is"},
          {"thrust", [](C* c) { c->rotor_thrust_n[3][1] = kInfinity; }, "step 3: rotor_thrust_n is"},
          {"collective", [](C* c) { c->collective_thrust_n[0] = kNan; }, "step 0: collective_thrust_n is"},
          {"body rates", [](C* c) { c->body_rates_rad_s[7].x() = 300; }, "step 7: body_rates_rad_s is"},
          {"solve time", [](C* c) { c->health.solve_time_s = -1; }, "health.solve_time_s is -1"},
          {"samples", [](C* c) { c->health.effective_samples = kNan; }, "health.effective_samples is"},
          {"field", [](C* c) { c->health.lowest_field_m = kInfinity; }, "health.lowest_field_m is"},
          {"latent age", [](C* c) { c->health.latent_age_s = -0.5; }, "health.latent_age_s is -0.5"},
          {"state age", [](C* c) { c->health.state_age_s = -0.1; }, "health.state_age_s is -0.1"},
          {"target", [](C* c) { c->health.target_waypoint = 65; }, "health.target_waypoint is 65"},
          {"isa open", [](C* c) { c->isa.fill('x'); }, "isa is"},
      });
  C bad_step = test::good_command();
  bad_step.rotor_thrust_n[3][1] = kInfinity;
  EXPECT_EQ(validate(bad_step).failure().field, "plan[3].rotor_thrust_n");
  expect_accepted<C>(test::good_command(), {
                                               // What lies past the steps is not looked at.
                                               [](C* c) { c->thrust_rate_n_s[20][0] = kNan; },
                                               [](C* c) { c->health.latent_age_s = -1; },
                                               [](C* c) { c->validity = Stamp(0); },
                                               [](C* c) { c->plan_start = Stamp::max() / 2; },
                                               [](C* c) { c->steps = 64; },
                                           });
}

TEST(ValidateCommand, APlanOfBodyRatesSaysNothingOfRotorsAndNeverPullsDown) {
  using C = ThrustRateCommand;
  C rates = test::good_command();
  rates.actuation = Actuation::Kind::kBodyRates;
  rates.thrust_rate_n_s.fill(Eigen::Vector4d::Zero());
  rates.rotor_thrust_n.fill(Eigen::Vector4d::Zero());
  expect_refused<C>(
      rates,
      {
          {"rates of rotors", [](C* c) { c->thrust_rate_n_s[2][3] = 0.5; },
           "step 2: thrust_rate_n_s is (0, 0, 0, 0.5), expected 0 in a plan of body rates"},
          {"rotors", [](C* c) { c->rotor_thrust_n[19][0] = 1; }, "step 19: rotor_thrust_n is (1, 0, 0, 0), expected 0"},
          {"pull", [](C* c) { c->collective_thrust_n[4] = -0.1; },
           "step 4: collective_thrust_n is -0.1, expected 0 to"},
          {"much", [](C* c) { c->collective_thrust_n[4] = 4.1e4; }, "step 4: collective_thrust_n is 41000"},
          {"none", [](C* c) { c->collective_thrust_n[4] = kNan; }, "step 4: collective_thrust_n is"},
          {"turn", [](C* c) { c->body_rates_rad_s[1].z() = kInfinity; }, "step 1: body_rates_rad_s is"},
          {"kind", [](C* c) { c->actuation = static_cast<Actuation::Kind>(2); }, "actuation is 2"},
      });
  expect_accepted<C>(rates, {[](C* c) { c->collective_thrust_n[0] = 0.0; }});
}

TEST(ValidateTelemetry, RefusesEveryBadFieldByName) {
  using T = Telemetry;
  expect_refused<T>(
      test::good_telemetry(),
      {
          {"name", [](T* t) { t->vehicle = std::string(""); }, "vehicle is"},
          {"stamp", [](T* t) { t->server_stamp = Stamp(-1); }, "server_stamp is"},
          {"health", [](T* t) { t->health.state_age_s = kNan; }, "health.state_age_s is"},
          {"encode", [](T* t) { t->encode_time_s = -1; }, "encode_time_s is -1"},
          {"factor", [](T* t) { t->identified.thrust_factor = kNan; }, "found_thrust_factor is nan"},
          {"lag", [](T* t) { t->identified.rate_time_constant_s[2] = -0.1; }, "found_rate_time_constant_s is -0.1"},
          {"limit", [](T* t) { t->identified.rate_limit_rad_s[0] = kNan; }, "found_rate_limit_rad_s is nan"},
          {"reason", [](T* t) { t->last_reason = "a\nb"; }, "last_reason is text with control"},
          {"isa", [](T* t) { t->isa = std::string(16, 'x'); }, "isa is 16"},
      });
}

}  // namespace
}  // namespace gatefield::protocol
