#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <vector>

#include "common/base/random.h"
#include "common/base/result.h"
#include "common/scene/stereo_camera.h"
#include "common/scene/world.h"
#include "server/training/data/dataset.h"

/// Flights through courses in rooms, seen by the second sensor: what stands in for recordings of real hardware.
namespace gatefield::training {

/// Raise when the sensor or what draws flights changes: files of other versions are not continued.
inline constexpr int kStereoVersion = 2;

/// A short stretch of a flight: one room with its gates in one placement, one camera pose per frame.
struct Flight {
  scene::World world;              ///< gates: those of the course
  scene::StereoOptions sensor;     ///< the same unit in all flights; light differs from room to room
  std::uint64_t texture_seed = 0;  ///< what the room's surfaces look like
  std::vector<Eigen::Isometry3d> X_WC;
};

struct FlightOptions {
  std::uint64_t seed = 21;     ///< names the rooms, courses, placements and paths; other seeds share none of them
  std::uint64_t count = 3000;  ///< frames
  std::uint64_t rooms = 25;    ///< different rooms; flights go through them in turn, with new placements every time
  std::uint32_t frames = 40;   ///< of each flight
  double rate_hz = 60.0;       ///< of the camera
  int threads = 2;
};

/// Says which field is wrong and why: at least one room, frame and thread, rate 1 to 240 Hz.
Status validate(const FlightOptions& options);

/// Draws flight `index` of a set from (seed, rooms, index, frames, rate) alone.
///
/// The room (index modulo rooms): 10 to 22 m long and wide, walls, floor, sometimes a ceiling, clutter, light; a course
/// of 3 to 6 gates on a circle, an eight or anywhere. The placement (index / rooms): every gate displaced by up to
/// 0.7 m (0.35 m in height), turned by up to 40 deg, tilted a little. The path: closed, smooth, through the openings up
/// to 0.3 m beside their centres, at least 0.15 m away from all solids; 3 to 9 m/s, slower where the curve would take
/// more than 16 m/s^2; the thrust axis along acceleration plus gravity, the nose along the path up to 25 deg beside it,
/// the camera mounted as in default_camera().
/// Thread-safe: yes.   Real-time safe: no.
Flight draw_flight(const FlightOptions& options, std::uint64_t index);

/// Frame `frame` of flight `index` as the second sensor measures it, with true depth, gates, pose and time.
/// `stereo` and `truth` were made from flight.world. Thread-safe: yes.
Sample measure(const FlightOptions& options, const Flight& flight, std::uint64_t index, std::uint32_t frame,
               const scene::StereoCamera& stereo, const scene::DepthCamera& truth);

/// Fills the file with `count` samples of kind kStereo (columns X_WC, sequence, time; sequence = flight). Continues a
/// file of the same set, as generate_dataset() does. `progress` is called from the calling thread after every flight
/// per thread; it returns false to stop. OpenCV is told to use one thread in this process. Errors: options, as
/// DatasetWriter, or a file of other rooms or frames per flight.
Status generate_flights(const std::filesystem::path& file, const FlightOptions& options,
                        const std::function<bool(const Progress&)>& progress = {});

}  // namespace gatefield::training
