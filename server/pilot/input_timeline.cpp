#include "server/pilot/input_timeline.h"

namespace gatefield::pilot {

using protocol::AskedBy;

void InputTimeline::add(Stamp plan_start, Stamp step, std::span<const PlainVector4> inputs, Stamp validity) noexcept {
  while (count_ > 0 && nth(count_ - 1).from >= plan_start) --count_;
  if (count_ > 0) nth(count_ - 1).to = std::min(nth(count_ - 1).to, plan_start);
  const Stamp end = plan_start + validity;
  Stamp from = plan_start;
  for (const PlainVector4& input : inputs) {
    if (from >= end) break;
    if (count_ == kCapacity) {
      first_ = (first_ + 1) % kCapacity;
      --count_;
    }
    Piece& piece = nth(count_++);
    piece.from = from;
    piece.to = std::min(from + step, end);
    piece.input = input;
    from = piece.to;
  }
  if (now_.asked.by == AskedBy::kFallback) now_.plan_resumes = std::min(now_.plan_resumes, plan_start);
}

void InputTimeline::begin_at(Stamp from) noexcept {
  while (count_ > 0 && nth(0).to <= from) {
    first_ = (first_ + 1) % kCapacity;
    --count_;
  }
  if (count_ > 0) nth(0).from = std::max(nth(0).from, from);
}

bool InputTimeline::plans_cover(Stamp from, Stamp to) const noexcept {
  for (std::size_t i = 0; i < count_ && from < to; ++i) {
    const Piece& piece = nth(i);
    if (piece.to <= from) continue;
    if (piece.from > from) return false;
    from = piece.to;
  }
  return from >= to;
}

bool InputTimeline::covers_as(const Told& told, Stamp from, Stamp to) const noexcept {
  if (told.asked.by == AskedBy::kPlans) return plans_cover(from, to);
  return told.asked.told() && (told.plan_resumes >= to || plans_cover(std::max(from, told.plan_resumes), to));
}

bool InputTimeline::covers(Stamp from, Stamp to) const noexcept {
  if (from >= turn_) return covers_as(now_, from, to);
  if (to <= turn_) return covers_as(before_, from, to);
  return before_.asked.by == now_.asked.by && covers_as(before_, from, turn_) && covers_as(now_, turn_, to);
}

void InputTimeline::tell(Stamp last, Stamp stamp, const protocol::Asked& asked) noexcept {
  const bool goes_on = asked.by == now_.asked.by;
  before_ = now_;
  // A plan that should hold by now and does not was not heard.
  if (!goes_on || now_.plan_resumes <= stamp) now_.plan_resumes = Stamp::max();
  now_.asked = asked;
  // Where plans go on there is no turn, so that nothing changes for who flies by them alone.
  turn_ = goes_on && asked.by == AskedBy::kPlans ? Stamp::min() : last + (stamp - last) / 2;
}

PlainVector4 InputTimeline::at(Stamp stamp) const noexcept {
  PlainVector4 found = still_;
  visit(stamp, stamp + Stamp{1}, [&](const PlainVector4& input, Stamp, Stamp) { found = input; });
  return found;
}

std::vector<InputTimeline::Piece> InputTimeline::pieces(Stamp from) const {
  std::vector<Piece> pieces;
  for (std::size_t i = 0; i < count_; ++i)
    if (nth(i).to > from) pieces.push_back(nth(i));
  return pieces;
}

bool InputTimeline::restore(std::span<const Piece> pieces) noexcept {
  if (pieces.size() > kCapacity) return false;
  for (std::size_t i = 0; i < pieces.size(); ++i)
    if (pieces[i].from >= pieces[i].to || (i > 0 && pieces[i].from < pieces[i - 1].to)) return false;
  first_ = 0;
  count_ = pieces.size();
  std::copy(pieces.begin(), pieces.end(), ring_.begin());
  return true;
}

void InputTimeline::restore(const Told& told) noexcept {
  now_ = before_ = told;
  turn_ = Stamp::min();
}

}  // namespace gatefield::pilot
