#include "common/dds/guarded_transport.h"

#include <fastdds/rtps/network/SenderResource.h>
#include <fastdds/rtps/transport/ChainingTransport.h>
#include <fastdds/rtps/transport/TransportReceiverInterface.h>
#include <fastrtps/utils/IPLocator.h>

#include <utility>

#include "common/base/clock.h"
#include "common/base/rate_limiter.h"

namespace gatefield::dds {
namespace {

namespace rtps = eprosima::fastdds::rtps;
using eprosima::fastrtps::rtps::Locator_t;

/// Tells of what is dropped, now and then.
class Drops {
 public:
  explicit Drops(std::function<void(const DroppedPackets&)> tell) : tell_(std::move(tell)) {}

  void count(const PacketVerdict& verdict, const Locator_t& sender) {
    unsigned untold = 0;
    if (!limiter_.admit(MonotonicClock().now(), &untold) || !tell_) return;
    DroppedPackets told;
    told.count = untold + 1u;
    told.fault = verdict.fault;
    told.submessage = verdict.submessage;
    told.sender = eprosima::fastrtps::rtps::IPLocator::toIPv4string(sender) + ":" + std::to_string(sender.port);
    tell_(told);
  }

 private:
  const std::function<void(const DroppedPackets&)> tell_;
  RateLimiter limiter_{std::chrono::seconds(1)};
};

class GuardedTransport final : public rtps::ChainingTransport {
 public:
  GuardedTransport(const rtps::ChainingTransportDescriptor& descriptor, std::shared_ptr<Drops> drops)
      : ChainingTransport(descriptor), udp_(descriptor.low_level_descriptor), drops_(std::move(drops)) {}

  rtps::TransportDescriptorInterface* get_configuration() override { return udp_.get(); }

  bool send(eprosima::fastrtps::rtps::SenderResource* sender, const eprosima::fastrtps::rtps::octet* buffer,
            std::uint32_t size, eprosima::fastrtps::rtps::LocatorsIterator* begin,
            eprosima::fastrtps::rtps::LocatorsIterator* end,
            const std::chrono::steady_clock::time_point& timeout) override {
    return sender->send(buffer, size, begin, end, timeout);
  }

  void receive(rtps::TransportReceiverInterface* next, const eprosima::fastrtps::rtps::octet* buffer,
               std::uint32_t size, const Locator_t& local, const Locator_t& remote) override {
    const PacketVerdict verdict = check_packet({buffer, size});
    if (verdict.fault == PacketFault::kNone)
      next->OnDataReceived(buffer, static_cast<std::uint32_t>(verdict.size), local, remote);
    else
      drops_->count(verdict, remote);
  }

 private:
  const std::shared_ptr<rtps::TransportDescriptorInterface> udp_;
  const std::shared_ptr<Drops> drops_;
};

class GuardedDescriptor final : public rtps::ChainingTransportDescriptor {
 public:
  GuardedDescriptor(std::shared_ptr<rtps::TransportDescriptorInterface> udp,
                    std::function<void(const DroppedPackets&)> on_dropped)
      : ChainingTransportDescriptor(std::move(udp)), drops_(std::make_shared<Drops>(std::move(on_dropped))) {}

  rtps::TransportInterface* create_transport() const override { return new GuardedTransport(*this, drops_); }

 private:
  std::shared_ptr<Drops> drops_;
};

}  // namespace

std::shared_ptr<rtps::TransportDescriptorInterface> guarded(std::shared_ptr<rtps::TransportDescriptorInterface> udp,
                                                            std::function<void(const DroppedPackets&)> on_dropped) {
  return std::make_shared<GuardedDescriptor>(std::move(udp), std::move(on_dropped));
}

}  // namespace gatefield::dds
