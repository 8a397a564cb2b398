#pragma once

#include <cassert>
#include <string>
#include <utility>
#include <variant>

namespace gatefield {

/// What went wrong outside this program (a file, a model, a peer), as one sentence a person can act on.
struct Error {
  std::string message;
};

/// A value, or the sentence that says why there is none. Can't be ignored; bugs abort instead of coming this way.
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

  /// @pre !ok()
  const std::string& error() const noexcept {
    assert(!ok());
    return std::get_if<Error>(&content_)->message;
  }

 private:
  std::variant<T, Error> content_;
};

/// Success without a value, or the sentence that says what failed.
class [[nodiscard]] Status {
 public:
  Status() = default;
  Status(Error error) : message_(std::move(error.message)), ok_(false) {}  // NOLINT(google-explicit-constructor)

  bool ok() const noexcept { return ok_; }
  explicit operator bool() const noexcept { return ok_; }
  const std::string& error() const noexcept { return message_; }

 private:
  std::string message_;
  bool ok_ = true;
};

}  // namespace gatefield
