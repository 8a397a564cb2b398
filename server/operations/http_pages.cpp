#include "server/operations/http_pages.h"

#include <pthread.h>

#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <charconv>
#include <chrono>
#include <optional>
#include <thread>
#include <utility>

namespace gatefield::operations {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using asio::ip::tcp;
using boost::system::error_code;

constexpr std::size_t kLongestHeader = 8192;

Error bad_address(const std::string& address, const std::string& why) {
  Error error = Error::invalid("--metrics", "\"" + address + "\"", "HOST:PORT, as in 127.0.0.1:9464");
  error.message += " (" + why + ")";
  return error;
}

Result<tcp::endpoint> endpoint_of(const std::string& address) {
  const std::size_t colon = address.rfind(':');
  if (colon == std::string::npos) return bad_address(address, "there is no port");
  std::string host = address.substr(0, colon);
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
  const std::string digits = address.substr(colon + 1);
  std::uint16_t port = 0;
  const auto [end, failed] = std::from_chars(digits.data(), digits.data() + digits.size(), port);
  if (failed != std::errc() || end != digits.data() + digits.size() || digits.empty())
    return bad_address(address, "the port is no number from 0 to 65535");
  error_code error;
  const auto parsed = asio::ip::make_address(host, error);
  if (error) return bad_address(address, "the host is no address: names are not looked up");
  return tcp::endpoint(parsed, port);
}

/// One who asks: a request, an answer, and goodbye.
class Visit : public std::enable_shared_from_this<Visit> {
 public:
  Visit(tcp::socket socket, const HttpPages::Pages& pages, int* visits)
      : stream_(std::move(socket)), pages_(pages), visits_(visits) {
    ++*visits_;
    parser_.header_limit(kLongestHeader);
    parser_.body_limit(0);
  }
  ~Visit() { --*visits_; }
  Visit(const Visit&) = delete;
  Visit& operator=(const Visit&) = delete;

  void begin() {
    stream_.expires_after(std::chrono::seconds(HttpPages::kPatience_s));
    http::async_read(stream_, buffer_, parser_, [self = shared_from_this()](beast::error_code error, std::size_t) {
      if (!error) self->answer();
    });
  }

 private:
  void answer() {
    const auto& request = parser_.get();
    const HttpAnswer answer = page(request.method(), std::string(request.target()));
    response_.version(request.version());
    response_.result(answer.status);
    response_.set(http::field::content_type, answer.type);
    response_.set(http::field::cache_control, "no-store");
    response_.keep_alive(false);
    response_.body() = answer.body;
    response_.prepare_payload();
    if (request.method() == http::verb::head) response_.body().clear();  // its length stays
    stream_.expires_after(std::chrono::seconds(HttpPages::kPatience_s));
    http::async_write(stream_, response_, [self = shared_from_this()](beast::error_code, std::size_t) {
      error_code ignored;
      self->stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
    });
  }

  HttpAnswer page(http::verb verb, const std::string& target) const {
    if (verb != http::verb::get && verb != http::verb::head) return {405, HttpAnswer().type, "expected GET or HEAD\n"};
    const auto found = pages_.find(target.substr(0, target.find('?')));
    if (found != pages_.end()) return made(found->second);
    std::string known;
    for (const auto& [path, unused] : pages_) known += (known.empty() ? "" : ", ") + path;
    return {404, HttpAnswer().type, "there is " + known + "\n"};
  }

  /// What a page throws must not end the server.
  static HttpAnswer made(const std::function<HttpAnswer()>& page) {
    try {
      return page();
    } catch (const std::exception& error) {
      return {500, HttpAnswer().type, std::string(error.what()) + "\n"};
    }
  }

  beast::tcp_stream stream_;
  const HttpPages::Pages& pages_;
  int* const visits_;
  beast::flat_buffer buffer_{2 * kLongestHeader};
  http::request_parser<http::empty_body> parser_;
  http::response<http::string_body> response_;
};

}  // namespace

class HttpPages::Server {
 public:
  explicit Server(Pages pages) : pages_(std::move(pages)) {}
  ~Server() {
    context_.stop();
    if (thread_.joinable()) thread_.join();
  }

  Status listen(const std::string& address) {
    const auto endpoint = endpoint_of(address);
    if (!endpoint) return endpoint.failure();
    error_code error;
    const auto step = [&](auto&& call) {
      if (!error) call();
    };
    step([&] { acceptor_.open(endpoint->protocol(), error); });
    step([&] { acceptor_.set_option(asio::socket_base::reuse_address(true), error); });
    step([&] { acceptor_.bind(*endpoint, error); });
    step([&] { acceptor_.listen(kAtOnce, error); });
    if (error) return bad_address(address, error.message());
    port_ = acceptor_.local_endpoint(error).port();
    accept();
    thread_ = std::thread([this] {
      pthread_setname_np(pthread_self(), "http");
      context_.run();
    });
    return {};
  }
  std::uint16_t port() const noexcept { return port_; }

 private:
  void accept() {
    acceptor_.async_accept([this](error_code error, tcp::socket socket) {
      if (!error && visits_ < kAtOnce) std::make_shared<Visit>(std::move(socket), pages_, &visits_)->begin();
      if (!error) return accept();
      // No descriptor is left, for one: what is tried at once again would take a whole core.
      pause_.expires_after(std::chrono::milliseconds(200));
      pause_.async_wait([this](error_code ended) {
        if (!ended) accept();
      });
    });
  }

  const Pages pages_;
  int visits_ = 0;  // its thread's; outlives the visits, which the context holds
  asio::io_context context_{1};
  tcp::acceptor acceptor_{context_};
  asio::steady_timer pause_{context_};
  std::uint16_t port_ = 0;
  std::thread thread_;
};

HttpPages::HttpPages(std::unique_ptr<Server> server) : server_(std::move(server)) {}
HttpPages::~HttpPages() = default;
std::uint16_t HttpPages::port() const noexcept { return server_->port(); }

Result<std::unique_ptr<HttpPages>> HttpPages::open(const std::string& address, Pages pages) {
  auto server = std::make_unique<Server>(std::move(pages));
  if (const Status listening = server->listen(address); !listening) return listening.failure();
  return std::unique_ptr<HttpPages>(new HttpPages(std::move(server)));
}

}  // namespace gatefield::operations
