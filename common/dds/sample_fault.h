#pragma once

#include <cstdint>
#include <string_view>

namespace gatefield::dds {

/// Why a sample is not taken from whom it came.
enum class SampleFault : std::uint8_t {
  kNone,
  kStranger,      ///< another participant has the vehicle's session, or nobody; or the number is another's
  kTooManyNames,  ///< more vehicles than one participant, or all together, may ask for
  kTooOften,      ///< more requests, samples or bytes a second than one may send
  kElsewhere,     ///< of a vehicle that asked here, too, and flies with another server: nobody's fault
};
/// For people: "another participant has its session, or nobody".
std::string_view sentence(SampleFault fault) noexcept;

}  // namespace gatefield::dds
