// Preloaded into Betaflight built for a computer (target SITL), this gives it the simulator's time: LD_PRELOAD names
// the library. What goes over the wire is in client/firmware/betaflight_sitl/packets.h.
//
// The firmware's main thread asks for the time (CLOCK_MONOTONIC) and sleeps; its other threads take states, channels
// and MSP from sockets. So the main thread runs on a clock of ours:
//
//   free    it follows the machine's, by at most kMaxCatchUp a look: its scheduler would give up the gyro for good if it
//           were kept from running for some periods of it just after the start, as busy machines do
//   bound   each look takes kLook, a sleep takes as long as it says and no real time. At the horizon, which each state
//           moves on, the main thread answers with its newest motors and waits.
//
// A state whose stamp is a little later than the last one's binds. One whose stamp stands still frees, and so does
// silence for kPatience: a firmware whose simulator has gone is an ordinary one again. A state moves the horizon only
// once its thread has taken it to the end, and when channels and MSP that came before it are taken, too: so what the
// firmware knows at a time of its own does not depend on how busy the machine is.

#include <arpa/inet.h>
#include <dlfcn.h>
#include <poll.h>
#include <pthread.h>
#include <sys/select.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <cstring>
#include <ctime>
#include <utility>

namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::int64_t kLook = 250;  // ns; its scheduler looks at the clock until a time has come, so time must pass
constexpr std::int64_t kMaxCatchUp = 2'000;
constexpr std::int64_t kPatience = 5 * kSecond;
constexpr std::int64_t kMaxStep = kSecond / 10;  // a stamp that is further on begins anew
constexpr std::int64_t kDrainLimit = kSecond / 20;
constexpr std::int64_t kMspTick = kSecond / 1000;  // its MSP thread looks this often for what to send: 4.4, every 0.5 s
constexpr std::uint16_t kStatePort = 9003, kChannelsPort = 9004, kMotorsPort = 9002;
constexpr ssize_t kStateBytes = 144, kStateBytesOf44 = 136;  // the older has no pressure
constexpr std::size_t kMotorsBytes = 16, kStampBytes = sizeof(double);

template <typename Function>
Function* next_of(const char* name) noexcept {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

/// The functions that ours stand before. A function of its own, since others may ask before main() begins.
struct Real {
  decltype(::clock_gettime)* clock_gettime = next_of<decltype(::clock_gettime)>("clock_gettime");
  decltype(::nanosleep)* nanosleep = next_of<decltype(::nanosleep)>("nanosleep");
  decltype(::select)* select = next_of<decltype(::select)>("select");
  decltype(::recv)* recv = next_of<decltype(::recv)>("recv");
  decltype(::recvfrom)* recvfrom = next_of<decltype(::recvfrom)>("recvfrom");
  decltype(::sendto)* sendto = next_of<decltype(::sendto)>("sendto");
};
const Real& real() noexcept {
  static const Real functions;
  return functions;
}

timespec timespec_of(std::int64_t ns) noexcept { return {ns / kSecond, ns % kSecond}; }

std::int64_t real_now() noexcept {
  timespec now{};
  real().clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * kSecond + now.tv_nsec;
}

void pause_really(std::int64_t ns) noexcept {
  const timespec span = timespec_of(ns);
  real().nanosleep(&span, nullptr);
}

/// What a thread takes from its sockets.
enum class Takes : std::uint8_t { kNothing, kUnknown, kStates, kChannels, kMsp };
thread_local Takes takes = Takes::kUnknown;
__attribute__((constructor)) void know_main_thread() noexcept { takes = Takes::kNothing; }

/// One of the sockets whose bytes must be taken before the firmware's time goes on.
struct Socket {
  std::atomic<int> fd{-1};
  std::atomic<bool> taking{false};

  bool drained() const noexcept {
    if (taking) return false;
    pollfd waiting{fd, POLLIN, 0};
    return waiting.fd < 0 || poll(&waiting, 1, 0) <= 0 || (waiting.revents & POLLIN) == 0;
  }
};
Socket channels_socket, msp_socket;

/// Motors, where they go, and which state they answer.
struct Answer {
  int fd = -1;
  sockaddr_in to{};
  std::array<std::uint8_t, kMotorsBytes + kStampBytes> packet{};

  void keep(int socket, const void* motors, const sockaddr* address) noexcept {
    fd = socket;
    std::memcpy(&to, address, sizeof(to));
    std::memcpy(packet.data(), motors, kMotorsBytes);
  }
  void send(double stamp) noexcept {
    if (fd < 0) return;
    std::memcpy(packet.data() + kMotorsBytes, &stamp, kStampBytes);
    real().sendto(fd, packet.data(), packet.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof(to));
  }
};

class LockstepClock {
 public:
  LockstepClock() noexcept {
    pthread_condattr_t monotonic;
    pthread_condattr_init(&monotonic);
    pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
    pthread_cond_init(&moved_on_, &monotonic);
    pthread_condattr_destroy(&monotonic);
  }

  bool bound() const noexcept { return bound_; }

  /// Of any thread.
  std::int64_t now() const noexcept { return now_; }

  /// The main thread looks at the time, which goes on by that.
  std::int64_t look() noexcept {
    if (bound_) return pass(kLook);
    const std::int64_t now = now_;
    return now_ = std::clamp(real_now() + ahead_, now, now + kMaxCatchUp);
  }

  /// The main thread sleeps.
  void sleep(std::int64_t span) noexcept {
    if (bound_) {
      pass(span);
      return;
    }
    const std::int64_t end = now_ + span, early = end - (real_now() + ahead_);
    if (early > 0) pause_really(early);
    now_ = end;
  }

  /// The main thread may run on until `span` later, which is what the state of this stamp says.
  void move_on(std::int64_t span, double stamp) noexcept {
    pthread_mutex_lock(&mutex_);
    if (!bound_) {
      horizon_ = now_.load();
      bound_ = true;
    }
    horizon_ = horizon_ + span;
    stamp_ = stamp;
    pthread_cond_signal(&moved_on_);
    pthread_mutex_unlock(&mutex_);
  }

  void free() noexcept {
    pthread_mutex_lock(&mutex_);
    if (bound_) {
      ahead_ = now_ - real_now();
      bound_ = false;
    }
    pthread_cond_signal(&moved_on_);
    pthread_mutex_unlock(&mutex_);
  }

  /// Motors that are to be sent, by any thread: the first state has its own thread send some.
  void keep(int fd, const void* motors, const sockaddr* to) noexcept {
    pthread_mutex_lock(&mutex_);
    answer_.keep(fd, motors, to);
    pthread_mutex_unlock(&mutex_);
  }

 private:
  /// The main thread's time, `span` later. Waits at the horizon; less of the span passes when it is freed there.
  std::int64_t pass(std::int64_t span) noexcept {
    while (bound_) {
      const std::int64_t now = now_, horizon = horizon_;
      if (now + span <= horizon) return now_ = now + span;
      if (now < horizon) {
        span -= horizon - now;
        now_ = horizon;
      }
      wait_at(horizon);
    }
    return now_;
  }

  void wait_at(std::int64_t horizon) noexcept {
    const timespec end = timespec_of(real_now() + kPatience);
    pthread_mutex_lock(&mutex_);
    if (horizon_ == horizon && std::exchange(answered_, horizon) != horizon) answer_.send(stamp_);
    int outcome = 0;
    while (bound_ && horizon_ == horizon && outcome == 0) outcome = pthread_cond_timedwait(&moved_on_, &mutex_, &end);
    const bool moved = horizon_ != horizon;
    pthread_mutex_unlock(&mutex_);
    if (!moved) free();
  }

  pthread_mutex_t mutex_ = PTHREAD_MUTEX_INITIALIZER;
  pthread_cond_t moved_on_{};
  std::atomic<bool> bound_{false};
  std::atomic<std::int64_t> now_{real_now()};  // written by the main thread
  std::atomic<std::int64_t> horizon_{0};       // while bound
  std::atomic<std::int64_t> ahead_{0};         // of the machine's clock, while free
  double stamp_ = 0.0;                         // under the mutex, as the answer
  Answer answer_;
  std::int64_t answered_ = 0;  // the horizon; the main thread's
};
LockstepClock& lockstep() noexcept {
  static LockstepClock clock;
  return clock;
}

/// States as they come; the thread that takes them only.
class States {
 public:
  void on_state(std::uint8_t* packet) noexcept {
    double stamp = 0.0;
    std::memcpy(&stamp, packet, kStampBytes);
    const double step_ns = 1e9 * (stamp - last_stamp_);
    span_ = step_ns > 0 && step_ns <= static_cast<double>(kMaxStep) ? static_cast<std::int64_t>(step_ns + 0.5) : 0;
    if (step_ns == 0) lockstep().free();
    last_stamp_ = stamp;
    std::memcpy(packet, &kConstantStamp, kStampBytes);
  }

  /// The newest state is taken to the end.
  void on_taken() noexcept {
    if (span_ == 0) return;
    for (std::int64_t end = real_now() + kDrainLimit; real_now() < end; pause_really(kPause)) {
      if (channels_socket.drained() && msp_socket.drained()) break;
    }
    lockstep().move_on(span_, last_stamp_);
    span_ = 0;
  }

 private:
  static constexpr double kConstantStamp = 1.0;  // stamps that advance would stretch its clock by a way of its own
  static constexpr std::int64_t kPause = 20'000;
  double last_stamp_ = 0.0;
  std::int64_t span_ = 0;
};
States states;

/// What a thread takes that waits for this socket alone, or for several.
Takes taken_from(int fd) noexcept {
  sockaddr_in bound{};
  socklen_t size = sizeof(bound);
  int type = 0;
  socklen_t type_size = sizeof(type);
  if (getsockopt(fd, SOL_SOCKET, SO_TYPE, &type, &type_size) != 0) return Takes::kUnknown;
  if (type == SOCK_STREAM) return Takes::kMsp;
  if (getsockname(fd, reinterpret_cast<sockaddr*>(&bound), &size) != 0) return Takes::kUnknown;
  if (ntohs(bound.sin_port) == kStatePort) return Takes::kStates;
  if (ntohs(bound.sin_port) == kChannelsPort) return Takes::kChannels;
  return Takes::kUnknown;
}

bool goes_to_the_simulator(const sockaddr* to, socklen_t to_size, std::size_t size) noexcept {
  if (size != kMotorsBytes || to == nullptr || to_size != sizeof(sockaddr_in) || to->sa_family != AF_INET) return false;
  sockaddr_in address{};
  std::memcpy(&address, to, sizeof(address));
  return ntohs(address.sin_port) == kMotorsPort;
}

}  // namespace

// NOLINTBEGIN(readability-inconsistent-declaration-parameter-name,readability-identifier-naming): the C library's
extern "C" {

int clock_gettime(clockid_t clock, timespec* time) noexcept {
  if (clock != CLOCK_MONOTONIC) return real().clock_gettime(clock, time);
  *time = timespec_of(takes == Takes::kNothing ? lockstep().look() : lockstep().now());
  return 0;
}

int nanosleep(const timespec* span, timespec* rest) {
  if (takes != Takes::kNothing) return real().nanosleep(span, rest);
  lockstep().sleep(span->tv_sec * kSecond + span->tv_nsec);
  return 0;
}

int select(int count, fd_set* readable, fd_set* writable, fd_set* failed, timeval* timeout) {
  if (takes == Takes::kUnknown && count > 0) takes = taken_from(count - 1);
  switch (takes) {
    case Takes::kStates:
      states.on_taken();
      break;
    case Takes::kChannels:
      channels_socket.fd = count - 1;
      channels_socket.taking = false;
      break;
    case Takes::kMsp:
      msp_socket.taking = false;
      if (timeout != nullptr && timeout->tv_sec == 0)
        timeout->tv_usec = std::min<suseconds_t>(timeout->tv_usec, kMspTick / 1000);
      break;
    case Takes::kNothing:
    case Takes::kUnknown:
      break;
  }
  return real().select(count, readable, writable, failed, timeout);
}

ssize_t recv(int fd, void* buffer, size_t size, int flags) {
  if (takes == Takes::kMsp) {
    msp_socket.taking = true;
    msp_socket.fd = fd;
  }
  return real().recv(fd, buffer, size, flags);
}

ssize_t recvfrom(int fd, void* buffer, size_t size, int flags, sockaddr* from, socklen_t* from_size) {
  if (takes == Takes::kChannels) channels_socket.taking = true;
  // 4.4 leaves it unset, and then the call may be refused.
  if (from_size != nullptr && *from_size > sizeof(sockaddr_storage)) *from_size = sizeof(sockaddr_in);
  const ssize_t got = real().recvfrom(fd, buffer, size, flags, from, from_size);
  if (takes == Takes::kStates && (got == kStateBytes || got == kStateBytesOf44))
    states.on_state(static_cast<std::uint8_t*>(buffer));
  return got;
}

ssize_t sendto(int fd, const void* bytes, size_t size, int flags, const sockaddr* to, socklen_t to_size) {
  if (goes_to_the_simulator(to, to_size, size)) {
    lockstep().keep(fd, bytes, to);
    if (takes == Takes::kNothing && lockstep().bound()) return static_cast<ssize_t>(size);
  }
  return real().sendto(fd, bytes, size, flags, to, to_size);
}

}  // extern "C"
// NOLINTEND(readability-inconsistent-declaration-parameter-name,readability-identifier-naming)
