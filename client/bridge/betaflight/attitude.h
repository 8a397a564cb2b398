#pragma once

#include <Eigen/Geometry>

#include "client/firmware/msp/messages.h"
#include "client/flight/frames.h"

namespace gatefield::bridge::betaflight {

/// The firmware's attitude in our axes: body FLU to world ENU, whose heading may count from anywhere.
inline Eigen::Quaterniond enu_flu(const firmware::msp::Attitude& attitude) noexcept {
  const Eigen::Quaterniond q_NF = Eigen::AngleAxisd(attitude.yaw_rad, Eigen::Vector3d::UnitZ()) *
                                  Eigen::AngleAxisd(attitude.pitch_rad, Eigen::Vector3d::UnitY()) *
                                  Eigen::AngleAxisd(attitude.roll_rad, Eigen::Vector3d::UnitX());
  return flight::enu_flu_from_ned_frd(q_NF);
}

}  // namespace gatefield::bridge::betaflight
