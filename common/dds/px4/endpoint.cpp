#include "common/dds/px4/endpoint.h"

#include <mutex>
#include <set>
#include <utility>

#include "common/dds/participant.h"
#include "common/dds/px4/convert.h"
#include "common/dds/px4/wire_type.h"
#include "common/dds/qos.h"
#include "common/dds/reader.h"
#include "common/dds/writer.h"
#include "gatefield_idl/px4PubSubTypes.h"

namespace gatefield::px4 {
namespace {

/// A reader of one kind of message, whichever its layout.
class AnyReader {
 public:
  virtual ~AnyReader() = default;
};

template <typename Generated, typename Kind>
class KindReader final : public AnyReader {
 public:
  Status open(dds::Participant* participant, const BusOptions& options, Handler* handler) {
    const std::string topic = topic_from_px4(options, Kind::kTopic);
    typename Reader::Callbacks callbacks{
        [handler](typename Generated::type* sample, const dds::Origin&) {
          const Kind message = from_wire(*sample);
          if (const Status status = validate(message); status)
            handler->on_message(message);
          else
            handler->on_rejected(Kind::kTopic, status.failure());
        },
        nullptr,
        [handler, why = Error("messages on " + topic + " are not laid out as PX4 " +
                                  std::string(name(options.release)) + " has them; set the release that PX4 has",
                              ErrorCode::kVersion, "release")] { handler->on_rejected(Kind::kTopic, why); }};
    return dds::keep(Reader::open(participant, topic, dds::foreign_reader_qos(), std::move(callbacks)), &reader_);
  }

 private:
  using Reader = dds::Reader<Generated, WireType<Generated, Kind>>;
  std::unique_ptr<Reader> reader_;
};

class BusEndpoint final : public Endpoint {
 public:
  Status open(const BusOptions& options, Handler* handler) {
    dds::TransportOptions transport;
    transport.network = options.network;
    transport.on_packets_dropped = [handler](const dds::DroppedPackets& dropped) {
      handler->on_rejected({}, Error(in_words(dropped)));
    };
    auto participant = dds::Participant::open(
        options.domain, "gatefield-bridge px4", "gatefield-bridge", transport, [](const dds::PeerEvent&) {},
        [this](const dds::WriterEvent& event) { take(event); });
    if (Status status = dds::keep(std::move(participant), &participant_); !status) return status;
    if (Status status = open_readers(options, handler); !status) return status;
    if (Status status = open_writer(options, &modes_, OffboardControlMode::kTopic); !status) return status;
    if (Status status = open_writer(options, &rates_, VehicleRatesSetpoint::kTopic); !status) return status;
    return open_writer(options, &commands_, VehicleCommand::kTopic);
  }

  bool publish(const OffboardControlMode& message) noexcept override { return write(modes_.get(), message); }
  bool publish(const VehicleRatesSetpoint& message) noexcept override { return write(rates_.get(), message); }
  bool publish(const VehicleCommand& message) noexcept override { return write(commands_.get(), message); }

  std::vector<std::string> offered() const override {
    const std::lock_guard lock(mutex_);
    return {offered_.begin(), offered_.end()};
  }

 private:
  void take(const dds::WriterEvent& event) {
    if (event.topic.find("fmu/out/") == std::string::npos) return;
    const std::lock_guard lock(mutex_);
    if (!event.gone) {
      if (offered_.size() < kMostOffered) offered_.insert(event.topic);
      return;
    }
    const auto one = offered_.find(event.topic);
    if (one != offered_.end()) offered_.erase(one);
  }

  template <typename Generated, typename Kind>
  Status open_reader(const BusOptions& options, Handler* handler) {
    auto reader = std::make_unique<KindReader<Generated, Kind>>();
    if (Status status = reader->open(participant_.get(), options, handler); !status) return status;
    readers_.push_back(std::move(reader));
    return {};
  }

  /// The kinds of message whose layout differs from release to release, in the three layouts that one has.
  template <typename StatusType, typename BatteryType, typename RadioType>
  Status open_varying(const BusOptions& options, Handler* handler) {
    if (Status status = open_reader<StatusType, VehicleStatus>(options, handler); !status) return status;
    if (Status status = open_reader<BatteryType, BatteryStatus>(options, handler); !status) return status;
    return open_reader<RadioType, InputRc>(options, handler);
  }

  Status open_readers(const BusOptions& options, Handler* handler) {
    using wire::BatteryStatusV1_PubSubType, wire::InputRc_PubSubType, wire::VehicleStatusV1_PubSubType;
    for (const auto open : {&BusEndpoint::open_reader<wire::VehicleCommandAck_PubSubType, VehicleCommandAck>,
                            &BusEndpoint::open_reader<wire::VehicleOdometry_PubSubType, VehicleOdometry>,
                            &BusEndpoint::open_reader<wire::VehicleLandDetected_PubSubType, VehicleLandDetected>,
                            &BusEndpoint::open_reader<wire::SensorCombined_PubSubType, SensorCombined>,
                            &BusEndpoint::open_reader<wire::TimesyncStatus_PubSubType, TimesyncStatus>,
                            &BusEndpoint::open_reader<wire::ManualControlSetpoint_PubSubType, ManualControlSetpoint>})
      if (Status status = (this->*open)(options, handler); !status) return status;
    switch (options.release) {
      case Release::k1_15:
        return open_varying<wire::VehicleStatusV0_PubSubType, wire::BatteryStatusFiltered_PubSubType,
                            InputRc_PubSubType>(options, handler);
      case Release::k1_16:
        return open_varying<VehicleStatusV1_PubSubType, wire::BatteryStatusV0_PubSubType, InputRc_PubSubType>(options,
                                                                                                              handler);
      case Release::k1_17:
        return open_varying<VehicleStatusV1_PubSubType, BatteryStatusV1_PubSubType, InputRc_PubSubType>(options,
                                                                                                        handler);
      case Release::k1_18:
        break;
    }
    return open_varying<wire::VehicleStatusV4_PubSubType, BatteryStatusV1_PubSubType,
                        wire::InputRcWithFrameRate_PubSubType>(options, handler);
  }

  template <typename Generated>
  Status open_writer(const BusOptions& options, std::unique_ptr<dds::Writer<Generated>>* place,
                     std::string_view topic) {
    return dds::keep(
        dds::Writer<Generated>::open(participant_.get(), topic_to_px4(options, topic), dds::foreign_setpoint_qos()),
        place);
  }

  template <typename Writer, typename Kind>
  static bool write(Writer* writer, const Kind& message) noexcept {
    return writer->write([&](typename Writer::Sample* sample) { to_wire(message, sample); });
  }

  static constexpr std::size_t kMostOffered = 1000;  // a bus full of vehicles is still told apart

  mutable std::mutex mutex_;
  std::multiset<std::string> offered_;
  std::unique_ptr<dds::Participant> participant_;  // after what it calls for, before what lives on it
  std::vector<std::unique_ptr<AnyReader>> readers_;
  std::unique_ptr<dds::Writer<wire::OffboardControlMode_PubSubType>> modes_;
  std::unique_ptr<dds::Writer<wire::VehicleRatesSetpoint_PubSubType>> rates_;
  std::unique_ptr<dds::Writer<wire::VehicleCommand_PubSubType>> commands_;
};

}  // namespace

Result<std::unique_ptr<Endpoint>> Endpoint::create(const BusOptions& options, Handler* handler) {
  if (Status status = validate(options); !status) return status.failure();
  auto endpoint = std::make_unique<BusEndpoint>();
  if (Status status = endpoint->open(options, handler); !status) return status.failure();
  return std::unique_ptr<Endpoint>(std::move(endpoint));
}

}  // namespace gatefield::px4
