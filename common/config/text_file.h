#pragma once

#include <google/protobuf/message.h>
#include <google/protobuf/text_format.h>

#include <filesystem>
#include <string>

#include "common/base/result.h"

/// Configuration is text that people write (protobuf text format) under schemas that stand beside this file.
namespace gatefield::config {

/// Reads a protobuf text file into `message` (cleared first).
///
/// Errors, each one sentence that begins with the file's name:
///   file:line:column: what is wrong, what was expected     (syntax, wrong type, unknown field, unknown enum value)
///   file: required field 'a.b' is missing ...              (proto2 `required`)
///   file: does not exist / is a folder / can't be read / is larger than 16 MiB
/// Thread-safe: yes.   Real-time safe: no.
/// @param lines  when given: learns in which line each field stands, for the sentences of a later validation
Status load_text(const std::filesystem::path& file, google::protobuf::Message* message,
                 google::protobuf::TextFormat::ParseInfoTree* lines = nullptr);

/// The same from memory; `name` stands for the file in the sentences.
Status parse_text(const std::string& text, const std::string& name, google::protobuf::Message* message,
                  google::protobuf::TextFormat::ParseInfoTree* lines = nullptr);

/// Puts the file's name before the sentence of a failed validation: "circle.txt: gate.inner_half_m is ..., expected
/// ...".
Error in_file(const std::filesystem::path& file, const std::string& sentence);

}  // namespace gatefield::config
