#pragma once

#include <filesystem>
#include <string>

#include "common/base/result.h"

/// What gatefield-train's commands share. Each command is add_<name>_command(app, exit_code): it declares its options
/// and leaves 0, kBadInput or kStopped in *exit_code when it ran.
namespace gatefield::training {

inline constexpr int kBadInput = 2;
inline constexpr int kStopped = 130;

inline constexpr std::uint64_t kTrainSeed = 1;
inline constexpr std::uint64_t kHeldOutSeed = 1'000'003;        ///< never trained on, never selected by
inline constexpr std::uint64_t kRoundHeldOutSeed = 1'000'033;   ///< the same, all gates round
inline constexpr std::uint64_t kSelectionSeed = 2'000'003;      ///< what designs are chosen by
inline constexpr std::uint64_t kStereoTrainSeed = 21;           ///< rooms, textures and courses of the second sensor
inline constexpr std::uint64_t kStereoHeldOutSeed = 1'000'021;  ///< others of them

/// Ctrl-C and SIGTERM set stop_requested (train_loop.h); every long stage looks at it.
void stop_on_signals();

/// Prints the sentence; returns kBadInput.
int fail(const std::string& sentence);
/// Says that `what` goes on where it stopped; returns kStopped.
int stopped(const std::string& what);

/// Makes the folder that a file will lie in. Error: can't be made.
Status make_folder(const std::filesystem::path& folder);

}  // namespace gatefield::training
