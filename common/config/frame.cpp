#include "common/config/frame.h"

#include <google/protobuf/text_format.h>

#include <cmath>

#include "common/base/text.h"
#include "common/config/frame.pb.h"
#include "common/config/gate_spec.h"
#include "common/config/text_file.h"

namespace gatefield::config {
namespace {

void put_pose(const Eigen::Isometry3d& X, PoseSpec* spec) {
  const Eigen::Quaterniond q(X.linear());
  spec->mutable_position()->set_x(X.translation().x());
  spec->mutable_position()->set_y(X.translation().y());
  spec->mutable_position()->set_z(X.translation().z());
  spec->set_qw(q.w());
  spec->set_qx(q.x());
  spec->set_qy(q.y());
  spec->set_qz(q.z());
}

Result<Eigen::Isometry3d> get_pose(const PoseSpec& spec, const std::string& field) {
  const Eigen::Quaterniond q(spec.qw(), spec.qx(), spec.qy(), spec.qz());
  if (!(std::abs(q.norm() - 1.0) < 1e-3))
    return Error{field + " has a quaternion of length " + text(q.norm()) + ", expected 1", ErrorCode::kInvalid, field};
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.linear() = q.normalized().toRotationMatrix();
  X.translation() = Eigen::Vector3d(spec.position().x(), spec.position().y(), spec.position().z());
  if (!X.translation().allFinite()) return Error::invalid(field + ".position", "not finite", "metres");
  return X;
}

}  // namespace

Result<SavedFrame> load_frame(const std::filesystem::path& file) {
  FrameFile spec;
  if (auto status = load_text(file, &spec); !status) return status.failure();
  SavedFrame frame;
  frame.depth_file = file.parent_path() / spec.depth_file();
  frame.camera.width_px = spec.camera().width_px();
  frame.camera.height_px = spec.camera().height_px();
  frame.camera.fx_px = spec.camera().fx_px();
  frame.camera.fy_px = spec.camera().fy_px();
  frame.camera.cx_px = spec.camera().cx_px();
  frame.camera.cy_px = spec.camera().cy_px();
  frame.camera.min_depth_m = spec.camera().min_depth_m();
  frame.camera.max_depth_m = spec.camera().max_depth_m();
  if (auto status = validate(frame.camera); !status) return in_file(file, status.failure());
  const auto X_WC = get_pose(spec.camera_pose(), "camera_pose");
  if (!X_WC) return in_file(file, X_WC.failure());
  frame.X_WC = *X_WC;
  frame.time_s = spec.time_s();
  if (spec.has_gate() != spec.has_gate_pose())
    return in_file(file,
                   Error{"has only one of gate and gate_pose, expected both or none", ErrorCode::kInvalid, "gate"});
  if (spec.has_gate()) {
    SavedFrame::TrueGate gate;
    gate.shape = to_shape(spec.gate());
    if (auto status = validate(gate.shape); !status) return in_file(file, status.failure());
    const auto X_WG = get_pose(spec.gate_pose(), "gate_pose");
    if (!X_WG) return in_file(file, X_WG.failure());
    gate.X_WG = *X_WG;
    frame.gate = gate;
  }
  return frame;
}

std::string frame_text(const SavedFrame& frame) {
  FrameFile spec;
  spec.set_depth_file(frame.depth_file.string());
  PinholeSpec& camera = *spec.mutable_camera();
  camera.set_width_px(frame.camera.width_px);
  camera.set_height_px(frame.camera.height_px);
  camera.set_fx_px(frame.camera.fx_px);
  camera.set_fy_px(frame.camera.fy_px);
  camera.set_cx_px(frame.camera.cx_px);
  camera.set_cy_px(frame.camera.cy_px);
  camera.set_min_depth_m(frame.camera.min_depth_m);
  camera.set_max_depth_m(frame.camera.max_depth_m);
  put_pose(frame.X_WC, spec.mutable_camera_pose());
  if (frame.gate) {
    put_shape(frame.gate->shape, spec.mutable_gate());
    put_pose(frame.gate->X_WG, spec.mutable_gate_pose());
  }
  spec.set_time_s(frame.time_s);
  std::string text;
  google::protobuf::TextFormat::PrintToString(spec, &text);
  return text;
}

}  // namespace gatefield::config
