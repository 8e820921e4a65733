// SPDX-License-Identifier: Apache-2.0
// What is said while a long record is read or a large one is written.
#include <signal.h>

#include <chrono>
#include <regex>
#include <string>
#include <thread>
#include <vector>

#include "tests/cli/command_line.h"

namespace zerodrift::cli_test {
namespace {

const std::string kModel = std::string(ZERODRIFT_SOURCE_DIR) + "/config/models/paper_fog.yaml";

class Writing : public CommandLine {
 protected:
  // By a shell, with a terminal for all that it says; `line` begins with the command's name.
  Finished on_terminal(const std::string& line) {
    return shell("script -qec \"$zerodrift " + line + "\" /dev/null < /dev/null");
  }

  // 10 min at 10 Hz: more rows than lie between two looks at the progress.
  void make_long_record() { make_record(600); }
};

TEST_F(Writing, WorkOnARecordShowsItsProgressOnATerminalAndNowhereElse) {
  make_long_record();
  ASSERT_EQ(run({"export", "@record.csv", "--out", "@record.mcap"}).exit_code, 0);
  for (const std::string line :
       {"compensate --record record.csv --out o.csv", "compensate --record record.mcap",
        "navigate --latitude 48 --record record.csv", "export record.csv --out o.mcap",
        "export record.mcap --out o.csv"}) {
    SCOPED_TRACE(line);
    const std::string bar = '\r' + line.substr(0, line.find(' ')) + " [";
    const Finished seen = on_terminal(line);
    EXPECT_EQ(seen.exit_code, 0) << seen.out;
    const std::size_t drawn = seen.out.find(bar);
    ASSERT_NE(drawn, std::string::npos) << seen.out;
    EXPECT_NE(seen.out.find("\r\033[K", drawn), std::string::npos) << "it is erased at the end";
    const Finished piped = shell("$zerodrift " + line);
    EXPECT_EQ(piped.exit_code, 0) << piped.err;
    EXPECT_EQ((piped.out + piped.err).find_first_of("\r\033"), std::string::npos) << piped.err;
  }
}

class LargeWriting : public Writing {
 protected:
  // 1.5 million rows.
  void make_large_record() {
    std::string text = "time_s,rate_x_deg_s\n";
    for (int i = 0; i < 1'500'000; ++i) text += std::to_string(i) + (i % 2 ? ",0.25\n" : ",0.5\n");
    system_test::write(path("large.csv"), text);
  }

  // The command is ended as soon as the line is there: nobody waits for the file.
  void expect_announced(const Arguments& arguments, const std::string& line) {
    SCOPED_TRACE(arguments[0]);
    ChildProcess process(command(arguments));
    const std::regex announced(line);
    const auto give_up = std::chrono::steady_clock::now() + std::chrono::minutes(1);
    while (process.running() && !std::regex_search(process.err(), announced) &&
           std::chrono::steady_clock::now() < give_up)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    EXPECT_TRUE(std::regex_search(process.err(), announced)) << process.err();
    EXPECT_TRUE(process.running()) << "it is said before the end";
    process.send(SIGTERM);
    EXPECT_EQ(process.wait(std::chrono::seconds(20)), 128 + SIGTERM);
  }
};

TEST_F(LargeWriting, IsAnnouncedWithItsSizeWhileItBegins) {
  make_large_record();
  make_record(10);
  expect_announced({"compensate", "--record", "@large.csv", "--out", "@o.csv"},
                   R"(o\.csv: about [1-9]\d\d MB will be written\n)");
  expect_announced({"compensate", "--record", "@large.csv", "--out", "@o.csv.gz"},
                   R"(o\.csv\.gz: about [1-9]\d\d MB will be written, less by compression\n)");
  expect_announced({"export", "@large.csv", "--out", "@o.mcap"},
                   R"(o\.mcap: about [1-9]\d\d MB will be written, less by compression\n)");
  expect_announced({"simulate", "--model", kModel, "--profile", "@profile.yaml", "--duration",
                    "1000h", "--out", "@o.csv"},
                   R"(o\.csv: about [1-9]\d* GB will be written\n)");
}

TEST_F(Writing, AFewMegabytesAreNotAnnounced) {
  make_long_record();
  EXPECT_EQ(run({"compensate", "--record", "@record.csv", "--out", "@o.csv"}).err.find("about"),
            std::string::npos);
}

}  // namespace
}  // namespace zerodrift::cli_test
