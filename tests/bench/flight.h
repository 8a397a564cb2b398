#pragma once

#include <memory>
#include <vector>

#include "common/geometry/camera.h"
#include "common/model/bundle.h"
#include "server/gates/gate_records.h"
#include "server/planner/planner.h"

namespace gatefield::bench {

/// What a planner was given in one step of a flight.
struct RecordedStep {
  planner::PlanInput input;
  std::shared_ptr<const gates::Snapshot> snapshot;          ///< that the input's fields point into,
  std::vector<std::shared_ptr<const gates::Field>> fields;  ///< or these
};

/// A circle of six gates.
Course circle_course();

/// Flies circle_course(), its gates turned, with the real encoder, memory, decoder and planner: images are drawn by
/// meeting each pixel's ray with the gates' planes and the floor, the vehicle follows the reference dynamics at 1 kHz.
/// @return every step's input, at the profile's control rate, until the circle is closed or `limit_s` has passed
std::vector<RecordedStep> fly(const model::Bundle& bundle, const planner::Profile& profile, double limit_s);

/// A depth image of one gate 3 m in front of the camera, before a wall.
std::vector<float> image_of_a_gate(const CameraModel& camera);

}  // namespace gatefield::bench
