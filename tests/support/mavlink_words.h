#pragma once

#include <cstdint>
#include <functional>
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

/// Calls `use` with every message that has one number out of range: of each element of each number that is checked NaN
/// (unless that means not known), the infinities, and what lies just beyond either end; with the field's full name.
void for_each_faulty_message(const std::function<void(const std::string& name, const mavlink::Message&)>& use);

/// Calls `use` with every message that has one of its whole numbers at an end of its type; of those of 8 bits, which
/// are enumerations and bits mostly, at each of their values. Some are out of range, most are not.
void for_each_extreme_message(const std::function<void(const std::string& name, const mavlink::Message&)>& use);

std::string hex(std::span<const std::uint8_t> bytes);
std::vector<std::uint8_t> unhex(std::string_view digits);

}  // namespace gatefield::test
