#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <variant>

namespace gatefield {

/// The kind of a failure: what a program decides by, where people read the sentence. The numbers travel on the wire
/// (SessionReply.code, Telemetry.last_code): new ones go to the end, none is used again.
enum class ErrorCode : std::uint8_t {
  kOther = 0,          ///< nothing to decide by; the sentence says what it was
  kInvalid = 1,        ///< a field's value is out of its range or contradicts another field
  kUnknownName = 2,    ///< a name that is none of those known: a profile, a model, a unit
  kUnreadable = 3,     ///< a file that is missing, can't be read or written, or is malformed
  kVersion = 4,        ///< the peer speaks another version of the protocol
  kUnsupported = 5,    ///< understood, and not offered by this build, machine or model
  kBusyName = 6,       ///< another client flies under this name; may pass
  kBusyServer = 7,     ///< the server flies as many vehicles as it may; may pass
  kNoAnswer = 8,       ///< nobody answered in time
  kLeaving = 9,        ///< the server is shutting down
  kAbandoned = 10,     ///< the session ended because nothing came for too long
  kWrongSession = 11,  ///< a sample of a session that is not the vehicle's
  kNotRising = 12,     ///< a sequence number or stamp that went backwards or jumped
  kFrame = 13,         ///< a depth frame of which nothing can be learned, or that fits no known pose
  kNotAnswering = 14,  ///< a process or thread of ours that ended or hangs
};

/// True for what may be gone a moment later: trying again makes sense.
constexpr bool may_pass(ErrorCode code) noexcept {
  return code == ErrorCode::kBusyName || code == ErrorCode::kBusyServer || code == ErrorCode::kNoAnswer;
}

/// What went wrong outside this program (a file, a model, a peer): a code and a field for programs, a sentence for
/// people. Code never searches the sentence.
struct Error {
  std::string message;                 ///< one sentence a person can act on
  ErrorCode code = ErrorCode::kOther;  ///< its kind
  std::string field;                   ///< dotted path of what was wrong ("quadrotor.mass_kg"); empty: no field's fault
  std::string value;                   ///< the field's value as text; empty: none
  std::string expected;                ///< what would have been right; empty: the sentence says it
  std::string file;                    ///< of a text that a person wrote: where it went wrong; empty: in none
  int line = 0;                        ///< in that file, from 1; 0: not known

  explicit Error(std::string sentence, ErrorCode kind = ErrorCode::kOther, std::string of_field = {})
      : message(std::move(sentence)), code(kind), field(std::move(of_field)) {}

  /// "<field> is <value>, expected <expected>", the sentence of nearly every check.
  static Error invalid(std::string field, std::string value, std::string expected,
                       ErrorCode code = ErrorCode::kInvalid) {
    Error error(field + " is " + value + ", expected " + expected, code);
    error.field = std::move(field);
    error.value = std::move(value);
    error.expected = std::move(expected);
    return error;
  }

  /// The same failure told from one level higher: "<where><message>", and the field's path grows with `path`.
  Error within(const std::string& where, const std::string& path = {}) const {
    Error error = *this;
    error.message = where + message;
    error.file.clear();  // the place stands in mid-sentence now
    error.line = 0;
    error.place_length_ = 0;
    if (!field.empty()) error.field = path + field;
    return error;
  }

  /// The same failure with its place in a text before the sentence: "course.txt:3:7: gate.inner_half_m is ...". A place
  /// in the same file gives way, since a line is found later than the file; one in another file stays in the sentence.
  /// @param of_line, of_column  from 1; 0: not known
  /// @param within              what stands between place and sentence: "cell 'a': "
  Error at(const std::string& in_file, int of_line = 0, int of_column = 0, const std::string& within = {}) const {
    std::string place = in_file;
    if (of_line > 0) place.append(":").append(std::to_string(of_line));
    if (of_line > 0 && of_column > 0) place.append(":").append(std::to_string(of_column));
    place.append(": ");
    Error error = *this;
    error.message = place + within + (file == in_file ? message.substr(place_length_) : message);
    error.file = in_file;
    error.line = of_line;
    error.place_length_ = place.size();
    return error;
  }

 private:
  std::size_t place_length_ = 0;  ///< how much of the message is the place
};

/// A value, or why there is none. Can't be ignored; bugs abort instead of coming this way.
/// Thread-safe: as T.   Real-time safe: reading yes, constructing an Error allocates.
template <typename T>
class [[nodiscard]] Result {
 public:
  Result(T value) : content_(std::move(value)) {}      // NOLINT(google-explicit-constructor): reads like a return value
  Result(Error error) : content_(std::move(error)) {}  // NOLINT(google-explicit-constructor)

  bool ok() const noexcept { return std::holds_alternative<T>(content_); }
  explicit operator bool() const noexcept { return ok(); }

  /// @pre ok()
  const T& value() const& noexcept {
    assert(ok());
    return *std::get_if<T>(&content_);
  }
  T& value() & noexcept {
    assert(ok());
    return *std::get_if<T>(&content_);
  }
  T&& value() && noexcept {
    assert(ok());
    return std::move(*std::get_if<T>(&content_));
  }
  const T& operator*() const& noexcept { return value(); }
  const T* operator->() const noexcept { return &value(); }

  /// The sentence. @pre !ok()
  const std::string& error() const noexcept { return failure().message; }
  /// Code, field and sentence. @pre !ok()
  const Error& failure() const noexcept {
    assert(!ok());
    return *std::get_if<Error>(&content_);
  }

 private:
  std::variant<T, Error> content_;
};

/// Success without a value, or why it failed.
class [[nodiscard]] Status {
 public:
  Status() = default;
  Status(Error error) : failure_(std::move(error)) {}  // NOLINT(google-explicit-constructor)

  bool ok() const noexcept { return !failure_.has_value(); }
  explicit operator bool() const noexcept { return ok(); }

  /// The sentence; empty on success.
  const std::string& error() const noexcept {
    static const std::string kNone;
    return failure_ ? failure_->message : kNone;
  }
  /// Code, field and sentence. @pre !ok()
  const Error& failure() const noexcept {
    assert(!ok());
    return *failure_;
  }

 private:
  std::optional<Error> failure_;
};

}  // namespace gatefield
