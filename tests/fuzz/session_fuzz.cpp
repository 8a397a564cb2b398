// libFuzzer over who may say what: the bytes are a story of replies, commands, requests and samples from several
// participants. What the client's and the server's side of the session protocol promise has to hold after each of them.

#include <fuzzer/FuzzedDataProvider.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <iostream>
#include <map>
#include <optional>
#include <string>

#include "client/sdk/session_logic.h"
#include "common/dds/speakers.h"

namespace {

using namespace gatefield;
using dds::ParticipantId;
using dds::SampleFault;

constexpr int kLongestStory = 400;
constexpr std::uint8_t kPeople = 4;

[[noreturn]] void bug(const std::string& what) {
  std::cerr << what << '\n';
  std::abort();
}

ParticipantId person(FuzzedDataProvider* story) {
  ParticipantId id;
  id.bytes[0] = static_cast<std::uint8_t>(1 + story->ConsumeIntegralInRange<int>(0, kPeople - 1));
  return id;
}

Stamp later(FuzzedDataProvider* story, Stamp now) {
  return now + std::chrono::milliseconds(story->ConsumeIntegralInRange<int>(0, 600));
}

/// The client's side: whatever strangers say, the session changes only by what SessionLogic tells of.
void client_story(FuzzedDataProvider* story) {
  using sdk::SessionLogic;
  SessionLogic logic(story->ConsumeBool() ? ~std::uint64_t{0} : 1);  // numbers may run over
  std::map<std::uint64_t, std::uint64_t> newest;                     // command by session
  Stamp now{0};
  for (int line = 0; line < kLongestStory && story->remaining_bytes() > 0; ++line) {
    now = later(story, now);
    const auto phase = logic.phase();
    const sdk::Ear ear = logic.ear();
    const ParticipantId server = logic.server();
    const std::uint64_t session = logic.session().session;
    const std::uint64_t reconnects = logic.reconnects();
    const std::uint64_t take_overs = logic.take_overs();
    bool told = false, inherited = false;
    switch (story->ConsumeIntegralInRange<int>(0, 3)) {
      case 0:
        if (logic.request_due(now) && phase == SessionLogic::Phase::kFailed) bug("asks again after it failed");
        break;
      case 1: {
        protocol::SessionReply reply;
        reply.request = logic.request() + story->ConsumeIntegralInRange<int>(-1, 1);
        reply.accepted = story->ConsumeBool();
        reply.code = static_cast<ErrorCode>(story->ConsumeIntegralInRange<int>(0, 14));
        reply.session = story->ConsumeIntegralInRange<std::uint64_t>(1, 5);
        reply.server = story->ConsumeBool() ? "a" : "b";
        reply.control_period_s = 0.02;
        if (story->ConsumeBool()) reply.heir = person(story).bytes;
        const ParticipantId from = person(story);
        told = logic.on_reply(reply, from, now);
        const bool stranger = phase == SessionLogic::Phase::kJoined && from != server;
        if (stranger && (told || logic.phase() != phase)) bug("a stranger's reply changed the session");
        if (told && logic.phase() != SessionLogic::Phase::kJoined) bug("a new session, and not joined");
        break;
      }
      case 2:
        told = logic.on_state_sent(now);
        break;
      default: {
        protocol::ThrustRateCommand command;
        command.session = story->ConsumeIntegralInRange<std::uint64_t>(0, 5);
        command.sequence = story->ConsumeIntegralInRange<std::uint64_t>(0, 50);
        const ParticipantId from = person(story);
        const auto heard = logic.on_command(command, from, now);
        inherited = logic.take_overs() != take_overs;
        if (inherited && (from == server || from != ear.heir || logic.take_overs() != take_overs + 1))
          bug("somebody goes on with the session whom the server did not name");
        if (inherited) newest.clear();  // the heir counts on from what it knows of
        if (heard != SessionLogic::Heard::kForeign && !ear.hears(from, now)) bug("a stranger's command is heard");
        if (heard == SessionLogic::Heard::kNew) {
          if (command.session != logic.session().session) bug("a command of another session is new");
          if (const auto found = newest.find(command.session);
              found != newest.end() && logic.session().session == session && command.sequence <= found->second)
            bug("an old command is new");
          newest[command.session] = command.sequence;
        }
        if (phase == SessionLogic::Phase::kFailed && heard != SessionLogic::Heard::kForeign)
          bug("hears commands after it failed");
      }
    }
    if (told) newest.clear();
    if (logic.request() == 0) bug("a request without a number");
    if (!told && ((logic.server() != server && !inherited) || logic.session().session != session))
      bug("the session changed and nobody was told");
    if (logic.reconnects() < reconnects || logic.reconnects() > reconnects + (told ? 1 : 0))
      bug("reconnects miscounted");
    if (phase == SessionLogic::Phase::kFailed && logic.phase() != phase) bug("alive after it failed");
  }
}

/// The server's side: who speaks is who claimed, and nobody takes more than there is for one.
void server_story(FuzzedDataProvider* story) {
  constexpr dds::SpeakerLimits kLimits{};
  dds::Speakers speakers(kLimits);
  std::map<std::string, ParticipantId> owner;  // of a bound session
  std::map<ParticipantId, std::map<std::string, std::uint64_t>> claims;
  Stamp now{0};
  for (int line = 0; line < kLongestStory && story->remaining_bytes() > 0; ++line) {
    now = later(story, now);
    const ParticipantId from = person(story);
    const std::string vehicle = "v" + std::to_string(story->ConsumeIntegralInRange<int>(0, 11));
    const auto number = story->ConsumeIntegralInRange<std::uint64_t>(0, 3);
    dds::Speakers::Instance instance{};
    instance[0] = static_cast<std::uint8_t>(vehicle[1]);
    instance[1] = static_cast<std::uint8_t>(vehicle.size());
    switch (story->ConsumeIntegralInRange<int>(0, 6)) {
      case 0:
        if (speakers.may_ask(from, vehicle, now) == SampleFault::kNone) {
          claims[from].try_emplace(vehicle, 0);
          if (claims[from].size() > kLimits.names) bug("asks for more names than it may");
        }
        break;
      case 1: {
        const bool mine = std::none_of(claims.begin(), claims.end(), [&](const auto& one) {
          const auto found = one.second.find(vehicle);
          return number != 0 && one.first != from && found != one.second.end() && found->second == number;
        });
        if (speakers.claim(from, vehicle, number, instance) != mine) bug("a number is given to two, or to nobody");
        if (const auto found = claims[from].find(vehicle); mine && found != claims[from].end()) found->second = number;
        break;
      }
      case 2: {
        const auto released = speakers.release(from, instance);
        if (!released) break;
        if (released->from != from) bug("somebody else's request was withdrawn");
        claims[from].erase(released->vehicle);
        break;
      }
      case 3:
        for (const auto& gone : speakers.forget(from))
          if (gone.from != from) bug("somebody else's request went with him");
        claims.erase(from);
        break;
      case 4:
        if (number == 0) break;  // no request has it
        speakers.bind(vehicle, number);
        for (const auto& [who, names] : claims)
          if (const auto found = names.find(vehicle); found != names.end() && found->second == number)
            owner[vehicle] = who;
        break;
      case 5:
        speakers.unbind(vehicle);
        owner.erase(vehicle);
        break;
      default: {
        const SampleFault fault = speakers.may_speak(from, vehicle, story->ConsumeIntegral<std::uint16_t>(), now);
        const auto found = owner.find(vehicle);
        const bool elsewhere = found == owner.end() && claims[from].contains(vehicle);
        const bool stranger = !elsewhere && (found == owner.end() || found->second != from);
        if (elsewhere != (fault == SampleFault::kElsewhere)) bug("who asked here is taken for somebody else");
        if (stranger != (fault == SampleFault::kStranger)) bug("a stranger speaks, or an owner doesn't");
      }
    }
    if (speakers.may_send_fragments(from, ~std::uint32_t{0}) !=
        std::any_of(owner.begin(), owner.end(), [&](const auto& one) { return one.second == from; }))
      bug("large samples of who has no session, or none of who has one");
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzedDataProvider story(data, size);
  if (story.ConsumeBool())
    client_story(&story);
  else
    server_story(&story);
  return 0;
}
