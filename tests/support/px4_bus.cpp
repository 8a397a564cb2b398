#include "tests/support/px4_bus.h"

#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <map>
#include <mutex>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>

#include "common/dds/participant.h"
#include "common/dds/px4/wire_type.h"
#include "common/dds/qos.h"
#include "common/dds/reader.h"
#include "gatefield_idl/px4PubSubTypes.h"

namespace gatefield::test {
namespace {

namespace wire = px4_msgs::msg::dds_;
using namespace eprosima::fastdds::dds;

template <typename T>
T must(Result<T> result) {
  if (!result) throw std::runtime_error(result.error());
  return std::move(result).value();
}

px4::OffboardControlMode from_wire(const wire::OffboardControlMode_& in) {
  return {in.timestamp(), in.position(),  in.velocity(),          in.acceleration(),
          in.attitude(),  in.body_rate(), in.thrust_and_torque(), in.direct_actuator()};
}
px4::VehicleRatesSetpoint from_wire(const wire::VehicleRatesSetpoint_& in) {
  return {in.timestamp(), in.roll(), in.pitch(), in.yaw(), in.thrust_body(), in.reset_integral()};
}
px4::VehicleCommand from_wire(const wire::VehicleCommand_& in) {
  return {in.timestamp(),        in.param1(),        in.param2(),           in.param3(),       in.param4(),
          in.param5(),           in.param6(),        in.param7(),           in.command(),      in.target_system(),
          in.target_component(), in.source_system(), in.source_component(), in.confirmation(), in.from_external()};
}

void fill(const px4::VehicleCommandAck& in, wire::VehicleCommandAck_* out) {
  out->command(in.command);
  out->result(in.result);
  out->result_param1(in.result_param1);
  out->result_param2(in.result_param2);
  out->target_system(in.target_system);
  out->target_component(in.target_component);
  out->from_external(in.from_external);
}
void fill(const px4::VehicleOdometry& in, wire::VehicleOdometry_* out) {
  out->timestamp_sample(in.timestamp_sample);
  out->pose_frame(in.pose_frame);
  out->position(in.position);
  out->q(in.q);
  out->velocity_frame(in.velocity_frame);
  out->velocity(in.velocity);
  out->angular_velocity(in.angular_velocity);
  out->reset_counter(in.reset_counter);
  out->quality(static_cast<std::uint8_t>(in.quality));
}
template <typename Wire>
void fill_status(const px4::VehicleStatus& in, Wire* out) {
  out->arming_state(in.arming_state);
  out->nav_state(in.nav_state);
  out->failsafe(in.failsafe);
  out->failsafe_and_user_took_over(in.failsafe_and_user_took_over);
  out->system_id(in.system_id);
  out->component_id(in.component_id);
  out->pre_flight_checks_pass(in.pre_flight_checks_pass);
}
void fill(const px4::VehicleStatus& in, wire::VehicleStatusV0_* out) { fill_status(in, out); }
void fill(const px4::VehicleStatus& in, wire::VehicleStatusV1_* out) { fill_status(in, out); }
void fill(const px4::VehicleStatus& in, wire::VehicleStatusV4_* out) { fill_status(in, out); }
void fill(const px4::VehicleLandDetected& in, wire::VehicleLandDetected_* out) {
  out->ground_contact(in.ground_contact);
  out->maybe_landed(in.maybe_landed);
  out->landed(in.landed);
}
void fill(const px4::SensorCombined& in, wire::SensorCombined_* out) {
  out->gyro_rad(in.gyro_rad);
  out->accelerometer_timestamp_relative(in.accelerometer_timestamp_relative);
  out->accelerometer_m_s2(in.accelerometer_m_s2);
}
void fill(const px4::TimesyncStatus& in, wire::TimesyncStatus_* out) {
  out->source_protocol(in.source_protocol);
  out->remote_timestamp(in.remote_timestamp);
  out->observed_offset(in.observed_offset);
  out->estimated_offset(in.estimated_offset);
  out->round_trip_time(in.round_trip_time);
}
void fill(const px4::ManualControlSetpoint& in, wire::ManualControlSetpoint_* out) {
  out->valid(in.valid);
  out->aux1(in.aux[0]);
  out->aux2(in.aux[1]);
  out->aux3(in.aux[2]);
  out->aux4(in.aux[3]);
  out->aux5(in.aux[4]);
  out->aux6(in.aux[5]);
}
template <typename Wire>
void fill_radio(const px4::InputRc& in, Wire* out) {
  out->channel_count(in.channel_count);
  out->rc_failsafe(in.rc_failsafe);
  out->rc_lost(in.rc_lost);
  out->values(in.values);
}
void fill(const px4::InputRc& in, wire::InputRc_* out) { fill_radio(in, out); }
void fill(const px4::InputRc& in, wire::InputRcWithFrameRate_* out) { fill_radio(in, out); }
template <typename Wire>
void fill_battery(const px4::BatteryStatus& in, Wire* out) {
  out->connected(in.connected);
  out->voltage_v(in.voltage_v);
}
void fill(const px4::BatteryStatus& in, wire::BatteryStatusFiltered_* out) { fill_battery(in, out); }
void fill(const px4::BatteryStatus& in, wire::BatteryStatusV0_* out) { fill_battery(in, out); }
void fill(const px4::BatteryStatus& in, wire::BatteryStatusV1_* out) { fill_battery(in, out); }

/// The wire type of a kind of message that has one layout in all releases.
template <typename Kind>
struct TypeOf;
template <>
struct TypeOf<px4::VehicleCommandAck> {
  using Type = wire::VehicleCommandAck_PubSubType;
};
template <>
struct TypeOf<px4::VehicleOdometry> {
  using Type = wire::VehicleOdometry_PubSubType;
};
template <>
struct TypeOf<px4::VehicleLandDetected> {
  using Type = wire::VehicleLandDetected_PubSubType;
};
template <>
struct TypeOf<px4::SensorCombined> {
  using Type = wire::SensorCombined_PubSubType;
};
template <>
struct TypeOf<px4::TimesyncStatus> {
  using Type = wire::TimesyncStatus_PubSubType;
};
template <>
struct TypeOf<px4::ManualControlSetpoint> {
  using Type = wire::ManualControlSetpoint_PubSubType;
};

class Bus final : public Px4Bus {
 public:
  explicit Bus(const px4::BusOptions& options)
      : options_(options),
        participant_(
            must(dds::Participant::open(options.domain, "/px4_micro_xrce_dds", "", {}, [](const dds::PeerEvent&) {}))) {
    modes_ = reader<wire::OffboardControlMode_PubSubType, px4::OffboardControlMode>();
    rates_ = reader<wire::VehicleRatesSetpoint_PubSubType, px4::VehicleRatesSetpoint>();
    commands_ = reader<wire::VehicleCommand_PubSubType, px4::VehicleCommand>();
    open_writers(static_cast<px4::Message*>(nullptr));
  }

  void write(const px4::Message& message) override {
    std::visit(
        [this]<typename Kind>(const Kind& content) {
          with_type<Kind>([&]<typename Generated>(Tag<Generated>) { write_as<Generated>(content); });
        },
        message);
  }

  std::vector<Heard> heard() override {
    const std::lock_guard lock(mutex_);
    return std::exchange(heard_, {});
  }

 private:
  template <typename Generated>
  struct Tag {};

  /// Calls `use` with the wire type that the release has for this kind of message.
  template <typename Kind, typename Use>
  void with_type(Use use) {
    const px4::Release release = options_.release;
    if constexpr (std::is_same_v<Kind, px4::VehicleStatus>) {
      if (release == px4::Release::k1_15) return use(Tag<wire::VehicleStatusV0_PubSubType>());
      if (release == px4::Release::k1_18) return use(Tag<wire::VehicleStatusV4_PubSubType>());
      use(Tag<wire::VehicleStatusV1_PubSubType>());
    } else if constexpr (std::is_same_v<Kind, px4::BatteryStatus>) {
      if (release == px4::Release::k1_15) return use(Tag<wire::BatteryStatusFiltered_PubSubType>());
      if (release == px4::Release::k1_16) return use(Tag<wire::BatteryStatusV0_PubSubType>());
      use(Tag<wire::BatteryStatusV1_PubSubType>());
    } else if constexpr (std::is_same_v<Kind, px4::InputRc>) {
      if (release == px4::Release::k1_18) return use(Tag<wire::InputRcWithFrameRate_PubSubType>());
      use(Tag<wire::InputRc_PubSubType>());
    } else {
      use(Tag<typename TypeOf<Kind>::Type>());
    }
  }

  template <typename... Kinds>
  void open_writers(std::variant<Kinds...>*) {
    (with_type<Kinds>([&]<typename Generated>(Tag<Generated>) { open_writer<Generated, Kinds>(); }), ...);
  }

  template <typename Generated, typename Kind>
  void open_writer() {
    auto* topic = participant_->topic(px4::topic_from_px4(options_, Kind::kTopic),
                                      TypeSupport(new px4::WireType<Generated, Kind>()));
    DataWriterQos qos = dds::foreign_setpoint_qos();
    qos.durability().kind = TRANSIENT_LOCAL_DURABILITY_QOS;
    writers_[Kind::kTopic] =
        participant_->raw()->create_publisher(PUBLISHER_QOS_DEFAULT)->create_datawriter(topic, qos);
  }

  template <typename Generated, typename Kind>
  void write_as(const Kind& message) {
    typename Generated::type sample;
    fill(message, &sample);
    sample.timestamp(message.timestamp);
    writers_.at(Kind::kTopic)->write(&sample);
  }

  template <typename Generated, typename Kind>
  std::unique_ptr<dds::Reader<Generated>> reader() {
    typename dds::Reader<Generated>::Callbacks callbacks{[this](typename Generated::type* sample, const dds::Origin&) {
                                                           const std::lock_guard lock(mutex_);
                                                           heard_.emplace_back(from_wire(*sample));
                                                         },
                                                         nullptr, [] {}};
    return must(dds::Reader<Generated>::open(participant_.get(), px4::topic_to_px4(options_, Kind::kTopic),
                                             dds::foreign_reader_qos(), std::move(callbacks)));
  }

  const px4::BusOptions options_;
  std::mutex mutex_;
  std::vector<Heard> heard_;
  std::unique_ptr<dds::Participant> participant_;
  std::map<std::string_view, DataWriter*> writers_;
  std::unique_ptr<dds::Reader<wire::OffboardControlMode_PubSubType>> modes_;
  std::unique_ptr<dds::Reader<wire::VehicleRatesSetpoint_PubSubType>> rates_;
  std::unique_ptr<dds::Reader<wire::VehicleCommand_PubSubType>> commands_;
};

}  // namespace

std::unique_ptr<Px4Bus> Px4Bus::open(const px4::BusOptions& options) { return std::make_unique<Bus>(options); }

}  // namespace gatefield::test
