#include "server/training/evaluation/approach.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/base/statistics.h"
#include "server/perception/learned/learned_sensor.h"
#include "server/perception/sight.h"
#include "server/training/data/scene_parts.h"
#include "server/training/evaluation/parallel.h"
#include "server/training/evaluation/shot.h"
#include "server/training/evaluation/wrong_gate.h"

namespace gatefield::training {
namespace {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kClearance_m = 0.2;
constexpr double kMinValidPart = 0.75;
constexpr int kAttempts = 2000;

/// A slow swing about zero.
struct Swing {
  double size, rate_rad_s, phase_rad;
  double at(double t_s) const { return size * std::sin(rate_rad_s * t_s + phase_rad); }
};

Swing draw_swing(double largest, Random* random) {
  return {random->uniform(0.0, largest), random->uniform(2.0, 7.0), random->uniform(0.0, 2.0 * std::numbers::pi)};
}

/// A point before the gate, `bearing` off its axis (about the vertical), on the side that x_W points to.
Vector3d before(const Vector3d& gate_W, const Vector3d& x_W, double away_m, double bearing_rad, double up_m) {
  const double level_m = std::sqrt(std::max(0.0, away_m * away_m - up_m * up_m));
  return gate_W + AngleAxisd(bearing_rad, Vector3d::UnitZ()) * x_W * level_m + Vector3d(0, 0, up_m);
}

/// Positions along a quadratic curve with a constant speed, from from_m to to_m before the gate.
std::vector<Vector3d> draw_positions(const ApproachOptions& options, const Vector3d& gate_W, const Vector3d& x_W,
                                     double step_m, Random* random) {
  const double bearing_rad = random->uniform(-60.0, 60.0) * kDegree;
  const Vector3d begin = before(gate_W, x_W, options.from_m, bearing_rad, random->uniform(-1.2, 1.2));
  const Vector3d end =
      before(gate_W, x_W, options.to_m, random->uniform(-15.0, 15.0) * kDegree, random->uniform(-0.2, 0.2));
  const Vector3d bend = before(gate_W, x_W, 0.5 * (options.from_m + options.to_m),
                               0.5 * bearing_rad + random->uniform(-10.0, 10.0) * kDegree, random->uniform(-0.5, 0.5));
  const auto at = [&](double t) -> Vector3d {
    return (1 - t) * (1 - t) * begin + 2 * t * (1 - t) * bend + t * t * end;
  };
  std::vector<Vector3d> out{begin};
  constexpr int kPieces = 2000;
  double passed_m = 0.0;
  for (int i = 1; i <= kPieces; ++i) {
    passed_m += (at(static_cast<double>(i) / kPieces) - at(static_cast<double>(i - 1) / kPieces)).norm();
    if (passed_m >= step_m) {
      out.push_back(at(static_cast<double>(i) / kPieces));
      passed_m -= step_m;
    }
  }
  return out;
}

/// A flight for this world, or nothing when there is no free way or the gate hides.
bool draw_flight(const ApproachOptions& options, Random* random, Approach* out) {
  const scene::World& world = out->scenario.world;
  if (out->scenario.gates == 0) return false;
  const Isometry3d& X_WG = world.gates[0].X_WG;
  Vector3d x_W = X_WG.linear().col(0) * (random->chance(0.5) ? 1.0 : -1.0);
  x_W.z() = 0.0;
  if (x_W.norm() < 0.5) return false;
  x_W.normalize();
  const double speed_m_s = random->uniform(5.0, 9.0);
  const double rate_hz = random->uniform(30.0, 60.0);
  const auto positions = draw_positions(options, X_WG.translation(), x_W, speed_m_s / rate_hz, random);
  const std::vector<scene::Box> solid = scene::solid_boxes(world);
  for (const Vector3d& p_W : positions) {
    if (world.has_floor && p_W.z() < world.floor_z_m + kClearance_m) return false;
    for (const scene::Box& box : solid)
      if (distance_m(box, p_W) < kClearance_m) return false;
  }

  const CameraModel& camera = dataset_camera();
  // The mounting's turn about the body's y axis: with it, a body that is nose down by as much has a level camera.
  const double mount_rad = std::asin(std::clamp(camera.X_BC.linear()(2, 2), -1.0, 1.0));
  const Swing yaw_off = draw_swing(15.0 * kDegree, random);
  const Swing pitch_off = draw_swing(8.0 * kDegree, random);
  const Swing roll = draw_swing(40.0 * kDegree, random);
  out->X_WC.clear();
  out->stamps.clear();
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const double t_s = static_cast<double>(i) / rate_hz;
    const Vector3d way = X_WG.translation() - positions[i];
    const double yaw = std::atan2(way.y(), way.x()) + yaw_off.at(t_s);
    const double elevation = std::atan2(way.z(), std::hypot(way.x(), way.y()));
    const double pitch = std::clamp(mount_rad - elevation + pitch_off.at(t_s), -35.0 * kDegree, 45.0 * kDegree);
    Isometry3d X_WC = pose(positions[i], yaw, pitch, roll.at(t_s));
    X_WC.linear() = X_WC.linear() * camera.X_BC.linear();
    out->X_WC.push_back(X_WC);
    out->stamps.push_back(from_seconds(t_s));
  }

  Vector3d off(random->normal(), random->normal(), random->normal());
  out->nominal_W = X_WG.translation() + options.nominal_m * off.normalized();
  out->direction_W = AngleAxisd(random->uniform(-15.0, 15.0) * kDegree, Vector3d::UnitZ()) * -x_W;

  const scene::DepthCamera depth_camera(world);
  scene::DepthImage clean;
  std::vector<std::uint16_t> clean_mm(kImageSize_px);
  int valid_n = 0;
  constexpr std::size_t kEvery = 4;
  for (std::size_t i = 0; i < out->X_WC.size(); i += kEvery) {
    depth_camera.render(camera, out->X_WC[i], &clean);
    for (std::size_t k = 0; k < kImageSize_px; ++k)
      clean_mm[k] = static_cast<std::uint16_t>(clean.depth_m[k] * 1000.0f + 0.5f);
    const Eigen::Isometry3f X_CG = (out->X_WC[i].inverse() * X_WG).cast<float>();
    if (visible_fraction(camera, clean_mm, world.gates[0].shape, X_CG) >= kValidVisibleFraction) ++valid_n;
  }
  const std::size_t looked_n = (out->X_WC.size() + kEvery - 1) / kEvery;
  return valid_n >= kMinValidPart * static_cast<double>(looked_n);
}

/// Keeps what the encoder said at the first call of a frame: that is the one with the memory's prior.
class Recorder final : public perception::DepthEncoder {
 public:
  explicit Recorder(perception::DepthEncoder* encoder) : encoder_(encoder) {}
  std::optional<perception::Encoding> encode(std::span<const float> depth_m, const CameraModel& camera,
                                             const std::optional<Eigen::Vector3d>& prior_C) override {
    auto encoding = encoder_->encode(depth_m, camera, prior_C);
    if (!called_) first_ = encoding;
    called_ = true;
    return encoding;
  }
  void forget() {
    called_ = false;
    first_.reset();
  }
  const std::optional<perception::Encoding>& first() const { return first_; }

 private:
  perception::DepthEncoder* encoder_;
  bool called_ = false;
  std::optional<perception::Encoding> first_;
};

/// One bundle's memory along one flight.
class Chain {
 public:
  Chain(Observer* observer, const Approach& flight)
      : observer_(observer), encoders_(recorder(&observer->encoder())), shape_(flight.scenario.world.gates[0].shape) {
    Course course;
    course.closed = false;
    course.waypoints.emplace_back(flight.nominal_W, flight.direction_W, shape_);
    sight_.emplace(dataset_camera(), course,
                   std::make_unique<perception::LearnedSensor>(&observer->bundle(), observer->decoder(), &encoders_),
                   perception::SightOptions{});
    direction_W_ = flight.direction_W;
  }

  ApproachFrame look(std::span<const std::uint16_t> image_mm, Stamp stamp, const Isometry3d& X_WC,
                     const Isometry3d& X_WG) {
    const Isometry3d X_WB = X_WC * dataset_camera().X_BC.inverse();
    const Vector3d expected_W = sight_->records().expected_center_W(0);
    recorder_->forget();
    const std::span<const std::uint8_t> bytes(reinterpret_cast<const std::uint8_t*>(image_mm.data()),
                                              image_mm.size_bytes());
    sight_->look(bytes, protocol::DepthEncoding::kCounts16, stamp, X_WB, 0, 0);
    ApproachFrame out;
    out.distance_m = (X_WG.translation() - X_WC.translation()).norm();
    const auto error_G = [&](const Vector3d& center_W) -> Vector3d {
      return X_WG.linear().transpose() * (center_W - X_WG.translation());
    };
    if (const auto& encoding = recorder_->first(); encoding.has_value()) {
      kernels::fold(observer_->decoder(), encoding->latent, X_WC, &field_.decoder);
      const Vector3d around_W =
          observer_->knows_center() ? Vector3d(X_WC * encoding->center_C.cast<double>()) : expected_W;
      const auto fit = perception::fit_hourglass(field_, shape_, observer_->bundle().manifest().cone_angle_rad,
                                                 around_W, direction_W_);
      if (fit.ok) out.frame_G = error_G(fit.X_WG.translation());
    }
    if (sight_->records().seen(0)) out.memory_G = error_G(sight_->records().expected_center_W(0));
    return out;
  }

 private:
  /// The one encoder that the sensor gets.
  std::vector<std::unique_ptr<perception::DepthEncoder>> recorder(perception::DepthEncoder* encoder) {
    auto made = std::make_unique<Recorder>(encoder);
    recorder_ = made.get();
    std::vector<std::unique_ptr<perception::DepthEncoder>> encoders;
    encoders.push_back(std::move(made));
    return encoders;
  }

  Observer* observer_;
  Recorder* recorder_ = nullptr;
  perception::EncoderPool encoders_;
  GateShape shape_;
  Vector3d direction_W_;
  std::optional<perception::Sight> sight_;
  perception::DecodedField field_;
};

}  // namespace

Approach draw_approach(const ApproachOptions& options, std::uint64_t index) {
  Random random(options.seed, index);
  Approach out;
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    out.scenario = draw_scenario(dataset_camera(), &random);
    if (draw_flight(options, &random, &out)) return out;
  }
  out.X_WC.clear();  // not reached: about every tenth world has a way
  out.stamps.clear();
  return out;
}

std::optional<std::vector<ApproachFlights>> measure_approaches(const ApproachOptions& options,
                                                               std::vector<Observers>* threads,
                                                               const std::function<bool(std::uint64_t)>& progress) {
  const std::size_t bundles = threads->front().size();
  const auto count = static_cast<std::size_t>(std::max(0, options.count));
  std::vector<ApproachFlights> out(bundles, ApproachFlights(count));
  const auto work = [&](int thread, std::uint64_t index) {
    const Approach flight = draw_approach(options, index);
    const scene::World& world = flight.scenario.world;
    const scene::DepthCamera camera(world);
    std::vector<std::unique_ptr<Chain>> chains;
    for (auto& observer : (*threads)[static_cast<std::size_t>(thread)])
      chains.push_back(std::make_unique<Chain>(observer.get(), flight));
    Random random(options.seed + 1, index);
    std::vector<std::uint16_t> image_mm(kImageSize_px);
    for (std::size_t i = 0; i < flight.X_WC.size(); ++i) {
      const Shot shot = take_shot(camera, world, 1, flight.X_WC[i], {}, &random);
      for (std::size_t k = 0; k < kImageSize_px; ++k)
        image_mm[k] = static_cast<std::uint16_t>(shot.noisy_m[k] * 1000.0f + 0.5f);
      for (std::size_t bundle = 0; bundle < bundles; ++bundle) {
        ApproachFrame frame = chains[bundle]->look(image_mm, flight.stamps[i], flight.X_WC[i], world.gates[0].X_WG);
        frame.valid = shot.gates[0].valid();
        out[bundle][index].push_back(frame);
      }
    }
  };
  if (!for_each_index(count, static_cast<int>(threads->size()), work, progress)) return std::nullopt;
  return out;
}

ApproachRow approach_row(const ApproachFlights& flights, double from_m, double to_m) {
  ApproachRow row;
  row.from_m = from_m;
  row.to_m = to_m;
  std::vector<double> frame_m, memory_m;
  for (const auto& flight : flights) {
    for (const ApproachFrame& frame : flight) {
      if (!frame.valid || frame.distance_m < from_m || frame.distance_m >= to_m) continue;
      frame_m.push_back(frame.frame_G ? frame.frame_G->norm() : kFailedCenter_m);
      memory_m.push_back(frame.memory_G ? frame.memory_G->norm() : kFailedCenter_m);
    }
  }
  row.count = static_cast<int>(frame_m.size());
  row.frame_median_m = quantile(frame_m, 0.5);
  row.frame_p90_m = quantile(frame_m, 0.9);
  row.memory_median_m = quantile(memory_m, 0.5);
  row.memory_p90_m = quantile(memory_m, 0.9);
  return row;
}

BiasAndNoise bias_and_noise(const ApproachFlights& flights, int window) {
  struct Part {
    Vector3d mean_G;
    double spread_m2;  ///< unbiased: sum of squares about the mean / (n - 1)
  };
  BiasAndNoise out;
  out.window = window;
  const auto n = static_cast<double>(window);
  std::vector<std::vector<Part>> parts;  // [flight][window]
  std::vector<double> bias_m, spread_m, single_m;
  for (const auto& flight : flights) {
    std::vector<Part> of_flight;
    std::vector<Vector3d> run;
    bool wrong = false;
    for (const ApproachFrame& frame : flight) {
      if (!frame.valid) {  // windows are frames in a row
        run.clear();
        wrong = false;
        continue;
      }
      wrong = wrong || !frame.frame_G || frame.frame_G->norm() > kWrongGate_m;
      run.push_back(frame.frame_G.value_or(Vector3d::Zero()));
      if (static_cast<int>(run.size()) < window) continue;
      if (wrong) {
        ++out.left_out;
      } else {
        Part part{Vector3d::Zero(), 0.0};
        for (const Vector3d& error_G : run) part.mean_G += error_G / n;
        for (const Vector3d& error_G : run) {
          part.spread_m2 += (error_G - part.mean_G).squaredNorm() / (n - 1.0);
          single_m.push_back(error_G.norm());
        }
        bias_m.push_back(part.mean_G.norm());
        spread_m.push_back(std::sqrt(part.spread_m2));
        of_flight.push_back(part);
      }
      run.clear();
      wrong = false;
    }
    if (!of_flight.empty()) parts.push_back(std::move(of_flight));
  }
  out.windows = static_cast<int>(bias_m.size());
  out.bias_median_m = quantile(bias_m, 0.5);
  out.spread_median_m = quantile(spread_m, 0.5);
  out.single_median_m = quantile(single_m, 0.5);
  if (out.windows == 0) return out;

  // Nested analysis of variance: what the level below adds to a mean's square is taken off it.
  const double all_n = out.windows;
  const auto flight_n = static_cast<double>(parts.size());
  Vector3d sum_of_flights = Vector3d::Zero();
  double within_m2 = 0.0, within_free = 0.0, per_flight = 0.0;
  std::vector<Vector3d> flight_means;
  for (const auto& flight : parts) {
    Vector3d mean_G = Vector3d::Zero();
    for (const Part& part : flight) mean_G += part.mean_G / static_cast<double>(flight.size());
    for (const Part& part : flight) {
      out.noise_m2 += part.spread_m2 / all_n;
      within_m2 += (part.mean_G - mean_G).squaredNorm();
    }
    within_free += static_cast<double>(flight.size()) - 1.0;
    per_flight += 1.0 / static_cast<double>(flight.size()) / flight_n;
    flight_means.push_back(mean_G);
    sum_of_flights += mean_G;
  }
  out.mean_G = sum_of_flights / flight_n;
  double between_m2 = 0.0;
  for (const Vector3d& mean_G : flight_means) between_m2 += (mean_G - out.mean_G).squaredNorm();
  const double window_mean_m2 = within_free > 0.0 ? within_m2 / within_free : 0.0;
  const double flight_mean_m2 = flight_n > 1.0 ? between_m2 / (flight_n - 1.0) : 0.0;
  out.window_m2 = std::max(0.0, window_mean_m2 - out.noise_m2 / n);
  out.flight_m2 = std::max(0.0, flight_mean_m2 - per_flight * (out.window_m2 + out.noise_m2 / n));
  out.global_m2 = std::max(0.0, out.mean_G.squaredNorm() - flight_mean_m2 / flight_n);
  return out;
}

}  // namespace gatefield::training
