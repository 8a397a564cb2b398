#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/scene/sensor_noise.h"
#include "server/training/data/depth_frames.h"
#include "server/training/evaluation/evaluate.h"

/// How often a gate is imagined in frames of a real camera that show none, and what refusing them costs.
namespace gatefield::training {

struct NoGateOptions {
  FrameFolder frames;
  Named bundle;
  int places = 20;              ///< nominal waypoints that are told in each frame, one at a time
  int gates = 1000;             ///< simulated images with a gate (seed kHeldOutSeed), for what thresholds cost; 0: none
  scene::SensorNoise noise;     ///< of these images
  double told_off_m = 0.5;      ///< there the waypoint is off by up to this, evenly, in any direction
  std::uint64_t gate_seed = 0;  ///< of these images
  std::uint64_t seed = 99;      ///< of places, noise and what is told
  int threads = 1;
};

/// What the network says of one image, and what the product makes of it.
struct GateLook {
  double validity = 0.0;
  double predicted_m = std::numeric_limits<double>::infinity();  ///< its own guess of its error
  double residual_m = std::numeric_limits<double>::infinity();   ///< of the hourglass fitted to its field
  bool taken = false;  ///< without a prior: the sensor gives an observation; with one: the gate memory has a gate
};

/// One frame without a gate, or (places: 1) one image with one.
struct NoGateFrame {
  std::string name;
  double returns = 0.0;        ///< part of the pixels
  GateLook free;               ///< nothing told
  std::vector<GateLook> told;  ///< [place]
};

struct NoGateResult {
  NoGateOptions options;
  double validity_threshold = 0.5;  ///< the bundle's
  std::vector<NoGateFrame> frames;
  std::vector<NoGateFrame> gates;
};

/// Without a prior LearnedSensor looks anywhere, as for a gate never seen. With one, Sight is told a course of one
/// waypoint and looks as in flight at first sight: where it is told, then anywhere but no farther from it than it
/// tolerates; GateRecords takes it or not. Waypoints in frames without a gate are drawn over the image, 1 to 8 m away
/// and at most 0.5 m behind what is seen there, passed in a direction up to 45 deg off the line of sight. Nobody told
/// the camera's attitude: it is taken as level.
/// Depends on the options alone, not on the number of threads.
/// @param progress  part done; false stops
/// Errors: folder, images, bundle; "evaluation stopped".
Result<NoGateResult> evaluate_no_gate(const NoGateOptions& options, const std::function<bool(double)>& progress = {});

}  // namespace gatefield::training
