// SPDX-License-Identifier: Apache-2.0
// A record on which no model ever came into force says so first, with the reason and what would be
// right, and gives no ratio; one of which no temperature was ever used says that; one whose samples
// are far apart is no such record.
#include <cmath>
#include <string>

#include "tests/cli/command_line.h"

namespace zerodrift::cli_test {
namespace {

// Of samples `interval_s` apart: a drift that follows the temperature, a fixed pattern for noise,
// and a swing of so many rad/s.
std::string record_of(int samples, double interval_s, double swing_radps = 0.0) {
  std::string text = "time_s,rate_z_rad_s,temperature_coil_degC\n";
  for (int k = 1; k <= samples; ++k) {
    const double temperature_degc = 20.0 + 10.0 * std::sin(0.05 * k);
    const double rate_radps =
        1e-6 * temperature_degc + 1e-7 * std::sin(1.7 * k * k) + swing_radps * std::sin(0.05 * k);
    char row[96];
    std::snprintf(row, sizeof row, "%g,%.9e,%.4f\n", k * interval_s, rate_radps, temperature_degc);
    text += row;
  }
  return text;
}

// The first line that is no doubt of the record itself.
std::string first_of_results(const std::string& out) {
  std::size_t begin = 0;
  while (out.compare(begin, 10, "doubtful: ") == 0) begin = out.find('\n', begin) + 1;
  return out.substr(begin, out.find('\n', begin) - begin);
}

class NoModel : public CommandLine {
 protected:
  // Both commands end well, and begin with the one line that names the reason and the remedy.
  void expect_said_first(const std::string& reason, const std::string& remedy,
                         const Arguments& more = {}) {
    for (const std::string command : {"compensate", "compare"}) {
      const Finished done = run(system_test::operator+({command, "--record", "@r.csv"}, more));
      EXPECT_EQ(done.exit_code, 0) << done.err;
      const std::string first = first_of_results(done.out);
      for (const std::string& part : {std::string("r.csv: no model ever came into force"), reason,
                                      remedy, std::string("not comparable")})
        EXPECT_NE(first.find(part), std::string::npos) << command << ": " << done.out << done.err;
      if (command == "compare") {
        EXPECT_TRUE(done.out.ends_with(first + "\n")) << done.out;
      } else {
        // A table only of what two minutes gave, and then without a ratio.
        const std::size_t row = done.out.find("\nz ");
        EXPECT_NE(done.out.find(row == std::string::npos ? "\nno table: " : "not comparable",
                                row == std::string::npos ? 0 : row),
                  std::string::npos)
            << done.out;
        EXPECT_EQ(done.out.find("0.00000"), std::string::npos) << done.out;
      }
    }
  }
};

TEST_F(NoModel, ARecordOfSevenSecondsSaysHowLongAFirstModelTakes) {
  system_test::write(path("r.csv"), record_of(7, 1.0));
  expect_said_first("no_estimate_yet", "spans 6.00 s, a first model takes at least 26.0 s");
}

TEST_F(NoModel, ARecordAllInMotionAsksForRestOrATrueRate) {
  system_test::write(path("r.csv"), record_of(1200, 0.05, 0.1));
  expect_said_first("no_estimate_yet", "rest, or with its true rate");
}

TEST_F(NoModel, ALevelAboveTheLargestDriftNamesTheKey) {
  system_test::write(path("r.csv"), record_of(600, 1.0));
  system_test::write(path("c.yaml"), "learning: {max_drift_deg_h: 0.001}\n");
  expect_said_first("level_implausible", "learning.max_drift_deg_h", {"--config", "@c.yaml"});
}

// What needs no temperature compensates, and is judged.
TEST_F(NoModel, ATemperatureThatIsAlwaysTooOldNamesTheKey) {
  std::string text = record_of(40, 1.0);
  for (int t = 41; t <= 600; ++t)
    text += std::to_string(t) + ",1." + std::to_string(t % 7) + "e-5,\n";
  system_test::write(path("r.csv"), text);
  system_test::write(path("c.yaml"), "temperature_rate: {window_s: 300}\n");
  for (const std::string command : {"compensate", "compare"}) {
    const Finished done = run({command, "--record", "@r.csv", "--config", "@c.yaml"});
    EXPECT_EQ(done.exit_code, 0) << done.err;
    const std::string first = first_of_results(done.out);
    for (const char* part : {"r.csv: no temperature was ever used", "its course in time alone",
                             "temperature_stale", "temperature_stale_s"})
      EXPECT_NE(first.find(part), std::string::npos) << command << ": " << done.out << done.err;
    EXPECT_EQ(done.out.find("not comparable"), std::string::npos) << done.out;
    EXPECT_EQ(done.out.ends_with(first + "\n"), command == "compare") << done.out;
  }
}

TEST_F(NoModel, NoneOfIsSaidOfARecordWithASampleEveryTenSecondsOrMinutes) {
  for (const double interval_s : {10.0, 60.0, 600.0}) {
    system_test::write(path("r.csv"), record_of(200, interval_s));
    const Finished done = run({"compensate", "--record", "@r.csv"});
    EXPECT_EQ(done.exit_code, 0) << done.err;
    EXPECT_EQ(done.out.find("no model"), std::string::npos) << done.out;
    EXPECT_EQ(done.out.find("not comparable"), std::string::npos) << done.out;
    const Finished compared = run({"compare", "--record", "@r.csv", "--schemes", "none,stack"});
    EXPECT_EQ(compared.exit_code, 0) << compared.err;
    EXPECT_NE(compared.out.find("axis z, one ahead"), std::string::npos) << compared.out;
  }
}

}  // namespace
}  // namespace zerodrift::cli_test
