#include "common/dds/guarded_transport.h"

#include <fastdds/rtps/network/SenderResource.h>
#include <fastdds/rtps/transport/ChainingTransport.h>
#include <fastdds/rtps/transport/TransportReceiverInterface.h>
#include <fastdds/rtps/transport/shared_mem/SharedMemTransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>

#include <algorithm>
#include <exception>
#include <utility>

#include "common/base/clock.h"
#include "common/base/rate_limiter.h"
#include "common/dds/announcements.h"
#include "common/dds/closed_domain.h"
#include "common/dds/packet_fields.h"

namespace gatefield::dds {
namespace {

namespace rtps = eprosima::fastdds::rtps;
using eprosima::fastrtps::rtps::Locator_t;

thread_local const ParticipantId* sender_now = nullptr;

/// For the length of a packet.
class Sender {
 public:
  explicit Sender(const ParticipantId& sender) : before_(std::exchange(sender_now, &sender)) {}
  ~Sender() { sender_now = before_; }
  Sender(const Sender&) = delete;
  Sender& operator=(const Sender&) = delete;

 private:
  const ParticipantId* before_;
};

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
    told.sender = sender.kind == LOCATOR_KIND_SHM
                      ? "shared memory"
                      : eprosima::fastrtps::rtps::IPLocator::toIPv4string(sender) + ":" + std::to_string(sender.port);
    tell_(told);
  }

 private:
  const std::function<void(const DroppedPackets&)> tell_;
  RateLimiter limiter_{std::chrono::seconds(1)};
};

class GuardedTransport final : public rtps::ChainingTransport {
 public:
  GuardedTransport(const rtps::ChainingTransportDescriptor& descriptor, std::shared_ptr<Drops> drops,
                   const Guard& guard, std::shared_ptr<SharedMemory> shared_memory)
      : ChainingTransport(descriptor),
        carrier_(descriptor.low_level_descriptor),
        drops_(std::move(drops)),
        admits_fragments_(guard.admits_fragments),
        shared_memory_(std::move(shared_memory)) {
    if (guard.closed) closed_ = std::make_unique<ClosedDomain>();
  }

  rtps::TransportDescriptorInterface* get_configuration() override { return carrier_.get(); }

  bool OpenInputChannel(const Locator_t& locator, rtps::TransportReceiverInterface* receiver,
                        std::uint32_t longest) override {
    if (!ChainingTransport::OpenInputChannel(locator, receiver, longest)) return false;
    if (shared_memory_) shared_memory_->listens_at(locator);
    return true;
  }

  bool transform_remote_locator(const Locator_t& remote, Locator_t& result) const override {
    if (shared_memory_ && !shared_memory_->within_reach(remote)) return false;
    return ChainingTransport::transform_remote_locator(remote, result);
  }

  bool send(eprosima::fastrtps::rtps::SenderResource* sender, const eprosima::fastrtps::rtps::octet* buffer,
            std::uint32_t size, eprosima::fastrtps::rtps::LocatorsIterator* begin,
            eprosima::fastrtps::rtps::LocatorsIterator* end,
            const std::chrono::steady_clock::time_point& timeout) override {
    return sender->send(buffer, size, begin, end, timeout);
  }

  void receive(rtps::TransportReceiverInterface* next, const eprosima::fastrtps::rtps::octet* buffer,
               std::uint32_t size, const Locator_t& local, const Locator_t& remote) override {
    if (shared_memory_ && shared_memory_->is_own_call({buffer, size}, local.port)) return;
    PacketVerdict verdict = check_packet({buffer, size});
    if (verdict.fault != PacketFault::kNone) return drops_->count(verdict, remote);
    ParticipantId sender;
    std::copy_n(buffer + kSender_at, sender.bytes.size(), sender.bytes.begin());
    if (verdict.fragmented_bytes > 0 && admits_fragments_ && !admits_fragments_(sender, verdict.fragmented_bytes)) {
      verdict.fault = PacketFault::kStranger;
      return drops_->count(verdict, remote);
    }
    // Anybody may say so in a participant's name, and Fast DDS 2.9.1 aborts when its timer for the participant's lease
    // comes up at that moment. Who leaves withdraws what he said; the lease does the rest.
    if (says_goodbye({buffer, verdict.size})) return;
    if (closed_) {
      const ClosedDomain::Verdict closed = closed_->check({buffer, verdict.size}, MonotonicClock().now());
      verdict.fault = closed.fault;
      verdict.submessage = closed.submessage;
      if (verdict.fault != PacketFault::kNone) return drops_->count(verdict, remote);
    }
    const Sender speaking(sender);
    try {
      next->OnDataReceived(buffer, static_cast<std::uint32_t>(verdict.size), local, remote);
    } catch (const std::exception&) {  // no memory for what a packet asks for, at the worst: it ends no process
      verdict.fault = PacketFault::kUnread;
      drops_->count(verdict, remote);
    }
  }

 private:
  const std::shared_ptr<rtps::TransportDescriptorInterface> carrier_;
  const std::shared_ptr<Drops> drops_;
  const AdmitsFragments admits_fragments_;
  const std::shared_ptr<SharedMemory> shared_memory_;  // null: the carrier is none
  std::unique_ptr<ClosedDomain> closed_;               // null: the domain is open
};

class GuardedDescriptor final : public rtps::ChainingTransportDescriptor {
 public:
  GuardedDescriptor(std::shared_ptr<rtps::TransportDescriptorInterface> carrier, Guard guard,
                    std::shared_ptr<SharedMemory> shared_memory)
      : ChainingTransportDescriptor(std::move(carrier)),
        drops_(std::make_shared<Drops>(guard.on_dropped)),
        guard_(std::move(guard)),
        shared_memory_(std::move(shared_memory)) {}

  rtps::TransportInterface* create_transport() const override {
    return new GuardedTransport(*this, drops_, guard_, shared_memory_);
  }

 private:
  std::shared_ptr<Drops> drops_;
  Guard guard_;
  std::shared_ptr<SharedMemory> shared_memory_;
};

/// A participant announces and takes shared memory only if one of its transports is described by this class.
class GuardedSharedMemory final : public rtps::SharedMemTransportDescriptor {
 public:
  GuardedSharedMemory(const rtps::SharedMemTransportDescriptor& carrier, std::shared_ptr<GuardedDescriptor> guard)
      : SharedMemTransportDescriptor(carrier), guard_(std::move(guard)) {}

  rtps::TransportInterface* create_transport() const override { return guard_->create_transport(); }

 private:
  std::shared_ptr<GuardedDescriptor> guard_;
};

}  // namespace

const ParticipantId* packet_sender() noexcept { return sender_now; }

std::shared_ptr<rtps::TransportDescriptorInterface> guarded(std::shared_ptr<rtps::TransportDescriptorInterface> carrier,
                                                            Guard guard) {
  return std::make_shared<GuardedDescriptor>(std::move(carrier), std::move(guard), nullptr);
}

std::shared_ptr<rtps::TransportDescriptorInterface> guarded(std::shared_ptr<SharedMemory> shared_memory, Guard guard) {
  const auto carrier = SharedMemory::transport();
  return std::make_shared<GuardedSharedMemory>(
      *carrier, std::make_shared<GuardedDescriptor>(carrier, std::move(guard), std::move(shared_memory)));
}

}  // namespace gatefield::dds
