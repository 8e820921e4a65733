// SPDX-License-Identifier: Apache-2.0
// How commands end: at once on a signal, and not before their files are written where nobody reads
// what they say.
#include <signal.h>
#include <sys/stat.h>

#include <thread>

#include "tests/cli/command_line.h"

namespace zerodrift::cli_test {
namespace {

using namespace std::chrono_literals;

const std::string kModel = std::string(ZERODRIFT_SOURCE_DIR) + "/config/models/paper_fog.yaml";

class Ending : public CommandLine {
 protected:
  // Until something is being written.
  void wait_for_partial_file() const {
    for (int tenth = 0; tenth < 600 && files().size() < 3; ++tenth)
      std::this_thread::sleep_for(100ms);
  }
};

TEST_F(Ending, OfALongRunComesAtOnceOnASignalAndLeavesNothingHalf) {
  make_record(10);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    ChildProcess process(command({"simulate", "--model", kModel, "--profile", "@profile.yaml",
                                  "--duration", "1000h", "--out", "@long.csv"}));
    wait_for_partial_file();
    ASSERT_EQ(files().size(), 3U);
    const auto sent = std::chrono::steady_clock::now();
    process.send(signal);
    EXPECT_EQ(process.wait(20s), 128 + signal);
    EXPECT_LT(std::chrono::steady_clock::now() - sent, 2s) << "a loaded machine is granted that";
    EXPECT_EQ(files().size(), 2U);
  }
}

// Nobody reads the pipe, so opening it waits.
TEST_F(Ending, OfACommandThatWaitsForAPipeComesOnASignal) {
  make_record(10);
  ASSERT_EQ(::mkfifo(path("pipe").c_str(), 0600), 0);
  for (const Arguments& arguments :
       std::vector<Arguments>{{"compensate", "--record", "@record.csv", "--out", "@pipe"},
                              {"record", "--out", "@pipe", "--domain", "119"}}) {
    ChildProcess process(command(arguments));
    std::this_thread::sleep_for(500ms);
    EXPECT_TRUE(process.running());
    process.send(SIGTERM);
    EXPECT_EQ(process.wait(20s), 128 + SIGTERM) << process.err();
  }
}

TEST_F(Ending, OfAReaderIsNoReasonToLeaveAFileUnwritten) {
  make_record(30);
  const Finished done = shell(
      "$zerodrift allan --record record.csv --json report.json > table.txt; "
      "mv report.json whole.json; "
      "$zerodrift allan --record record.csv --json report.json | true; echo ${PIPESTATUS[0]}");
  EXPECT_EQ(done.out, "0\n") << done.err;
  EXPECT_EQ(system_test::first_difference(path("report.json"), path("whole.json")), "");
}

TEST_F(Ending, WithoutHavingSaidAllIsNoSuccess) {
  make_record(30);
  const Finished done = shell("$zerodrift allan --record record.csv > /dev/full");
  EXPECT_EQ(done.exit_code, 1);
  EXPECT_NE(done.err.find("standard output: writing fails"), std::string::npos) << done.err;
  EXPECT_EQ(lines_of(done.err), 1U) << done.err;
}

}  // namespace
}  // namespace zerodrift::cli_test
