#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "client/firmware/mavlink/frame.h"
#include "common/base/random.h"

namespace gatefield::test {

namespace mavlink = firmware::mavlink;

/// A message in words, as tests/conformance/mavlink/peer.js says them: NAME field=value ..., in the order of the wire;
/// floats as their bits, arrays with commas, text up to its end.
std::string words_of(const mavlink::Message& message);

/// A message of the kind definitions()[kind] with every field drawn: any integer, floats and letters.
mavlink::Message drawn_message(std::size_t kind, Random* random);

/// Every alternative of the variant by its index, with its defaults.
mavlink::Message empty_message(std::size_t kind);

std::string hex(std::span<const std::uint8_t> bytes);
std::vector<std::uint8_t> unhex(std::string_view digits);

}  // namespace gatefield::test
