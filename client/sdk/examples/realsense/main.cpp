// Hands a RealSense's depth images to a gatefield-bridge, and says what its camera is for the vehicle file. Ends when
// the camera is unplugged.
//   gatefield-realsense [DDS domain, 0 unless told] [seconds, for ever unless told]
#include <gatefield/sdk/publisher.h>

#include <cstdio>
#include <cstdlib>
#include <librealsense2/rs.hpp>
#include <vector>

namespace {

constexpr const char* kTopic = "/camera/depth/image_rect_raw";  // depth { image: ".." } in the bridge's file
constexpr int kWidth = 640, kHeight = 360, kRate = 60;
// The network sees some 160 columns; fewer pixels on the wire are younger ones.
constexpr int kDecimation = 4;

// The sent image's camera, in the words of a vehicle file. Principal points scale by themselves where pixels are
// counted from their edges, as a vehicle file does; the library counts from the first pixel's centre.
void print_camera(const rs2::video_stream_profile& sensor, int width, int height) {
  const rs2_intrinsics full = sensor.get_intrinsics();
  const double x = static_cast<double>(width) / full.width, y = static_cast<double>(height) / full.height;
  std::printf("camera {\n  width_px: %d\n  height_px: %d\n  fx_px: %.2f\n  fy_px: %.2f\n  cx_px: %.2f\n  cy_px: %.2f\n",
              width, height, full.fx * x, full.fy * y, (full.ppx + 0.5) * x, (full.ppy + 0.5) * y);
  std::printf("  min_depth_m: 0.3\n  max_depth_m: 10\n  rate_hz: %d\n  mount { ... }  # as it is built in\n}\n",
              sensor.fps());
}

// When the middle of the exposure was, by this machine's clock.
std::chrono::system_clock::time_point exposed(const rs2::frame& frame) {
  double stamp_ms = frame.get_timestamp();
  // The stamp is of the readout; where the camera's firmware says both, the exposure is that much earlier.
  if (frame.supports_frame_metadata(RS2_FRAME_METADATA_SENSOR_TIMESTAMP) &&
      frame.supports_frame_metadata(RS2_FRAME_METADATA_FRAME_TIMESTAMP)) {
    const auto middle_us = frame.get_frame_metadata(RS2_FRAME_METADATA_SENSOR_TIMESTAMP);
    const auto readout_us = frame.get_frame_metadata(RS2_FRAME_METADATA_FRAME_TIMESTAMP);
    stamp_ms -= static_cast<double>(readout_us - middle_us) * 1e-3;
  }
  using Milliseconds = std::chrono::duration<double, std::milli>;
  return std::chrono::system_clock::time_point(
      std::chrono::duration_cast<std::chrono::system_clock::duration>(Milliseconds(stamp_ms)));
}

void run(gatefield::sdk::Publisher& publisher, double seconds) {
  rs2::config config;
  config.enable_stream(RS2_STREAM_DEPTH, kWidth, kHeight, RS2_FORMAT_Z16, kRate);
  rs2::pipeline camera;
  const rs2::pipeline_profile profile = camera.start(config);
  const auto sensor = profile.get_device().first<rs2::depth_sensor>();
  if (sensor.supports(RS2_OPTION_GLOBAL_TIME_ENABLED)) sensor.set_option(RS2_OPTION_GLOBAL_TIME_ENABLED, 1);
  const float metres_per_count = sensor.get_depth_scale();
  const auto stream = profile.get_stream(RS2_STREAM_DEPTH).as<rs2::video_stream_profile>();

  rs2::decimation_filter decimation(kDecimation);
  std::vector<float> depth_m;
  bool described = false;
  unsigned long long sent = 0;
  const auto begin = std::chrono::steady_clock::now();
  while (seconds <= 0 || std::chrono::steady_clock::now() - begin < std::chrono::duration<double>(seconds)) {
    const rs2::depth_frame full = camera.wait_for_frames().get_depth_frame();  // throws after 15 s without one
    if (full.get_frame_timestamp_domain() == RS2_TIMESTAMP_DOMAIN_HARDWARE_CLOCK)
      throw std::runtime_error("the camera stamps by its own clock, expected the system's: update its firmware");
    const rs2::depth_frame small = decimation.process(full).as<rs2::depth_frame>();
    const auto* counts = static_cast<const std::uint16_t*>(small.get_data());
    const int width = small.get_width(), height = small.get_height(), row = small.get_stride_in_bytes() / 2;
    depth_m.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    for (int v = 0; v < height; ++v)
      for (int u = 0; u < width; ++u) depth_m[v * width + u] = counts[v * row + u] * metres_per_count;

    if (!described) print_camera(stream, width, height);
    described = true;
    const auto status = publisher.publish_depth(exposed(full), width, height, depth_m);
    if (!status.ok()) std::fprintf(stderr, "%s\n", status.error().c_str());
    sent += status.ok();
  }
  std::printf("%llu images, %zu bridges listen\n", sent, publisher.listeners(kTopic));
}

}  // namespace

int main(int argc, char** argv) {
  gatefield::sdk::PublisherOptions options;
  options.domain = argc > 1 ? static_cast<std::uint32_t>(std::atoi(argv[1])) : 0;
  options.name = "realsense";
  options.depth = kTopic;
  auto publisher = gatefield::sdk::Publisher::create(options);
  if (!publisher.ok()) {
    std::fprintf(stderr, "%s\n", publisher.error().c_str());
    return 2;
  }
  try {
    run(**publisher, argc > 2 ? std::atof(argv[2]) : 0.0);
  } catch (const std::exception& error) {  // the library's, too: no camera, unplugged, another program has it
    std::fprintf(stderr, "camera: %s\n", error.what());
    return 1;
  }
}
