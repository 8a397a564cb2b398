#include "common/dds/packet_check.h"

namespace gatefield::dds {

std::string_view sentence(PacketFault fault) noexcept {
  switch (fault) {
    case PacketFault::kNone:
      return "nothing";
    case PacketFault::kHeader:
      return "it is no RTPS message of version 2";
    case PacketFault::kCut:
      return "a submessage goes beyond the packet's end";
    case PacketFault::kTooShort:
      return "a submessage is shorter than its fields";
    case PacketFault::kVendor:
      return "a vendor's submessage stands where none may";
    case PacketFault::kSequence:
      return "a sequence number is out of range";
    case PacketFault::kRange:
      return "a range of sequence numbers is turned round or too wide";
    case PacketFault::kFragment:
      return "fragments don't fit their sample, or it is too large";
    case PacketFault::kParameters:
      return "a list of parameters has no end";
    case PacketFault::kFlags:
      return "flags exclude each other";
    case PacketFault::kSource:
      return "it goes on in another participant's name";
    case PacketFault::kFilter:
      return "it answers for the reader's filter";
    case PacketFault::kKey:
      return "a key stands alone and disposes of nothing";
    case PacketFault::kToken:
      return "a security token or handshake says more than it has";
    case PacketFault::kUnprotected:
      return "it is not encrypted for this receiver, and the domain is closed to strangers";
    case PacketFault::kAnnouncement:
      return "it announces a participant other than that one does itself";
    case PacketFault::kUnread:
      return "the DDS library could not read it";
    case PacketFault::kStranger:
      return "fragments of a large sample of somebody without a session";
  }
  return "";
}

}  // namespace gatefield::dds
