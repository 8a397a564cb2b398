#include "client/simulator/depth_picture.h"

#include <algorithm>
#include <cmath>

#include "client/simulator/view.h"
#include "common/base/whole_file.h"
#include "common/config/frame.h"

namespace gatefield::simulator {

Status write_depth_picture(const std::filesystem::path& file, const Snapshot& snapshot, const std::string& title) {
  const scene::DepthImage& depth = snapshot.depth;
  constexpr double kWidth_px = 960;
  const double height_px = kWidth_px * depth.height_px / depth.width_px;
  Canvas canvas(1150, static_cast<int>(height_px) + 110);
  canvas.text(title, {40, 44}, 14, kInk, Align::kLeft, true);
  canvas.image(depth_colors(depth, snapshot.camera.max_depth_m), {40, 70}, kWidth_px, height_px);
  draw_color_bar(&canvas, {1045, 100}, 20, height_px - 30, 0.0, snapshot.camera.max_depth_m, "depth [m]");

  return canvas.save(file);
}

Status save_frame(const std::filesystem::path& folder, const Snapshot& snapshot) {
  const scene::DepthImage& depth = snapshot.depth;
  cv::Mat image(depth.height_px, depth.width_px, CV_16UC1);
  std::transform(depth.depth_m.begin(), depth.depth_m.end(), image.begin<std::uint16_t>(), [](float depth_m) {
    return static_cast<std::uint16_t>(std::clamp(std::lround(depth_m * 1000.0f), 0L, 65535L));
  });
  if (auto status = write_png(folder / "depth.png", image); !status) return status;

  config::SavedFrame frame;
  frame.depth_file = "depth.png";
  frame.camera = snapshot.camera;
  frame.X_WC = snapshot.X_WC;
  frame.gate = config::SavedFrame::TrueGate{snapshot.gate.X_WG, snapshot.gate.shape};
  frame.time_s = snapshot.t_s;
  return write_file(folder / "frame.txt", config::frame_text(frame));
}

}  // namespace gatefield::simulator
