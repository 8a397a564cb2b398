#include "tests/support/hil_firmware.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "client/firmware/mavlink/constants.h"
#include "client/flight/frames.h"

namespace gatefield::test {

void HilFirmware::serve(Stamp now) {
  if (!greeted_) greeted_ = link_->send(mavlink::pack(mavlink::Heartbeat{}, {1, 1}, sequence_++).bytes()).bytes > 0;
  std::array<std::uint8_t, firmware::Link::kMaxMessage> buffer{};
  while (const auto bytes = link_->receive(buffer).bytes)
    reader_.read(std::span(buffer).first(bytes), false, [&](const mavlink::Frame& frame) {
      const auto message = mavlink::unpack(frame);
      if (!message) return;
      if (const auto* sensor = std::get_if<mavlink::HilSensor>(&*message)) take(now, *sensor);
      if (const auto* truth = std::get_if<mavlink::HilStateQuaternion>(&*message)) take(*truth);
    });
}

void HilFirmware::take(Stamp now, const mavlink::HilSensor& sensor) {
  ++samples_;
  if (hangs) return;
  const bool own = clock_ == Clock::kOwn;
  const double passed_s = own ? seconds(now - last_) : static_cast<double>(sensor.time_usec - last_us_) * 1e-6;
  const double dt_s = last_us_ == 0 ? 0.004 : own ? std::clamp(passed_s, 1e-3, 0.02) : passed_s;
  last_us_ = sensor.time_usec;
  last_ = now;
  const Eigen::Vector3d gyro_F(static_cast<double>(sensor.xgyro), static_cast<double>(sensor.ygyro),
                               static_cast<double>(sensor.zgyro));
  const auto outputs = controller_.loop().step(now, flight::flu_from_frd(gyro_F), dt_s);
  controller_.specific_force_z = -static_cast<double>(sensor.zacc);
  if (own && (!controller_.armed() || now - answered_ < kOutputs)) return;
  answered_ = now;
  mavlink::HilActuatorControls controls;
  controls.time_usec =
      own ? static_cast<std::uint64_t>((now + controller_.boot) / std::chrono::microseconds(1)) : sensor.time_usec;
  controls.flags = flags;
  controls.mode = controller_.armed() ? mavlink::kModeArmed : 0;
  constexpr std::array<std::size_t, 4> kOutputOfMotor{1, 2, 3, 0};  // front right, rear left, front left, rear right
  for (std::size_t i = 0; i < 4; ++i) {
    const double output = outputs[kOutputOfMotor[i]];
    controls.controls[i] = static_cast<float>(thrust_linear ? std::sqrt(output) : output);
  }
  link_->send(mavlink::pack(controls, {1, 1}, sequence_++).bytes());
}

void HilFirmware::take(const mavlink::HilStateQuaternion& truth) {
  ++truths_;
  constexpr double kMetres = 6371000.0 * std::numbers::pi / 180.0;
  const Eigen::Vector3d p_N(
      (truth.lat * 1e-7 - site_.latitude_deg) * kMetres,
      (truth.lon * 1e-7 - site_.longitude_deg) * kMetres * std::cos(site_.latitude_deg * std::numbers::pi / 180.0),
      site_.altitude_m - truth.alt * 1e-3);
  std::array<double, 4> q{};
  for (std::size_t i = 0; i < 4; ++i) q[i] = static_cast<double>(truth.attitude_quaternion[i]);
  QuadrotorState& state = controller_.state;
  state.p_WB = flight::enu_from_ned(p_N);
  state.v_WB = flight::enu_from_ned(Eigen::Vector3d(truth.vx, truth.vy, truth.vz) * 0.01);
  state.q_WB = flight::enu_flu_from_ned_frd(flight::from_wxyz(q).normalized());
  state.w_WB_B =
      flight::flu_from_frd(Eigen::Vector3d(static_cast<double>(truth.rollspeed), static_cast<double>(truth.pitchspeed),
                                           static_cast<double>(truth.yawspeed)));
  controller_.on_ground = state.p_WB.z() < 0.02;
}

}  // namespace gatefield::test
