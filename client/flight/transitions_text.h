#pragma once

#include <string>

/// The supervisor's table for people: what docs/safety.md shows is made here, so that it is what flies.
/// Thread-safe: yes (pure).   Real-time safe: no.
namespace gatefield::flight {

/// In Graphviz's language: a node a phase, an arrow for what leads from one to another. Phases that something leads out
/// of together stand in one box, and the arrow comes from the box.
std::string to_dot();

/// Tables of Markdown: what the phases are, and what leads from which to which, the more urgent first.
std::string to_markdown();

}  // namespace gatefield::flight
