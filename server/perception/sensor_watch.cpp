#include "server/perception/sensor_watch.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <limits>
#include <numbers>

#include "server/gates/gate_size.h"

namespace gatefield::perception {
namespace {

using protocol::bit;
using protocol::Problem;

constexpr std::array<float, 12> kFactors = {0.001f, 0.01f, 0.1f, 0.2f,  0.25f,  0.5f,
                                            2.0f,   4.0f,  5.0f, 10.0f, 100.0f, 1000.0f};

constexpr double kAround_m = 1.0;      ///< a gate is searched this far around its frame
constexpr double kAtDistance_m = 1.5;  ///< depths so near the waypoint's may be its gate's,
constexpr double kAtDistance = 0.35;   ///< but this share of it at most
constexpr std::size_t kFewestPixels = 12;
constexpr std::size_t kRanks = 3;  ///< corrections that are tried in turn, the likeliest first

constexpr std::size_t kFewestSightings = 8, kMaxSightings = 64;
constexpr double kMost = 0.75;  ///< of the sightings: what the others say may be of another gate
constexpr double kMuchNearer = 0.5;
constexpr double kNearlyAll = 0.95;
constexpr double kMillimetre_m = 1e-3;
constexpr float kNotAllTheSame = 1.05f;  ///< what never ends is often told as one large number

/// Turns of the true mounting against the one that was told.
enum Turn : std::size_t { kHalf, kRight, kLeft, kBackwards };
constexpr std::size_t kTurns = 4;

/// The mounting, if the one that was told is turned so.
Eigen::Isometry3d turned(const Eigen::Isometry3d& X_BC, std::size_t turn) {
  constexpr double kQuarter = 0.5 * std::numbers::pi;
  const auto about_z = [](double angle) { return Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()); };
  switch (turn) {
    case kHalf:
      return X_BC * about_z(2.0 * kQuarter);
    case kRight:
      return X_BC * about_z(kQuarter);
    case kLeft:
      return X_BC * about_z(-kQuarter);
    default:  // kBackwards
      return about_z(2.0 * kQuarter) * X_BC;
  }
}

/// The value that so great a share of the others is below. @pre 0 <= share < 1, values
double at_share(double share, std::vector<double>* values) {
  const auto nth = values->begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values->size()));
  std::nth_element(values->begin(), nth, values->end());
  return *nth;
}

}  // namespace

const SensorWatch::Correction SensorWatch::kUpsideDown{Correction::Kind::kTurned, kHalf};

SensorWatch::SensorWatch(const CameraModel& camera, const gates::Passages* passages, double tolerance_m)
    : camera_(camera), reversed_camera_(camera), passages_(passages), tolerance_m_(tolerance_m) {
  reversed_camera_.cx_px = camera.width_px - camera.cx_px;
  reversed_camera_.cy_px = camera.height_px - camera.cy_px;
}

void SensorWatch::watch(const WatchedFrame& frame, const gates::Expectation& gate, GateSensor* sensor) {
  if (frame.capture < newest_) {
    floats_since_ = tried_ = Stamp{-1};
    taken_since_ = Stamp{-1};
    missed_ = 0;
    suspicion_.reset();
    sightings_.clear();
  }
  newest_ = frame.capture;
  if (frame.target != target_) {
    missed_ = 0;
    sightings_.clear();
  }
  target_ = frame.target;
  watch_floats(frame);
  watch_sightings(frame);
  if (!frame.taken || moving_turn_) {
    taken_since_ = Stamp{-1};
  } else {
    if (taken_since_ < Stamp{0}) taken_since_ = frame.capture;
    if (frame.capture - taken_since_ >= kCleared) explained_ = 0;
  }

  if (!frame.expected) {
    missed_ = 0;
    return;
  }
  if (missed_++ == 0) missed_since_ = frame.capture;
  if (missed_ < kMissedFrames || frame.capture - missed_since_ < kMissed) return;
  if (tried_ >= Stamp{0} && frame.capture - tried_ < kBetween) return;
  tried_ = frame.capture;

  std::optional<Try> found = try_turns(frame);
  if (!found) found = try_looking(frame, gate, sensor);
  if (found) {
    conclude(*found);
  } else {
    suspicion_.reset();
    ++failures_;
  }
}

void SensorWatch::conclude(const Try& found) noexcept {
  const bool agrees = suspicion_ && suspicion_->correction == found.correction &&
                      (suspicion_->p_W - found.p_W).norm() < size() * kSamePlace_m &&
                      found.capture - suspicion_->capture <= kAgree;
  if (agrees)
    explained_ |= bit(found.correction.kind == Correction::Kind::kUnit ? Problem::kDepthUnitLooksWrong
                                                                       : Problem::kMountingLooksWrong);
  suspicion_ = found;
}

void SensorWatch::watch_floats(const WatchedFrame& frame) {
  floats_ = 0;
  const DecodedDepth& decoded = frame.decoded;
  if (frame.image.encoding != protocol::DepthEncoding::kMetres32 || decoded.returns > decoded.saturated) {
    floats_since_ = Stamp{-1};
    return;
  }
  std::size_t returns = 0, millimetres = 0;
  float least = std::numeric_limits<float>::infinity(), largest = 0.0f;
  for_each_depth(frame.image, camera_, [&](std::size_t, float z, bool) {
    if (!(z > 0.0f) || !std::isfinite(z)) return;
    ++returns;
    if (!(z > camera_.max_depth_m)) return;
    const double as_millimetres_m = kMillimetre_m * static_cast<double>(z);
    millimetres += as_millimetres_m >= camera_.min_depth_m && as_millimetres_m <= camera_.max_depth_m ? 1 : 0;
    least = std::min(least, z);
    largest = std::max(largest, z);
  });
  const bool so = returns >= kFewestPixels &&
                  static_cast<double>(millimetres) >= kNearlyAll * static_cast<double>(returns) &&
                  largest > kNotAllTheSame * least;
  if (!so)
    floats_since_ = Stamp{-1};
  else if (floats_since_ < Stamp{0})
    floats_since_ = frame.capture;
  if (so && frame.capture - floats_since_ >= kFloats) floats_ = bit(Problem::kDepthUnitLooksWrong);
}

void SensorWatch::watch_sightings(const WatchedFrame& frame) {
  const auto stale = [&](const Sighting& sighting) { return frame.capture - sighting.capture > kWindow; };
  sightings_.erase(sightings_.begin(), std::find_if_not(sightings_.begin(), sightings_.end(), stale));
  if (frame.seen_W) {
    if (sightings_.size() == kMaxSightings) sightings_.erase(sightings_.begin());
    const Eigen::Isometry3d X_BC = camera_.X_BC;
    sightings_.push_back({frame.capture, frame.X_WC * X_BC.inverse(), frame.X_WC.inverse() * *frame.seen_W});
  }
  std::optional<std::size_t> turn;
  if (sightings_.size() >= kFewestSightings) {
    const Eigen::Isometry3d X_BC = camera_.X_BC;
    if (const double told_m = spread_m(X_BC); told_m > size() * kMoved_m) {
      double least_m = kStill * told_m;
      for (std::size_t i = 0; i < kTurns; ++i)
        if (const double turned_m = spread_m(turned(X_BC, i)); turned_m < least_m) {
          least_m = turned_m;
          turn = i;
        }
    }
  }
  if (turn != moving_turn_) moving_since_ = frame.capture;
  moving_turn_ = turn;
  if (turn && frame.capture - moving_since_ >= kMoving) explained_ |= bit(Problem::kMountingLooksWrong);
}

double SensorWatch::spread_m(const Eigen::Isometry3d& X_BC) const {
  std::vector<double> values(sightings_.size());
  Eigen::Vector3d middle_W;
  for (int axis = 0; axis < 3; ++axis) {
    std::transform(sightings_.begin(), sightings_.end(), values.begin(),
                   [&](const Sighting& s) { return (s.X_WB * (X_BC * s.p_C))[axis]; });
    middle_W[axis] = at_share(0.5, &values);
  }
  std::transform(sightings_.begin(), sightings_.end(), values.begin(),
                 [&](const Sighting& s) { return (s.X_WB * (X_BC * s.p_C) - middle_W).norm(); });
  return at_share(kMost, &values);
}

double SensorWatch::distance_to_course_m(const Eigen::Vector3d& p_W) const noexcept {
  double nearest_m = std::numeric_limits<double>::infinity();
  for (std::uint32_t i = 0; i < passages_->waypoints(); ++i)
    nearest_m = std::min(nearest_m, distance_to_waypoint_m(p_W, i));
  return nearest_m;
}

bool SensorWatch::explains(double off_m, const Eigen::Vector3d& p_W) const noexcept {
  const double uncorrected_m = distance_to_course_m(p_W);
  const double tolerance_m = size() * tolerance_m_;
  return off_m <= tolerance_m && uncorrected_m > tolerance_m && off_m <= kMuchNearer * uncorrected_m;
}

double SensorWatch::size() const noexcept { return gates::gate_size(passages_->nominal(target_).shape); }

std::optional<SensorWatch::Try> SensorWatch::try_turns(const WatchedFrame& frame) const {
  if (!frame.seen_W) return std::nullopt;
  const Eigen::Isometry3d X_BC = camera_.X_BC;
  const Eigen::Isometry3d X_WB = frame.X_WC * X_BC.inverse();
  const Eigen::Vector3d p_C = frame.X_WC.inverse() * *frame.seen_W;
  std::optional<Try> best;
  double nearest_m = size() * tolerance_m_;
  for (std::size_t turn = 0; turn < kTurns; ++turn) {
    const Eigen::Vector3d p_W = X_WB * (turned(X_BC, turn) * p_C);
    const double off_m = turn == kBackwards ? distance_to_course_m(p_W) : distance_to_waypoint_m(p_W, frame.target);
    if (off_m > nearest_m || !explains(off_m, *frame.seen_W)) continue;
    nearest_m = off_m;
    best = Try{{Correction::Kind::kTurned, turn}, p_W, frame.capture};
  }
  return best;
}

std::optional<SensorWatch::Correction> SensorWatch::choose(const WatchedFrame& frame,
                                                           const gates::Expectation& gate) const {
  // Pixels around the waypoint whose depth a correction would bring to its distance.
  const Eigen::Vector3d center_C = frame.X_WC.inverse() * gate.center_W;
  const double z_m = center_C.z(), around_m = gate.shape.outer_half_m + size() * kAround_m;
  const double off_m = std::min(size() * kAtDistance_m, kAtDistance * z_m);
  const double u = camera_.cx_px + camera_.fx_px * center_C.x() / z_m;
  const double v = camera_.cy_px + camera_.fy_px * center_C.y() / z_m;
  const double half_u = camera_.fx_px * around_m / z_m, half_v = camera_.fy_px * around_m / z_m;
  const auto width = static_cast<std::size_t>(camera_.width_px), height = static_cast<std::size_t>(camera_.height_px);
  const auto around = [&](std::size_t column, std::size_t row) {
    return std::abs(static_cast<double>(column) + 0.5 - u) <= half_u &&
           std::abs(static_cast<double>(row) + 0.5 - v) <= half_v;
  };
  struct Candidate {
    Correction correction;
    std::size_t pixels = 0;
  };
  std::array<Candidate, kFactors.size() + 1> candidates{};
  for (std::size_t i = 0; i < kFactors.size(); ++i) candidates[i].correction = {Correction::Kind::kUnit, i};
  candidates.back().correction = kUpsideDown;
  for_each_depth(frame.image, camera_, [&](std::size_t i, float told_m, bool at_end) {
    if (at_end || !(told_m > 0.0f)) return;
    const std::size_t column = i % width, row = i / width;
    const auto at_distance = [&](double z) { return std::abs(z - z_m) <= off_m; };
    if (around(column, row))
      for (std::size_t k = 0; k < kFactors.size(); ++k)
        if (at_distance(static_cast<double>(kFactors[k] * told_m))) ++candidates[k].pixels;
    if (around(width - 1 - column, height - 1 - row) && at_distance(static_cast<double>(told_m)))
      ++candidates.back().pixels;
  });
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.pixels > b.pixels; });
  const auto end = std::find_if(candidates.begin(), candidates.begin() + kRanks,
                                [](const Candidate& candidate) { return candidate.pixels < kFewestPixels; });
  const auto worth_it = static_cast<std::size_t>(end - candidates.begin());
  if (worth_it == 0) return std::nullopt;
  return candidates[failures_ % worth_it].correction;
}

std::optional<SensorWatch::Try> SensorWatch::try_looking(const WatchedFrame& frame, const gates::Expectation& gate,
                                                         GateSensor* sensor) {
  // What explained one frame is asked again. (Other turns are only read, from gates that the sensor sees elsewhere.)
  std::optional<Correction> correction;
  if (suspicion_ && (suspicion_->correction.kind == Correction::Kind::kUnit || suspicion_->correction == kUpsideDown)) {
    correction = suspicion_->correction;
  } else {
    correction = choose(frame, gate);
  }
  if (!correction) return std::nullopt;

  const bool reversed = *correction == kUpsideDown;
  const float factor = reversed ? 1.0f : kFactors[correction->which];
  if (decode_depth(frame.image, camera_, &depth_m_, factor).returns == 0) return std::nullopt;
  if (reversed) std::reverse(depth_m_.begin(), depth_m_.end());
  std::optional<Observation> seen;
  try {
    seen = sensor->look({depth_m_, reversed ? reversed_camera_ : camera_, frame.X_WC}, gate, Where::kAnywhere);
  } catch (const std::exception&) {
    return std::nullopt;  // an image that nobody sent must not cost the frame
  }
  if (!seen) return std::nullopt;
  const Eigen::Vector3d p_W = seen->gate.X_WG.translation(), p_C = frame.X_WC.inverse() * p_W;
  const Eigen::Vector3d uncorrected_C =
      reversed ? Eigen::Vector3d(-p_C.x(), -p_C.y(), p_C.z()) : Eigen::Vector3d(p_C / static_cast<double>(factor));
  if (!explains(distance_to_waypoint_m(p_W, frame.target), frame.X_WC * uncorrected_C)) return std::nullopt;
  return Try{*correction, p_W, frame.capture};
}

}  // namespace gatefield::perception
