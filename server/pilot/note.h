#pragma once

#include <string>

#include "common/base/result.h"

namespace gatefield::pilot {

/// Something that is told to people, telemetry and log: what was wrong with what came in, or why nothing goes out.
struct Note {
  ErrorCode code = ErrorCode::kOther;
  std::string field;     ///< of the message, dotted; empty: no field's fault
  std::string sentence;  ///< for people; programs go by code and field
};

/// @param what  begins the sentence: which kind of sample it was
inline Note note_of(const char* what, const Error& error) {
  return {error.code, error.field, std::string(what) + ": " + error.message};
}

}  // namespace gatefield::pilot
