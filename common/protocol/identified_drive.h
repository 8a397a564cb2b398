#pragma once

#include <Eigen/Core>
#include <string>

#include "common/vehicle/actuation.h"

namespace gatefield::protocol {

/// How a vehicle of collective thrust and body rates follows what it is asked for, as the server has found in its
/// flight. 0 = not known: too little was flown yet, or the vehicle is one of rotor thrusts.
struct IdentifiedDrive {
  double thrust_factor = 0.0;  ///< collective thrust given, over the thrust asked for
  /// The first-order lag of each body rate behind its command that explains the flight best. A loop that overshoots a
  /// little comes out at about 0.8 of the time in which 63 % of its step are there.
  Eigen::Matrix<double, 3, 1, Eigen::DontAlign> rate_time_constant_s = Eigen::Vector3d::Zero();
  /// Where each body rate stays while it is asked for more; 0 = not known, or none was met.
  Eigen::Matrix<double, 3, 1, Eigen::DontAlign> rate_limit_rad_s = Eigen::Vector3d::Zero();
};

/// For people: "thrust 1.08 of what is asked for; rates 31, 30, ? ms behind (told: 40, 40, 80 ms), at most ?, 2.9, ?
/// rad/s"; empty: nothing is known.
std::string in_words(const IdentifiedDrive& found, const Actuation& told);

}  // namespace gatefield::protocol
