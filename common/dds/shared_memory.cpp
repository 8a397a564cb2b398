#include "common/dds/shared_memory.h"

#include <fastdds/rtps/network/SenderResource.h>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <fastdds/rtps/common/LocatorList.hpp>
#include <random>
#include <string>

namespace gatefield::dds {
namespace {

using namespace std::chrono_literals;
namespace rtps = eprosima::fastdds::rtps;
using eprosima::fastrtps::rtps::Locator_t;

constexpr std::uint32_t kSegment_bytes = 8 << 20;  // some depth frames under way
constexpr std::uint32_t kQueue = 2048;             // datagrams, of which a frame of 640 x 480 has 900
constexpr std::uint32_t kCallerSegment_bytes = 65536;
constexpr auto kCallEvery = 200ms;
constexpr auto kDeafAfter = 3s;
constexpr unsigned kDeafAfterCalls = 10;  // a process that was stopped for a while hears nothing, and isn't deaf
constexpr std::size_t kPlace_at = 8;      // in a locator's address; the library uses those before

/// Tells this /dev/shm and this user from others. A restart of the machine empties it anyway.
std::array<std::uint8_t, 8> place_here() {
  struct stat folder {};
  stat("/dev/shm", &folder);
  const std::uint64_t place = (static_cast<std::uint64_t>(folder.st_dev) << 32) ^
                              (static_cast<std::uint64_t>(folder.st_ino) << 24) ^ geteuid() ^
                              0x47'46'00'00'00'00'00'01U;
  std::array<std::uint8_t, 8> bytes{};
  std::memcpy(bytes.data(), &place, bytes.size());
  return bytes;
}

std::array<std::uint8_t, 24> fresh_call() {
  std::array<std::uint8_t, 24> call{'G', 'F', 'c', 'a', 'l', 'l'};
  std::random_device device;
  std::generate(call.begin() + 8, call.end(), [&] { return static_cast<std::uint8_t>(device()); });
  return call;
}

std::shared_ptr<rtps::SharedMemTransportDescriptor> descriptor(std::uint32_t segment_bytes) {
  auto made = std::make_shared<rtps::SharedMemTransportDescriptor>();
  made->segment_size(segment_bytes);
  made->port_queue_capacity(kQueue);
  made->max_message_size(65500);
  return made;
}

}  // namespace

SharedMemory::SharedMemory(std::function<void()> on_deaf)
    : on_deaf_(std::move(on_deaf)), place_(place_here()), call_(fresh_call()) {
  caller_.reset(descriptor(kCallerSegment_bytes)->create_transport());
  if (caller_->init()) thread_ = std::thread([this] { watch(); });
}

SharedMemory::~SharedMemory() {
  ends_ = true;
  if (thread_.joinable()) thread_.join();
}

std::shared_ptr<rtps::SharedMemTransportDescriptor> SharedMemory::transport() { return descriptor(kSegment_bytes); }

Locator_t SharedMemory::locator(std::uint32_t port) const {
  rtps::LocatorList list;
  caller_->getDefaultUnicastLocators(list, port);
  Locator_t made = *list.begin();
  std::copy(place_.begin(), place_.end(), made.address + kPlace_at);
  return made;
}

void SharedMemory::listens_at(const Locator_t& locator) {
  auto ear = std::make_unique<Ear>();
  ear->locator = locator;
  ear->heard_ns = MonotonicClock().now().count();
  const std::lock_guard lock(mutex_);
  ears_.push_back(std::move(ear));
}

bool SharedMemory::within_reach(const Locator_t& remote) const noexcept {
  return remote.kind != LOCATOR_KIND_SHM || std::equal(place_.begin(), place_.end(), remote.address + kPlace_at);
}

bool SharedMemory::is_own_call(std::span<const std::uint8_t> packet, std::uint32_t port) noexcept {
  if (!std::equal(packet.begin(), packet.end(), call_.begin(), call_.end())) return false;
  const std::lock_guard lock(mutex_);
  for (const auto& ear : ears_) {
    if (ear->locator.port != port) continue;
    ear->heard_ns = MonotonicClock().now().count();
    ear->unheard = 0;
  }
  return true;
}

void SharedMemory::watch() {
  rtps::SendResourceList voices;
  while (!ends_) {
    std::vector<Locator_t> ports;
    {
      const std::lock_guard lock(mutex_);
      for (const auto& ear : ears_) {
        ports.push_back(ear->locator);
        ++ear->unheard;
      }
    }
    for (const Locator_t& port : ports) caller_->OpenOutputChannel(voices, port);
    if (!voices.empty() && !ports.empty()) {
      rtps::Locators begin(ports.cbegin()), end(ports.cend());
      voices.front()->send(call_.data(), static_cast<std::uint32_t>(call_.size()), &begin, &end,
                           std::chrono::steady_clock::now() + 50ms);
    }
    if (deaf()) return on_deaf_ ? on_deaf_() : void();
    for (auto waited = 0ms; waited < kCallEvery && !ends_; waited += 50ms) std::this_thread::sleep_for(50ms);
  }
}

bool SharedMemory::deaf() const {
  const std::int64_t now_ns = MonotonicClock().now().count();
  const std::lock_guard lock(mutex_);
  return std::any_of(ears_.begin(), ears_.end(), [now_ns](const auto& ear) {
    return ear->unheard > kDeafAfterCalls && now_ns - ear->heard_ns > std::chrono::nanoseconds(kDeafAfter).count();
  });
}

namespace {

/// Nobody holds the lock of this file, or it isn't there.
bool unlocked(const std::filesystem::path& lock_file) {
  const int file = open(lock_file.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
  if (file < 0) return errno == ENOENT;
  const bool free = flock(file, LOCK_EX | LOCK_NB) == 0;
  close(file);
  return free;
}

bool all_of(const std::string& text, const char* letters) {
  return text.find_first_not_of(letters) == std::string::npos;
}

/// "fastrtps_0123456789abcdef" of a segment, "fastrtps_port7411" of a port; empty: none of them.
std::string resource_of(const std::string& name) {
  constexpr std::string_view kPrefix = "fastrtps_", kPort = "port";
  if (!name.starts_with(kPrefix)) return {};
  const std::string rest = name.substr(kPrefix.size());
  if (rest.starts_with(kPort))
    return rest.size() > kPort.size() && all_of(rest.substr(kPort.size()), "0123456789") ? name : std::string();
  return rest.size() == 16 && all_of(rest, "0123456789abcdef") ? name : std::string();
}

}  // namespace

int remove_dead_segments(const std::filesystem::path& folder) {
  std::error_code failed;
  std::vector<std::string> resources;
  for (const auto& entry : std::filesystem::directory_iterator(folder, failed))
    if (std::string name = resource_of(entry.path().filename().string()); !name.empty())
      resources.push_back(std::move(name));
  int removed = 0;
  for (const std::string& name : resources) {
    // A segment's owner holds the first; who listens at a port alone that one, those who listen together the second.
    if (!unlocked(folder / (name + "_el")) || !unlocked(folder / (name + "_sl"))) continue;
    for (const std::string& file : {name, name + "_el", name + "_sl", "sem." + name + "_mutex"})
      if (std::filesystem::remove(folder / file, failed)) ++removed;
  }
  return removed;
}

}  // namespace gatefield::dds
