#pragma once

#include <cstddef>

namespace gatefield::test {

/// Counts calls of the global operator new made by this thread while it lives (tests/support/allocation_trap.cpp
/// replaces the operators of the test program that links it).
class AllocationTrap {
 public:
  AllocationTrap();
  ~AllocationTrap();
  std::size_t count() const;
};

}  // namespace gatefield::test
