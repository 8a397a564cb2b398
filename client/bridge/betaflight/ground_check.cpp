#include "client/bridge/betaflight/ground_check.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>

#include "client/bridge/betaflight/attitude.h"
#include "client/flight/held.h"
#include "common/base/text.h"

namespace gatefield::bridge::betaflight {
namespace {

using namespace std::chrono_literals;

constexpr auto kAskTimeout = 1s;
constexpr double kTurned_rad = 0.5;                      // a turn that a person makes on purpose
constexpr double kStill_rad_s = 0.2, kLevel_rad = 0.35;  // held in hands
constexpr Stamp kStillFor = 500ms, kFollows = 300ms;

/// What a person is asked to do, and what the turn is: along one axis of the body (FLU).
struct Turn {
  const char* request;
  Eigen::Vector3d axis_B;
};
const std::array kTurns{
    Turn{"Roll it to the right by hand: right side down, by some 45 degrees, and hold it there.", {1, 0, 0}},
    Turn{"Turn its nose down by some 45 degrees, and hold it there.", {0, 1, 0}},
    Turn{"Turn it to the left by some 45 degrees (anticlockwise from above), and hold it there.", {0, 0, 1}}};

/// The turn that `angle_B` is in the main, in words.
std::string words(const Eigen::Vector3d& angle_B) {
  Eigen::Index axis = 0;
  if (angle_B.cwiseAbs().maxCoeff(&axis) < 0.4 * kTurned_rad) return "no turn";
  constexpr std::array<std::array<const char*, 2>, 3> kWords{
      {{"right side down", "left side down"}, {"nose down", "nose up"}, {"to the left", "to the right"}}};
  return kWords[static_cast<std::size_t>(axis)][angle_B[axis] > 0 ? 0 : 1];
}

Eigen::Vector3d rotation_vector(const Eigen::Quaterniond& from, const Eigen::Quaterniond& to) {
  Eigen::Quaterniond turn = from.conjugate() * to;
  if (turn.w() < 0) turn.coeffs() *= -1;
  const Eigen::AngleAxisd made(turn);
  return made.angle() * made.axis();
}

/// Quad X as Betaflight numbers it; which way round with yaw_motors_reversed = OFF.
struct Motor {
  const char* place;
  bool clockwise;
};
constexpr std::array kMotors{Motor{"rear right", true}, Motor{"front right", false}, Motor{"rear left", false},
                             Motor{"front left", true}};

class GroundCheck {
 public:
  GroundCheck(msp::Connection* connection, const Settings& settings, const Clock& clock, Person* person,
              flight::StateSource* states, const GroundCheckOptions& options)
      : connection_(*connection),
        settings_(settings),
        clock_(clock),
        person_(*person),
        states_(states),
        options_(options) {}

  Result<std::vector<std::string>> run() {
    if (Status status = expect_disarmed(); !status) return status.failure();
    if (Status status = look_up(); !status) return status.failure();
    if (!faults_.empty()) return faults_;
    for (const Turn& turn : kTurns)
      if (Status status = follow(turn); !status) return status.failure();
    Status turned;
    for (std::size_t i = 0; i < kMotors.size() && turned; ++i) turned = look_at(i);
    const Status stopped = spin(kMotors.size());
    if (!turned) return turned.failure();
    if (!stopped) return stopped.failure();
    return faults_;
  }

 private:
  struct Sample {
    Stamp now{0};
    Eigen::Vector3d gyro_B, acceleration_B;
    Eigen::Quaterniond q_firmware;
    std::optional<Eigen::Quaterniond> q_source;
  };

  template <typename Read>
  auto asked(std::uint16_t command, Read read) -> Result<typename decltype(read(msp::Payload()))::value_type> {
    auto answer = connection_.ask(command, kAskTimeout);
    if (!answer) return answer.failure();
    auto value = read(*answer);
    if (!value) return Error(connection_.name() + ": an answer makes no sense", ErrorCode::kInvalid, "link");
    return *value;
  }

  Result<Sample> sample() {
    const auto imu = asked(msp::command::kRawImu, msp::read_raw_imu);
    if (!imu) return imu.failure();
    const auto attitude = asked(msp::command::kAttitude, msp::read_attitude);
    if (!attitude) return attitude.failure();
    Sample made{clock_.now(), Eigen::Vector3d(imu->gyro_rad_s.data()), Eigen::Vector3d(imu->acceleration.data()),
                enu_flu(*attitude), std::nullopt};
    if (states_ != nullptr)
      if (const auto state = states_->newest(made.now)) made.q_source = Eigen::Quaterniond(state->state.q_WB);
    return made;
  }

  Error gave_up(const std::string& expected) const {
    return Error("nothing happened for " + text(seconds(options_.patience)) + " s, expected " + expected +
                     "; start the check again",
                 ErrorCode::kNoAnswer, "person");
  }

  Status expect_disarmed() {
    const auto status = asked(msp::command::kStatus, msp::read_status);
    if (!status) return status.failure();
    const auto place = std::find(settings_.boxes.begin(), settings_.boxes.end(), msp::kModeArm);
    const auto bit = static_cast<unsigned>(place - settings_.boxes.begin());
    if (bit < 32 && (status->modes >> bit & 1u) != 0)
      return Error::invalid("arming", "on", "off: disarm it, and take the propellers off");
    return {};
  }

  Status goes_on(Stamp since, const std::string& expected) {
    if (person_.leaves()) return Error("the check was left", ErrorCode::kNoAnswer, "person");
    return clock_.now() - since <= options_.patience ? Status() : Status(gave_up(expected));
  }

  static bool level(const Sample& sample) { return sample.acceleration_B.normalized().z() >= std::cos(kLevel_rad); }

  /// Until it has not turned for a while, and is level.
  Result<Sample> still(bool is_level) {
    const Stamp begin = clock_.now();
    flight::Held rests;
    for (;;) {
      auto now = sample();
      if (!now) return now.failure();
      rests.update(now->now, now->gyro_B.norm() <= kStill_rad_s && (level(*now) || !is_level));
      if (rests.for_at_least(now->now, kStillFor)) return now;
      if (Status status = goes_on(begin, "a vehicle that is held still"); !status) return status.failure();
    }
  }

  Status look_up() {
    person_.tell("Put it down, level, and let go.");
    const auto standing = still(false);
    if (!standing) return standing.failure();
    if (!level(*standing))
      faults_.push_back("put down level, its accelerometer says that up is " +
                        text(standing->acceleration_B.normalized().eval()) +
                        " in its own axes (x forward, y left, z up), expected 0, 0, 1: calibrate it, and set the "
                        "board's alignment (align_board_roll, align_board_pitch)");
    return {};
  }

  Status follow(const Turn& turn) {
    person_.tell("Hold it level and still.");
    const auto begin = still(true);
    if (!begin) return begin.failure();
    person_.tell(turn.request);
    const Stamp asked_at = clock_.now();
    Eigen::Vector3d by_gyro = Eigen::Vector3d::Zero();
    Sample last = *begin;
    std::optional<Stamp> turned_at;
    while (!turned_at || last.now - *turned_at < kFollows) {
      const auto now = sample();
      if (!now) return now.failure();
      if (Status status = goes_on(asked_at, "a turn of half a radian that the gyro notices"); !status) return status;
      by_gyro += seconds(now->now - last.now) * now->gyro_B;
      last = *now;
      if (!turned_at && by_gyro.norm() >= kTurned_rad) turned_at = last.now;
    }
    judge(turn, "gyro", by_gyro,
          "set the board's alignment (align_board_yaw and its like), or flash the firmware made for this board");
    judge(turn, "firmware's attitude", rotation_vector(begin->q_firmware, last.q_firmware),
          "calibrate the accelerometer, and look whether the firmware's version is one that is known here");
    if (begin->q_source && last.q_source)
      judge(turn, "source of states", rotation_vector(*begin->q_source, *last.q_source),
            "define its body again with x forward and z up, or set states.rpy_MB_rad");
    return {};
  }

  void judge(const Turn& turn, const std::string& who, const Eigen::Vector3d& said_B, const std::string& next_step) {
    if (words(said_B) == words(turn.axis_B)) return;
    faults_.push_back("turned " + words(turn.axis_B) + ", the " + who + " says " + words(said_B) + " (" + text(said_B) +
                      " rad about x forward, y left, z up): " + next_step);
  }

  /// This motor alone; kMotors.size(): none.
  Status spin(std::size_t motor) {
    msp::Motors pulses;
    pulses.fill(1000);
    if (motor < kMotors.size()) pulses[motor] = static_cast<std::uint16_t>(options_.spin_us);
    const auto answer = connection_.ask(msp::command::kSetMotor, msp::set_motor(pulses), kAskTimeout);
    return answer ? Status() : Status(answer.failure());
  }

  Status look_at(std::size_t motor) {
    const std::string number = text(motor + 1);
    if (Status status = spin(kMotors.size()); !status) return status;
    while (person_.answer()) {  // what was typed before is no answer to this
    }
    person_.tell(
        "Motor " + number +
        " turns now. Which one is it, and which way round from above? Type 1 (rear right), 2 (front right), 3 "
        "(rear left) or 4 (front left), with c (clockwise) or a (anticlockwise) behind it, as in 2a; 0: none.");
    const Stamp asked_at = clock_.now();
    std::optional<std::string> said;
    while (!said) {
      if (Status status = goes_on(asked_at, "an answer"); !status) return status;
      if (Status status = spin(motor); !status) return status;
      said = person_.answer();
    }
    const bool clockwise = kMotors[motor].clockwise != settings_.mixer.yaw_reversed;
    const std::string right = number + (clockwise ? "c" : "a");
    if (*said == right) return {};
    if (*said == "0") {
      faults_.push_back("motor " + number + " did not turn: check battery, wiring and motor protocol");
      return {};
    }
    const bool known =
        said->size() == 2 && (*said)[0] >= '1' && (*said)[0] <= '4' && ((*said)[1] == 'c' || (*said)[1] == 'a');
    if (!known) {
      person_.tell("'" + *said + "' is none of these.");
      return look_at(motor);
    }
    if ((*said)[0] != right[0]) {
      faults_.push_back("motor " + number + " is the one at the " +
                        kMotors[static_cast<std::size_t>((*said)[0] - '1')].place + ", expected the " +
                        kMotors[motor].place + ": put the motors in order (Motors tab, or resource MOTOR)");
    } else {
      faults_.push_back("motor " + number + " turns " + (clockwise ? "anticlockwise" : "clockwise") + ", expected " +
                        (clockwise ? "clockwise" : "anticlockwise") +
                        ": turn it round (Motors tab), or all of them by yaw_motors_reversed");
    }
    return {};
  }

  msp::Connection& connection_;
  const Settings& settings_;
  const Clock& clock_;
  Person& person_;
  flight::StateSource* const states_;
  const GroundCheckOptions options_;
  std::vector<std::string> faults_;
};

}  // namespace

Result<std::vector<std::string>> check_on_the_ground(msp::Connection* connection, const Settings& settings,
                                                     const Clock& clock, Person* person, flight::StateSource* states,
                                                     const GroundCheckOptions& options) {
  return GroundCheck(connection, settings, clock, person, states, options).run();
}

}  // namespace gatefield::bridge::betaflight
