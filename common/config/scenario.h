#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "common/base/clock.h"
#include "common/base/result.h"
#include "common/config/course.h"
#include "common/config/hard_world.h"
#include "common/config/vehicle.h"
#include "common/scene/sensor_noise.h"
#include "common/scene/stereo_camera.h"

namespace gatefield::config {

/// How far true gates stand from the nominal ones. Magnitudes; see perturbed_world() for how they are drawn.
struct Perturbation {
  double position_m = 0.0;
  double height_m = 0.0;
  double yaw_rad = 0.0;
  double tilt_rad = 0.0;
  bool exact = false;  ///< each is exactly that large, not up to it
};

/// By what the referee judges contact, see scenario.proto.
enum class HullKind { kDiscs, kSphere };

/// The kinds as command lines and tables name them: "discs", "sphere".
const std::map<std::string, HullKind>& hull_names();
const char* name(HullKind kind) noexcept;

/// One sigma per axis of the error of the state that the vehicle sends.
struct StateNoise {
  double position_m = 0.0;
  double velocity_m_s = 0.0;
  double attitude_rad = 0.0;
  double rate_rad_s = 0.0;
};

/// The true vehicle against the one the planner believes in.
struct Mismatch {
  double mass_factor = 1.0;
  double drag_factor = 1.0;
  double rotor_lag_factor = 1.0;
  Eigen::Vector3d wind_W_m_s = Eigen::Vector3d::Zero();
  double thrust_factor = 1.0;                  ///< what a rotor gives of what it is asked for, its limits too
  double rate_lag_factor = 1.0;                ///< body rates: the rate loop's time constants against those told
  std::chrono::nanoseconds setpoint_delay{0};  ///< body rates: from setpoint to rate loop
  /// Body rates: where the rate loop clamps what it is asked for, about x, y, z of B; 0: nowhere.
  Eigen::Vector3d rate_limit_rad_s = Eigen::Vector3d::Zero();
};

struct Scenario {
  std::string title;
  std::filesystem::path course_file;
  std::filesystem::path vehicle_file;
  Track track;
  Vehicle vehicle;  ///< what the planner is told
  Perturbation perturbation;
  HullKind hull = HullKind::kDiscs;
  scene::SensorNoise sensor_noise;
  std::optional<scene::StereoOptions> stereo;  ///< set: this sensor, and no sensor_noise
  StateNoise state_noise;
  Mismatch mismatch;
  HardWorld hard;
  std::uint64_t seed = 1;                     ///< of the true world: gates, noise, link
  std::optional<std::uint64_t> planner_seed;  ///< of the planner's sampling, when the file or a person says it
  std::chrono::nanoseconds time_limit = std::chrono::seconds(120);
};

/// The planner's seed where nobody says one. The one place that decides it. The two stay two numbers whose default is
/// the same; what keeps their draws apart is that every random stream has a key of its own name (common/base/random.h).
constexpr std::uint64_t default_planner_seed(std::uint64_t world_seed) noexcept { return world_seed; }

/// The seed that the planner is told: its own, or the one that goes with the world's.
inline std::uint64_t planner_seed_of(const Scenario& scenario) noexcept {
  return scenario.planner_seed.value_or(default_planner_seed(scenario.seed));
}

/// Reads a scenario file (schema: scenario.proto) with the course and vehicle it names, and checks all three.
/// The sentence names file, field, value and what was expected.
/// Thread-safe: yes.   Real-time safe: no.
Result<Scenario> load_scenario(const std::filesystem::path& file);

class ScenarioFile;  // of scenario.proto

/// The same from a message; `file` is what its names are relative to, and how the sentences begin.
Result<Scenario> make_scenario(const ScenarioFile& spec, const std::filesystem::path& file);

/// A scenario without a file: no perturbation, standard sensor noise, no mismatch.
Result<Scenario> make_scenario(const std::filesystem::path& course_file, const std::filesystem::path& vehicle_file);

/// Errors of these three: kInvalid with the field as scenario.proto has it ("perturbation.yaw_deg").
/// Ranges: position 0 to 5 m, height 0 to 5 m (exact: to position), yaw 0 to 180 deg, tilt 0 to 60 deg.
Status validate(const Perturbation& perturbation);
/// Ranges: position 0 to 1 m, velocity 0 to 5 m/s, attitude 0 to 45 deg, rate 0 to 5 rad/s.
Status validate(const StateNoise& noise);
/// Factors 0.2 to 5 (thrust 0.5 to 2, rate loop 0.2 to 5), wind up to 30 m/s, delay of setpoints up to 200 ms,
/// limit of rates 0 (none) or 0.2 to 100 rad/s.
Status validate(const Mismatch& mismatch);
/// A rate loop's lag, delay and limit are of a vehicle that has one.
Status validate(const Mismatch& mismatch, const Actuation& actuation);

/// The true world. Per gate that stands there (one that is passed several times is drawn once), in the order of first
/// passage, from the stream "gatefield.perturbation", each draw made whether or not its magnitude is zero, so
/// that one magnitude does not change what another one gives:
///   - displaced by exactly position_m in a horizontal direction uniform over the circle,
///   - moved up or down, uniform in [-height_m, height_m] (kept above the floor),
///   - turned about the vertical by yaw_rad times a uniform factor in [0.5, 1], to a random side,
///   - leant about a random horizontal axis by tilt_rad times a uniform factor in [0.5, 1].
/// Exact, the same ways and sides, but each in full: yaw_rad and tilt_rad without a factor, and a displacement of
/// position_m in all, of which the part up or down is taken as above (and counts from the floor's limit where that is
/// nearer) and the rest is horizontal. With height_m = position_m the direction is uniform over the sphere.
/// The paper speaks of "position perturbation of about 0.3 m" and of "yaw noise" without saying how they were drawn; a
/// fixed displacement makes the figure mean what it says: every gate is that far off.
scene::World perturbed_world(const Track& track, const Perturbation& perturbation, std::uint64_t seed);

/// The scenario's own: perturbed_world(), with furniture where it has some.
scene::World true_world(const Scenario& scenario);

/// The vehicle as it truly is: mass (and inertia with it), drag, rotor lag and thrust scaled.
QuadrotorModel true_quadrotor(const QuadrotorModel& believed, const Mismatch& mismatch);

}  // namespace gatefield::config
