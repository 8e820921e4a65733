// SPDX-License-Identifier: Apache-2.0
// Wrong usage and bad input at the start: exit code 2 and one line that names file, line or key.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "tests/system/files.h"
#include "tests/system/pipeline.h"

namespace zerodrift::system_test {
namespace {

using namespace std::chrono_literals;

constexpr const char* kGoodRecord =
    "time_s,rate_x_rad_s,temperature_coil_degC\n0.0,1e-6,20\n0.1,1e-6,20\n0.2,1e-6,20\n";
const std::string kDomain = std::to_string(static_cast<std::uint32_t>(Domain::kBadStart));

struct Case {
  std::string what;
  std::string program;
  Arguments arguments;             // "@name" stands for a file of the test's folder
  std::vector<std::string> named;  // each must be part of the line
};

std::vector<Case> bad_starts() {
  const Arguments publish{"--source", "record", "--domain", kDomain, "--record"};
  const auto record = [&](const Arguments& more) {
    Arguments all = publish;
    all.insert(all.end(), more.begin(), more.end());
    return all;
  };
  const Arguments simulation{"--source", "simulation", "--domain", kDomain};
  return {
      {"unknown key",
       "compensation",
       {"--config", "@unknown_key.yaml", "--domain", kDomain},
       {"unknown_key.yaml", "capasity"}},
      {"wrong value",
       "compensation",
       {"--config", "@wrong_value.yaml", "--domain", kDomain},
       {"wrong_value.yaml", "epsilon"}},
      {"no such configuration",
       "compensation",
       {"--config", "@none.yaml", "--domain", kDomain},
       {"none.yaml"}},
      {"unknown option",
       "compensation",
       {"--no-such-option", "--domain", kDomain},
       {"--no-such-option"}},
      {"domain too large", "compensation", {"--domain", "300"}, {"--domain", "300"}},
      {"domain too large", "allan_monitor", {"--domain", "-1"}, {"--domain"}},
      {"interface not of this machine",
       "allan_monitor",
       {"--domain", kDomain, "--interface", "203.0.113.1"},
       {"203.0.113.1"}},
      {"missing record", "gyro_publisher", record({"@none.csv"}), {"none.csv"}},
      {"missing record", "thermal_publisher", record({"@none.csv"}), {"none.csv"}},
      {"missing record", "zerodrift", {"compensate", "--record", "@none.csv"}, {"none.csv"}},
      {"wrong unit in the header",
       "gyro_publisher",
       record({"@wrong_unit.csv"}),
       {"wrong_unit.csv", "rate_x_furlongs"}},
      {"wrong unit in --columns",
       "gyro_publisher",
       record({"@good.csv", "--columns", "rate_x=rate_x_rad_s[deg/fortnight]"}),
       {"deg/fortnight"}},
      {"wrong unit in --columns",
       "zerodrift",
       {"compensate", "--record", "@good.csv", "--columns", "rate_x=rate_x_rad_s[furlong]"},
       {"furlong"}},
      {"no such column",
       "thermal_publisher",
       record({"@good.csv", "--columns", "temperature_coil=nowhere[degC]"}),
       {"nowhere"}},
      {"wrong speed",
       "gyro_publisher",
       record({"@good.csv", "--speed", "fast"}),
       {"--speed", "fast"}},
      {"no source", "gyro_publisher", {"--domain", kDomain}, {"--source"}},
      {"no model", "gyro_publisher", simulation, {"--model"}},
      {"no device",
       "gyro_publisher",
       {"--source", "serial", "--device", "@none", "--domain", kDomain},
       {"none"}},
      {"no thermometer",
       "thermal_publisher",
       {"--source", "sysfs", "--sysfs-root", "@none", "--domain", kDomain},
       {"none", "--probe"}},
      {"no subcommand", "zerodrift", {}, {"subcommand"}},
      {"unknown scheme",
       "zerodrift",
       {"compensate", "--record", "@good.csv", "--scheme", "magic"},
       {"--scheme", "magic"}},
      {"broken row",
       "zerodrift",
       {"compensate", "--record", "@broken_row.csv"},
       {"broken_row.csv", "3"}},
  };
}

TEST(BadStart, EndsWithCodeTwoAndOneLineThatNamesWhatIsWrong) {
  SystemUnderTest system(Domain::kBadStart);
  write(system.path("unknown_key.yaml"), "svr:\n  capasity: 100\n");
  write(system.path("wrong_value.yaml"), "svr:\n  epsilon: narrow\n");
  write(system.path("good.csv"), kGoodRecord);
  write(system.path("wrong_unit.csv"), "time_s,rate_x_furlongs\n0.0,1e-6\n");
  write(system.path("broken_row.csv"), "time_s,rate_x_rad_s\n0.0,1e-6\n0.1,zero\n0.2,1e-6\n");
  for (const Case& bad : bad_starts()) {
    SCOPED_TRACE(bad.program + ": " + bad.what);
    Arguments arguments = bad.arguments;
    for (auto& argument : arguments) {
      if (argument.starts_with('@')) argument = system.path(argument.substr(1));
    }
    const Finished end = system.run(bad.program, arguments, 10s);
    EXPECT_EQ(end.exit_code, 2) << end.out << end.err;
    EXPECT_EQ(std::count(end.err.begin(), end.err.end(), '\n'), 1) << end.err;
    for (const auto& name : bad.named) {
      EXPECT_NE(end.err.find(name), std::string::npos) << name << " is not named in: " << end.err;
    }
  }
}

// A record that was cut in its last line is still good for all the lines before it; the cut is
// told.
TEST(BadStart, ARecordCutInItsLastLineIsUsedUpToThereAndTheCutIsTold) {
  SystemUnderTest system(Domain::kTruncatedRecord);
  write(system.path("cut.csv"), std::string(kGoodRecord) + "0.3,1e-");
  const Finished end = system.run("zerodrift", {"compensate", "--record", system.path("cut.csv"),
                                                "--out", system.path("out.csv")});
  EXPECT_EQ(end.exit_code, 0);
  EXPECT_NE(end.err.find("cut.csv"), std::string::npos) << end.err;
  EXPECT_EQ(read_table(system.path("out.csv")).rows.size(), 3U);
}

// A record that goes bad in the middle, beyond the rows that are looked at before anything starts:
// what came before it is answered, the publishers say where it went bad and end with 2, the service
// goes on.
TEST(BadStart, ARecordThatGoesBadInTheMiddleEndsItsPublisherAlone) {
  SystemUnderTest system(Domain::kBadInTheMiddle);
  constexpr std::size_t kGoodRows = 2000;
  std::string record = "time_s,rate_x_rad_s,temperature_coil_degC\n";
  for (std::size_t k = 0; k < kGoodRows; ++k)
    record += std::to_string(0.01 * static_cast<double>(k)) + ",1e-6,20\n";
  write(system.path("bad.csv"), record + "20.1,zero,20\n20.2,1e-6,20\n");
  dds::Participant participant("test", system.network());
  Collector<msg::CompensatedRate> answers(participant);
  ChildProcess& compensation = system.start("compensation", {"--await-subscribers", "1"});
  const Arguments source{"--source", "record", "--record", system.path("bad.csv"),
                         "--speed",  "max"};
  ChildProcess& thermal = system.start("thermal_publisher", source);
  ChildProcess& gyro = system.start("gyro_publisher", source);
  EXPECT_EQ(gyro.wait(10s), 2);
  EXPECT_EQ(thermal.wait(10s), 2);
  for (const ChildProcess* publisher : {&gyro, &thermal}) {
    const std::string err = publisher->err();
    EXPECT_EQ(std::count(err.begin(), err.end(), '\n'), 1) << err;
    EXPECT_NE(err.find("bad.csv:2002"), std::string::npos) << err;
  }
  EXPECT_TRUE(eventually([&] { return answers.size() == kGoodRows; })) << answers.size();
  EXPECT_TRUE(compensation.running());
}

}  // namespace
}  // namespace zerodrift::system_test
