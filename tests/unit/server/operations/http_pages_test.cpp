#include "server/operations/http_pages.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <boost/asio/buffers_iterator.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/streambuf.hpp>
#include <boost/asio/write.hpp>
#include <memory>
#include <stdexcept>
#include <vector>

namespace gatefield::operations {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

class Pages : public ::testing::Test {
 protected:
  Pages() {
    auto opened = HttpPages::open("127.0.0.1:0", {{"/a",
                                                   [] {
                                                     return HttpAnswer{200, "text/plain", "hello\n"};
                                                   }},
                                                  {"/ill",
                                                   [] {
                                                     return HttpAnswer{503, "text/plain", "no\n"};
                                                   }},
                                                  {"/throws", []() -> HttpAnswer { throw std::runtime_error("oh"); }}});
    if (!opened) throw std::runtime_error(opened.error());
    pages_ = std::move(opened).value();
  }
  tcp::socket connected() {
    tcp::socket socket(context_);
    socket.connect({asio::ip::address_v4::loopback(), pages_->port()});
    return socket;
  }
  /// All that comes until the other side closes.
  static std::string rest(tcp::socket& socket) {
    asio::streambuf buffer;
    boost::system::error_code end;
    asio::read(socket, buffer, end);
    return {asio::buffers_begin(buffer.data()), asio::buffers_end(buffer.data())};
  }
  std::string ask(const std::string& words) {
    tcp::socket socket = connected();
    boost::system::error_code closed;
    asio::write(socket, asio::buffer(words), closed);
    return rest(socket);
  }
  std::string get(const std::string& path, const std::string& verb = "GET") {
    return ask(verb + " " + path + " HTTP/1.1\r\nHost: x\r\n\r\n");
  }

  asio::io_context context_;
  std::unique_ptr<HttpPages> pages_;
};

TEST_F(Pages, AreGiven) {
  const std::string answer = get("/a?x=1");
  EXPECT_THAT(answer, StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(answer, HasSubstr("Content-Length: 6\r\n"));
  EXPECT_THAT(answer, HasSubstr("\r\n\r\nhello\n"));
  EXPECT_THAT(get("/ill"), StartsWith("HTTP/1.1 503"));
  const std::string head = get("/a", "HEAD");
  EXPECT_THAT(head, HasSubstr("Content-Length: 6\r\n"));
  EXPECT_THAT(head, Not(HasSubstr("hello")));
}

TEST_F(Pages, OthersAreRefusedInWords) {
  EXPECT_THAT(get("/b"), HasSubstr("there is /a, /ill, /throws"));
  EXPECT_THAT(get("/a", "POST"), StartsWith("HTTP/1.1 405"));
  const std::string thrown = get("/throws");
  EXPECT_THAT(thrown, StartsWith("HTTP/1.1 500"));
  EXPECT_THAT(thrown, HasSubstr("oh\n"));
}

TEST_F(Pages, NobodyEndsThem) {
  EXPECT_EQ(ask("\x16\x03\x01 no HTTP\r\n\r\n"), "");
  EXPECT_EQ(ask("GET /a HTTP/1.1\r\nX: " + std::string(100'000, 'x')), "");
  EXPECT_EQ(ask("POST /a HTTP/1.1\r\nContent-Length: 99999999999\r\n\r\n").substr(0, 12).find("200"),
            std::string::npos);
  { tcp::socket gone = connected(); }
  EXPECT_THAT(get("/a"), HasSubstr("hello"));
}

TEST_F(Pages, ThoseWhoSayNothingTakeNoPlaceForEver) {
  std::vector<tcp::socket> idle;
  for (int i = 0; i < HttpPages::kAtOnce; ++i) idle.push_back(connected());
  EXPECT_EQ(get("/a"), "") << "all places are taken";
  for (tcp::socket& socket : idle) EXPECT_EQ(rest(socket), "");  // they are sent away
  EXPECT_THAT(get("/a"), HasSubstr("hello"));
}

TEST(PagesAddress, IsCheckedInWords) {
  for (const char* bad :
       {"", "9464", "localhost:9464", "127.0.0.1:", "127.0.0.1:70000", "127.0.0.1:94x", "300.0.0.1:1"}) {
    const auto opened = HttpPages::open(bad, {});
    ASSERT_FALSE(opened.ok()) << bad;
    EXPECT_THAT(opened.error(), HasSubstr("--metrics is \"" + std::string(bad) + "\", expected HOST:PORT"));
    EXPECT_EQ(opened.failure().code, ErrorCode::kInvalid);
  }
  const auto first = HttpPages::open("127.0.0.1:0", {});
  ASSERT_TRUE(first.ok());
  const auto second = HttpPages::open("127.0.0.1:" + std::to_string((*first)->port()), {});
  ASSERT_FALSE(second.ok());
  EXPECT_THAT(second.error(), HasSubstr("in use"));
  EXPECT_TRUE(HttpPages::open("[::1]:0", {}).ok());
}

}  // namespace
}  // namespace gatefield::operations
