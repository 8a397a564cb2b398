#pragma once

#include <google/protobuf/message.h>

#include <map>
#include <string>
#include <string_view>
#include <variant>

#include "common/base/clock.h"
#include "common/base/result.h"

namespace gatefield::bridge {

/// Where a field's value goes: as it is, or seconds as a Stamp, or a number of eight or 32 bits that has no sign.
using Place = std::variant<bool*, int*, std::uint8_t*, std::uint32_t*, double*, Stamp*, std::string*>;

/// Writes what a person wrote into a message's plain fields to their places; what is left out keeps its default there.
/// Enums and messages inside are the caller's. A plain field without a place aborts, so that none is forgotten.
/// Errors: kInvalid with the field, for numbers that don't fit the place: below 0 or above it where there is no sign,
/// and times beyond a million seconds.
/// Thread-safe: yes.   Real-time safe: no.
Status take_fields(const google::protobuf::Message& message, const std::map<std::string_view, Place>& places);

}  // namespace gatefield::bridge
