#pragma once

#include <string>

#include "common/base/result.h"

namespace gatefield::pilot {

/// Something that is told to people, telemetry and log: what was wrong with what came in, or why nothing goes out.
struct Note {
  ErrorCode code = ErrorCode::kOther;
  std::string field;          ///< of the message, dotted; empty: no field's fault
  std::string sentence;       ///< for people; programs go by code and field
  std::string value = {};     ///< the field's value as text; empty: none
  std::string expected = {};  ///< what would have been right; empty: the sentence says it
};

/// @param what  begins the sentence: which kind of sample it was
inline Note note_of(const char* what, const Error& error) {
  return {error.code, error.field, std::string(what) + ": " + error.message, error.value, error.expected};
}

}  // namespace gatefield::pilot
