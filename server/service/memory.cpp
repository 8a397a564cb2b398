#include "server/service/sight.h"

namespace gatefield::service {
namespace {

class GateMemoryAdapter final : public Memory {
 public:
  GateMemoryAdapter(const model::Bundle& bundle, std::shared_ptr<const kernels::PreparedDecoder> decoder,
                    const Course& course)
      : memory_(bundle, std::move(decoder), course) {}
  Eigen::Vector3d expected_center_W(std::uint32_t waypoint) const noexcept override {
    return memory_.expected_center_W(waypoint);
  }
  bool seen(std::uint32_t waypoint) const noexcept override { return memory_.seen(waypoint); }
  perception::GateMemory::Outcome observe(std::uint32_t waypoint, const perception::Encoding& encoding,
                                          const Eigen::Isometry3d& X_WC, Stamp capture) override {
    return memory_.observe(waypoint, encoding, X_WC, capture);
  }
  void snapshot(std::uint32_t target, std::uint32_t next, perception::MemorySnapshot* out) const override {
    memory_.snapshot(target, next, out);
  }

 private:
  perception::GateMemory memory_;
};

}  // namespace

std::unique_ptr<Memory> make_memory(const model::Bundle& bundle,
                                    std::shared_ptr<const kernels::PreparedDecoder> decoder,
                                    const Course& course) {
  return std::make_unique<GateMemoryAdapter>(bundle, std::move(decoder), course);
}

}  // namespace gatefield::service
