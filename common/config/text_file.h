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
/// Errors, each one sentence that begins with the file's name, with file and line in the Error:
///   kUnreadable  file:line:column: what was found, what was expected       (syntax, wrong type)
///                file: does not exist / is a folder / can't be read / is larger than 16 MiB
///   kInvalid     file:line:column: unknown field, unknown enum value       (with the field)
///                file: required field 'a.b' is missing ...                 (proto2 `required`; with the field)
/// Thread-safe: yes.   Real-time safe: no.
/// @param lines  when given: learns in which line each field stands, for the sentences of a later validation
Status load_text(const std::filesystem::path& file, google::protobuf::Message* message,
                 google::protobuf::TextFormat::ParseInfoTree* lines = nullptr);

/// The same from memory; `name` stands for the file in the sentences.
Status parse_text(const std::string& text, const std::string& name, google::protobuf::Message* message,
                  google::protobuf::TextFormat::ParseInfoTree* lines = nullptr);

/// A failed validation of what stands in a file: "circle.txt: gate.inner_half_m is ..., expected ...". A place that the
/// error has in this file already stays.
Error in_file(const std::filesystem::path& file, const Error& error);

}  // namespace gatefield::config
