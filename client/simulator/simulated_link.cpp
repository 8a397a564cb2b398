#include "client/simulator/simulated_link.h"

#include <cmath>

#include "client/simulator/plant.h"
#include "common/config/scenario.h"

namespace gatefield::simulator {

SimulatedLink::SimulatedLink(const Options& options, std::uint64_t seed)
    : options_(options), random_(seed, Stream("gatefield.link")) {}

Stamp SimulatedLink::outage_begin(std::uint64_t seed) {
  Random random(seed, Stream("gatefield.outage"));
  const double share = random.uniform();
  return kFirstOutage + from_seconds(share * seconds(kLastOutage - kFirstOutage));
}

void SimulatedLink::begin(const QuadrotorState& estimate) {
  past_.assign(static_cast<std::size_t>(options_.delay / Plant::kStep) + 1, estimate);
}

void SimulatedLink::remember(const QuadrotorState& estimate) {
  past_.pop_front();
  past_.push_back(estimate);
}

SimulatedLink::Passage SimulatedLink::pass(int ways) {
  Passage passage;
  for (int way = 0; way < ways; ++way) passage.lost = random_.uniform() < options_.loss || passage.lost;
  passage.jitter = Plant::kStep * std::llround(random_.uniform() * seconds(options_.jitter) / seconds(Plant::kStep));
  return passage;
}

void SimulatedLink::send_state(Stamp now) {
  const Passage passage = pass(2);
  if (!passage.lost && !cut(now - options_.delay, now + passage.jitter))
    states_.push_back({now + passage.jitter, {now - options_.delay, past_.front()}});
}

void SimulatedLink::send_frame(Stamp now, Stamp stamp, const scene::DepthImage& metres,
                               const std::vector<std::uint16_t>& counts) {
  const Passage passage = pass(1);
  const Stamp arrival = now + options_.delay + passage.jitter;
  if (!passage.lost && !cut(now, arrival)) frames_.push_back({arrival, {stamp, metres, counts}});
}

std::optional<SimulatedLink::State> SimulatedLink::take_state(Stamp now) {
  std::size_t arrived = states_.size();
  while (arrived > 0 && states_[arrived - 1].arrival > now) --arrived;
  if (arrived == 0) return std::nullopt;
  const State newest = states_[arrived - 1].message;
  states_.erase(states_.begin(), states_.begin() + static_cast<std::ptrdiff_t>(arrived));
  return newest;
}

std::optional<SimulatedLink::Frame> SimulatedLink::take_frame(Stamp now) {
  for (std::size_t i = 0; i < frames_.size(); ++i) {
    if (frames_[i].arrival > now) continue;
    Frame frame = std::move(frames_[i].message);
    frames_.erase(frames_.begin(), frames_.begin() + static_cast<std::ptrdiff_t>(i) + 1);
    return frame;
  }
  return std::nullopt;
}

}  // namespace gatefield::simulator
