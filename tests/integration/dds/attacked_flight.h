#pragma once

#include <gatefield/sdk/client.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <condition_variable>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "common/dds/convert.h"
#include "common/dds/pairing.h"
#include "common/dds/participant.h"
#include "common/dds/reader.h"
#include "common/dds/server_endpoint.h"
#include "common/dds/writer.h"
#include "gatefield_idl/gatefieldPubSubTypes.h"
#include "server/app/dds_transport.h"
#include "server/service/service.h"
#include "tests/support/dds_domain.h"
#include "tests/support/messages.h"
#include "tests/unit/server/service/fakes.h"

/// A vehicle that flies, and somebody who wants that it doesn't.
namespace gatefield::dds {

using namespace std::chrono_literals;
using test::own_domain;

template <typename T>
inline T must(Result<T> result) {
  EXPECT_TRUE(result.ok()) << (result.ok() ? "" : result.error());
  if (!result.ok()) std::abort();
  return std::move(result).value();
}

inline constexpr const char* kServer = "planner-1";
inline constexpr Stamp kStrangersMark = 123'456us;  ///< length of a step of a stranger's plan

/// Somebody else in the domain, who overhears what is asked.
class Stranger {
 public:
  /// @param credentials  in a closed domain: what he got hold of; nullptr: nothing
  explicit Stranger(const std::string& user_data = {}, const Credentials* credentials = nullptr)
      : participant_(must(Participant::open(
            own_domain(), "stranger", user_data, {}, [this](const PeerEvent& event) { meet(event); }, {}, {},
            credentials))) {
    if (credentials != nullptr && credentials->identity.role == Role::kVehicle) return;  // may not overhear
    Reader<wire::SessionRequestPubSubType>::Callbacks callbacks;
    callbacks.sample = [this](wire::SessionRequest* request, const Origin&) { overheard_ = request->request(); };
    callbacks.unreadable = [] {};
    requests_ = must(
        Reader<wire::SessionRequestPubSubType>::open(participant_.get(), Topic::kSessionRequest, std::move(callbacks)));
  }
  /// The number of the newest request in the domain.
  std::uint64_t overheard() const {
    for (int i = 0; i < 500 && overheard_ == 0; ++i) std::this_thread::sleep_for(10ms);
    return overheard_;
  }
  Participant* participant() { return participant_.get(); }
  /// The participant of the server of this name.
  ParticipantId server(const std::string& name) {
    for (int i = 0; i < 500; ++i) {
      {
        const std::lock_guard lock(mutex_);
        for (const auto& [announced, id] : met_)
          if (Pairing::server_in(announced) == name) return id;
      }
      std::this_thread::sleep_for(10ms);
    }
    ADD_FAILURE() << "no server " << name;
    return {};
  }

  /// All that it met, by what they announce.
  std::map<std::string, ParticipantId> met() {
    const std::lock_guard lock(mutex_);
    return met_;
  }

  template <typename Generated>
  std::unique_ptr<Writer<Generated>> writer(Topic topic, std::uint32_t strength = 0,
                                            const std::string& partition = {}) {
    auto qos = writer_qos(topic, {});
    if (topic == Topic::kCommand) qos.ownership_strength().value = strength;
    return must(Writer<Generated>::open(participant_.get(), topic_name(topic), qos, partition));
  }

 private:
  void meet(const PeerEvent& event) {
    const std::lock_guard lock(mutex_);
    met_[event.user_data] = event.peer;
  }

  std::mutex mutex_;
  std::map<std::string, ParticipantId> met_;  // by what they announce
  std::unique_ptr<Participant> participant_;
  std::atomic<std::uint64_t> overheard_{0};
  std::unique_ptr<Reader<wire::SessionRequestPubSubType>> requests_;
};

/// A server as the program has it, with stand-ins for planner and sensor, and the victim, which joined it.
class AttackedFlight : public ::testing::Test {
 protected:
  /// Its folder in a closed domain; empty: the domain is open.
  virtual std::string security(Role role, const std::string& name) const {
    static_cast<void>(role);
    static_cast<void>(name);
    return {};
  }
  virtual PartnerNames partners() const { return {}; }
  void SetUp() override {
    service::ServiceOptions options;
    options.name = kServer;
    options.has_heir = !partners().heir.empty();
    options.max_vehicles = 4;
    options.profiles = {{"race", service::testing::small_profile()}};
    service_ = std::make_unique<service::Service>(options, service::testing::fake_factories(), &clock_, &transport_);
    transport_.attach(service_.get());
    TransportOptions told;
    told.network.security = security(Role::kServer, kServer);
    told.on_samples_dropped = [this](const DroppedSamples& dropped) {
      const std::lock_guard lock(mutex_);
      dropped_ += dropped.count;
      newest_ = dropped;
      newest_of_[dropped.topic] = dropped;
    };
    told.on_packets_dropped = [this](const DroppedPackets& dropped) {
      const std::lock_guard lock(mutex_);
      packets_told_ = in_words(dropped);
    };
    endpoint_ = must(ServerEndpoint::create(own_domain(), kServer, &transport_, told, partners()));
    transport_.attach(endpoint_.get());
    service_->start();
    victim_ = join("victim");
  }
  void TearDown() override {
    victim_.reset();
    service_->stop();
    endpoint_.reset();
  }

  sdk::Options options_of(const std::string& vehicle) const {
    sdk::Options options;
    options.network.security = security(Role::kVehicle, vehicle);
    options.domain = own_domain();
    options.vehicle = vehicle;
    options.course = test::good_request().course;
    options.connect_timeout = 20s;
    return options;
  }
  std::unique_ptr<sdk::Client> join(const std::string& vehicle) const {
    return must(sdk::Client::connect(options_of(vehicle)));
  }

  struct Flown {
    int commands = 0;   ///< of the session that it flew with before
    int strange = 0;    ///< of any other, or with a stranger's mark
    bool kept = false;  ///< it has that session still
  };
  /// Flies for 1.2 s, longer where the machine is busy, while `attack` is called with the number of each state.
  Flown fly(sdk::Client* client, const std::function<void(std::uint64_t)>& attack = {}) {
    Flown flown;
    const std::uint64_t session = client->session().session;
    const Stamp end = clock_.now() + 1200ms;
    while (clock_.now() < end || (flown.commands <= kEnough && clock_.now() < end + 8s)) {
      QuadrotorState state = test::good_state().state;
      state.p_WB = {0.0, 0.0, 1.5};
      state.v_WB.setZero();
      state.w_WB_B.setZero();
      state.q_WB.setIdentity();
      const std::uint64_t sequence = client->send_state(clock_.now(), state);
      if (attack) attack(sequence);
      std::this_thread::sleep_for(15ms);
      while (const auto command = client->newest()) {
        const bool strange = command->session != session || command->plan_step == kMark;
        ++(strange ? flown.strange : flown.commands);
      }
    }
    flown.kept = client->session().session == session;
    return flown;
  }
  /// The vehicle went on as if nobody else were there.
  static void expect_unharmed(const Flown& flown) {
    EXPECT_GT(flown.commands, kEnough);
    EXPECT_EQ(flown.strange, 0);
    EXPECT_TRUE(flown.kept);
  }
  std::string told() {
    const std::lock_guard lock(mutex_);
    return dropped_ > 0 ? in_words(newest_) : "";
  }

  /// The newest that was told of this topic; empty: nothing.
  std::string told_of(Topic topic) {
    const std::lock_guard lock(mutex_);
    const auto found = newest_of_.find(topic);
    return found == newest_of_.end() ? "" : in_words(found->second);
  }
  std::string packets_told() {
    const std::lock_guard lock(mutex_);
    return packets_told_;
  }

  static constexpr int kEnough = 10;  // commands, to see that it goes on
  static constexpr Stamp kMark = kStrangersMark;
  MonotonicClock clock_;
  app::DdsTransport transport_;
  std::unique_ptr<service::Service> service_;
  std::unique_ptr<ServerEndpoint> endpoint_;
  std::unique_ptr<sdk::Client> victim_;
  std::mutex mutex_;
  std::uint64_t dropped_ = 0;
  DroppedSamples newest_;
  std::map<Topic, DroppedSamples> newest_of_;
  std::string packets_told_;
};

}  // namespace gatefield::dds
