#pragma once

#include <fastdds/rtps/common/Locator.h>
#include <fastdds/rtps/transport/TransportInterface.h>
#include <fastdds/rtps/transport/shared_mem/SharedMemTransportDescriptor.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <thread>
#include <vector>

#include "common/base/clock.h"

/// Inside common/dds only.
namespace gatefield::dds {

/// Shared memory of one participant, watched. In Fast DDS 2.9.1 a datagram whose sender died before it was read stays
/// at the head of the receiver's queue for ever, and nothing that comes after it is heard. So this calls the
/// participant's own ports several times a second, from a segment of its own, and says so when it no longer hears that.
///
/// Locators that are announced carry in bytes that the library leaves alone which /dev/shm and which user they are of:
/// who has another one is not reached, and takes UDP.
/// Thread-safe: yes.
class SharedMemory {
 public:
  /// @param on_deaf  called once, on a thread of this
  explicit SharedMemory(std::function<void()> on_deaf);
  ~SharedMemory();
  SharedMemory(const SharedMemory&) = delete;
  SharedMemory& operator=(const SharedMemory&) = delete;

  /// What the participant sends and listens with.
  static std::shared_ptr<eprosima::fastdds::rtps::SharedMemTransportDescriptor> transport();
  /// Where a participant listens, to be announced.
  eprosima::fastrtps::rtps::Locator_t locator(std::uint32_t port) const;

  /// The participant listens there from now on.
  void listens_at(const eprosima::fastrtps::rtps::Locator_t& locator);
  bool within_reach(const eprosima::fastrtps::rtps::Locator_t& remote) const noexcept;
  /// Called with each packet. @return true: it was a call of this one, and has done its work
  bool is_own_call(std::span<const std::uint8_t> packet, std::uint32_t port) noexcept;

 private:
  using Call = std::array<std::uint8_t, 24>;
  struct Ear {
    eprosima::fastrtps::rtps::Locator_t locator;
    std::atomic<std::int64_t> heard_ns{0};
    std::atomic<unsigned> unheard{0};  ///< calls since then
  };
  void watch();
  bool deaf() const;

  const std::function<void()> on_deaf_;
  const std::array<std::uint8_t, 8> place_;  ///< this /dev/shm and this user
  const Call call_;
  std::unique_ptr<eprosima::fastdds::rtps::TransportInterface> caller_;
  mutable std::mutex mutex_;  // of the list; ears themselves stay where they are
  std::vector<std::unique_ptr<Ear>> ears_;
  std::atomic<bool> ends_{false};
  std::thread thread_;  // last: goes first
};

/// Removes what Fast DDS's processes that are gone left in the folder: segments and ports whose lock nobody holds.
/// @param folder  /dev/shm, and another one in tests
/// @return how many files
int remove_dead_segments(const std::filesystem::path& folder = "/dev/shm");

}  // namespace gatefield::dds
