#include "common/plot/table.h"

#include <gtest/gtest.h>

#include <cmath>

namespace gatefield::plot {
namespace {

Table example() {
  Table table;
  table.title = "Errors";
  table.columns = {"gate at", "error, m"};
  table.rows = {{"1 to 2 m", {0.0314, 3}}, {"a|b, \"c\"", {std::nan(""), 3}}};
  table.note = "n = 2";
  return table;
}

TEST(Table, TextStandsInColumns) {
  EXPECT_EQ(to_text(example()),
            "Errors\n"
            "gate at   error, m\n"
            "1 to 2 m     0.031\n"
            "a|b, \"c\"         -\n"
            "n = 2\n");
}

TEST(Table, LongNotesAreBrokenAtSpaces) {
  Table table = example();
  table.note = std::string(100, 'a') + " " + std::string(49, 'b') + " " + std::string(49, 'c') + " d";
  const std::string text = to_text(table);
  EXPECT_NE(text.find(std::string(49, 'b') + "\n" + std::string(49, 'c') + " d\n"), std::string::npos) << text;
}

TEST(Table, Markdown) {
  EXPECT_EQ(
      to_markdown(example()),
      "**Errors**\n\n| gate at | error, m |\n| --- | ---: |\n| 1 to 2 m | 0.031 |\n| a\\|b, \"c\" | - |\n\nn = 2\n");
}

TEST(Table, CsvKeepsTheDigitsAndQuotesWhatMustBe) {
  EXPECT_EQ(to_csv(example()), "gate at,\"error, m\"\n1 to 2 m,0.0314\n\"a|b, \"\"c\"\"\",\n");
}

}  // namespace
}  // namespace gatefield::plot
