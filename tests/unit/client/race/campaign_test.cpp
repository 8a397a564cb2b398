#include "client/race/campaign.h"

#include <gmock/gmock.h>

#include "client/race/single_cell.h"
#include "common/base/whole_file.h"
#include "common/config/locate.h"
#include "tests/unit/client/race/fixtures.h"

namespace gatefield::race {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;

std::string refusal(const std::string& text) {
  const Folder folder;
  const auto campaign = load_campaign(folder.put("c.txt", text));
  return campaign.ok() ? "" : campaign.error();
}

TEST(Campaign, AHarderWorldIsOfTheCellsAlone) {
  const Folder folder;
  folder.put("sized.txt", "course: \"circle\" vehicle: \"racer\" world: LAG world_sizes { lag_ms: 40 }");
  const auto loaded = load_campaign(folder.put("c.txt", R"(
    defaults { scenario: "sized.txt" speed_m_s: 6 seeds { first: 1 last: 2 } }
    cell { name: "as-it-is" }
    cell { name: "hard" world: HARD }
    cell { name: "some" world: [DRIFT, LAG] world_sizes { lag_ms: 5 } }
    cell { name: "easy" world: EASY }
  )"));
  ASSERT_TRUE(loaded.ok()) << loaded.error();
  using std::chrono::milliseconds;
  EXPECT_EQ(loaded->cells[0].scenario.hard.estimate.lag, milliseconds(40));
  EXPECT_EQ(loaded->cells[1].scenario.hard.estimate.lag, milliseconds(15)) << "its sizes are its own";
  EXPECT_TRUE(loaded->cells[1].scenario.hard.thrust_unknown);
  EXPECT_EQ(loaded->cells[1].scenario.vehicle.camera.rate_hz, 30);
  EXPECT_EQ(loaded->cells[2].scenario.hard.estimate.lag, milliseconds(5));
  EXPECT_EQ(loaded->cells[3].scenario.hard.estimate.lag, milliseconds(0));
  EXPECT_THAT(loaded->cells[2].scenario_text, HasSubstr("lag_ms: 5"));
}

TEST(Campaign, ACellBesideAnotherIsTheSameButForWhatItSets) {
  const std::string text = R"(
    defaults { scenario: "circle-0.3m" seeds { first: 3 last: 9 } }
    cell { name: "field" title: "Gates off" speed_m_s: [5, 6] profile: "paper" link { each_way_ms: 50 } rollouts: true
           goal { speed_m_s: 6 success_percent: 90 } published { who: "Others" speed_m_s: 7 } }
    cell { name: "truth" beside: "field" perception: TRUE_POSE }
    cell { name: "blind" beside: "field" perception: NONE title: "Blind" speed_m_s: 5 link { } }
  )";
  const Campaign campaign = campaign_of(text);
  ASSERT_EQ(campaign.cells.size(), 3u);
  const Cell &field = campaign.cells[0], &truth = campaign.cells[1], &blind = campaign.cells[2];
  EXPECT_EQ(field.perception, Perception::kLearned);
  EXPECT_TRUE(field.beside.empty());
  EXPECT_TRUE(field.rollouts);
  EXPECT_EQ(truth.perception, Perception::kTruePose);
  EXPECT_EQ(truth.beside, "field");
  EXPECT_EQ(truth.title, "Gates off, true pose");
  EXPECT_EQ(truth.series, "Gates off, true pose");
  EXPECT_EQ(truth.profile, "paper");
  EXPECT_DOUBLE_EQ(truth.link.each_way_ms, 50);
  EXPECT_THAT(truth.speeds_m_s, ElementsAre(5, 6));
  EXPECT_FALSE(truth.goal || truth.rollouts || !truth.published.empty());
  EXPECT_EQ(blind.title, "Blind");
  EXPECT_THAT(blind.speeds_m_s, ElementsAre(5));
  EXPECT_DOUBLE_EQ(blind.link.each_way_ms, 0);

  const Folder folder;
  ASSERT_TRUE(save_campaign(campaign, folder.path()).ok());
  const auto again = load_campaign(folder.path() / "campaign.txt");
  ASSERT_TRUE(again.ok()) << again.error();
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(again->cells[i].perception, campaign.cells[i].perception);
    EXPECT_EQ(again->cells[i].beside, campaign.cells[i].beside);
    EXPECT_EQ(again->cells[i].title, campaign.cells[i].title);
    EXPECT_EQ(again->cells[i].rollouts, campaign.cells[i].rollouts);
    EXPECT_DOUBLE_EQ(again->cells[i].link.each_way_ms, campaign.cells[i].link.each_way_ms);
    EXPECT_FALSE(i > 0 && again->cells[i].goal);
  }

  EXPECT_THAT(refusal("defaults { scenario: \"circle\" speed_m_s: 6 seeds { first: 1 last: 2 } }\n"
                      "cell { name: \"a\" beside: \"b\" }\ncell { name: \"b\" }"),
              HasSubstr("c.txt:2: cell 'a': beside is 'b', expected the name of a cell above"));
}

TEST(Campaign, CellsTakeWhatTheyLeaveOutFromTheDefaults) {
  const Campaign campaign = campaign_of(R"(
    title: "Some"
    defaults { scenario: "circle-0.3m" seeds { first: 3 last: 9 } profile: "paper" speed_m_s: [5, 6] link { loss: 0.1 } }
    cell { name: "plain" }
    cell { name: "own" title: "Own" speed_m_s: 7.5 laps: 2 profile: "race" link { each_way_ms: 50 } perturbation { yaw_deg: 30 } }
  )");
  ASSERT_EQ(campaign.cells.size(), 2u);
  const Cell &plain = campaign.cells[0], &own = campaign.cells[1];
  EXPECT_THAT(plain.speeds_m_s, ElementsAre(5, 6));
  EXPECT_EQ(plain.profile, "paper");
  EXPECT_EQ(plain.title, "plain");
  EXPECT_EQ(plain.figure, "success");
  EXPECT_DOUBLE_EQ(plain.link.loss, 0.1);
  EXPECT_DOUBLE_EQ(plain.scenario.perturbation.position_m, 0.3);
  EXPECT_EQ(plain.scenario.track.course.laps, 3);
  EXPECT_EQ(plain.seeds.count(), 7u);
  EXPECT_THAT(own.speeds_m_s, ElementsAre(7.5));
  EXPECT_EQ(own.profile, "race");
  EXPECT_EQ(own.scenario.track.course.laps, 2);
  EXPECT_EQ(own.link.each_way_ms, 50);
  EXPECT_EQ(own.link.loss, 0) << "a field is replaced whole";
  EXPECT_EQ(own.scenario.perturbation.position_m, 0) << "a field is replaced whole";
  EXPECT_NEAR(own.scenario.perturbation.yaw_rad, 0.5236, 1e-4);
  EXPECT_EQ(own.series, "Own");
}

struct Refusal {
  std::string name, text, says;
};
class Refusals : public testing::TestWithParam<Refusal> {};

TEST_P(Refusals, NameFileLineFieldValueAndWhatWasExpected) {
  const std::string said = refusal(GetParam().text);
  EXPECT_THAT(said, HasSubstr("c.txt")) << said;
  EXPECT_THAT(said, HasSubstr(GetParam().says));
}

TEST(Campaign, RefusalsCarryFileLineAndField) {
  const Folder folder;
  const auto file = folder.put("c.txt", R"(cell {
 name: "a"
 scenario: "circle" speed_m_s: 6 seeds { first: 1 last: 2 }
 sensor_noise { scale: -1 } })");
  const auto campaign = load_campaign(file);
  ASSERT_FALSE(campaign.ok());
  EXPECT_EQ(campaign.failure().code, ErrorCode::kInvalid);
  EXPECT_EQ(campaign.failure().file, std::filesystem::path(file).string());
  EXPECT_EQ(campaign.failure().line, 4);
  EXPECT_EQ(campaign.failure().field, "noise.scale");
}

TEST(Campaign, WhatIsWrongInTheScenariosOwnFilesIsToldWhereTheyAreNamed) {
  const Folder folder;
  std::string vehicle = read_file(config::find_config("vehicles", "racer").value()).value();
  vehicle.replace(vehicle.find("mass_kg: 0.83"), 13, "mass_kg: -1");
  folder.put("bad.txt", vehicle);
  const auto campaign = load_campaign(folder.put("c.txt", R"(cell {
 name: "a" course: "circle" speed_m_s: 6 seeds { first: 1 last: 2 }
 vehicle: "bad.txt" })"));
  ASSERT_FALSE(campaign.ok());
  EXPECT_THAT(campaign.error(), HasSubstr("c.txt:3: cell 'a': "));
  EXPECT_THAT(campaign.error(), HasSubstr("bad.txt: quadrotor.mass_kg is -1"));
  EXPECT_EQ(campaign.failure().field, "quadrotor.mass_kg");
}

TEST(Campaign, AFieldOfTheCourseIsNotTakenForTheCellsOfThatName) {
  const Folder folder;
  std::string course = read_file(config::find_config("courses", "circle").value()).value();
  course.replace(course.find("laps: 3"), 7, "laps: 0");
  folder.put("bad.txt", course);
  const auto campaign = load_campaign(folder.put("c.txt", R"(cell {
 name: "a" vehicle: "racer" speed_m_s: 6 seeds { first: 1 last: 2 }
 course: "bad.txt"
 laps: 2 })"));
  ASSERT_FALSE(campaign.ok());
  EXPECT_THAT(campaign.error(), HasSubstr("c.txt:3: cell 'a': "));
  EXPECT_THAT(campaign.error(), HasSubstr("bad.txt: laps is 0"));
  EXPECT_EQ(campaign.failure().code, ErrorCode::kInvalid);
  EXPECT_EQ(campaign.failure().field, "laps");
}

TEST(Campaign, WhatWasTakenOtherwiseThanWrittenIsNotedOnce) {
  const Folder folder;
  std::string vehicle = read_file(config::find_config("vehicles", "racer").value()).value();
  vehicle.replace(vehicle.find("zz: 5.0e-3"), 10, "zz: 6.21e-3");
  folder.put("mine.txt", vehicle);
  const auto campaign = load_campaign(folder.put("c.txt", R"(
    defaults { course: "circle" vehicle: "mine.txt" speed_m_s: 6 seeds { first: 1 last: 2 } }
    cell { name: "a" } cell { name: "b" })"));
  ASSERT_TRUE(campaign.ok()) << campaign.error();
  ASSERT_EQ(campaign->notes.size(), 1u);
  EXPECT_THAT(campaign->notes[0], HasSubstr("zz is 0.00621, taken as 0.0062"));
}

const std::string kGood = R"(scenario: "circle" speed_m_s: 6 seeds { first: 1 last: 2 })";

INSTANTIATE_TEST_SUITE_P(
    All, Refusals,
    testing::Values(
        Refusal{"NoCell", "title: \"x\"", "there are 0 cells, expected 1 to 1000"},
        Refusal{"UnknownField", "cell {\n  name: \"a\"\n  sped: 6 }",
                "c.txt:3:7: unknown field 'sped', expected one of"},
        Refusal{"NoName", "cell { " + kGood + " }", "name is ''"},
        Refusal{"BadName", "cell { name: \"a b\" " + kGood + " }", "c.txt:1: cell 'a b': name is 'a b'"},
        Refusal{"SameName", "cell { name: \"a\" " + kGood + " }\ncell { name: \"a\" " + kGood + " }",
                "c.txt:2: cell 'a': the name is taken"},
        Refusal{"NoScenario", "cell { name: \"a\" speed_m_s: 6 seeds { first: 1 last: 2 } }", "scenario is missing"},
        Refusal{"NoSuchScenario", "cell { name: \"a\"\n scenario: \"cricle\" speed_m_s: 6 seeds { first: 1 last: 2 } }",
                "c.txt:2: cell 'a': scenario: 'cricle' is neither"},
        Refusal{"NoSpeed", "cell { name: \"a\" scenario: \"circle\" seeds { first: 1 last: 2 } }",
                "speed_m_s has 0 values"},
        Refusal{"TooFast", "cell {\n name: \"a\" scenario: \"circle\"\n speed_m_s: 60 seeds { first: 1 last: 2 } }",
                "c.txt:3: cell 'a': speed_m_s is 60, expected 0.5 to 50 m/s"},
        Refusal{"SpeedTwice", "cell { name: \"a\" scenario: \"circle\" speed_m_s: [6, 6] seeds { first: 1 last: 2 } }",
                "speed_m_s has 6 twice"},
        Refusal{"NoSeeds", "cell { name: \"a\" scenario: \"circle\" speed_m_s: 6 }", "seeds is missing"},
        Refusal{"SeedsBackwards",
                "cell { name: \"a\" scenario: \"circle\" speed_m_s: 6\n\n seeds { first: 9 last: 2 } }",
                "c.txt:3: cell 'a': seeds is 9 to 2"},
        Refusal{"Laps", "cell { name: \"a\" laps: 0 " + kGood + " }", "laps is 0, expected 1 to 1000"},
        Refusal{"Loss", "cell { name: \"a\" link { loss: 2 } " + kGood + " }", "link.loss is 2, expected 0 to 0.9"},
        Refusal{"Perturbation", "cell {\n name: \"a\"\n perturbation { position_m: 9 }\n " + kGood + " }",
                "c.txt:3: cell 'a': perturbation.position_m is 9, expected 0 to 5 m"},
        Refusal{"FromDefaults", "defaults {\n mismatch { mass_factor: 90 } }\ncell { name: \"a\" " + kGood + " }",
                "c.txt:2: cell 'a': mismatch.mass_factor is 90"},
        Refusal{"Sensor", "cell {\n name: \"a\"\n sensor_noise { scale: -1 }\n " + kGood + " }", "c.txt:3: cell 'a': "},
        Refusal{"Goal", "cell { name: \"a\" goal { speed_m_s: 7 success_percent: 90 } " + kGood + " }",
                "goal.speed_m_s is 7, expected one of the cell's speed_m_s"},
        Refusal{"Figure", "cell { name: \"a\" " + kGood + " }\nfigure { name: \"other\" }",
                "c.txt:2: figure 'other' is named by no cell"}),
    [](const testing::TestParamInfo<Refusal>& refusal_info) { return refusal_info.param.name; });

TEST(Campaign, TheHullIsTheScenariosTheCellsOrTheOneAskedFor) {
  const Folder folder;
  folder.put("round.txt", "course: \"circle\"\nvehicle: \"racer\"\nhull: SPHERE\n");
  const auto file = folder.put("c.txt", R"(
    defaults { scenario: "circle" speed_m_s: 6 seeds { first: 1 last: 2 } }
    cell { name: "usual" } cell { name: "own" hull: SPHERE } cell { name: "scenario" scenario: "round.txt" })");
  const auto hulls = [](const Result<Campaign>& campaign) {
    std::vector<std::string> names;
    for (const Cell& cell : campaign->cells) names.emplace_back(config::name(cell.scenario.hull));
    return names;
  };
  const auto asked = load_campaign(file, config::HullKind::kSphere);
  EXPECT_THAT(hulls(load_campaign(file)), ElementsAre("discs", "sphere", "sphere"));
  EXPECT_THAT(hulls(asked), ElementsAre("sphere", "sphere", "sphere"));
  EXPECT_THAT(hulls(load_campaign(file, config::HullKind::kDiscs)), ElementsAre("discs", "discs", "discs"));
  // What is asked for is what is kept, to be flown and reported elsewhere.
  ASSERT_TRUE(save_campaign(*asked, folder.path() / "saved").ok());
  EXPECT_THAT(hulls(load_campaign(folder.path() / "saved/campaign.txt")), ElementsAre("sphere", "sphere", "sphere"));
  SingleCell single{"circle", "race", "race", {6}, {1, 2}, {}, {}};
  single.hull = config::HullKind::kSphere;
  EXPECT_THAT(hulls(single_cell_campaign(single)), ElementsAre("sphere"));
}

TEST(Campaign, AFileThatIsNotThereIsSaid) {
  EXPECT_THAT(load_campaign("/nowhere/c.txt").error(), StartsWith("/nowhere/c.txt: does not exist"));
}

TEST(Campaign, ASavedOneReadsBackTheSameInAnotherPlace) {
  const Campaign campaign = campaign_of(R"(
    title: "Saved"
    cell { name: "all" title: "All" scenario: "circle-hard" laps: 2 speed_m_s: [5, 6.5] profile: "paper" model: "race"
           link { each_way_ms: 20 jitter_ms: 5 loss: 0.01 } seeds { first: 11 last: 12 } figure: "f" series: "s"
           time_limit_s: 33 published { who: "others" speed_m_s: 7 success_percent: 90 }
           published { who: "more" speed_m_s: 5 } goal { speed_m_s: 5 success_percent: 95 } }
    cell { name: "tilt" course: "one-gate" vehicle: "racer" perturbation { tilt_deg: 30 } speed_m_s: 5 seeds { first: 1 last: 1 }
           mismatch { wind_m_s { x: 4 } } }
    figure { name: "f" title: "F" against: DELAY }
  )");
  Folder folder;
  ASSERT_TRUE(save_campaign(campaign, folder.path() / "here").ok());
  std::filesystem::rename(folder.path() / "here", folder.path() / "there");
  const auto again = load_campaign(folder.path() / "there/campaign.txt");
  ASSERT_TRUE(again.ok()) << again.error();
  ASSERT_EQ(again->cells.size(), 2u);
  const Cell &a = campaign.cells[0], &b = again->cells[0];
  EXPECT_EQ(again->title, "Saved");
  EXPECT_EQ(b.title, a.title);
  EXPECT_EQ(b.speeds_m_s, a.speeds_m_s);
  EXPECT_EQ(b.scenario_text, a.scenario_text);
  EXPECT_EQ(b.laps, a.laps);
  EXPECT_EQ(b.link.jitter_ms, 5);
  EXPECT_EQ(b.seeds.last, 12u);
  EXPECT_EQ(b.figure, "f");
  EXPECT_EQ(b.series, "s");
  EXPECT_EQ(b.scenario.time_limit, std::chrono::seconds(33));
  EXPECT_EQ(b.scenario.mismatch.drag_factor, a.scenario.mismatch.drag_factor);
  EXPECT_EQ(b.scenario.sensor_noise.scale, a.scenario.sensor_noise.scale);
  ASSERT_EQ(b.published.size(), 2u);
  EXPECT_FALSE(b.published[1].success_percent);
  EXPECT_EQ(b.goal->success_percent, 95);
  EXPECT_EQ(again->figures[0].against, Against::kDelay);
  EXPECT_EQ(again->cells[1].scenario.mismatch.wind_W_m_s.x(), 4);
  EXPECT_EQ(b.scenario.course_file.parent_path().filename(), "cells");
}

TEST(Campaign, TheOnesThatShipAreGood) {
  for (const char* name : {"paper", "rates", "readme", "smoke"}) {
    const auto campaign = load_campaign(config::find_config("campaigns", name).value());
    ASSERT_TRUE(campaign.ok()) << campaign.error();
    for (const Cell& cell : campaign->cells) {
      const bool evaluation = std::string(name) != "smoke";
      if (cell.figure == "tracks") {  // pictures of single flights
        EXPECT_GE(cell.seeds.first, 1001u) << cell.name;
        EXPECT_EQ(cell.seeds.count(), 1u) << cell.name;
        continue;
      }
      EXPECT_EQ(cell.seeds.first, evaluation ? 1001u : 1u) << cell.name;
      EXPECT_EQ(cell.seeds.count(), evaluation ? 100u : 2u) << cell.name;
    }
  }
}

TEST(Campaign, ACellSaysHowItsVehicleIsDriven) {
  const Campaign campaign = campaign_of(R"(
    defaults { scenario: "circle-0.3m" speed_m_s: 8 seeds { first: 1 last: 2 } actuation { kind: BODY_RATES } }
    cell { name: "usual" mismatch { rate_lag_factor: 1.5 } }
    cell { name: "own" actuation { kind: BODY_RATES thrust_time_constant_s: 0.04 rate_time_constant_s { x: 0.1 y: 0.1 z: 0.3 } } }
    cell { name: "thrusts" actuation { kind: ROTOR_THRUSTS } }
    cell { name: "files" vehicle: "racer-rates" }
  )");
  ASSERT_EQ(campaign.cells.size(), 4u);
  const auto lag_s = [&](std::size_t i) {
    return campaign.cells[i].scenario.vehicle.actuation.rate_time_constant_s.x();
  };
  EXPECT_EQ(campaign.cells[0].scenario.vehicle.actuation.kind, Actuation::Kind::kBodyRates);
  EXPECT_NEAR(lag_s(0), 0.0425, 1e-12);
  EXPECT_EQ(campaign.cells[0].scenario.mismatch.rate_lag_factor, 1.5);
  EXPECT_EQ(lag_s(1), 0.1);
  EXPECT_EQ(campaign.cells[2].scenario.vehicle.actuation.kind, Actuation::Kind::kRotorThrusts);
  EXPECT_NEAR(lag_s(3), lag_s(0), 1e-12) << "the shipped file has the usual lags";

  const Folder folder;
  ASSERT_TRUE(save_campaign(campaign, folder.path()).ok());
  const auto again = load_campaign(folder.path() / "campaign.txt");
  ASSERT_TRUE(again.ok()) << again.error();
  for (std::size_t i = 0; i < campaign.cells.size(); ++i) {
    const Actuation &flown = campaign.cells[i].scenario.vehicle.actuation,
                    &kept = again->cells[i].scenario.vehicle.actuation;
    EXPECT_EQ(kept.kind, flown.kind);
    EXPECT_EQ(kept.rate_time_constant_s, flown.rate_time_constant_s);
  }

  EXPECT_THAT(
      refusal("defaults { scenario: \"circle\" speed_m_s: 6 seeds { first: 1 last: 2 } }\n"
              "cell { name: \"a\"\n  mismatch { rate_lag_factor: 1.5 } }"),
      HasSubstr("c.txt:3: cell 'a': mismatch.rate_lag_factor is 1.5, expected 1 for a vehicle driven by rotor"));
  EXPECT_THAT(refusal("defaults { scenario: \"circle\" speed_m_s: 6 seeds { first: 1 last: 2 } }\n"
                      "cell { name: \"a\"\n  actuation { kind: BODY_RATES thrust_time_constant_s: 0.02 } }"),
              HasSubstr("c.txt:3: cell 'a': actuation.rate_time_constant_s[0] is 0 s"));
}

TEST(SingleCell, SaysHowItsVehicleIsDriven) {
  SingleCell asked{"circle-yaw30", "race", "race", {8}, {1, 2}, {}, {}};
  EXPECT_EQ(single_cell_campaign(asked)->cells[0].scenario.vehicle.actuation.kind, Actuation::Kind::kRotorThrusts);
  asked.actuation = Actuation::Kind::kBodyRates;
  EXPECT_EQ(single_cell_campaign(asked)->cells[0].scenario.vehicle.actuation.kind, Actuation::Kind::kBodyRates);
}

TEST(SingleCell, IsACampaignLikeAnyOther) {
  const auto campaign = single_cell_campaign({"circle-yaw30", "paper", "race", {8, 10}, {1, 20}, 2, {5, 0, 0}});
  ASSERT_TRUE(campaign.ok()) << campaign.error();
  ASSERT_EQ(campaign->cells.size(), 1u);
  EXPECT_EQ(campaign->cells[0].name, "circle-yaw30");
  EXPECT_THAT(campaign->cells[0].speeds_m_s, ElementsAre(8, 10));
  EXPECT_EQ(campaign->cells[0].scenario.track.course.laps, 2);
  EXPECT_EQ(campaign->cells[0].link.each_way_ms, 5);
  EXPECT_THAT(single_cell_campaign({"circle", "race", "race", {99}, {1, 2}, {}, {}}).error(),
              testing::AllOf(StartsWith("command line:"), HasSubstr("speed_m_s is 99, expected 0.5 to 50")));
}

TEST(Seeds, AreARangeOrOne) {
  EXPECT_EQ(parse_seeds("1001-1100")->count(), 100u);
  EXPECT_EQ(parse_seeds("7")->last, 7u);
  for (const char* bad : {"", "-", "a-b", "9-2", "1-", "1-2-3", "0-100000"})
    EXPECT_THAT(parse_seeds(bad).ok() ? "" : parse_seeds(bad).error(), HasSubstr("expected FIRST-LAST")) << bad;
}

}  // namespace
}  // namespace gatefield::race
