#pragma once

#include <string>

#include "server/training/data/dataset.h"
#include "server/training/data/dataset_schema.h"

/// Labels as numbers of a data set's file, and which of them can't be. Not for use outside of this folder.
/// Thread-safe: yes.
namespace gatefield::training {

/// @param out  kGateValues numbers
void store_gate(const GateLabel& gate, float* out);
/// @param in  kGateValues numbers that wrong_in_gate() has nothing against
GateLabel load_gate(const float* in);

/// Says which of a gate's values can't be; empty when all can.
std::string wrong_in_gate(const float* gate);
/// The same of a camera pose: p_WC x y z, q_WC w x y z.
std::string wrong_in_pose(const float* pose);

}  // namespace gatefield::training
