#include "gatefield/sdk/client.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <condition_variable>
#include <cstring>
#include <mutex>
#include <random>
#include <utility>
#include <vector>

#include "client/sdk/asked_history.h"
#include "client/sdk/fallback.h"
#include "client/sdk/keep_clear.h"
#include "client/sdk/plan_player.h"
#include "client/sdk/problem_watch.h"
#include "client/sdk/session_logic.h"
#include "client/sdk/silence.h"
#include "common/base/mailbox.h"
#include "common/base/statistics.h"
#include "common/dds/client_endpoint.h"
#include "common/protocol/validate.h"

namespace gatefield::sdk {
namespace {

using namespace std::chrono_literals;

constexpr auto kResendState = 20ms;
constexpr auto kResendDepth = 160ms;
constexpr Stamp kMaxPeriod = 100ms;    // slower is no control any more
constexpr double kGateMargin_m = 0.4;  // how well a gate's place is known; as SupervisorOptions::gate_margin_m
constexpr auto kMaxRoundTrip = 60s;    // what the wire takes; a longer one is a pause, not a delay

Stamp wall_now() { return MonotonicClock().now(); }

// Two clients, or two starts of one, must not have the same request numbers.
std::uint64_t fresh_number() {
  std::random_device device;
  std::uint64_t number = 0;
  while (number == 0) number = (std::uint64_t{device()} << 32) | device();
  return number;
}

RateCommand command_of(const Setpoint& setpoint) {
  RateCommand command;
  command << setpoint.collective_thrust_n, setpoint.body_rates_rad_s;
  return command;
}

// The last 4096 values of something.
class Window {
 public:
  void add(double value) {
    if (values_.size() < kSize)
      values_.push_back(value);
    else
      values_[next_] = value;
    next_ = (next_ + 1) % kSize;
  }
  // 0 when there are none.
  double quantile(double part) const { return values_.empty() ? 0.0 : gatefield::quantile(values_, part); }

 private:
  static constexpr std::size_t kSize = 4096;
  std::vector<double> values_;
  std::size_t next_ = 0;
};

class DdsClient final : public Client, private dds::ClientHandler {
 public:
  explicit DdsClient(const Options& options)
      : options_(options), logic_(fresh_number()), fallback_(options.quadrotor, options.actuation) {
    frame_.vehicle = options.vehicle;
    last_state_.vehicle = options.vehicle;
  }

  Status join(const std::atomic<bool>* cancel) {
    if (auto good = protocol::validate(request(logic_.request())); !good) return good;
    fallback_ = Fallback(options_.quadrotor, options_.actuation,
                         KeepClear(options_.course, options_.quadrotor.collision_radius_m + kGateMargin_m));
    dds::TransportOptions transport;
    transport.network = options_.network;
    transport.on_packets_dropped = [this](const dds::DroppedPackets& dropped) {
      packets_dropped_.fetch_add(dropped.count, std::memory_order_relaxed);
    };
    auto endpoint = dds::ClientEndpoint::create(options_.domain, options_.vehicle, this, transport);
    if (!endpoint.ok()) return endpoint.failure();
    endpoint_ = std::move(endpoint).value();

    const Stamp deadline = wall_now() + options_.connect_timeout;
    std::unique_lock lock(mutex_);
    while (logic_.phase() == SessionLogic::Phase::kJoining) {
      const Stamp now = wall_now();
      if (cancel != nullptr && *cancel)
        return Error("joining was cancelled before a server answered", ErrorCode::kNoAnswer);
      if (now >= deadline) {
        if (logic_.refusal()) return *logic_.refusal();
        const std::string named = options_.server.empty() ? "" : " of the name '" + options_.server + "'";
        return Error("no planning server" + named + " answered in DDS domain " + std::to_string(options_.domain) +
                         " within " + std::to_string(options_.connect_timeout.count()) +
                         " ms, expected a gatefield-server" + named + " in that domain on this network",
                     ErrorCode::kNoAnswer);
      }
      if (logic_.request_due(now)) {
        const auto due = request(logic_.request());
        lock.unlock();
        if (auto sent = endpoint_->publish(due); !sent) return sent;
        lock.lock();
      }
      changed_.wait_for(lock, std::min<Stamp>(deadline - now, 20ms));
    }
    if (logic_.phase() == SessionLogic::Phase::kFailed) return *logic_.refusal();
    return {};
  }

  /// Leaves the session.
  ~DdsClient() override {
    if (!endpoint_) return;
    bool joined = false;
    protocol::SessionRequest goodbye;
    {
      const std::lock_guard lock(mutex_);
      joined = logic_.phase() == SessionLogic::Phase::kJoined;
      goodbye = request(logic_.request());
    }
    goodbye.action = protocol::SessionRequest::Action::kLeave;
    // When this can't be sent, the withdrawal that follows or the lease says the same.
    if (joined) static_cast<void>(endpoint_->publish(goodbye));
    endpoint_.reset();  // no callback comes after this
  }

  protocol::SessionReply session() const override {
    const std::lock_guard lock(mutex_);
    return logic_.session();
  }

  std::uint64_t send_depth(Stamp stamp, std::span<const float> depth_m) override {
    return send_pixels(stamp, protocol::DepthEncoding::kMetres32, depth_m.size(), depth_m.data());
  }

  std::uint64_t send_depth_counts(Stamp stamp, std::span<const std::uint16_t> counts) override {
    return send_pixels(stamp, protocol::DepthEncoding::kCounts16, counts.size(), counts.data());
  }

  std::uint64_t send_state(Stamp stamp, const QuadrotorState& state, bool thrust_known) override {
    const Stamp now = wall_now();
    const std::lock_guard sending(state_mutex_);
    protocol::SessionRequest again;
    bool due = false;
    {
      const std::lock_guard lock(mutex_);
      if (logic_.on_state_sent(now)) adopted();
      due = logic_.request_due(now);
      if (due) again = request(logic_.request());
      last_state_.session = logic_.session().session;
      last_state_.round_trip =
          options_.timing == protocol::Timing::kLockstep ? Stamp{played_after_.load()} : newest_round_trip_;
      last_state_.heard_waypoint = heard_waypoint_;
      last_state_.heard_lap = heard_lap_;
      ++last_state_.sequence;
      sent_[last_state_.sequence % sent_.size()] = {last_state_.sequence, now};
    }
    if (due) static_cast<void>(endpoint_->publish(again));
    last_state_.stamp = stamp;
    last_state_.state = state;
    last_state_.thrust_known = thrust_known;
    last_state_.depth_sequence = depth_sequence_.load(std::memory_order_acquire);
    last_state_.asked = asked_.at(stamp);
    endpoint_->publish(last_state_);
    return last_state_.sequence;
  }

  std::optional<protocol::ThrustRateCommand> newest() override {
    const std::lock_guard lock(mutex_);
    if (!command_fresh_) return std::nullopt;
    command_fresh_ = false;
    return command_;
  }

  std::optional<protocol::ThrustRateCommand> wait_for_answer(std::uint64_t state_sequence,
                                                             std::chrono::milliseconds timeout) override {
    const Stamp start = wall_now();
    const Stamp deadline = start + timeout;
    std::unique_lock lock(mutex_);
    // Who waits in short turns, to look at something else between them, sends again as if it had been one.
    Waited due = waited_;
    if (due.sequence != state_sequence) due = {state_sequence, start + kResendState, start + kResendDepth};
    const auto keep_due = [&] {
      if (state_sequence >= waited_.sequence) waited_ = due;
    };
    keep_due();
    const auto answered = [&] { return command_valid_ && command_.answers_sequence == state_sequence; };
    while (!answered()) {
      const Stamp now = wall_now();
      if (now >= deadline) return std::nullopt;
      if (now < due.next_state) {
        changed_.wait_for(lock, std::min(due.next_state, deadline) - now);
        continue;
      }
      const bool taken_over = logic_.on_state_sent(now);
      if (taken_over) adopted();
      const bool new_session = taken_over || logic_.session().session != frame_session_.load();
      const std::uint64_t session = logic_.session().session;
      const bool ask = logic_.request_due(now);
      protocol::SessionRequest again;
      if (ask) again = request(logic_.request());
      lock.unlock();
      if (ask) static_cast<void>(endpoint_->publish(again));
      // A server that is new to us has never seen the frame that the state names, and one that was slow to match may
      // have missed it.
      if (new_session || now >= due.next_depth) {
        resend_depth(session);
        due.next_depth = now + kResendDepth;
      }
      resend_state(session, state_sequence);
      due.next_state = now + kResendState;
      lock.lock();
      keep_due();
    }
    return command_;
  }

  Setpoint play(Stamp now, const QuadrotorState& state, std::chrono::nanoseconds period) override {
    if (const protocol::ThrustRateCommand* command = play_box_.read()) {
      player_.take(*command);
      silence_.heard(now);
      gives_up_ = false;
      played_after_.store(std::clamp<Stamp>(now - command->answers_stamp, Stamp{0}, kMaxRoundTrip).count());
    }
    const auto setpoint = player_.at(now, std::clamp<Stamp>(period, Stamp{0}, kMaxPeriod));
    // Of a link that is cut the rest of the plan is worth flying only where it leads through a gate: else that is the
    // room to stop in. What has begun goes on until a command comes.
    gives_up_ =
        gives_up_ || !setpoint || (silence_.lasts(now) && fallback_.better_than_plan(state, player_.end() - now));
    if (gives_up_) return played(now, fallback_.update(now, state));
    fallback_.reset();
    return played(now, *setpoint);
  }

  void applied(Stamp now, const std::optional<Setpoint>& setpoint) override {
    if (!by_rates()) return;
    if (!setpoint) return asked_.note(now, {protocol::AskedBy::kUnknown});
    const RateCommand command = command_of(*setpoint);
    if (now != played_at_ || command != played_) asked_.note(now, {protocol::AskedBy::kOther, command});
  }

  protocol::Problems problems() const override {
    const std::lock_guard lock(mutex_);
    return problems_.now();
  }

  std::optional<ProblemChange> problem_change() override {
    const std::lock_guard lock(mutex_);
    return problems_.next();
  }

  std::optional<SessionChange> session_change() override {
    const std::lock_guard lock(mutex_);
    return logic_.next_change();
  }

  LinkStatistics statistics() const override {
    LinkStatistics statistics;
    Window round_trips, solves;  // sorted without the lock, which commands wait for
    {
      const std::lock_guard lock(mutex_);
      statistics.commands = commands_;
      statistics.rejected = rejected_ + strangers_.load(std::memory_order_relaxed);
      statistics.reconnects = logic_.reconnects();
      statistics.take_overs = logic_.take_overs();
      statistics.longest_silence_s = seconds(logic_.longest_silence());
      statistics.packets_dropped = packets_dropped_.load(std::memory_order_relaxed);
      round_trips = round_trips_;
      solves = solves_;
    }
    statistics.round_trip_p50_s = round_trips.quantile(0.50);
    statistics.round_trip_p99_s = round_trips.quantile(0.99);
    statistics.solve_p50_s = solves.quantile(0.50);
    statistics.solve_p99_s = solves.quantile(0.99);
    return statistics;
  }

  std::optional<protocol::Telemetry> telemetry() override {
    const std::lock_guard lock(mutex_);
    return std::exchange(telemetry_, std::nullopt);
  }

 private:
  bool by_rates() const { return options_.actuation.kind == Actuation::Kind::kBodyRates; }

  const Setpoint& played(Stamp now, const Setpoint& setpoint) {
    if (!by_rates()) return setpoint;
    played_at_ = now;
    played_ = command_of(setpoint);
    if (setpoint.source == Setpoint::Source::kPlan)
      asked_.note(now, {});
    else
      asked_.note(now, {protocol::AskedBy::kFallback, played_});
    return setpoint;
  }

  protocol::SessionRequest request(std::uint64_t number) const {
    protocol::SessionRequest request;
    request.vehicle = options_.vehicle;
    request.request = number;
    request.timing = options_.timing;
    request.profile = options_.profile;
    request.seed = options_.seed;
    request.speed_limit_m_s = options_.speed_limit_m_s;
    request.priority = options_.priority;
    request.quadrotor = options_.quadrotor;
    request.actuation = options_.actuation;
    request.camera = options_.camera;
    request.course = options_.course;
    return request;
  }

  std::uint64_t send_pixels(Stamp stamp, protocol::DepthEncoding encoding, std::size_t count, const void* pixels) {
    const auto width_px = static_cast<std::uint32_t>(options_.camera.width_px);
    const auto height_px = static_cast<std::uint32_t>(options_.camera.height_px);
    if (count != std::size_t{width_px} * height_px) return 0;
    const std::uint64_t current = session().session;
    const std::lock_guard lock(depth_mutex_);
    frame_.session = current;
    ++frame_.sequence;
    frame_.stamp = stamp;
    frame_.width_px = width_px;
    frame_.height_px = height_px;
    frame_.encoding = encoding;
    frame_.pixels.resize(count * protocol::bytes_per_pixel(encoding));
    std::memcpy(frame_.pixels.data(), pixels, frame_.pixels.size());
    endpoint_->publish(frame_);
    frame_session_.store(current);
    depth_sequence_.store(frame_.sequence, std::memory_order_release);
    return frame_.sequence;
  }

  void resend_depth(std::uint64_t session) {
    const std::lock_guard lock(depth_mutex_);
    frame_session_.store(session);
    if (frame_.sequence == 0) return;
    frame_.session = session;
    endpoint_->publish(frame_);
  }

  void resend_state(std::uint64_t session, std::uint64_t sequence) {
    const std::lock_guard sending(state_mutex_);
    if (last_state_.sequence != sequence) return;  // a newer one is out
    last_state_.session = session;
    endpoint_->publish(last_state_);
  }

  /// A new session is the current one. Under the mutex.
  void adopted() {
    problems_.reset();
    listen();
  }
  /// Who is heard from now on. Under the mutex.
  void listen() {
    const std::lock_guard lock(ear_mutex_);
    ear_ = logic_.ear();
  }
  /// Under the mutex.
  bool may_answer(const protocol::SessionReply& reply, const dds::ParticipantId& from) const {
    const bool goes_on = from == logic_.ear().server || from == logic_.ear().heir;  // as our server said, or is it
    return options_.server.empty() || reply.server == options_.server || goes_on;
  }

  void on_reply(const protocol::SessionReply& reply, const dds::ParticipantId& from) override {
    {
      const std::lock_guard lock(mutex_);
      if (!may_answer(reply, from)) return;
      if (logic_.on_reply(reply, from, wall_now()))
        adopted();
      else
        listen();
    }
    changed_.notify_all();
  }

  bool hears(const dds::ParticipantId& from) noexcept override {
    const Stamp now = wall_now();
    const std::lock_guard lock(ear_mutex_);
    if (ear_.hears(from, now)) return true;
    strangers_.fetch_add(1, std::memory_order_relaxed);
    return false;
  }

  void on_command(const protocol::ThrustRateCommand& command, const dds::ParticipantId& from) override {
    {
      const Stamp now = wall_now();
      const std::lock_guard lock(mutex_);
      const SessionLogic::Heard heard = command.actuation == options_.actuation.kind
                                            ? logic_.on_command(command, from, now)
                                            : SessionLogic::Heard::kForeign;  // this vehicle could not follow it
      if (heard == SessionLogic::Heard::kForeign) ++rejected_;
      if (heard != SessionLogic::Heard::kNew) return;
      listen();
      ++commands_;
      const Sent& sent = sent_[command.answers_sequence % sent_.size()];
      if (sent.sequence == command.answers_sequence && command.answers_sequence > last_answered_) {
        last_answered_ = command.answers_sequence;
        newest_round_trip_ = std::min<Stamp>(now - sent.when, kMaxRoundTrip);
        round_trips_.add(seconds(newest_round_trip_));
      }
      solves_.add(command.health.solve_time_s);
      heard_waypoint_ = command.health.target_waypoint;
      heard_lap_ = command.health.lap;
      command_ = command;
      command_valid_ = command_fresh_ = true;
      problems_.on_command(command.health.problems);
      // Under the lock, so that who sees the answer also plays it: lockstep would not repeat itself otherwise.
      // Of this reader's callbacks only one runs at a time, so the mailbox has one writer.
      play_box_.write(command);
    }
    changed_.notify_all();
  }

  void on_telemetry(const protocol::Telemetry& telemetry) override {
    const std::lock_guard lock(mutex_);
    if (telemetry.session != logic_.session().session) return;
    logic_.on_telemetry(wall_now());
    telemetry_ = telemetry;
    problems_.on_telemetry(telemetry.health.problems);
  }

  void on_rejected(dds::Topic topic, const std::string&) override {
    if (topic != dds::Topic::kCommand) return;
    const std::lock_guard lock(mutex_);
    ++rejected_;
  }

  struct Sent {
    std::uint64_t sequence = 0;
    Stamp when{0};
  };

  /// The newest wait for an answer: when state and depth are due again.
  struct Waited {
    std::uint64_t sequence = 0;
    Stamp next_state{0}, next_depth{0};
  };

  const Options options_;
  std::atomic<std::uint64_t> packets_dropped_{0};

  mutable std::mutex mutex_;  // all that follows, up to the next mutex
  std::condition_variable changed_;
  SessionLogic logic_;
  protocol::ThrustRateCommand command_;
  bool command_valid_ = false;
  bool command_fresh_ = false;
  std::optional<protocol::Telemetry> telemetry_;
  ProblemWatch problems_;
  Waited waited_;
  std::array<Sent, 1024> sent_{};  // when each state went out, by its sequence
  std::uint64_t last_answered_ = 0;
  Stamp newest_round_trip_{0};  // by the wall clock; in lockstep played_after_ is told instead
  std::uint32_t heard_waypoint_ = 0;
  std::uint32_t heard_lap_ = 0;
  std::uint64_t commands_ = 0;
  std::uint64_t rejected_ = 0;
  Window round_trips_;
  Window solves_;

  std::mutex ear_mutex_;  // taken after mutex_, and by callbacks that hold the middleware's locks
  Ear ear_;
  std::atomic<std::uint64_t> strangers_{0};  // commands and telemetry of other participants

  std::mutex state_mutex_;  // taken before mutex_
  protocol::VehicleState last_state_;

  std::mutex depth_mutex_;
  protocol::DepthFrame frame_;
  std::atomic<std::uint64_t> depth_sequence_{0};
  std::atomic<std::uint64_t> frame_session_{0};

  // play() and applied() only; the mailbox is how commands get there without a lock.
  Mailbox<protocol::ThrustRateCommand> play_box_;
  PlanPlayer player_;
  Fallback fallback_;
  Silence silence_;
  bool gives_up_ = false;  // the plan, until the next one
  Stamp played_at_{-1};
  RateCommand played_ = RateCommand::Zero();
  AskedHistory asked_;  // written by play() and applied(), read by send_state()
  // From a state's stamp to the first use of the plan that answers it, by the client's own clock: the whole delay, in
  // simulated time too.
  std::atomic<std::int64_t> played_after_{0};

  std::unique_ptr<dds::ClientEndpoint> endpoint_;  // last: goes first, and its callbacks with it
};

}  // namespace

Result<std::unique_ptr<Client>> connect_if_layouts_agree(const Options& options, const std::atomic<bool>* cancel,
                                                         ClientLayout) {
  auto client = std::make_unique<DdsClient>(options);
  if (auto joined = client->join(cancel); !joined) return joined.failure();
  return std::unique_ptr<Client>(std::move(client));
}

}  // namespace gatefield::sdk
