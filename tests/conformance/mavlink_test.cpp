// MAVLink against someone else's (npm node-mavlink, tests/conformance/mavlink/peer.js), both ways. Left out, with a
// line that says so, where node or its packages are not installed.

#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include "client/firmware/mavlink/frame_reader.h"
#include "common/base/child_process.h"
#include "tests/support/mavlink_words.h"

namespace gatefield::firmware::mavlink {
namespace {

using namespace std::chrono_literals;
using test::hex;
using test::unhex;
using test::words_of;

const std::string kFolder = std::string(GATEFIELD_SOURCE_DIR) + "/tests/conformance/mavlink";

std::vector<std::string> lines_of(const std::string& words) {
  std::vector<std::string> lines;
  std::istringstream stream(words);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

class Peer : public testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(kFolder + "/node_modules/node-mavlink"))
      GTEST_SKIP() << "node-mavlink is not installed: npm install --prefix " << kFolder;
    ChildOptions options;
    options.arguments = {"node", "--version"};
    if (!run_child(options, 20s).ok()) GTEST_SKIP() << "node is not installed: apt-get install nodejs npm";
  }

  /// What peer.js says to these arguments and this input.
  static std::vector<std::string> said(const std::vector<std::string>& arguments, const std::string& input) {
    ChildOptions options;
    options.arguments = {"node", "peer.js"};
    options.arguments.insert(options.arguments.end(), arguments.begin(), arguments.end());
    options.folder = kFolder;
    options.input = input;
    const auto child = ChildProcess::start(options);
    EXPECT_TRUE(child.ok()) << child.error();
    if (!child) return {};
    const auto end = child.value()->wait(60s);
    EXPECT_TRUE(end && end->well()) << child.value()->words();
    return lines_of(child.value()->said());
  }
};

TEST_F(Peer, ReadsWhatIsWritten) {
  Random random(7, Stream("test.mavlink.conformance"));
  std::vector<std::string> expected;
  std::string input;
  for (int round = 0; round < 20; ++round) {
    for (std::size_t kind = 0; kind < definitions().size(); ++kind) {
      const Message message = test::drawn_message(kind, &random);
      expected.push_back(words_of(message));
      input += hex(pack(message, {255, 191}, static_cast<std::uint8_t>(expected.size())).bytes()) + "\n";
      if (definitions()[kind].base_length != definitions()[kind].payload_length) continue;
      expected.push_back(words_of(message));
      input += hex(pack(message, {255, 191}, static_cast<std::uint8_t>(expected.size()), 1).bytes()) + "\n";
    }
  }
  EXPECT_EQ(said({"read"}, input), expected);
}

TEST_F(Peer, WritesWhatIsRead) {
  for (const auto* const seed : {"2", "3", "4"}) {
    const auto lines = said({"write", seed}, "");
    ASSERT_EQ(lines.size(), 2 * definitions().size());
    for (const std::string& line : lines) {
      const std::size_t end = line.find(" | ");
      const std::string frame = line.substr(end + 3, line.find(" | ", end + 3) - end - 3);
      FrameReader reader;
      std::string read;
      reader.read(unhex(frame), true, [&](const Frame& found) { read = words_of(unpack(found).value()); });
      EXPECT_EQ(read, line.substr(0, end));
    }
  }
}

}  // namespace
}  // namespace gatefield::firmware::mavlink
