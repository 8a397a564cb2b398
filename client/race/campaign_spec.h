#pragma once

#include <google/protobuf/text_format.h>

#include <filesystem>

#include "client/race/campaign.h"

namespace gatefield::race {

class CampaignFile;  // of campaign.proto

/// A campaign that stands in a text that was read already, a file of its own or part of another one.
/// @param file   what its names are relative to, and how the sentences begin
/// @param lines  where its fields stand there
/// Errors: as load_campaign().
Result<Campaign> make_campaign(const std::filesystem::path& file, const CampaignFile& spec,
                               const google::protobuf::TextFormat::ParseInfoTree& lines);

}  // namespace gatefield::race
