// What SensorWatch says of the shipped model's sight along laps of shipped courses, as a camera with noise shows them.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/base/random.h"
#include "common/config/locate.h"
#include "common/config/scenario.h"
#include "common/scene/depth_camera.h"
#include "common/scene/sensor_noise.h"
#include "common/scene/stereo_camera.h"
#include "server/kernels/backend.h"
#include "server/perception/learned/learned_sensor.h"
#include "server/perception/sight.h"

namespace gatefield::perception {
namespace {

using namespace std::chrono_literals;
using protocol::bit;
using protocol::Problem;
using protocol::Problems;

constexpr Problems kUnit = bit(Problem::kDepthUnitLooksWrong);
constexpr Problems kMounting = bit(Problem::kMountingLooksWrong);
constexpr auto kFrame = 33ms;

/// What differs between what the session told and what is so.
struct Mistake {
  double depth_factor = 1.0;                           ///< what is sent, over the true depth
  Eigen::Matrix3d R_CC = Eigen::Matrix3d::Identity();  ///< of the true camera against the told one
  protocol::DepthEncoding encoding = protocol::DepthEncoding::kMetres32;
};

std::unique_ptr<GateSensor> sensor() {
  static const model::Bundle bundle = model::Bundle::read(GATEFIELD_SOURCE_DIR "/deploy/models/race").value();
  static const auto decoder = kernels::best_backend().prepare(bundle.decoder());
  static const auto encoders = EncoderPool::create(bundle, 1);
  return std::make_unique<LearnedSensor>(&bundle, decoder, encoders.value().get());
}

class Flight {
 public:
  Flight(const config::Scenario& scenario, const Mistake& mistake)
      : Flight(scenario, mistake, config::perturbed_world(scenario.track, scenario.perturbation, scenario.seed)) {}
  Flight(config::Scenario scenario, const Mistake& mistake, const scene::World& world)
      : scenario_(std::move(scenario)),
        mistake_(mistake),
        camera_(scenario_.vehicle.camera),
        random_(scenario_.seed, 77),
        sight_(camera_, scenario_.track.course, sensor(), SightOptions{}) {
    if (scenario_.stereo)
      stereo_.emplace(world, *scenario_.stereo, scenario_.seed);
    else
      renderer_.emplace(world);
  }

  /// A frame of a vehicle at p_W that flies nose down by `pitch` towards `ahead_W`.
  void look(const Eigen::Vector3d& p_W, const Eigen::Vector3d& ahead_W, double pitch_rad, double roll_rad,
            std::uint32_t target) {
    const Eigen::Vector3d way = ahead_W - p_W;
    Eigen::Isometry3d X_WB = Eigen::Isometry3d::Identity();
    X_WB.translation() = p_W;
    X_WB.linear() =
        (Eigen::AngleAxisd(std::atan2(way.y(), way.x()), Eigen::Vector3d::UnitZ()) *
         Eigen::AngleAxisd(pitch_rad, Eigen::Vector3d::UnitY()) * Eigen::AngleAxisd(roll_rad, Eigen::Vector3d::UnitX()))
            .toRotationMatrix();
    Eigen::Isometry3d X_WC = X_WB * camera_.X_BC;
    X_WC.linear() = X_WC.linear() * mistake_.R_CC;
    scene::DepthImage image;
    if (stereo_) {
      stereo_->render(camera_, X_WC, &random_, &image);
    } else {
      scene::DepthImage clean;
      scene::SurfaceImage surface;
      renderer_->render(camera_, X_WC, &clean, &surface);
      scene::apply_noise(scenario_.sensor_noise, camera_, clean, surface, &random_, &image);
    }
    std::vector<std::uint8_t> bytes;
    for (const float true_m : image.depth_m) {
      const double z = mistake_.depth_factor * static_cast<double>(true_m);
      const auto put = [&](const auto& value) {
        const auto* const raw = reinterpret_cast<const std::uint8_t*>(&value);
        bytes.insert(bytes.end(), raw, raw + sizeof value);
      };
      if (mistake_.encoding == protocol::DepthEncoding::kMetres32)
        put(static_cast<float>(z));
      else
        put(static_cast<std::uint16_t>(std::clamp(std::lround(z / camera_.metres_per_count), 0L, 65535L)));
    }
    now_ += kFrame;
    const auto waypoints = static_cast<std::uint32_t>(scenario_.track.course.waypoints.size());
    sight_.look(bytes, mistake_.encoding, now_, X_WB, target, (target + 1) % waypoints);
  }

  /// From the start towards the first gate, from a standing start, for so long.
  /// @return what is told at the end
  Problems start(Stamp time) {
    const Eigen::Vector3d from = scenario_.track.start_p_WB, to = scenario_.track.course.waypoints[0].p_W;
    const Stamp begin = now_;
    while (now_ - begin < time) {
      const double t_s = seconds(now_ - begin), way_m = 0.5 * 4.0 * t_s * t_s;
      look(from + way_m * (to - from).normalized(), to, std::min(0.3, 0.6 * t_s), 0.0, 0);
    }
    return sight_.problems();
  }
  /// A lap through the places of the scenario's gates. @return all that was told
  Problems lap(double speed_m_s) {
    const std::vector<scene::Gate> gates = config::gates_by_waypoint(
        config::perturbed_world(scenario_.track, scenario_.perturbation, scenario_.seed), scenario_.track.course);
    Problems told = 0;
    Eigen::Vector3d p_W = scenario_.track.start_p_WB;
    for (std::uint32_t target = 0; target < gates.size(); ++target) {
      const Eigen::Vector3d to = gates[target].X_WG.translation();
      const Eigen::Vector3d from = p_W;
      const int frames = static_cast<int>((to - from).norm() / (speed_m_s * seconds(kFrame)));
      for (int i = 0; i < frames; ++i) {
        p_W = from + (to - from) * i / frames;
        look(p_W, to, 0.35 * random_.uniform(0.0, 1.0), random_.uniform(-0.3, 0.3), target);
        told |= sight_.problems();
      }
      p_W = to;
    }
    return told;
  }
  bool seen(std::uint32_t waypoint) const { return sight_.records().seen(waypoint); }

 private:
  config::Scenario scenario_;
  Mistake mistake_;
  CameraModel camera_;
  std::optional<scene::DepthCamera> renderer_;  // one of the two
  std::optional<scene::StereoCamera> stereo_;
  Random random_;
  Sight sight_;
  Stamp now_{1s};
};

config::Scenario scenario(const std::string& name, std::uint64_t seed) {
  config::Scenario made = config::load_scenario(config::find_config("scenarios", name).value()).value();
  made.seed = seed;
  return made;
}

Mistake unit(double factor) {
  Mistake mistake;
  mistake.depth_factor = factor;
  return mistake;
}
Mistake turn(double degrees) {
  Mistake mistake;
  mistake.R_CC = Eigen::AngleAxisd(degrees * std::numbers::pi / 180.0, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return mistake;
}

TEST(WatchedFlight, AnotherUnitOfDepthIsToldSoonAfterTheStart) {
  for (const double factor : {0.001, 0.25, 2.0, 4.0, 5.0, 1000.0}) {
    Flight flight(scenario("circle-0.55m", 3), unit(factor));
    EXPECT_EQ(flight.start(1200ms), kUnit) << factor;
    EXPECT_FALSE(flight.seen(0)) << factor;
  }
}

TEST(WatchedFlight, CountsOfAnotherSizeThanToldAreFound) {
  Mistake mistake = unit(4.0);  // counts of a quarter of a millimetre, of which nobody spoke
  mistake.encoding = protocol::DepthEncoding::kCounts16;
  EXPECT_EQ(Flight(scenario("figure-eight", 2), mistake).start(1200ms), kUnit);
}

TEST(WatchedFlight, ACameraThatIsTurnedAboutItsAxisIsToldWithinASecondThoughTheGateIsSeen) {
  for (const double degrees : {180.0, 90.0, -90.0})
    for (const char* name : {"circle-0.55m", "split-s"})
      EXPECT_EQ(Flight(scenario(name, 2), turn(degrees)).start(990ms), kMounting) << degrees << " on " << name;
}

TEST(WatchedFlight, NothingIsWrongOnALapThatGoesRight) {
  for (const char* name : {"circle-1.0m", "circle-yaw60", "there-and-back"})
    EXPECT_EQ(Flight(scenario(name, 1), {}).lap(5.0), 0u) << name;
}

TEST(WatchedFlight, NothingIsWrongWithAnotherSensor) {
  config::Scenario stereo = scenario("circle-0.3m", 1);
  stereo.stereo.emplace();
  Flight flight(stereo, {});
  EXPECT_EQ(flight.start(1200ms), 0u);
  EXPECT_TRUE(flight.seen(0));
}

TEST(WatchedFlight, NoGateOrOneOfAnotherSizeIsNoMistakeOfUnitOrMounting) {
  const config::Scenario circle = scenario("circle", 1);
  scene::World world = config::nominal_world(circle.track);
  for (const double scale : {0.5, 2.0, 2.7}) {
    for (scene::Gate& gate : world.gates) gate.shape = {gate.shape.opening, 0.5 * scale, 0.75 * scale, 0.06};
    EXPECT_EQ(Flight(circle, {}, world).lap(5.0), 0u) << scale;
  }
  world.gates.clear();
  EXPECT_EQ(Flight(circle, {}, world).lap(5.0), 0u);
}

}  // namespace
}  // namespace gatefield::perception
