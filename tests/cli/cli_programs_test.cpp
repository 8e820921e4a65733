// SPDX-License-Identifier: Apache-2.0
// One name to find every program by, and what is said of a word that nobody knows.
#include <signal.h>

#include <regex>

#include "tests/cli/command_line.h"

namespace zerodrift::cli_test {
namespace {

namespace fs = std::filesystem;

const fs::path kBin = ZERODRIFT_BIN_DIR;

// Command and file of each, but of the bench, which isn't always built.
const std::vector<std::pair<std::string, std::string>> kPrograms{
    {"compensation", "compensation"},
    {"gyro-publisher", "gyro_publisher"},
    {"thermal-publisher", "thermal_publisher"},
    {"allan-monitor", "allan_monitor"},
    {"navigation-filter", "navigation_filter"},
    {"ctl", "ctl"},
    {"console", "console"},
    {"discovery-server", "discovery_server"}};

class Programs : public CommandLine {
 protected:
  // `zerodrift` in the test's folder, with programs of the test's beside it.
  void put_zerodrift_beside(const std::string& name, const std::string& script) {
    if (!fs::exists(path("zerodrift"))) fs::copy_file(kBin / "zerodrift", path("zerodrift"));
    system_test::write(path(name), "#!/bin/sh\n" + script + "\n");
    fs::permissions(path(name), fs::perms::owner_all);
  }
};

TEST_F(Programs, EachIsFoundByACommandAndIsTheOneOfItsName) {
  for (const auto& [command, program] : kPrograms) {
    const Finished asked = run({command, "--help"});
    const Finished itself = shell("'" + (kBin / program).string() + "' --help");
    EXPECT_EQ(asked.exit_code, 0) << asked.err;
    EXPECT_EQ(asked.out, itself.out);
    const std::string joins = command == "ctl" ? run({command, "status", "--help"}).out : asked.out;
    EXPECT_NE(joins.find("--domain"), std::string::npos) << joins;
    EXPECT_NE(run({"--help"}).out.find("\n  " + command + " "), std::string::npos);
  }
}

TEST_F(Programs, KeepTheProcessTheArgumentsAndTheExitCode) {
  put_zerodrift_beside("console", R"(echo $$ "$#" "$1" "$2"; exit 7)");
  const Finished done = shell("sh -c 'echo $$; exec ./zerodrift console \"a b\" --help'");
  EXPECT_EQ(done.exit_code, 7) << done.err;
  const std::string pid = done.out.substr(0, done.out.find('\n'));
  EXPECT_EQ(done.out, pid + '\n' + pid + " 2 a b --help\n");
}

TEST_F(Programs, EndByTheSignalThatEndsThem) {
  put_zerodrift_beside("console", "kill -TERM $$");
  EXPECT_EQ(shell("./zerodrift console").exit_code, 128 + SIGTERM);
}

TEST_F(Programs, OfOthersWithTheSameNameAreNotTakenForOurs) {
  put_zerodrift_beside("console", "echo foreign");
  put_zerodrift_beside("zerodrift-console", "echo ours");
  EXPECT_EQ(shell("./zerodrift console").out, "ours\n");
  fs::create_directory(path("bin"));
  fs::create_symlink(path("zerodrift"), path("bin/zerodrift"));
  EXPECT_EQ(shell("bin/zerodrift console").out, "ours\n") << "beside the file, not the link";
}

TEST_F(Programs, ThatAreNotThereAreToldInOneLine) {
  put_zerodrift_beside("console", "exit 0");
  const Finished done = shell("./zerodrift bench latency");
  EXPECT_EQ(done.exit_code, 2);
  EXPECT_EQ(done.err, "zerodrift: bench: neither zerodrift-bench nor zerodrift_bench is in " +
                          path("").parent_path().string() + "\n");
}

TEST_F(Programs, AllTellTheSameVersionCommitAndBuild) {
  const Finished told = run({"--version"});
  EXPECT_EQ(told.exit_code, 0) << told.err;
  const std::regex form(R"(zerodrift \d+\.\d+\.\d+ \(commit ([0-9a-f]{7,}\+?|unknown), \w+\)\n)");
  EXPECT_TRUE(std::regex_match(told.out, form)) << told.out;
  for (const auto& [command, program] : kPrograms)
    EXPECT_EQ(run({command, "--version"}).out, told.out);
}

struct Unknown {
  std::string name;
  Arguments arguments;
  std::string line;
};

class UnknownWord : public CommandLine, public testing::WithParamInterface<Unknown> {};

TEST_P(UnknownWord, EndsInOneLineWithTheNearestKnownOne) {
  const Finished done = run(GetParam().arguments);
  EXPECT_EQ(done.exit_code, 2);
  EXPECT_EQ(done.err, GetParam().line + '\n');
  EXPECT_EQ(done.out, "");
}

INSTANTIATE_TEST_SUITE_P(
    Of, UnknownWord,
    testing::Values(
        Unknown{"a_command",
                {"simulat", "--model", "x"},
                "zerodrift: unknown command 'simulat'; did you mean 'simulate'? (--help lists "
                "them)"},
        Unknown{"a_lone_command",
                {"simulat"},
                "zerodrift: unknown command 'simulat'; did you mean 'simulate'? (--help lists "
                "them)"},
        Unknown{"a_program",
                {"gyro_publisher"},
                "zerodrift: unknown command 'gyro_publisher'; did you mean 'gyro-publisher'? "
                "(--help lists them)"},
        Unknown{"nothing_near", {"plot"}, "zerodrift: unknown command 'plot' (--help lists them)"},
        Unknown{"a_command_of_a_command",
                {"config", "shw"},
                "zerodrift: unknown command 'shw'; did you mean 'show'? (--help lists them)"},
        Unknown{"an_option_beside_one_that_is_required",
                {"simulate", "--modle", "x"},
                "zerodrift: unknown option '--modle'; did you mean '--model'? (--help lists them)"},
        Unknown{"an_option_with_its_value",
                {"allan", "--recrod=x"},
                "zerodrift: unknown option '--recrod'; did you mean '--record'? (--help lists "
                "them)"},
        Unknown{"an_option_with_one_dash",
                {"allan", "-record", "x"},
                "zerodrift: unknown option '-record'; did you mean '--record'? (--help lists "
                "them)"},
        Unknown{"an_option_of_a_program",
                {"discovery-server", "--domian", "3"},
                "discovery_server: unknown option '--domian'; did you mean '--domain'? (--help "
                "lists them)"},
        Unknown{"a_value",
                {"gyro-publisher", "--source", "seral"},
                "gyro_publisher: --source: found 'seral'; did you mean 'serial'? (--help tells "
                "more)"},
        Unknown{"a_value_with_nothing_near",
                {"compensation", "--transport", "pigeon"},
                "compensation: --transport: found 'pigeon'; valid: shm, udp (--help tells more)"},
        Unknown{"an_option_with_nothing_near",
                {"allan", "--colour"},
                "zerodrift: unknown option '--colour' (--help lists them)"}),
    [](const auto& info) { return info.param.name; });

// A duration or rate that isn't one would be left aside in silence, and more done than was asked.
TEST_F(CommandLine, NoDurationOrRateOfZeroOrLessOrBeyondMeasureIsTakenByAnyCommand) {
  const std::string model = std::string(ZERODRIFT_SOURCE_DIR) + "/config/models/lab_fog.yaml";
  const std::string profile = std::string(ZERODRIFT_SOURCE_DIR) + "/config/profiles/";
  const Arguments simulate{"simulate", "--model", model, "--profile", profile + "turns.yaml",
                           "--out",    "@o.csv"};
  const Arguments publish{"gyro-publisher", "--domain", "119"};
  const Arguments replay{"replay", "--domain", "119", "--record", "@r.csv"};
  const std::vector<std::pair<Arguments, std::string>> options{
      {simulate, "--rate"},
      {simulate, "--duration"},
      {publish, "--rate"},
      {publish, "--duration"},
      {publish, "--frame-rate"},
      {replay, "--to"},
      {{"thermal-publisher", "--domain", "119"}, "--duration"},
      {{"thermal-publisher", "--domain", "119"}, "--rate"},
      {{"compensation", "--domain", "119"}, "--stale-after"},
      {{"compensation", "--domain", "119"}, "--peer-within"},
      {{"compensation", "--domain", "119"}, "--checkpoint-period"},
      {{"record", "--domain", "119", "--out", "@o.mcap"}, "--duration"},
      {{"compare", "--model", model, "--profile", profile + "turns.yaml"}, "--rate"}};
  for (const auto& [command, option] : options) {
    for (const std::string value : {"0", "-5", "1e300", "nan"}) {
      SCOPED_TRACE(command[0] + " " + option + " " + value);
      Arguments all = command;
      all.push_back(option + "=" + value);
      const Finished done = run(all);
      EXPECT_EQ(done.exit_code, 2) << done.out;
      EXPECT_NE(done.err.find(option + ": found '" + value + "', expected a "), std::string::npos)
          << done.err;
    }
  }
  Arguments from = replay;
  from.push_back("--from=1e300");
  EXPECT_EQ(run(from).exit_code, 2);
}

TEST_F(CommandLine, ATimeMayHaveAFractionOfASecond) {
  const Finished health = run({"health", "--file", "@none", "--max-age", "200ms"});
  EXPECT_EQ(health.exit_code, 1) << health.err;
  EXPECT_NE(health.err.find("cannot be read"), std::string::npos) << health.err;
  const Finished service = run({"compensation", "--domain", "119", "--checkpoint-period", "1500ms",
                                "--config", "@none.yaml"});
  EXPECT_EQ(service.exit_code, 2);
  EXPECT_NE(service.err.find("none.yaml"), std::string::npos) << service.err;
}

TEST_F(CommandLine, AnIdOfNoGyroOrANumberOfSubscribersBelowNoneIsRefusedInOneLine) {
  for (const auto& [option, value] :
       {std::pair{"--ros2-imu", "0=imu"}, std::pair{"--await-subscribers", "-1"}}) {
    const Finished done = run({"compensation", "--domain", "119", option, value});
    EXPECT_EQ(done.exit_code, 2) << option;
    EXPECT_NE(done.err.find(option), std::string::npos) << done.err;
    EXPECT_EQ(done.err.find('\n'), done.err.size() - 1) << done.err;
  }
}

}  // namespace
}  // namespace zerodrift::cli_test
