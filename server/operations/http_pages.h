#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "common/base/result.h"

namespace gatefield::operations {

/// What a page says to somebody who asks for it.
struct HttpAnswer {
  unsigned status = 200;
  std::string type = "text/plain; charset=utf-8";
  std::string body;
};

/// A few pages over HTTP for machines that watch over a server: GET and HEAD, no more. Whoever asks is not trusted:
/// requests are short and have kPatience, and kAtOnce of them are served at a time.
/// Thread-safe: yes. Pages are made on its own thread, one at a time.   Real-time safe: no.
class HttpPages {
 public:
  static constexpr int kAtOnce = 16;
  static constexpr unsigned kPatience_s = 5;
  using Pages = std::map<std::string, std::function<HttpAnswer()>>;  ///< by path

  /// @param address  "HOST:PORT", where HOST is an address of this machine: "127.0.0.1:9464", "[::1]:9464"; port 0:
  ///                 any that is free
  /// Errors: kInvalid ("--metrics") for an address that is none or that can't be listened to.
  static Result<std::unique_ptr<HttpPages>> open(const std::string& address, Pages pages);
  ~HttpPages();
  HttpPages(const HttpPages&) = delete;
  HttpPages& operator=(const HttpPages&) = delete;

  std::uint16_t port() const noexcept;

 private:
  class Server;
  explicit HttpPages(std::unique_ptr<Server> server);
  std::unique_ptr<Server> server_;
};

}  // namespace gatefield::operations
