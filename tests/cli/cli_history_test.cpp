// SPDX-License-Identifier: Apache-2.0
// What becomes of gyros over their records, from the files of their models.
#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "tests/cli/command_line.h"

namespace zerodrift::cli_test {
namespace {

class History : public CommandLine {
 protected:
  // A model as calibrate writes it: one effect, with its standard error.
  std::string model(const std::string& unit, const std::string& date, const std::string& value) {
    const std::string name = unit + "_" + date + ".yaml";
    system_test::write(path(name),
                       "gyro_id: '" + unit +
                           "'\neffects:\n"
                           "  - kind: bias\n    axis: x\n    parameters: {bias_deg_h: " +
                           value +
                           "}\n    standard_errors: {bias_deg_h: 0.02}\n"
                           "    origin: {by: diagnose, record: " +
                           name + ".csv, date: '" + date + "'}\n");
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
  std::string said = done.out;
  std::replace(said.begin(), said.end(), '\n', ' ');  // wherever its lines end
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
