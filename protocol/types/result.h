// Result<T>: a value, or the reason there is none. For everything that data, disk or network can cause;
// our own bugs are assertions.
#pragma once

#include <cassert>
#include <string>
#include <utility>
#include <variant>

namespace comap {

/// What went wrong, in the terms the command line's exit codes use.
enum class ErrorCode {
  kWrongUse,     ///< the caller asked for something that makes no sense (exit 2)
  kUnreachable,  ///< a file, device or peer cannot be reached or read (exit 3)
  kBadData,      ///< it was read, and it is damaged or not what it claims to be (exit 3)
  kProblem,      ///< it was read and understood, and it shows a problem (exit 1)
  kNoDevice,     ///< no usable Vulkan device (exit 3)
  kOutOfMemory,  ///< device or host memory ran out (exit 3)
};

/// The process exit code that belongs to `code`.
constexpr int exitCodeOf(ErrorCode code) {
  switch (code) {
    case ErrorCode::kProblem:
      return 1;
    case ErrorCode::kWrongUse:
      return 2;
    default:
      return 3;
  }
}

/// `text` names the file or field, the value found and what was expected, as one sentence without newline.
struct Error {
  ErrorCode code = ErrorCode::kProblem;
  std::string text;
};

template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : content_(std::move(value)) {}
  Result(Error error) : content_(std::move(error)) {}

  explicit operator bool() const { return std::holds_alternative<T>(content_); }
  T& value() & {
    assert(*this);
    return std::get<T>(content_);
  }
  const T& value() const& {
    assert(*this);
    return std::get<T>(content_);
  }
  T&& value() && {
    assert(*this);
    return std::get<T>(std::move(content_));
  }
  T& operator*() & { return value(); }
  const T& operator*() const& { return value(); }
  T* operator->() { return &value(); }
  const T* operator->() const { return &value(); }
  const Error& error() const {
    assert(!*this);
    return std::get<Error>(content_);
  }

 private:
  std::variant<T, Error> content_;
};

template <>
class [[nodiscard]] Result<void> {
 public:
  Result() = default;
  Result(Error error) : error_(std::move(error)), ok_(false) {}
  explicit operator bool() const { return ok_; }
  const Error& error() const {
    assert(!ok_);
    return error_;
  }

 private:
  Error error_;
  bool ok_ = true;
};

}  // namespace comap
