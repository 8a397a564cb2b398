#include "server/pilot/pilot.h"

#include <utility>

namespace gatefield::pilot {

Pilot::Pilot(PilotParts parts)
    : request_(std::move(parts.request)),
      session_(parts.session),
      take_overs_(parts.take_overs),
      isa_(std::move(parts.isa)),
      model_hash_(parts.model_hash),
      intake_(&request_, session_, &shared_),
      looking_(&request_, std::move(parts.sensor), parts.sight, &shared_),
      stepping_(&request_, session_, isa_, std::move(parts.planner), std::move(parts.observer), &shared_) {
  shared_.last_heard.store(parts.now.count(), std::memory_order_relaxed);
}

Stepping::Answer Pilot::feed(const Event& event) {
  struct Feed {
    Pilot& pilot;
    Stepping::Answer operator()(const StateArrived& e) const {
      pilot.intake_.take_state(e.state, e.at);
      return {};
    }
    Stepping::Answer operator()(const FrameArrived& e) const {
      protocol::DepthFrame frame = e.frame;
      pilot.intake_.take_depth(frame, e.at);
      return {};
    }
    Stepping::Answer operator()(const Looked& e) const {
      if (pilot.looking_.look()) pilot.looking_.looked(e.took);
      return {};
    }
    Stepping::Answer operator()(const Ticked& e) const { return pilot.stepping_.step(e.at); }
    Stepping::Answer operator()(const Solved& e) const {
      pilot.stepping_.solved(e.took);
      return {};
    }
    Stepping::Answer operator()(const Sent& e) const {
      pilot.stepping_.sent(e.at, e.ok);
      return {};
    }
  };
  return std::visit(Feed{*this}, event);
}

const protocol::PlannerHealth& Pilot::health() {
  if (const protocol::PlannerHealth* const newest = shared_.healths.read()) last_health_ = *newest;
  return last_health_;
}

void Pilot::fill(Stamp now, protocol::Telemetry* telemetry) {
  telemetry->vehicle = request_.vehicle;
  telemetry->session = session_;
  telemetry->server_stamp = now;
  telemetry->health = health();
  if (const protocol::IdentifiedDrive* const newest = shared_.drives.read()) identified_ = *newest;
  telemetry->identified = identified_;
  telemetry->isa = isa_.substr(0, 15);
  shared_.account.fill(telemetry);
}

}  // namespace gatefield::pilot
