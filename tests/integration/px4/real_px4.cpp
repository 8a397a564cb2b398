#include "tests/integration/px4/real_px4.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>

#include "common/base/text.h"
#include "common/base/whole_file.h"

namespace gatefield::test {
namespace {

using namespace std::chrono_literals;

std::string variable(const char* name) {
  const char* const value = std::getenv(name);  // NOLINT(concurrency-mt-unsafe): one thread
  return value == nullptr ? "" : value;
}

}  // namespace

std::vector<std::string> px4_settings(const QuadrotorModel& model) {
  std::vector<std::string> lines{"COM_RC_IN_MODE 4",  // no sticks
                                 "COM_RCL_EXCEPT 4",  // and none missed while setpoints come
                                 "NAV_DLL_ACT 0",    "COM_OF_LOSS_T 1.0", "COM_DISARM_PRFLT -1", "COM_SPOOLUP_TIME 0.1",
                                 "FD_FAIL_P 0",      "FD_FAIL_R 0",       "SDLOG_MODE -1",       "UXRCE_DDS_SYNCT 0",
                                 "MC_AIRMODE 1",     "THR_MDL_FAC 1.0",   "IMU_GYRO_CUTOFF 100", "IMU_DGYRO_CUTOFF 60",
                                 "CA_AIRFRAME 0",    "CA_ROTOR_COUNT 4"};
  // Its motors 1 to 4: front right, rear left, front left, rear right. FRD, and KM is positive of what turns the body
  // to the right.
  constexpr std::array<std::array<int, 2>, 4> kCorners{{{1, -1}, {-1, 1}, {1, 1}, {-1, -1}}};
  for (std::size_t motor = 0; motor < kCorners.size(); ++motor)
    for (std::size_t rotor = 0; rotor < kRotors; ++rotor) {
      const auto& arm = model.rotor_position_B_m[rotor];
      if ((arm.x() > 0) != (kCorners[motor][0] > 0) || (arm.y() > 0) != (kCorners[motor][1] > 0)) continue;
      const std::string name = "CA_ROTOR" + text(motor) + "_";
      lines.push_back(name + "PX " + text(arm.x()));
      lines.push_back(name + "PY " + text(-arm.y()));
      lines.push_back(name + "KM " + text(-model.rotor_spin[rotor] * model.torque_per_thrust_m));
    }
  // Angular acceleration of a whole torque setpoint: its mixer gives each motor 0.71 of it about x and y, all about z.
  const double arm_m = std::abs(model.rotor_position_B_m[0].x());
  const double level = 4 * 0.7071 * model.thrust_max_n * arm_m / model.inertia_kg_m2.x();
  const double yaw = 4 * model.thrust_max_n * model.torque_per_thrust_m / model.inertia_kg_m2.z();
  constexpr double kP_s = 36.0, kI_s2 = 36.0, kD = 0.5, kYawP_s = 13.0, kYawI_s2 = 7.0;
  for (const char* axis : {"ROLL", "PITCH"}) {
    const std::string name = "MC_" + std::string(axis) + "RATE_";
    lines.push_back(name + "P " + text(kP_s / level));
    lines.push_back(name + "I " + text(kI_s2 / level));
    lines.push_back(name + "D " + text(kD / level));
  }
  lines.push_back("MC_YAWRATE_P " + text(kYawP_s / yaw));
  lines.push_back("MC_YAWRATE_I " + text(kYawI_s2 / yaw));
  return lines;
}

std::string RealPx4::program() { return variable("GATEFIELD_PX4_SITL"); }

RealPx4::RealPx4(const std::filesystem::path& folder, const std::vector<std::string>& settings) {
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  // Up to 1.15 PX4 looks for a file of this name on the PATH, for what a person adds to its airframe; from 1.16 on it
  // takes the same from its environment.
  ChildOptions options;
  std::string script = "#!/bin/sh\n";
  for (const std::string& line : settings) {
    script += "param set " + line + "\n";
    const std::size_t space = line.find(' ');
    options.environment.emplace_back("PX4_PARAM_" + line.substr(0, space), line.substr(space + 1));
  }
  if (const Status written = write_file(folder / "px4-rc.params", script); !written) {
    std::fprintf(stderr, "%s\n", written.error().c_str());
    std::abort();
  }
  const std::filesystem::path built = std::filesystem::path(program()).parent_path().parent_path();
  options.arguments = {program(), "-d", (built / "etc").string()};
  options.folder = folder;
  options.environment.emplace_back("PX4_SIM_MODEL", "none_iris");
  options.environment.emplace_back("PATH", folder.string() + ":" + (built / "bin").string() + ":" + variable("PATH"));
  options.log = folder / "px4.log";
  auto started = ChildProcess::start(options);
  if (!started) {
    std::fprintf(stderr, "%s\n", started.error().c_str());
    std::abort();
  }
  process_ = std::move(started).value();
}

void RealPx4::stop() { process_->signal(SIGSTOP); }
void RealPx4::kill() { process_->signal(SIGKILL); }

}  // namespace gatefield::test
