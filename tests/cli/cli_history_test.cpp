// SPDX-License-Identifier: Apache-2.0
// What becomes of gyros over their records, from the files of their models.
#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "tests/cli/command_line.h"

namespace zerodrift::cli_test {
namespace {

// Wherever lines end.
std::string in_one_line(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

class History : public CommandLine {
 protected:
  // A model as calibrate writes it: one effect, with its standard error, and what else is given.
  std::string model(const std::string& unit, const std::string& date, const std::string& value,
                    const std::string& more = "") {
    const std::string name = unit + "_" + date + ".yaml";
    system_test::write(path(name),
                       "gyro_id: '" + unit +
                           "'\neffects:\n"
                           "  - kind: bias\n    axis: x\n    parameters: {bias_deg_h: " +
                           value +
                           "}\n    standard_errors: {bias_deg_h: 0.02}\n"
                           "    origin: {by: diagnose, record: " +
                           name + ".csv, date: '" + date + "'}\n" + more);
    return "@" + name;
  }
};

TEST_F(History, SaysWhichUnitChangedBetweenWhichDates) {
  Arguments arguments{"history", "--json", "@h.json", "--model"};
  for (const auto& [date, value] :
       std::vector<std::pair<std::string, std::string>>{{"2026-05-01", "2.01"},
                                                        {"2026-01-01", "1.01"},
                                                        {"2026-02-01", "0.99"},
                                                        {"2026-04-01", "2.00"},
                                                        {"2026-03-01", "1.00"}})
    arguments.push_back(model("17", date, value));
  const Finished done = run(arguments);
  EXPECT_EQ(done.exit_code, 0) << done.err;
  const std::string said = in_one_line(done.out);
  EXPECT_EQ(said.find("Unit 17 changed between 2026-03-01 and 2026-04-01: axis x, "
                      "bias.bias_deg_h from 1.00 ±"),
            0U)
      << done.out;
  EXPECT_NE(said.find("can't be asked: it needs four"), std::string::npos) << done.out;
  const auto json = nlohmann::json::parse(files().at("h.json"));
  ASSERT_EQ(json["coefficients"].size(), 1U);
  EXPECT_EQ(json["coefficients"][0]["records"].size(), 5U);
  EXPECT_EQ(json["coefficients"][0]["changes"][0]["unit"], "17");
  EXPECT_EQ(json["provenance"]["inputs"].size(), 5U);
}

// Of eight units, whose records tell how much they scatter.
TEST_F(History, ARecordThatStandsAloneIsNoChangeYet) {
  Arguments arguments{"history", "--json", "@h.json", "--model"};
  for (const std::string& unit :
       std::vector<std::string>{"10", "11", "12", "13", "14", "15", "16", "17", "18"}) {
    for (const std::string& month : std::vector<std::string>{"1", "2", "3", "4", "5", "6"}) {
      const bool is_odd = (unit == "17" && month == "3") || (unit == "18" && month == "6");
      const bool is_even = (std::stoi(unit) + std::stoi(month)) % 2 == 0;
      arguments.push_back(
          model(unit, "2026-0" + month + "-01", is_odd ? "1.50" : (is_even ? "1.01" : "0.99")));
    }
  }
  const std::string said = in_one_line(run(arguments).out);
  EXPECT_EQ(
      said.find("Unit 17, record of 2026-03-01: axis x, bias.bias_deg_h is 1.50 ± 0.020 in "
                "it alone, 1.00 ± 0.014 (2 records) before and 0.997 ± 0.012 (3 records) after"),
      0U)
      << said;
  EXPECT_EQ(said.find("Unit 17 changed"), std::string::npos) << said;
  EXPECT_NE(said.find("Unit 18 changed between 2026-05-01 and 2026-06-01"), std::string::npos)
      << said;
  EXPECT_NE(said.find("Or a record that stands alone there is the odd one"), std::string::npos)
      << said;
  const auto json = nlohmann::json::parse(files().at("h.json"));
  EXPECT_EQ(json["coefficients"][0]["changes"][0]["may_be_one_record"], true);
}

// Which is what `diagnose --out-model` leaves of an effect that came with time.
TEST_F(History, AnEffectThatCameIsToldThoughItCannotBeCompared) {
  Arguments arguments{"history", "--json", "@h.json", "--model"};
  for (const char* unit : {"17", "18"}) {
    for (const std::string& date :
         std::vector<std::string>{"2026-01-01", "2026-02-01", "2026-03-01", "2026-04-01"}) {
      const bool has_it = std::string(unit) == "17" && date >= "2026-03-01";
      arguments.push_back(
          model(unit, date, "1.0",
                has_it ? "  - kind: magnetic\n    axis: x\n    parameters: {x_deg_h_per_ut: 0.1}\n"
                         "    standard_errors: {x_deg_h_per_ut: 0.001}\n    origin: {by: diagnose, "
                         "record: r.csv, date: '" +
                             date + "'}\n"
                       : ""));
    }
  }
  const std::string said = in_one_line(run(arguments).out);
  EXPECT_EQ(said.find("Axis x, magnetic was sized in 2 of 8 records: of unit 17 in 2 of 4, from "
                      "2026-03-01 on. Whether it came or went there isn't asked"),
            0U)
      << said;
  const auto json = nlohmann::json::parse(files().at("h.json"));
  EXPECT_EQ(json["partly_sized"][0]["units"][0]["sized"], 2);
}

TEST_F(History, OfOneRecordAsksNothing) {
  const Finished done = run({"history", "--model", model("17", "2026-01-01", "1")});
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_EQ(done.out.find("Whether anything changed can't be asked"), 0U) << done.out;
}

TEST_F(History, RefusesInOneLineWhatItCannotAskAbout) {
  const std::string one = model("17", "2026-01-01", "1");
  system_test::write(path("listed.yaml"), "gyro_id: a\neffects: [{kind: bias, axis: x}]\n");
  for (
      const auto& [arguments, line] : std::vector<std::pair<Arguments, std::string>>{
          {{"history", "--model", "@listed.yaml"}, "listed.yaml: nothing here was measured"},
          {{"history", "--model", model("17", "spring", "1")},
           "17_spring.yaml: effects[0].origin.date: has to be a day as 2026-03-31, found 'spring'"},
          {{"history", "--model", one, "@none.yaml"}, "none.yaml: "},
          {{"history", "--model", one, "--false-discovery-rate", "2"}, "--false-discovery-rate"}}) {
    const Finished done = run(arguments);
    EXPECT_EQ(done.exit_code, 2);
    EXPECT_NE(done.err.find(line), std::string::npos) << done.err;
    EXPECT_EQ(std::count(done.err.begin(), done.err.end(), '\n'), 1) << done.err;
    EXPECT_EQ(done.out, "");
  }
}

}  // namespace
}  // namespace zerodrift::cli_test
