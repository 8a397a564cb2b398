// Every type to a Cyclone DDS program (cyclone_peer.c) and back, with the product's QoS on our side.

#include <gtest/gtest.h>

#include <condition_variable>
#include <filesystem>
#include <mutex>
#include <optional>
#include <thread>

#include "common/dds/convert.h"
#include "common/dds/reader.h"
#include "common/dds/writer.h"
#include "gatefield_idl/gatefieldPubSubTypes.h"
#include "tests/support/dds_domain.h"
#include "tests/support/messages.h"
#include "tests/support/process.h"

namespace gatefield::dds {
namespace {

using namespace std::chrono_literals;

template <typename Generated>
std::vector<std::uint8_t> bytes_of(typename Generated::type sample) {
  WireType<Generated> type;
  eprosima::fastrtps::rtps::SerializedPayload_t payload(type.getSerializedSizeProvider(&sample)());
  EXPECT_TRUE(type.serialize(&sample, &payload));
  return {payload.data, payload.data + payload.length};
}

template <typename Sample>
auto& key_of(Sample& sample) {
  return sample.vehicle();
}
auto& key_of(wire::ServerStatus& sample) { return sample.name(); }

// One topic, both directions: sends `original` as "ours" and keeps what comes back as "cyclone".
template <typename Generated>
class Exchange {
 public:
  using Sample = typename Generated::type;

  Exchange(Participant* participant, Topic topic, const Sample& original, const std::string& ours = {},
           const std::string& theirs = {})
      : original_(original) {
    auto reader = Reader<Generated>::open(participant, topic,
                                          {[this](Sample* sample, const Origin&) {
                                             const std::lock_guard lock(mutex_);
                                             if (std::string(key_of(*sample).c_str()) == "cyclone") back_ = *sample;
                                           },
                                           nullptr, [] { ADD_FAILURE() << "unreadable sample"; }},
                                          theirs);
    auto writer = Writer<Generated>::open(participant, topic, ours);
    EXPECT_TRUE(reader.ok() && writer.ok());
    reader_ = std::move(reader).value();
    writer_ = std::move(writer).value();
  }

  void send() {
    EXPECT_TRUE(writer_->write([this](Sample* sample) { *sample = original_; }));
  }

  bool done() {
    const std::lock_guard lock(mutex_);
    return back_.has_value();
  }

  // Equal in every field but the name, and good enough for the product.
  template <typename Message>
  void check() {
    const std::lock_guard lock(mutex_);
    ASSERT_TRUE(back_.has_value());
    Sample expected = original_;
    key_of(expected) = "cyclone";
    EXPECT_EQ(bytes_of<Generated>(*back_), bytes_of<Generated>(expected));
    Message message;
    Status verdict;
    if constexpr (std::is_same_v<Message, protocol::DepthFrame>)
      verdict = from_wire(&*back_, &message);
    else
      verdict = from_wire(*back_, &message);
    EXPECT_TRUE(verdict.ok()) << verdict.error();
  }

 private:
  const Sample original_;
  std::mutex mutex_;
  std::optional<Sample> back_;
  std::unique_ptr<Reader<Generated>> reader_;
  std::unique_ptr<Writer<Generated>> writer_;
};

template <typename Sample, typename Message>
Sample wire_of(const Message& message) {
  Sample sample;
  to_wire(message, &sample);
  return sample;
}

TEST(Cyclone, EveryTypeGoesThereAndBack) {
  const auto domain = test::own_domain();
  auto opened = Participant::open(domain, "conformance", "", {}, [](const PeerEvent&) {});
  ASSERT_TRUE(opened.ok()) << opened.error();
  const auto participant = std::move(opened).value();

  wire::DepthFrame frame;
  header_to_wire(test::good_frame("ours"), &frame);
  frame.pixels() = test::good_frame("ours").pixels;

  auto request = std::make_unique<Exchange<wire::SessionRequestPubSubType>>(
      participant.get(), Topic::kSessionRequest, wire_of<wire::SessionRequest>(test::good_request("ours")));
  Exchange<wire::SessionReplyPubSubType> reply(participant.get(), Topic::kSessionReply,
                                               wire_of<wire::SessionReply>(test::good_reply("ours")));
  Exchange<wire::VehicleStatePubSubType> state(participant.get(), Topic::kVehicleState,
                                               wire_of<wire::VehicleState>(test::good_state("ours")));
  Exchange<wire::DepthFramePubSubType> depth(participant.get(), Topic::kDepthFrame, frame);
  Exchange<wire::ThrustRateCommandPubSubType> command(participant.get(), Topic::kCommand,
                                                      wire_of<wire::ThrustRateCommand>(test::good_command("ours")),
                                                      command_partition("ours"), command_partition("cyclone"));
  Exchange<wire::TelemetryPubSubType> telemetry(participant.get(), Topic::kTelemetry,
                                                wire_of<wire::Telemetry>(test::good_telemetry("ours")));

  Exchange<wire::ServerStatusPubSubType> status(participant.get(), Topic::kServerStatus,
                                                wire_of<wire::ServerStatus>(test::good_status("ours")));

  const auto output = std::filesystem::temp_directory_path() / ("gatefield-cyclone-" + std::to_string(getpid()));
  test::Process peer(CYCLONE_PEER, {std::to_string(domain)}, output);
  // Sent once: whoever comes late gets them all the same, as the QoS promises.
  request->send();
  reply.send();
  const auto end = std::chrono::steady_clock::now() + 15s;
  const auto all_done = [&] {
    return request->done() && reply.done() && state.done() && depth.done() && command.done() && telemetry.done() &&
           status.done();
  };
  while (!all_done() && std::chrono::steady_clock::now() < end && peer.running()) {
    state.send();
    depth.send();
    command.send();
    telemetry.send();
    status.send();
    std::this_thread::sleep_for(20ms);
  }
  const std::string said = peer.output();
  EXPECT_TRUE(request->done()) << said;
  EXPECT_TRUE(reply.done()) << said;
  EXPECT_TRUE(state.done()) << said;
  EXPECT_TRUE(depth.done()) << said;
  EXPECT_TRUE(command.done()) << said;
  EXPECT_TRUE(telemetry.done()) << said;
  EXPECT_TRUE(status.done()) << said;
  if (HasFailure()) return;
  request->check<protocol::SessionRequest>();
  reply.check<protocol::SessionReply>();
  state.check<protocol::VehicleState>();
  depth.check<protocol::DepthFrame>();
  command.check<protocol::ThrustRateCommand>();
  telemetry.check<protocol::Telemetry>();
  status.check<protocol::ServerStatus>();

  request.reset();  // the peer ends when nobody listens to its requests any more
  const auto code = peer.wait(5s);
  ASSERT_TRUE(code.has_value());
  EXPECT_EQ(*code, 0) << peer.output();
  std::filesystem::remove(output);
}

}  // namespace
}  // namespace gatefield::dds
