#include "client/bridge/config/config.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "client/bridge/config/bridge.pb.h"
#include "client/bridge/config/fields.h"

namespace gatefield::bridge {
namespace {

using namespace std::chrono_literals;

constexpr const char* kRacer = "vehicle: 'racer-rates' course: 'one-gate' ";
constexpr const char* kMavlink = "mavlink { link: 'udp-listen:127.0.0.1:14540' radio { arm: 5 } } ";

class BridgeConfigFile : public testing::Test {
 protected:
  ~BridgeConfigFile() override { std::filesystem::remove(file_); }

  Result<BridgeConfig> load(const std::string& text, Firmware firmware = Firmware::kMavlink) {
    std::ofstream(file_) << text;
    return load_config(file_, firmware);
  }
  Error refused(const std::string& text, Firmware firmware = Firmware::kMavlink) {
    const auto config = load(text, firmware);
    EXPECT_FALSE(config.ok()) << text;
    return config.ok() ? Error("") : config.failure();
  }

  const std::filesystem::path file_ =
      std::filesystem::temp_directory_path() / ("gatefield-bridge-" + std::to_string(getpid()) + ".txt");
};

TEST_F(BridgeConfigFile, WhatIsLeftOutKeepsItsDefault) {
  const auto config = load(std::string(kRacer) + kMavlink);
  ASSERT_TRUE(config) << config.error();
  EXPECT_EQ(config->session.profile, "race");
  EXPECT_EQ(config->session.actuation.kind, Actuation::Kind::kBodyRates);
  EXPECT_EQ(config->session.course.waypoints.size(), 1U);
  EXPECT_EQ(config->safety.hold_limit, flight::SupervisorOptions{}.hold_limit);
  EXPECT_TRUE(config->safety.needs_pilot && config->safety.needs_depth);
  EXPECT_FALSE(config->safety.fence);
  const auto& mavlink = std::get<MavlinkConfig>(config->firmware);
  EXPECT_EQ(mavlink.dialect, Dialect::kPx4);
  EXPECT_EQ(mavlink.quadrotor.mass_kg, config->session.quadrotor.mass_kg);
}

TEST_F(BridgeConfigFile, WhatIsWrittenIsTaken) {
  const auto config = load(std::string(kRacer) +
                           "session { domain: 7 name: 'red' server: 'pit' profile: 'onboard' speed_limit_m_s: 4 "
                           "  connect_timeout: 1.5 state_rate_hz: 100 priority: 7 } "
                           "safety { arm_by: ITSELF needs_pilot: false needs_depth: false hold_limit: 4 "
                           "  battery_arm_v: 15 state { lost_after: 0.2 } "
                           "  fence { low { x: -1 y: -2 z: -3 } high { x: 1 y: 2 z: 3 } } } "
                           "thrust { hover_throttle: 0.4 exponent: 2 } "
                           "mavlink { link: 'tcp:127.0.0.1:5760' dialect: ARDUPILOT vehicle_system: 3 stamps: ARRIVAL "
                           "  link_delay: 0.01 state { from: LOCAL_POSITION p_WL { x: 1 y: 2 z: 3 } yaw_WL_rad: 0.5 } "
                           "  time_sync { most_drift_ppm: 50 } radio { kill: 7 } arm_by_command: true }");
  ASSERT_TRUE(config) << config.error();
  EXPECT_EQ(config->session.domain, 7U);
  EXPECT_EQ(config->session.vehicle, "red");
  EXPECT_EQ(config->session.connect_timeout, 1500ms);
  EXPECT_EQ(config->loop.state_rate_hz, 100);
  EXPECT_EQ(config->session.priority, 7);
  EXPECT_EQ(config->safety.arm_by, flight::ArmBy::kItself);
  EXPECT_EQ(config->safety.hold_limit, 4s);
  EXPECT_EQ(config->safety.state.lost_after, 200ms);
  ASSERT_TRUE(config->safety.fence);
  EXPECT_EQ(config->safety.fence->high_W, Eigen::Vector3d(1, 2, 3));
  const auto& mavlink = std::get<MavlinkConfig>(config->firmware);
  EXPECT_EQ(mavlink.dialect, Dialect::kArduPilot);
  EXPECT_EQ(mavlink.vehicle_system, 3);
  EXPECT_EQ(mavlink.stamps, Stamps::kArrival);
  EXPECT_EQ(mavlink.state.from, StateFrom::kLocalPosition);
  EXPECT_EQ(mavlink.state.frame.p_WL, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(mavlink.time_sync.most_drift_ppm, 50);
  EXPECT_EQ(mavlink.radio.kill, 7);
  EXPECT_EQ(mavlink.thrust.hover_throttle, 0.4);
}

TEST_F(BridgeConfigFile, BetaflightHasItsSection) {
  const auto config = load(std::string(kRacer) +
                               "thrust { exponent: 1.5 } betaflight { link: 'serial:/dev/ttyACM0:115200' "
                               "receiver: OVERRIDE arm_aux: 2 kill { aux: 4 from_us: 1800 } } "
                               "states { pose: '/mocap/pose' }",
                           Firmware::kBetaflight);
  ASSERT_TRUE(config) << config.error();
  const auto& options = std::get<betaflight::Options>(config->firmware);
  EXPECT_EQ(options.link.place, "/dev/ttyACM0");
  EXPECT_EQ(options.receiver, betaflight::Options::Receiver::kOverride);
  EXPECT_EQ(options.arm_aux, 2);
  ASSERT_TRUE(options.kill);
  EXPECT_EQ(options.kill->from_us, 1800);
  EXPECT_EQ(options.thrust.exponent, 1.5);
}

TEST_F(BridgeConfigFile, StatesAndDepthFromElsewhereHaveTheirSections) {
  const auto config = load(std::string(kRacer) + kMavlink +
                           "safety { tilt_apart_rad: 0.1 } states { odometry: '/vio/odometry' frame_id: 'map' "
                           "  p_WO { x: 1 y: 2 z: 3 } yaw_WO_rad: 0.5 p_MB { x: 0.1 y: 0 z: -0.05 } "
                           "  rpy_MB_rad { x: 0 y: 0 z: 1.5 } velocity_window: 0.05 "
                           "  time { from: ARRIVAL delay: 0.004 } } "
                           "depth { image: '/camera/depth' time { oldest: 0.5 } }");
  ASSERT_TRUE(config) << config.error();
  ASSERT_TRUE(config->sources.states && config->sources.depth);
  const sources::StateOptions& states = *config->sources.states;
  EXPECT_EQ(states.odometry, "/vio/odometry");
  EXPECT_EQ(states.frame_id, "map");
  EXPECT_EQ(states.p_WO, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(states.yaw_WO_rad, 0.5);
  EXPECT_EQ(states.p_MB, Eigen::Vector3d(0.1, 0, -0.05));
  EXPECT_EQ(states.rpy_MB_rad, Eigen::Vector3d(0, 0, 1.5));
  EXPECT_EQ(states.velocity_window, 50ms);
  EXPECT_EQ(states.time.from, sources::TimeOptions::From::kArrival);
  EXPECT_EQ(states.time.delay, 4ms);
  EXPECT_EQ(config->sources.depth->image, "/camera/depth");
  EXPECT_EQ(config->sources.depth->time.oldest, 500ms);
  EXPECT_EQ(config->safety.tilt_apart_rad, 0.1);

  const auto field = [&](const std::string& extra) { return refused(std::string(kRacer) + kMavlink + extra).field; };
  EXPECT_EQ(field("states { pose: '/a' odometry: '/b' }"), "states.odometry");
  EXPECT_EQ(field("states { pose: 'mocap' }"), "states.pose");
  EXPECT_EQ(field("states { pose: '/a' time { oldest: 2 } }"), "states.time.oldest");
  EXPECT_EQ(field("depth { image: '' }"), "depth.image");
}

TEST_F(BridgeConfigFile, BetaflightFliesByStatesFromElsewhereAndSomebodyHasToArm) {
  const std::string link = "betaflight { link: 'tcp:127.0.0.1:5761' } ", states = "states { pose: '/mocap/pose' } ",
                    override_by_radio = "betaflight { link: 'tcp:127.0.0.1:5761' receiver: OVERRIDE } ",
                    itself = "safety { arm_by: ITSELF needs_pilot: false } ";
  const auto field = [&](const std::string& extra) { return refused(kRacer + extra, Firmware::kBetaflight).field; };
  EXPECT_EQ(field(link + itself), "states");
  EXPECT_EQ(field(link + states), "safety.arm_by");
  EXPECT_EQ(field(link + states + "safety { arm_by: ITSELF }"), "safety.needs_pilot");
  EXPECT_TRUE(load(kRacer + link + states + itself, Firmware::kBetaflight).ok());
  EXPECT_TRUE(load(kRacer + override_by_radio + states, Firmware::kBetaflight).ok());
  std::ofstream(file_) << kRacer + link;
  EXPECT_TRUE(load_config(file_, Firmware::kBetaflight, false).ok()) << "to look at it no more is needed";
}

TEST_F(BridgeConfigFile, MistakesAreNamedWithFileAndField) {
  const std::string base = std::string(kRacer) + kMavlink;
  const auto field = [&](const std::string& extra) { return refused(base + extra).field; };
  EXPECT_EQ(field("safety { hold_limit: 1000 }"), "safety.hold_limit");
  EXPECT_EQ(field("safety { hold_limit: nan }"), "safety.hold_limit");
  EXPECT_EQ(field("safety { state { lost_after: 5 } }"), "safety.state.lost_after");
  EXPECT_EQ(field("session { domain: 233 }"), "session.domain");
  EXPECT_EQ(field("session { domain: -1 }"), "session.domain");
  EXPECT_EQ(field("session { state_rate_hz: 1 }"), "session.state_rate_hz");
  EXPECT_EQ(field("session { priority: 10 }"), "session.priority");
  EXPECT_EQ(field("thrust { hover_throttle: 1.5 }"), "thrust.hover_throttle");
  EXPECT_EQ(field("wings: 2"), "wings");
  EXPECT_EQ(refused(base + "safety { hold_limit: 1000 }").message,
            file_.string() + ": safety.hold_limit is 1000 s, expected 0 to 300 s");
  const auto mavlink = [&](const std::string& section) {
    return refused(kRacer + ("mavlink { " + section + " }")).field;
  };
  EXPECT_EQ(mavlink("link: 'serial:/dev/ttyACM0:1234'"), "mavlink.link.baud");
  EXPECT_EQ(mavlink("link: 'udp:127.0.0.1:99999'"), "mavlink.link.port");
  EXPECT_EQ(mavlink("link: 'udp-listen:0.0.0.0:14540' own_system: 300"), "mavlink.own_system");
  EXPECT_EQ(mavlink("link: 'udp-listen:0.0.0.0:14540' radio { arm: 5 kill: 5 }"), "mavlink.radio.kill");
  EXPECT_EQ(refused(std::string("vehicle: 'racer-rates' course: 'nowhere' ") + kMavlink).code, ErrorCode::kUnknownName);
}

TEST_F(BridgeConfigFile, TheFirmwaresSectionHasToBeThere) {
  EXPECT_EQ(refused(kRacer).field, "mavlink");
  EXPECT_EQ(refused(std::string(kRacer) + kMavlink, Firmware::kBetaflight).field, "betaflight");
}

TEST_F(BridgeConfigFile, SomebodyHasToBeAbleToArm) {
  EXPECT_EQ(refused(std::string(kRacer) + "mavlink { link: 'tcp:127.0.0.1:5760' }").field, "mavlink.radio.arm");
  EXPECT_EQ(refused(std::string(kRacer) + kMavlink + "safety { arm_by: ITSELF }").field, "mavlink.arm_by_command");
}

/// Gives each field of a message and of those inside it a value.
void fill(google::protobuf::Message* message) {
  using google::protobuf::FieldDescriptor;
  const auto* reflection = message->GetReflection();
  for (int i = 0; i < message->GetDescriptor()->field_count(); ++i) {
    const FieldDescriptor* field = message->GetDescriptor()->field(i);
    switch (field->cpp_type()) {
      case FieldDescriptor::CPPTYPE_MESSAGE:
        fill(field->is_repeated() ? reflection->AddMessage(message, field)
                                  : reflection->MutableMessage(message, field));
        break;
      case FieldDescriptor::CPPTYPE_BOOL:
        reflection->SetBool(message, field, true);
        break;
      case FieldDescriptor::CPPTYPE_INT32:
        reflection->SetInt32(message, field, 1);
        break;
      case FieldDescriptor::CPPTYPE_DOUBLE:
        reflection->SetDouble(message, field, 1.0);
        break;
      case FieldDescriptor::CPPTYPE_STRING:
        if (field->is_repeated())
          reflection->AddString(message, field, "127.0.0.1");
        else
          reflection->SetString(message, field, "udp:127.0.0.1:9");
        break;
      default:
        break;
    }
  }
}

TEST_F(BridgeConfigFile, EveryFieldOfTheSchemaHasAPlace) {
  for (const Firmware firmware : {Firmware::kMavlink, Firmware::kBetaflight, Firmware::kPx4}) {
    BridgeFile file;
    fill(&file);
    file.set_vehicle("racer-rates");
    file.set_course("one-gate");
    file.mutable_session()->set_name("drone");
    file.mutable_px4()->set_release("1.16");
    for (const auto* section : {"session", "safety", "thrust", "states", "depth", "mavlink"}) {
      // Sections are read one after the other, and each stops at its first mistake: one at a time.
      BridgeFile only = file;
      const auto* reflection = BridgeFile::GetReflection();
      for (const auto* other : {"session", "safety", "thrust", "states", "depth"})
        if (std::string_view(other) != section)
          reflection->ClearField(&only, BridgeFile::GetDescriptor()->FindFieldByName(other));
      EXPECT_NO_THROW((void)load(only.DebugString(), firmware)) << section;
    }
  }
}

/// Calls use(path, set) for every number in `message` and those inside it; set(value) puts it there, and makes the
/// sections on the way to it.
using SetNumber = std::function<void(BridgeFile* file, double value)>;
void for_each_number(const google::protobuf::Descriptor& type, const std::string& path,
                     const std::function<google::protobuf::Message*(BridgeFile*)>& section,
                     const std::function<void(const std::string&, bool whole, const SetNumber&)>& use) {
  using google::protobuf::FieldDescriptor;
  for (int i = 0; i < type.field_count(); ++i) {
    const FieldDescriptor* const field = type.field(i);
    const std::string name = path.empty() ? field->name() : path + "." + field->name();
    if (field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) {
      for_each_number(
          *field->message_type(), name,
          [=](BridgeFile* file) {
            google::protobuf::Message* const around = section(file);
            const auto* const reflection = around->GetReflection();
            return field->is_repeated() ? reflection->MutableRepeatedMessage(around, field, 0)
                                        : reflection->MutableMessage(around, field);
          },
          use);
    } else if (field->cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE) {
      use(name, false, [=](BridgeFile* file, double value) {
        google::protobuf::Message* const around = section(file);
        around->GetReflection()->SetDouble(around, field, value);
      });
    } else if (field->cpp_type() == FieldDescriptor::CPPTYPE_INT32) {
      use(name, true, [=](BridgeFile* file, double value) {
        google::protobuf::Message* const around = section(file);
        around->GetReflection()->SetInt32(around, field, static_cast<int>(value));
      });
    }
  }
}

TEST_F(BridgeConfigFile, EveryNumberThatCantBeIsRefusedByItsName) {
  int refusals = 0;
  for (const Firmware firmware : {Firmware::kMavlink, Firmware::kBetaflight, Firmware::kPx4}) {
    BridgeFile good;
    good.set_vehicle("racer-rates");
    good.set_course("one-gate");
    auto* const fence = good.mutable_safety()->mutable_fence();
    fence->mutable_low()->set_x(-9), fence->mutable_low()->set_y(-9), fence->mutable_low()->set_z(-1);
    fence->mutable_high()->set_x(9), fence->mutable_high()->set_y(9), fence->mutable_high()->set_z(9);
    good.mutable_mavlink()->set_link("udp-listen:127.0.0.1:14540");
    good.mutable_mavlink()->mutable_radio()->set_arm(5);
    good.mutable_mavlink()->mutable_state()->mutable_p_wl()->set_x(1);
    good.mutable_mavlink()->mutable_state()->mutable_p_wl()->set_y(1);
    good.mutable_mavlink()->mutable_state()->mutable_p_wl()->set_z(1);
    good.mutable_betaflight()->set_link("tcp:127.0.0.1:5761");
    good.mutable_betaflight()->set_receiver(BetaflightSpec::OVERRIDE);
    good.mutable_betaflight()->mutable_kill()->set_aux(3);
    good.mutable_states()->set_pose("/mocap/pose");
    for (Point* const point : {good.mutable_states()->mutable_p_wo(), good.mutable_states()->mutable_p_mb(),
                               good.mutable_states()->mutable_rpy_mb_rad()})
      point->set_x(0), point->set_y(0), point->set_z(0);
    good.mutable_depth()->set_image("/depth");
    good.mutable_px4()->set_release("1.16");
    good.mutable_px4()->mutable_radio()->set_arm(5);
    good.mutable_px4()->mutable_versions()->Add()->set_topic("vehicle_status");
    good.mutable_px4()->mutable_versions(0)->set_version(1);
    good.mutable_px4()->mutable_state()->mutable_p_wl()->set_x(1);
    good.mutable_px4()->mutable_state()->mutable_p_wl()->set_y(1);
    good.mutable_px4()->mutable_state()->mutable_p_wl()->set_z(1);
    if (firmware == Firmware::kPx4) good.mutable_safety()->set_needs_firmware_failsafe(false);
    const auto loaded = load(good.DebugString(), firmware);
    ASSERT_TRUE(loaded.ok()) << loaded.error();
    for_each_number(
        *BridgeFile::descriptor(), "", [](BridgeFile* file) { return file; },
        [&](const std::string& path, bool whole, const SetNumber& set) {
          const auto of = firmware_names().find(path.substr(0, path.find('.')));
          if (of != firmware_names().end() && of->second != firmware) return;  // another firmware's section is not read
          constexpr double kInfinity = std::numeric_limits<double>::infinity();
          const std::vector<double> bad =
              whole ? std::vector<double>{std::numeric_limits<int>::min(), std::numeric_limits<int>::max(), -1}
                    : std::vector<double>{std::nan(""), kInfinity, -kInfinity, 1e300, -1e300};
          for (const double value : bad) {
            BridgeFile file = good;
            set(&file, value);
            const auto config = load(file.DebugString(), firmware);
            ASSERT_FALSE(config.ok()) << path << " of " << value;
            const std::string& field = config.failure().field;
            // Of a point all of it is named.
            EXPECT_TRUE(field == path || path.rfind(field + ".", 0) == 0)
                << path << " of " << value << " is called " << field << ": " << config.error();
            EXPECT_FALSE(config.failure().expected.empty()) << config.error();
            EXPECT_EQ(config.error().rfind(file_.string() + ": ", 0), 0U) << config.error();
            ++refusals;
          }
        });
  }
  EXPECT_GT(refusals, 400);
}

// ---- PX4 over DDS --------------------------------------------------------------------------------------------------

constexpr const char* kFailsafeSeen = "safety { needs_firmware_failsafe: false } ";

TEST_F(BridgeConfigFile, Px4HasItsSection) {
  const auto config = load(std::string(kRacer) +
                               "safety { arm_by: ITSELF needs_firmware_failsafe: false } thrust { exponent: 1.5 } "
                               "px4 { release: '1.17' domain: 3 namespace: 'px4_1' own_component: 300 "
                               "  vehicle_system: 2 stamps: ARRIVAL link_delay: 0.01 clock { most_error: 0.05 } "
                               "  state { p_WL { x: 1 y: 2 z: 3 } yaw_WL_rad: 0.5 } radio_from: MANUAL_CONTROL "
                               "  radio { kill: 6 } arm_by_command: true "
                               "  versions { topic: 'vehicle_status' version: 2 } }",
                           Firmware::kPx4);
  ASSERT_TRUE(config) << config.error();
  const auto& px4 = std::get<Px4Config>(config->firmware);
  EXPECT_EQ(px4.bus.release, px4::Release::k1_17);
  EXPECT_EQ(px4.bus.domain, 3U);
  EXPECT_EQ(px4.bus.name_space, "px4_1");
  EXPECT_EQ(px4.bus.versions.at("vehicle_status"), 2);
  EXPECT_EQ(px4.own_component, 300);
  EXPECT_EQ(px4.vehicle_system, 2);
  EXPECT_EQ(px4.stamps, Stamps::kArrival);
  EXPECT_EQ(px4.clock.most_error, 50ms);
  EXPECT_EQ(px4.state.frame.p_WL, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(px4.radio_from, RadioFrom::kManualControl);
  EXPECT_EQ(px4.radio.kill, 6);
  EXPECT_TRUE(px4.arm_by_command);
  EXPECT_EQ(px4.thrust.exponent, 1.5);
  EXPECT_EQ(px4.quadrotor.mass_kg, config->session.quadrotor.mass_kg);
}

TEST_F(BridgeConfigFile, MistakesAboutPx4AreNamed) {
  const auto field = [&](const std::string& section, const std::string& safety = kFailsafeSeen) {
    return refused(kRacer + safety + section, Firmware::kPx4).field;
  };
  const auto px4 = [&](const std::string& fields) { return field("px4 { radio { arm: 5 } " + fields + " }"); };
  EXPECT_EQ(field(kMavlink), "px4");
  EXPECT_EQ(px4("release: '2.0'"), "px4.release");
  EXPECT_EQ(px4("release: '1.16' domain: 300"), "px4.domain");
  EXPECT_EQ(px4("release: '1.16' namespace: '/'"), "px4.namespace");
  EXPECT_EQ(px4("release: '1.16' own_component: 70000"), "px4.own_component");
  EXPECT_EQ(px4("release: '1.16' clock { most_error: 5 }"), "px4.clock.most_error");
  EXPECT_EQ(px4("release: '1.16' versions { topic: 'wings' version: 1 }"), "px4.versions.topic");
  EXPECT_EQ(field("px4 { release: '1.16' }"), "px4.radio.arm");
  EXPECT_EQ(field("px4 { release: '1.16' }", "safety { arm_by: ITSELF needs_firmware_failsafe: false } "),
            "px4.arm_by_command");
  EXPECT_EQ(field("px4 { release: '1.16' radio { arm: 5 } }", ""), "safety.needs_firmware_failsafe");
}

}  // namespace
}  // namespace gatefield::bridge
