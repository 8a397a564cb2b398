// The second half of a pilot's race of one lap in a process of its own: move_test.cpp starts it.
// usage: pilot_flies_on STATE_FILE lockstep|real-time FIRST_STEPS STEPS
// Brings the client's side of the flight to where it was, restores a new pilot from the file, and writes the commands
// of the steps that follow.

#include <fstream>
#include <iostream>
#include <iterator>

#include "tests/unit/server/pilot/flight.h"

int main(int argc, char** argv) {
  using namespace gatefield;
  if (argc != 5) return 2;
  std::ifstream file(argv[1], std::ios::binary);
  const std::string state{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  const auto timing = std::string(argv[2]) == "lockstep" ? protocol::Timing::kLockstep : protocol::Timing::kRealTime;
  pilot::testing::Flight flight(timing, {}, 1);
  flight.fly(flight.make_pilot().get(), std::stoi(argv[3]));
  const auto moved = flight.make_pilot();
  if (const Status status = moved->restore(state); !status) {
    std::cout << status.error() << "\n";
    return 1;
  }
  for (const std::string& command : flight.fly(moved.get(), std::stoi(argv[4]))) std::cout << command << "\n";
  return 0;
}
