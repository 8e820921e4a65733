// SPDX-License-Identifier: Apache-2.0
// How a record is read is asked for alike by every command that reads one: by which columns, which
// gyro of several, which topics of a bag.
#include <sstream>
#include <string>
#include <vector>

#include "common/core/one_line.h"
#include "tests/cli/command_line.h"

namespace zerodrift::cli_test {
namespace {

const std::string kModel = std::string(ZERODRIFT_SOURCE_DIR) + "/config/models/lab_fog.yaml";

class Reading : public CommandLine {
 protected:
  // A call of each command that computes from a record, up to its record.
  static std::vector<Arguments> commands() {
    return {{"compensate", "--record"},
            {"compare", "--record"},
            {"navigate", "--latitude", "48", "--record"},
            {"allan", "--record"},
            {"diagnose", "--model", kModel, "--record"},
            {"calibrate", "--effects", "bias", "--out-model", "@m.yaml", "--record"},
            {"export", "--out", "@o.csv", "--record"}};
  }
  Finished run_on(Arguments command, const Arguments& record) {
    command.insert(command.end(), record.begin(), record.end());
    return run(command);
  }
};

TEST_F(Reading, AGyroThatIsNotInARecordingIsRefusedByEveryCommand) {
  make_record(60);
  ASSERT_EQ(run({"export", "@record.csv", "--gyro-id", "3", "--out", "@r.mcap"}).exit_code, 0);
  for (const Arguments& command : commands()) {
    SCOPED_TRACE(command[0]);
    const Finished done = run_on(command, {"@r.mcap", "--gyro-id", "4"});
    EXPECT_EQ(done.exit_code, 2) << done.out;
    EXPECT_NE(done.err.find("r.mcap: has no gyro 4, expected --gyro-id to be one of 3"),
              std::string::npos)
        << done.err;
    EXPECT_EQ(lines_of(done.err), 1U) << done.err;
  }
}

TEST_F(Reading, AColumnMapThatNamesNothingIsRefusedByEveryCommand) {
  make_record(60);
  for (const Arguments& command : commands()) {
    if (command[0] == "export") continue;  // of a CSV record it makes .mcap alone
    SCOPED_TRACE(command[0]);
    const Finished done = run_on(command, {"@record.csv", "--columns", "rate_x=none[deg/s]"});
    EXPECT_EQ(done.exit_code, 2) << done.out;
    EXPECT_NE(done.err.find("none"), std::string::npos) << done.err;
    EXPECT_EQ(lines_of(done.err), 1U) << done.err;
  }
}

// What looks like a result of a record whose rates are not understood would be taken for one.
TEST_F(Reading, ARecordWithoutARateIsRefusedWithAGuessByEveryCommandThatNeedsOne) {
  std::string text = "time_s,wx_deg_h,temp_degC\n";
  for (int i = 0; i < 6000; ++i)
    text += std::to_string(0.1 * i) + "," + std::to_string(i % 7) + ",20\n";
  system_test::write(path("plain.csv"), text);
  auto all = commands();
  all.push_back({"export", "--out", "@o.mcap", "--record"});
  all.push_back({"replay", "--domain", "119", "--as-gyro-id", "1", "--record"});
  all.push_back({"gyro-publisher", "--domain", "119", "--source", "record", "--record"});
  const std::string guess =
      "plain.csv: no column is an angular rate (rate_x_deg_h); name one by --columns "
      "'rate_x=<column>[deg/s]'; the columns are: time_s, wx_deg_h, temp_degC; a guess, not used: "
      "--columns 'time=time_s[s],rate_x=wx_deg_h[deg/h],temperature_coil=temp_degC[degC]'\n";
  for (const Arguments& command : all) {
    if (command[0] == "export" && command[2] == "@o.csv") continue;  // of a CSV record .mcap alone
    SCOPED_TRACE(command[0]);
    const Finished done = run_on(command, {"@plain.csv"});
    EXPECT_EQ(done.exit_code, 2) << done.out;
    EXPECT_TRUE(done.err.ends_with(guess)) << done.err;
    EXPECT_EQ(lines_of(done.err), 1U) << done.err;
    EXPECT_EQ(done.out, "");
  }
  const Finished asked = run({"info", "@plain.csv"});
  EXPECT_EQ(asked.exit_code, 0) << asked.err;
  EXPECT_NE(asked.out.find("rate axes none"), std::string::npos) << asked.out;
  EXPECT_NE(asked.out.find("rate_x=wx_deg_h[deg/h]"), std::string::npos) << asked.out;
}

// Before: of an MCAP file --columns was advised, which is refused with one.
TEST_F(Reading, ThatAnMcapFileIsInKelvinIsAdvisedWithWhatWorks) {
  std::string text = "time_s,rate_x_deg_h,temperature_coil_degC\n";
  for (int i = 0; i < 600; ++i) {
    const int rate = i * i % 7;
    text += std::to_string(i) + ",1." + std::to_string(rate) + "," +
            std::to_string(293.0 + 0.01 * i) + "\n";
  }
  system_test::write(path("r.csv"), text);
  ASSERT_EQ(run({"export", "@r.csv", "--out", "@r.mcap"}).exit_code, 0);
  const Finished doubted = run({"compensate", "--record", "@r.mcap"});
  EXPECT_EQ(doubted.exit_code, 0) << doubted.err;
  for (const char* advised :
       {"is it in K? then zerodrift export to a .csv, and read that with --columns "
        "'temperature_coil=temperature_coil_degC[K]'\n",
        "temperature_missing; what would be right: a temperature of the probe that the features "
        "need "
        "(of a ROS 2 bag: --temperature-topic PROBE=TOPIC)\n"})
    EXPECT_NE(doubted.out.find(advised), std::string::npos) << advised << doubted.out;
  ASSERT_EQ(run({"export", "@r.mcap", "--out", "@kelvin.csv"}).exit_code, 0);
  const Finished cured = run({"compensate", "--record", "@kelvin.csv", "--columns",
                              "temperature_coil=temperature_coil_degC[K]"});
  EXPECT_EQ(cured.exit_code, 0) << cured.err;
  EXPECT_EQ(cured.out.find("doubtful"), std::string::npos) << cured.out;
  EXPECT_EQ(cured.out.find("no temperature was ever used"), std::string::npos) << cured.out;
}

// A terminal obeys control characters, and some turn the direction of writing: whoever wrote the
// file commands nobody's terminal, in whichever of its names they stand.
TEST_F(Reading, NoNameOfAColumnCommandsTheTerminalInAnyCommand) {
  auto all = commands();
  all.push_back({"info", "--record"});
  for (const std::string evil : {"\x1b[31m", "\xe2\x80\xae", "\xc2\x9b", "\x7f", "\xff"}) {
    std::string text =
        "time_s,rate_x_deg_h,temperature_" + evil + "_degC,temperature_coil_degC," + evil + "\n";
    for (int i = 0; i < 1500; ++i)
      text += std::to_string(i) + "," + std::to_string(i % 7) + ",2" + std::to_string(i % 10) +
              ",20." + std::to_string(i % 9) + ",1\n";
    system_test::write(path("r.csv"), text);
    ASSERT_EQ(run({"export", "@r.csv", "--out", "@r.mcap"}).exit_code, 0);
    system_test::write(path("c.yaml"), "features: [{kind: temperature, probe: \"no\\e[31m\"}]\n");
    for (const std::string record : {"@r.csv", "@r.mcap"}) {
      for (Arguments command : all) {
        if (command[0] == "export") continue;
        SCOPED_TRACE(command[0] + " " + record);
        for (const bool configured : {false, true}) {
          if (configured && command[0] != "compensate") continue;  // knows no such configuration
          if (configured) command.insert(command.begin() + 1, {"--config", "@c.yaml"});
          const Finished done = run_on(command, {record});
          std::istringstream lines(done.out + done.err);
          for (std::string line; std::getline(lines, line);)
            EXPECT_TRUE(core::is_one_line(line)) << line;
        }
      }
    }
  }
}

TEST_F(Reading, WhatIsGuessedIsTakenWhereItIsPasted) {
  system_test::write(path("dates.csv"),
                     "time_s,rate_x_deg_h\n2024-05-01T12:00:00Z,1\n2024-05-01T12:00:01Z,2\n");
  const Finished refused = run({"info", "@dates.csv"});
  EXPECT_EQ(refused.exit_code, 2) << refused.out;
  const std::string before = "a guess, not used: --columns '";
  const std::size_t at = refused.err.find(before);
  ASSERT_NE(at, std::string::npos) << refused.err;
  const std::size_t begin = at + before.size();
  const std::string guess = refused.err.substr(begin, refused.err.find('\'', begin) - begin);
  const Finished done = run({"info", "@dates.csv", "--columns", guess});
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_NE(done.out.find("rate axes x"), std::string::npos) << done.out;
}

TEST_F(Reading, TheGyroThatIsChosenIsTheOneThatIsNavigatedBy) {
  make_record(1200);
  ASSERT_EQ(run({"export", "@record.csv", "--gyro-id", "3", "--out", "@r.mcap"}).exit_code, 0);
  const Finished done =
      run({"navigate", "--latitude", "48", "--record", "@r.mcap", "--gyro-id", "3"});
  EXPECT_EQ(done.exit_code, 0) << done.err;
}

}  // namespace
}  // namespace zerodrift::cli_test
