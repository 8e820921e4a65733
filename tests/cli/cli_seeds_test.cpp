// SPDX-License-Identifier: Apache-2.0
// `zerodrift compare` over several seeds of a simulation.
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/cli/command_line.h"

namespace zerodrift::cli_test {
namespace {

using Json = nlohmann::ordered_json;
using system_test::operator+;

const std::string kModel = std::string(ZERODRIFT_SOURCE_DIR) + "/config/models/paper_fog.yaml";

class Seeds : public CommandLine {
 protected:
  void SetUp() override {
    system_test::write(path("profile.yaml"),
                       "name: ramp\nduration_s: 1500\ninitial_temperature_degc: 20\n"
                       "power_on_s: 0\nchamber:\n  - {time_s: 1500, temperature_degc: 45}\n");
  }
  Finished compare(const Arguments& more) {
    return run(Arguments{"compare", "--model", kModel, "--profile", "@profile.yaml", "--rate", "2",
                         "--delays", "60", "--schemes", "persistence,stack"} +
               more);
  }
  [[nodiscard]] Json json() const { return Json::parse(content(path("r.json"))); }
};

// Rule: the geometric mean over axes and seeds is that of the figures of `simulate` and `compare`
// of each seed alone.
TEST_F(Seeds, TheMeansAreThoseOfEachSeedAlone) {
  const Finished done = compare({"--seeds", "2", "--seed", "4", "--json", "@r.json"});
  ASSERT_EQ(done.exit_code, 0) << done.err;
  const Json together = json();
  double logs = 0.0;
  double count = 0.0;
  for (const std::string seed : {"4", "5"}) {
    ASSERT_EQ(run({"simulate", "--model", kModel, "--profile", "@profile.yaml", "--rate", "2",
                   "--seed", seed, "--out", "@s.csv"})
                  .exit_code,
              0);
    ASSERT_EQ(run({"compare", "--record", "@s.csv", "--delays", "60", "--schemes",
                   "persistence,stack", "--json", "@r.json"})
                  .exit_code,
              0);
    const Json alone = json();
    for (const auto& axis : alone["axis"]) {
      logs += std::log(
          axis["protocols"]["delayed_60_s"]["schemes"]["stack"]["rmse_deg_h"].get<double>());
      count += 1.0;
    }
  }
  const Json& told = together["protocols"]["delayed 60 s"]["stack"];
  EXPECT_EQ(told["judged"].get<double>(), count);
  EXPECT_EQ(count, 6.0);
  EXPECT_NEAR(told["rmse_deg_h"]["value"].get<double>(), std::exp(logs / count), 1e-9);
  EXPECT_LT(told["rmse_deg_h"]["lower"], told["rmse_deg_h"]["value"]);
  EXPECT_GT(told["rmse_deg_h"]["upper"], told["rmse_deg_h"]["value"]);
  EXPECT_EQ(together["protocols"]["delayed 60 s"]["persistence"]["rmse_over_holding"]["value"],
            1.0);
}

// Rule: the same tables in text and HTML; nothing is left among the temporary files.
TEST_F(Seeds, TextPageAndJsonHaveTheSameTable) {
  std::filesystem::create_directory(path("tmp"));
  const Finished done =
      run(Arguments{"compare", "--model", kModel, "--profile", "@profile.yaml", "--rate", "2",
                    "--seeds", "2", "--delays", "60", "--schemes", "persistence,stack", "--json",
                    "@r.json", "--html", "@r.html"},
          {{"TMPDIR", path("tmp").string()}});
  ASSERT_EQ(done.exit_code, 0) << done.err;
  const std::string caption = "delayed 60 s: RMSE of labels, geometric mean over 6 axes of 2 seeds";
  EXPECT_NE(done.out.find(caption), std::string::npos) << done.out;
  EXPECT_NE(content(path("r.html")).find(caption), std::string::npos);
  EXPECT_EQ(json()["seeds"], 2);
  EXPECT_NE(done.out.find("Smallest geometric mean of the RMSE"), std::string::npos) << done.out;
  EXPECT_TRUE(std::filesystem::is_empty(path("tmp")));
}

TEST_F(Seeds, WhatCannotBeIsRefusedInOneLineWithCodeTwo) {
  make_record(20);
  const Arguments model{"--model", kModel};
  for (const Arguments& wrong : std::vector<Arguments>{
           {"compare"},
           Arguments{"compare"} + model,
           Arguments{"compare", "--profile", "@profile.yaml"},
           Arguments{"compare", "--record", "@record.csv", "--profile", "@profile.yaml"} + model,
           {"compare", "--record", "@record.csv", "--seeds", "3"},
           Arguments{"compare", "--profile", "@profile.yaml", "--seeds", "0"} + model,
           Arguments{"compare", "--profile", "@profile.yaml", "--rate", "-1"} + model,
           Arguments{"compare", "--profile", "@profile.yaml", "--json", "@profile.yaml"} + model,
           Arguments{"compare", "--profile", "@none.yaml"} + model}) {
    const Finished done = run(wrong);
    EXPECT_EQ(done.exit_code, 2) << done.out << done.err;
    EXPECT_EQ(lines_of(done.err), 1U) << done.err;
  }
}

// Rule: what the model lacks is said of the model, not of a record that is gone with the program.
TEST_F(Seeds, AModelWithoutTheProbeThatIsReadIsRefusedByItsOwnName) {
  make_record(20);
  std::string model = content(kModel);
  for (std::size_t at = 0; (at = model.find("name: coil,", at)) != std::string::npos; at += 11)
    model.replace(at, 11, "name: skin,");
  system_test::write(path("model.yaml"), model);
  const Finished done = run({"compare", "--model", "@model.yaml", "--profile", "@profile.yaml"});
  EXPECT_EQ(done.exit_code, 2) << done.out;
  EXPECT_EQ(lines_of(done.err), 1U) << done.err;
  EXPECT_NE(done.err.find("model.yaml: probes: found none named 'coil'"), std::string::npos)
      << done.err;
}

}  // namespace
}  // namespace zerodrift::cli_test
