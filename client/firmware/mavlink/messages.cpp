#include "client/firmware/mavlink/messages.h"

#include <algorithm>
#include <utility>

namespace gatefield::firmware::mavlink {
namespace {

template <typename Kind>
consteval Definition definition() {
  static_assert(in_wire_order<Kind>());
  return {Kind::kId, Kind::kName, crc_extra<Kind>(), static_cast<std::uint8_t>(base_length<Kind>()),
          static_cast<std::uint8_t>(payload_length<Kind>())};
}

template <std::size_t... kIndex>
consteval auto all_definitions(std::index_sequence<kIndex...>) {
  return std::array{definition<std::variant_alternative_t<kIndex, Message>>()...};
}

constexpr auto kDefinitions = all_definitions(std::make_index_sequence<std::variant_size_v<Message>>());
static_assert(std::ranges::is_sorted(kDefinitions, {}, &Definition::id), "looked up by bisection");

}  // namespace

const std::array<Definition, std::variant_size_v<Message>>& definitions() noexcept { return kDefinitions; }

const Definition* find_definition(std::uint32_t id) noexcept {
  const auto* const found = std::ranges::lower_bound(kDefinitions, id, {}, &Definition::id);
  return found != kDefinitions.end() && found->id == id ? found : nullptr;
}

}  // namespace gatefield::firmware::mavlink
