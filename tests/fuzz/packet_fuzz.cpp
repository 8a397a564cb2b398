// libFuzzer over what comes in from the network, before the DDS library reads it: what the check lets through, another
// reader finds within bounds; a second look at it finds the same; and no packet of Fast DDS that ends with statistics
// keeps them. In a closed domain what passed once passes again.

#include <cstdlib>
#include <iostream>
#include <span>

#include "common/dds/announcements.h"
#include "common/dds/closed_domain.h"
#include "common/dds/packet_check.h"
#include "tests/support/rtps_walk.h"

namespace {

[[noreturn]] void bug(const std::string& what) {
  std::cerr << what << '\n';
  std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace gatefield;
  const dds::PacketVerdict verdict = dds::check_packet({data, size});
  if (dds::sentence(verdict.fault).empty()) bug("a fault without words");
  if (verdict.fault != dds::PacketFault::kNone) return 0;
  if (verdict.size > size) bug("more was let through than came");
  const std::span<const std::uint8_t> passed(data, verdict.size);
  if (const std::string wrong = test::RtpsWalk::complaint(passed); !wrong.empty()) bug(wrong + " was let through");
  const dds::PacketVerdict again = dds::check_packet(passed);
  if (again.fault != dds::PacketFault::kNone || again.size != verdict.size) bug("a second look finds something else");

  if (dds::says_goodbye(passed)) return 0;
  dds::ClosedDomain closed;
  const dds::PacketFault first = closed.check(passed, Stamp{1}).fault;
  if (dds::sentence(first).empty()) bug("a fault of a closed domain without words");
  if (closed.check(passed, Stamp{2}).fault != first) bug("a closed domain changes its mind");
  return 0;
}
