// SPDX-License-Identifier: Apache-2.0
// Every command that writes a report ends it with what it was made by and from, so that it can be
// made again.
#include <algorithm>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>

#include "tests/cli/command_line.h"

namespace zerodrift::cli_test {
namespace {

const std::string kConfig = std::string(ZERODRIFT_SOURCE_DIR) + "/config/";
const std::string kModel = kConfig + "models/paper_fog.yaml";
const std::string kLimits = kConfig + "chambers/laboratory.yaml";

struct Report {
  Arguments command;                // its reports left out
  std::string configuration;        // none: the defaults
  std::vector<std::string> inputs;  // in the order of the report
  bool has_page = true;
};

std::ostream& operator<<(std::ostream& stream, const Report& one) {
  return stream << one.command.front();
}

std::vector<Report> reports() {
  return {
      {{"info", "@record.csv"}, "", {"@record.csv"}, false},
      {{"allan", "--record", "@record.csv"}, "", {"@record.csv"}},
      {{"compare", "--record", "@record.csv", "--config", "@vehicle.yaml"},
       "@vehicle.yaml",
       {"@record.csv"}},
      {{"navigate", "--record", "@record.csv", "--latitude", "48", "--config", "@vehicle.yaml",
        "--prior", kModel},
       "@vehicle.yaml",
       {"@record.csv", kModel}},
      {{"diagnose", "--record", "@record.csv", "--model", kModel}, kModel, {"@record.csv"}},
      {{"calibrate", "--record", "@record.csv", "--effects", "bias", "--out-model", "@own.yaml"},
       "",
       {"@record.csv"}},
      {{"history", "--model", "@own_of_march.yaml"}, "", {"@own_of_march.yaml"}, false},
      {{"design", "--model", kModel, "--diagnosis", "@open.json", "--limits", "@limits.yaml",
        "--against", "@profile.yaml", "--replicates", "0", "--out", "@designed.yaml"},
       "@limits.yaml",
       {kModel, "@open.json", "@profile.yaml"},
       false},
  };
}

// A warm-up that a ramp explains nearly as well.
constexpr const char* kOpen = R"({"axis": {"y": {"taken_back": [], "unknown": null, "effects": [
  {"name": "warm_up", "probability": 0.7, "inputs": [],
   "parameters": {"amplitude_deg_h": 0.2, "tau_s": 1800},
   "alternatives": [{"name": "rate_ramp", "probability": 0.3, "inputs": [],
                     "parameters": {"ramp_deg_per_h2": 0.01}}]}]}}})";

constexpr const char* kMeasured =
    "gyro_id: a\neffects:\n"
    "  - {kind: bias, axis: x, parameters: {bias_deg_h: 1}, standard_errors: {bias_deg_h: 0.1},\n"
    "     origin: {by: diagnose, date: '2026-03-31'}}\n";

class ReportOf : public CommandLine, public testing::WithParamInterface<Report> {
 protected:
  void SetUp() override {
    make_record(1200);
    system_test::write(path("vehicle.yaml"), content(kConfig + "vehicle.yaml"));
    system_test::write(path("limits.yaml"), "duration_s: 600\npower:\n  off_s: 300\n");
    system_test::write(path("open.json"), kOpen);
    system_test::write(path("own_of_march.yaml"), kMeasured);
  }
  std::string sha256(const std::string& file) {
    return shell("sha256sum < '" + file + "'").out.substr(0, 64);
  }
  nlohmann::json described(const std::string& file) {
    const std::string name = in_folder({file}).front();
    return {{"file", name}, {"sha256", sha256(name)}};
  }
};

TEST_P(ReportOf, EndsWithWhatItWasMadeByAndFrom) {
  const Report& report = GetParam();
  Arguments arguments = system_test::operator+(report.command, {"--json", "@report.json"});
  if (report.has_page) arguments = system_test::operator+(arguments, {"--html", "@report.html"});
  const Finished done = run(arguments, {{"SOURCE_DATE_EPOCH", "951782400"}});
  ASSERT_EQ(done.exit_code, 0) << done.out << done.err;

  const auto json = nlohmann::ordered_json::parse(content(path("report.json")));
  const nlohmann::json made = json.at("provenance");
  EXPECT_EQ(made, nlohmann::json(json.back()));
  EXPECT_EQ(made["program"].get<std::string>() + '\n', run({"--version"}).out);
  EXPECT_EQ(made["date"], "2000-02-29");
  std::string typed = "zerodrift";
  for (const std::string& word : in_folder(arguments)) typed += ' ' + word;
  EXPECT_EQ(made["command_line"], typed);
  std::vector<nlohmann::json> read;
  if (!report.configuration.empty()) {
    read.push_back(described(report.configuration));
    EXPECT_EQ(made["configuration"], read.back());
  } else {
    EXPECT_TRUE(made["configuration"].is_null());
  }
  ASSERT_EQ(made["inputs"].size(), report.inputs.size());
  for (std::size_t i = 0; i < report.inputs.size(); ++i) {
    read.push_back(described(report.inputs[i]));
    EXPECT_EQ(made["inputs"][i], read.back());
  }
  if (!report.has_page) return;
  const std::string page = content(path("report.html"));
  const std::size_t end = page.rfind("Made by and from</h2>");
  ASSERT_NE(end, std::string::npos);
  EXPECT_EQ(page.find("<h2", end), std::string::npos);
  for (const nlohmann::json& file : read)
    EXPECT_NE(page.find(file["sha256"].get<std::string>(), end), std::string::npos) << file;
}

INSTANTIATE_TEST_SUITE_P(OfEveryCommand, ReportOf, testing::ValuesIn(reports()),
                         [](const auto& info) { return info.param.command.front(); });

class Reports : public CommandLine {};

// By its help: a command that writes one has a case above.
TEST_F(Reports, AreAskedForOfTheCommandsAbove) {
  std::set<std::string> writing;
  const std::string help = run({"--help"}).out;
  const std::regex name("\n  ([a-z]+) ");
  for (std::sregex_iterator one(help.begin(), help.end(), name), end; one != end; ++one) {
    const std::string command = (*one)[1];
    const std::string told = run({command, "--help"}).out;
    if (std::regex_search(told, std::regex("--(json|html) TEXT"))) writing.insert(command);
  }
  std::set<std::string> above;
  for (const Report& report : reports()) above.insert(report.command.front());
  EXPECT_EQ(writing, above);
}

}  // namespace
}  // namespace zerodrift::cli_test
