#include "client/flight/transitions_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>
#include <string>

#include "client/flight/arming_checks.h"
#include "client/flight/transitions.h"

namespace gatefield::flight {
namespace {

using testing::HasSubstr;

std::string file(const std::string& path) {
  std::ifstream in(std::string(GATEFIELD_SOURCE_DIR) + "/" + path);
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

constexpr const char* kMakeAnew = "make it anew with deploy/safety-picture";

/// "from -> to" of the arrows and the lines of their labels, in an order of their own.
struct Drawn {
  std::multiset<std::string> arrows, words;
  bool operator==(const Drawn&) const = default;
};

Drawn read_dot(const std::string& dot) {
  Drawn drawn;
  static const std::regex arrow(R"re((\w+) -> (\w+) \[label="([^"]*)")re");
  for (auto match = std::sregex_iterator(dot.begin(), dot.end(), arrow); match != std::sregex_iterator(); ++match) {
    drawn.arrows.insert((*match)[1].str() + " -> " + (*match)[2].str());
    const std::string label = (*match)[3].str();
    for (std::size_t begin = 0; begin <= label.size();) {
      const std::size_t end = std::min(label.find("\\n", begin), label.size());
      drawn.words.insert(label.substr(begin, end - begin));
      begin = end + 2;
    }
  }
  static const std::regex node(R"re(  \w+ \[label="([^"]*)" fill)re");
  for (auto match = std::sregex_iterator(dot.begin(), dot.end(), node); match != std::sregex_iterator(); ++match)
    drawn.words.insert((*match)[1].str());
  static const std::regex box(R"re(    label="?([^";]*)"; style)re");
  for (auto match = std::sregex_iterator(dot.begin(), dot.end(), box); match != std::sregex_iterator(); ++match)
    drawn.words.insert((*match)[1].str());
  return drawn;
}

Drawn read_svg(const std::string& svg) {
  Drawn drawn;
  static const std::regex arrow(R"re(<title>(\w+)&#45;&gt;(\w+)</title>)re");
  for (auto match = std::sregex_iterator(svg.begin(), svg.end(), arrow); match != std::sregex_iterator(); ++match)
    drawn.arrows.insert((*match)[1].str() + " -> " + (*match)[2].str());
  static const std::regex words(R"re(<text [^>]*>([^<]*)</text>)re");
  for (auto match = std::sregex_iterator(svg.begin(), svg.end(), words); match != std::sregex_iterator(); ++match)
    drawn.words.insert((*match)[1].str());
  return drawn;
}

TEST(SafetyPicture, ShowsTheTableThatFlies) {
  const Drawn table = read_dot(to_dot()), picture = read_svg(file("docs/images/safety.svg"));
  EXPECT_GT(table.arrows.size(), 30u);
  EXPECT_EQ(picture.arrows, table.arrows) << kMakeAnew;
  EXPECT_EQ(picture.words, table.words) << kMakeAnew;
}

TEST(SafetyPicture, HasEveryPhaseAndEveryCause) {
  const Drawn table = read_dot(to_dot());
  const auto shown = [&](std::string name) {
    std::replace(name.begin(), name.end(), '_', ' ');
    return table.words.contains(name);
  };
  for (std::size_t i = 0; i < kPhases; ++i) EXPECT_TRUE(shown(std::string(name(static_cast<Phase>(i))))) << i;
  for (std::size_t i = 0; i < kCauses; ++i) EXPECT_TRUE(shown(std::string(name(static_cast<Cause>(i))))) << i;
}

TEST(SafetyPage, HasTheTablesThatFly) { EXPECT_THAT(file("docs/safety.md"), HasSubstr(to_markdown())) << kMakeAnew; }

TEST(SafetyPage, HasEveryCheckBeforeArming) {
  const std::string page = file("docs/safety.md");
  for (int i = 0; i < kChecks; ++i)
    EXPECT_THAT(page, HasSubstr("| `" + std::string(name(static_cast<Check>(i))) + "` |"));
}

}  // namespace
}  // namespace gatefield::flight
