// SPDX-License-Identifier: Apache-2.0
// How a record is read is asked for alike by every command that reads one: by which columns, which
// gyro of several, which topics of a bag.
#include <string>
#include <vector>

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

TEST_F(Reading, TheGyroThatIsChosenIsTheOneThatIsNavigatedBy) {
  make_record(1200);
  ASSERT_EQ(run({"export", "@record.csv", "--gyro-id", "3", "--out", "@r.mcap"}).exit_code, 0);
  const Finished done =
      run({"navigate", "--latitude", "48", "--record", "@r.mcap", "--gyro-id", "3"});
  EXPECT_EQ(done.exit_code, 0) << done.err;
}

}  // namespace
}  // namespace zerodrift::cli_test
