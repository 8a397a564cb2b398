#pragma once

#include "common/config/hard_world.h"

namespace gatefield::simulator {

/// Share of its thrust that a rotor has left at the battery's voltage, for the same throttle.
///
/// A rotor's speed goes as the voltage, its thrust as the square:  factor = (x / x_told)^2, where x is the voltage
/// under load in units of the cell's at half charge, and x_told that of a hover at half charge, where the vehicle's
/// thrust was told.
///   x = (u + sqrt(u^2 - 4 s P)) / 2,   u = u(charge) at rest,   P = power over that of a hover
/// solves x = u - s P / x: a resistance at which a hover costs the share s of the voltage. The power is that of
/// momentum theory, P = sum T^1.5 over hover's (Leishman, "Principles of Helicopter Aerodynamics", 2006, ch. 2). The
/// charge falls by P / hover_s a second. u(charge) is the resting voltage of a LiPo cell over 3.83 V, straight between
///   charge  0     0.1   0.3   0.5   0.7   0.9   1
///   volts   3.30  3.65  3.76  3.83  3.95  4.10  4.20   (chosen: tables of charger makers differ by 0.03 V).
/// Thread-safe: no.   Real-time safe: yes.
class Battery {
 public:
  /// @param charge  at the start, 0 to 1
  Battery(const config::AirErrors& air, double charge) noexcept
      : sag_(air.sag), hover_s_(air.hover_s), charge_(charge) {}

  /// Thrust factor under this power (over hover's).
  double factor(double power) const noexcept;
  void spend(double power, double dt_s) noexcept;
  double charge() const noexcept { return charge_; }

 private:
  double voltage(double charge, double power) const noexcept;

  double sag_, hover_s_, charge_;
};

}  // namespace gatefield::simulator
