#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "client/race/tune/search.h"
#include "common/base/result.h"

/// What a search leaves for people. Thread-safe: yes.
namespace gatefield::race {

/// The found profile as a file: complete, with where it comes from on top.
std::string found_text(const Tune& tune, std::size_t generations, const ProfileSheet& base, const ProfileSheet& found);

struct TuneReport {
  std::filesystem::path page;  ///< report.md
  std::string text;            ///< comparison and verdict, for a terminal
};
/// Writes report.md: the verdict, both profiles side by side on fresh seeds, the fields before and after, the picture
/// of the progress; and the comparison's own report.
/// @param results     of `comparison`
/// @param folder      of the search
/// @param comparison_folder  a campaign's
/// Errors: what can't be written.
Result<TuneReport> write_tune_report(const Tune& tune, const Space& space, const Search& search,
                                     const Campaign& comparison, const std::vector<TrialResult>& results,
                                     const std::filesystem::path& folder,
                                     const std::filesystem::path& comparison_folder, const ProfileSheet& found);

}  // namespace gatefield::race
