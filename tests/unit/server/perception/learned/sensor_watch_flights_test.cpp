// What SensorWatch says of the shipped model's sight along laps of shipped courses, as a camera with noise shows them.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <optional>
#include <string>

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
  static const auto encoders = EncoderPool::create(bundle, 1).value().release();
  return std::make_unique<LearnedSensor>(&bundle, decoder, encoders);
}

class Flight {
 public:
  Flight(config::Scenario scenario, const Mistake& mistake)
      : scenario_(std::move(scenario)),
        mistake_(mistake),
        camera_(scenario_.vehicle.camera),
        world_(config::perturbed_world(scenario_.track, scenario_.perturbation, scenario_.seed)),
        random_(scenario_.seed, 77),
        sight_(camera_, scenario_.track.course, sensor(), SightOptions{}) {
    if (scenario_.stereo)
      stereo_.emplace(world_, *scenario_.stereo, scenario_.seed);
    else
      renderer_.emplace(world_);
  }
  scene::World& world() { return world_; }

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
  /// @return what is told at the end; *told_at: when it was told first
  Problems start(Stamp time, Stamp* told_at = nullptr) {
    const Eigen::Vector3d from = scenario_.track.start_p_WB, to = scenario_.track.course.waypoints[0].p_W;
    const Stamp begin = now_;
    if (told_at) *told_at = Stamp{-1};
    while (now_ - begin < time) {
      const double t_s = seconds(now_ - begin), way_m = 0.5 * 4.0 * t_s * t_s;
      look(from + way_m * (to - from).normalized(), to, std::min(0.3, 0.6 * t_s), 0.0, 0);
      if (told_at && *told_at < Stamp{0} && sight_.problems() != 0) *told_at = now_ - begin;
    }
    return sight_.problems();
  }
  /// A lap through the true gates. @return all that was told
  Problems lap(double speed_m_s) {
    const std::vector<scene::Gate> gates = config::gates_by_waypoint(world_, scenario_.track.course);
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
  scene::World world_;
  std::optional<scene::DepthCamera> renderer_;  // one of the two
  std::optional<scene::StereoCamera> stereo_;
  Random random_;
  Sight sight_;
  Stamp now_{1s};
};

config::Scenario scenario(const std::string& name, std::uint64_t seed, bool stereo = false) {
  config::Scenario made = config::load_scenario(config::find_config("scenarios", name).value()).value();
  made.seed = seed;
  if (stereo) made.stereo.emplace();
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

TEST(Table, OfMistakes) {
  for (const char* name : {"circle", "circle-0.55m", "circle-1.0m", "figure-eight", "split-s", "heights", "mixed-0.3m"})
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
      std::printf("%-14s %d", name, static_cast<int>(seed));
      for (const double factor : {1.0, 0.1, 0.2, 0.25, 0.5, 2.0, 4.0, 5.0, 10.0, 1000.0}) {
        Stamp at;
        Flight flight(scenario(name, seed), unit(factor));
        const Problems told = flight.start(1200ms, &at);
        std::printf("  x%g:%s%s%.2f", factor, flight.seen(0) ? "S" : "-",
                    told == kUnit       ? "u"
                    : told == kMounting ? "m"
                    : told              ? "b"
                                        : "-",
                    seconds(at));
      }
      for (const double degrees : {180.0, 90.0, -90.0}) {
        Stamp at;
        Flight flight(scenario(name, seed), turn(degrees));
        const Problems told = flight.start(1200ms, &at);
        std::printf("  t%g:%s%s%.2f", degrees, flight.seen(0) ? "S" : "-",
                    told == kUnit       ? "u"
                    : told == kMounting ? "m"
                    : told              ? "b"
                                        : "-",
                    seconds(at));
      }
      std::printf("\n");
    }
}

TEST(Table, OfLaps) {
  for (const char* name : {"circle-1.0m", "circle-yaw60", "circle-hard", "figure-eight", "split-s", "heights",
                           "mixed-0.3m", "there-and-back"})
    for (const bool stereo : {false, true})
      for (std::uint64_t seed = 1; seed <= (stereo ? 1 : 6); ++seed) {
        Flight flight(scenario(name, seed, stereo), {});
        const Problems told = flight.lap(5.0);
        std::printf("%-14s %d %d %s\n", name, stereo, static_cast<int>(seed),
                    told == kUnit       ? "UNIT"
                    : told == kMounting ? "MOUNT"
                    : told              ? "BOTH"
                                        : "-");
      }
}

}  // namespace
}  // namespace gatefield::perception
