#include "client/flight/transitions_text.h"

#include <array>
#include <string_view>
#include <utility>
#include <vector>

#include "client/flight/transitions.h"

namespace gatefield::flight {
namespace {

struct Box {
  PhaseSet phases;
  std::string_view id, label;
};
/// Each lies in the one before it.
constexpr std::array<Box, 4> kBoxes{{{kAlive, "cluster_alive", "whatever it does"},
                                     {kInTheAir, "cluster_air", "in the air"},
                                     {kByState, "cluster_state", "flown by state"},
                                     {kOnward, "cluster_onward", "towards the race"}}};

struct Look {
  std::string_view fill, line;
};
Look look(Phase phase) noexcept {
  if (phase == Phase::kKilled) return {"#f4a582", "#b2182b"};
  if (phase == Phase::kYielded) return {"#a6dba0", "#1b7837"};
  if (phase == Phase::kBraking || phase == Phase::kDescending || phase == Phase::kLevelDescent)
    return {"#fee0b6", "#b35806"};
  return contains(kInTheAir, phase) ? Look{"#d1e5f0", "#2166ac"} : Look{"#f0f0f0", "#404040"};
}

template <typename Do>
void for_each_phase(PhaseSet phases, Do&& act) {
  for (std::size_t i = 0; i < kPhases; ++i)
    if (contains(phases, static_cast<Phase>(i))) act(static_cast<Phase>(i));
}

std::string quoted(std::string_view text) { return '"' + std::string(text) + '"'; }

/// "hand over": names read as words in a picture.
std::string words(std::string_view name) {
  std::string out(name);
  for (char& c : out)
    if (c == '_') c = ' ';
  return out;
}

/// One arrow of the picture, with all the causes that lead along it.
struct Arrow {
  const Box* box;  // null: from a phase
  Phase from, to;
  std::string label;
};

void add(std::vector<Arrow>* arrows, const Arrow& next) {
  for (Arrow& arrow : *arrows)
    if (arrow.box == next.box && arrow.from == next.from && arrow.to == next.to) {
      arrow.label += "\\n" + next.label;
      return;
    }
  arrows->push_back(next);
}

std::vector<Arrow> arrows() {
  std::vector<Arrow> all;
  for (const Transition& transition : transitions()) {
    const std::string label = words(name(transition.cause));
    PhaseSet rest = transition.from;
    for (const Box& box : kBoxes)
      if ((rest & box.phases) == box.phases) {
        // An arrow out of a box needs a phase in it to begin at.
        Phase inside{};
        for_each_phase(box.phases, [&](Phase phase) { inside = phase; });
        if (box.phases == kByState) inside = Phase::kRacing;
        if (box.phases == kOnward) inside = Phase::kTakeOff;
        add(&all, {&box, inside, transition.to, label});
        rest = static_cast<PhaseSet>(rest & ~box.phases);
      }
    for_each_phase(rest, [&](Phase phase) { add(&all, {nullptr, phase, transition.to, label}); });
  }
  return all;
}

std::string phase_list(PhaseSet phases) {
  for (const Box& box : kBoxes)
    if (phases == box.phases) return "*" + std::string(box.label) + "*";
  std::string list;
  for_each_phase(phases, [&](Phase phase) { list += (list.empty() ? "`" : ", `") + std::string(name(phase)) + "`"; });
  return list;
}

}  // namespace

std::string to_dot() {
  std::string out =
      "digraph supervisor {\n"
      "  compound=true; rankdir=TB; nodesep=0.35; ranksep=0.55; fontname=\"Helvetica\"; fontsize=13;\n"
      "  node [shape=box style=\"rounded,filled\" fontname=\"Helvetica\" fontsize=14 margin=\"0.15,0.08\"];\n"
      "  edge [fontname=\"Helvetica\" fontsize=11];\n";
  std::string close;
  for (std::size_t i = 0; i < kBoxes.size(); ++i) {
    const Box& box = kBoxes[i];
    const std::string indent(2 * i + 2, ' ');
    out.append(indent).append("subgraph ").append(box.id).append(" {\n");
    out.append(indent)
        .append("  label=")
        .append(quoted(box.label))
        .append("; style=\"rounded,dashed\"; color=\"#808080\";\n");
    const PhaseSet inner = i + 1 < kBoxes.size() ? kBoxes[i + 1].phases : PhaseSet{0};
    for_each_phase(static_cast<PhaseSet>(box.phases & ~inner), [&](Phase phase) {
      out.append(indent).append("  ").append(name(phase)).append(" [label=").append(quoted(words(name(phase))));
      out.append(" fillcolor=").append(quoted(look(phase).fill)).append("];\n");
    });
    close.insert(0, indent + "}\n");
  }
  out += close;
  out.append("  killed [label=\"killed\" fillcolor=").append(quoted(look(Phase::kKilled).fill)).append("];\n");
  for (const Arrow& arrow : arrows()) {
    out.append("  ")
        .append(name(arrow.from))
        .append(" -> ")
        .append(name(arrow.to))
        .append(" [label=\"" + arrow.label + "\"");
    if (arrow.box) out.append(" ltail=").append(arrow.box->id);
    out.append(" color=").append(quoted(look(arrow.to).line)).append(" fontcolor=").append(quoted(look(arrow.to).line));
    out.append("];\n");
  }
  return out + "}\n";
}

std::string to_markdown() {
  std::string out = "| phase | what the vehicle does |\n| --- | --- |\n";
  for_each_phase(kAlive | Phase::kKilled, [&](Phase phase) {
    out.append("| `").append(name(phase)).append("` | ").append(sentence(phase)).append(" |\n");
  });
  out += "\n| from | cause | to | |\n| --- | --- | --- | --- |\n";
  for (const Transition& transition : transitions()) {
    out.append("| ").append(phase_list(transition.from)).append(" | `").append(name(transition.cause)).append("` | `");
    out.append(name(transition.to)).append("` | ").append(sentence(transition.cause)).append(" |\n");
  }
  return out;
}

}  // namespace gatefield::flight
