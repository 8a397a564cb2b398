#include "server/training/data/dataset_labels.h"

#include <cmath>

namespace gatefield::training {

void store_gate(const GateLabel& gate, float* out) {
  out[0] = gate.p_CG.x();
  out[1] = gate.p_CG.y();
  out[2] = gate.p_CG.z();
  out[3] = gate.q_CG.w();
  out[4] = gate.q_CG.x();
  out[5] = gate.q_CG.y();
  out[6] = gate.q_CG.z();
  out[7] = gate.visible_fraction;
  out[8] = static_cast<float>(gate.shape.inner_half_m);
  out[9] = static_cast<float>(gate.shape.outer_half_m);
  out[10] = static_cast<float>(gate.shape.thickness_m);
  out[11] = gate.shape.opening == GateShape::Opening::kRound ? 1.0f : 0.0f;
}

GateLabel load_gate(const float* in) {
  GateLabel gate;
  gate.p_CG = Eigen::Vector3f(in[0], in[1], in[2]);
  gate.q_CG = Eigen::Quaternionf(in[3], in[4], in[5], in[6]);
  gate.visible_fraction = in[7];
  gate.shape.inner_half_m = static_cast<double>(in[8]);
  gate.shape.outer_half_m = static_cast<double>(in[9]);
  gate.shape.thickness_m = static_cast<double>(in[10]);
  gate.shape.opening = in[11] == 1.0f ? GateShape::Opening::kRound : GateShape::Opening::kSquare;
  return gate;
}

std::string wrong_in_gate(const float* gate) {
  const auto wrong = [](const char* name, float value, const char* expected) {
    return std::string(name) + " is " + std::to_string(value) + ", expected " + expected;
  };
  for (int i = 0; i < 3; ++i) {
    if (!(std::abs(gate[i]) < 1e4f)) return wrong("p_CG", gate[i], "finite metres");
  }
  const float norm = std::sqrt(gate[3] * gate[3] + gate[4] * gate[4] + gate[5] * gate[5] + gate[6] * gate[6]);
  if (!(std::abs(norm - 1.0f) < 0.01f)) return wrong("the norm of q_CG", norm, "1");
  if (!((gate[7] >= 0.0f && gate[7] <= 1.0f) || gate[7] == -1.0f))
    return wrong("visible_fraction", gate[7], "0 to 1, or -1 to have it worked out");
  if (!(gate[8] > 0.0f && gate[8] < 100.0f)) return wrong("inner_half_m", gate[8], "more than 0 m");
  if (!(gate[9] > gate[8] && gate[9] < 100.0f)) return wrong("outer_half_m", gate[9], "more than inner_half_m");
  if (!(gate[10] > 0.0f && gate[10] < 100.0f)) return wrong("thickness_m", gate[10], "more than 0 m");
  if (gate[11] != 0.0f && gate[11] != 1.0f) return wrong("opening", gate[11], "0 (square) or 1 (round)");
  return {};
}

std::string wrong_in_pose(const float* pose) {
  for (int i = 0; i < 3; ++i) {
    if (!(std::abs(pose[i]) < 1e6f)) return "p_WC is " + std::to_string(pose[i]) + ", expected finite metres";
  }
  const float norm = std::sqrt(pose[3] * pose[3] + pose[4] * pose[4] + pose[5] * pose[5] + pose[6] * pose[6]);
  if (!(std::abs(norm - 1.0f) < 0.01f)) return "the norm of q_WC is " + std::to_string(norm) + ", expected 1";
  return {};
}

}  // namespace gatefield::training
