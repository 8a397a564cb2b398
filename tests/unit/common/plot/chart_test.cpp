#include "common/plot/chart.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <iterator>

namespace gatefield::plot {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

Chart two_series() {
  Chart chart;
  chart.title = "Error";
  chart.x = {.label = "distance", .unit = "m"};
  chart.y = {.label = "error", .unit = "m"};
  chart.series = {{.name = "a", .x = {1, 2}, .y = {3, 4}},
                  {.name = "b", .x = {1, 2, 3}, .y = {5, 6, 7}, .low = {4, 5, 6}, .high = {6, 7, 8}}};
  return chart;
}

class ChartFiles : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("gatefield-chart-" + std::to_string(::getpid()));
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::string text_of(const std::filesystem::path& file) {
    std::ifstream in(file);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  std::filesystem::path folder_;
};

TEST(ChartCsv, OneLineAPoint) {
  EXPECT_EQ(to_csv(two_series()),
            "series,distance [m],error [m],low,high\n"
            "a,1,3,,\na,2,4,,\nb,1,5,4,6\nb,2,6,5,7\nb,3,7,6,8\n");
}

TEST(ChartScript, EachSeriesTakesItsOwnRows) {
  const std::string script = to_gnuplot(two_series(), "e.csv", "e.png");
  EXPECT_THAT(script, HasSubstr("'e.csv' skip 1 every ::0::1 using 2:3 with lines"));
  EXPECT_THAT(script, HasSubstr("'e.csv' skip 1 every ::2::4 using 2:3 with lines"));
  EXPECT_THAT(script, HasSubstr("set xlabel 'distance [m]'"));
}

TEST(ChartScript, NothingInALabelIsACommand) {
  Chart chart = two_series();
  chart.title = "it's `rm` \"x\"\nset output 'other.png'";
  EXPECT_THAT(to_gnuplot(chart, "e.csv", "e.png"),
              HasSubstr("set title 'it''s `rm` \"x\" set output ''other.png'''\n"));
}

TEST(ChartScript, LogarithmicAxesLimitsAndNamedTicks) {
  Chart chart = two_series();
  chart.y.logarithmic = true;
  chart.y.low = 0.01;
  chart.x.ticks = {{1, "one"}, {2, "two"}};
  const std::string script = to_gnuplot(chart, "e.csv", "e.png");
  EXPECT_THAT(script, HasSubstr("set logscale y"));
  EXPECT_THAT(script, HasSubstr("set yrange [0.01:*]"));
  EXPECT_THAT(script, HasSubstr("set xtics ('one' 1, 'two' 2)"));
  EXPECT_THAT(script, Not(HasSubstr("set logscale x")));
}

TEST(ChartScript, BarsStandSideBySide) {
  Chart chart = two_series();
  for (Series& series : chart.series) series.style = Style::kBars;
  const std::string script = to_gnuplot(chart, "e.csv", "e.png");
  EXPECT_THAT(script, HasSubstr("using ($2+-0.2):3 with boxes"));
  EXPECT_THAT(script, HasSubstr("using ($2+0.2):3 with boxes"));
}

TEST(ChartScript, SeriesThatBelongTogetherShareAColor) {
  Chart chart = two_series();
  EXPECT_THAT(to_gnuplot(chart, "e.csv", "e.png"), HasSubstr("#d55e00"));
  chart.series[1].color = 0;
  EXPECT_THAT(to_gnuplot(chart, "e.csv", "e.png"), Not(HasSubstr("#d55e00")));
}

TEST(ChartScript, BandsAndErrorBars) {
  Chart chart = two_series();
  chart.series[1].spread = Spread::kBand;
  EXPECT_THAT(to_gnuplot(chart, "e.csv", "e.png"), HasSubstr("using 2:4:5 with filledcurves"));
  chart.series[1].spread = Spread::kErrorBars;
  EXPECT_THAT(to_gnuplot(chart, "e.csv", "e.png"), HasSubstr("using 2:3:4:5 with yerrorbars"));
}

TEST(ChartValidate, SaysWhichSeriesIsWrong) {
  Chart chart = two_series();
  EXPECT_TRUE(validate(chart).ok());
  chart.series[1].y.pop_back();
  EXPECT_THAT(validate(chart).error(), HasSubstr("series 1 ('b') has 2 values of y, expected 3"));
  chart = two_series();
  chart.series[0].spread = Spread::kBand;
  EXPECT_THAT(validate(chart).error(), HasSubstr("series 0 ('a') shows a spread and has no low and high"));
  chart = two_series();
  chart.series[0].x[0] = std::nan("");
  EXPECT_THAT(validate(chart).error(), HasSubstr("x that is not finite"));
  chart = two_series();
  chart.y.logarithmic = true;
  chart.y.low = 0.0;
  EXPECT_THAT(validate(chart).error(), HasSubstr("axis y is logarithmic and has the limit 0"));
  chart = two_series();
  chart.x.low = 2.0;
  chart.x.high = 1.0;
  EXPECT_THAT(validate(chart).error(), HasSubstr("axis x goes from 2 to 1"));
  chart.series.clear();
  EXPECT_THAT(validate(chart).error(), HasSubstr("0 series"));
}

TEST_F(ChartFiles, WithoutGnuplotTheFilesStayAndASentenceSaysSo) {
  const auto drawn = draw(two_series(), folder_, "error", {.gnuplot = "no-such-gnuplot-anywhere"});
  ASSERT_TRUE(drawn.ok()) << drawn.error();
  EXPECT_FALSE(drawn->png.has_value());
  EXPECT_THAT(drawn->why_not, HasSubstr("no-such-gnuplot-anywhere isn't there (package gnuplot-nox)"));
  EXPECT_EQ(text_of(folder_ / "error.csv"), to_csv(two_series()));
  EXPECT_EQ(text_of(folder_ / "error.gp"), to_gnuplot(two_series(), "error.csv", "error.png"));
}

TEST_F(ChartFiles, AnOldPictureDoesNotPassForANewOne) {
  std::filesystem::create_directories(folder_);
  std::ofstream(folder_ / "error.png") << "old";
  const auto drawn = draw(two_series(), folder_, "error", {.gnuplot = "true"});
  ASSERT_TRUE(drawn.ok()) << drawn.error();
  EXPECT_FALSE(drawn->png.has_value());
  EXPECT_THAT(drawn->why_not, HasSubstr("left no picture"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "error.png"));
}

TEST_F(ChartFiles, RefusesNamesThatLeaveTheFolder) {
  for (const char* name : {"", "../x", "a/b", "-e", "a b", "x;y"}) {
    const auto drawn = draw(two_series(), folder_, name);
    ASSERT_FALSE(drawn.ok()) << name;
    EXPECT_THAT(drawn.error(), HasSubstr("other characters"));
  }
}

TEST_F(ChartFiles, GnuplotUnderstandsTheScript) {
  Chart chart = two_series();
  chart.title = "it's 100 % \"odd\" {x}_2 `date`";
  chart.series[1].spread = Spread::kBand;
  chart.series.push_back({.name = "bars",
                          .x = {1, 2},
                          .y = {1, std::nan("")},
                          .low = {0.5, 1},
                          .high = {2, 2},
                          .style = Style::kBars,
                          .spread = Spread::kErrorBars});
  const auto drawn = draw(chart, folder_, "error");
  ASSERT_TRUE(drawn.ok()) << drawn.error();
  if (!drawn->png) {  // a machine without gnuplot; any other reason is a fault of the script
    EXPECT_THAT(drawn->why_not, HasSubstr("isn't there"));
    return;
  }
  EXPECT_EQ(text_of(*drawn->png).substr(1, 3), "PNG");
}

}  // namespace
}  // namespace gatefield::plot
