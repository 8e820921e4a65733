// SPDX-License-Identifier: Apache-2.0
// `zerodrift_bench latency` and `bench end-to-end --gyros`, short: every row is there, nothing is
// lost, the figures can be read by a program. No time is judged.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <utility>

#include "tests/system/files.h"
#include "tests/system/system_under_test.h"

namespace zerodrift::system_test {
namespace {

using namespace std::chrono_literals;
using Json = nlohmann::json;

std::string domain_of(const SystemUnderTest& system) {
  return std::to_string(system.network().domain);
}

std::size_t lines_of(const std::string& text) {
  return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
}

TEST(BenchLatency, AShortRunHasEveryRowAndLosesNothing) {
  SystemUnderTest system(Domain::kBenchLatency);
  const auto file = system.path("latency.json");
  const Finished bench = system.run(
      "zerodrift_bench", {"latency", "--rate", "200,1000", "--seconds", "0.3", "--load", "none",
                          "--json", file.string(), "--domain", domain_of(system)});
  // 1: a goal was missed, which says nothing on a machine that does other things too.
  ASSERT_TRUE(bench.exit_code == 0 || bench.exit_code == 1) << bench.err;
  EXPECT_TRUE(bench.err.empty()) << "no progress where nobody watches: " << bench.err;

  const Json figures = Json::parse(content(file));
  std::set<std::pair<std::string, double>> seen;
  for (const auto& row : figures.at("rows")) {
    const auto kind = row.at("row").get<std::string>();
    seen.insert({kind, row.at("rate_hz").get<double>()});
    EXPECT_NE(bench.out.find(row.at("text").get<std::string>()), std::string::npos) << kind;
    for (const char* direction : {"one_way", "round_trip"}) {
      const auto& cell = row.at(direction);
      EXPECT_GT(cell.at("sent").get<int>(), 0) << kind << ' ' << direction;
      EXPECT_EQ(cell.at("lost").get<int>(), 0) << kind << ' ' << direction;
      EXPECT_GT(cell.at("p50_us").get<double>(), 0.0) << kind << ' ' << direction;
    }
  }
  std::set<std::string> kinds{"udp", "futex", "best-effort", "topic", "chain"};
  const auto folder = std::filesystem::path(ZERODRIFT_BIN_DIR);
  if (std::filesystem::exists(folder / "libzerodrift_cyclone_hop.so")) kinds.insert("cyclone");
  for (const std::string& kind : kinds) {
    EXPECT_TRUE(seen.contains({kind, 200.0})) << kind;
    EXPECT_TRUE(seen.contains({kind, 1000.0})) << kind;
  }
}

TEST(BenchLatency, LossIsRepairedByTheTopicsQosAndSeenInBestEffort) {
  SystemUnderTest system(Domain::kBenchAlternatives);
  const auto file = system.path("alternatives.json");
  // 1000 samples at 2 %: best effort loses none of them with a probability of 2e-9.
  const Finished bench =
      system.run("zerodrift_bench",
                 {"latency", "--alternatives", "--only", "topic", "--rate", "1000", "--seconds",
                  "1", "--json", file.string(), "--domain", domain_of(system)});
  ASSERT_EQ(bench.exit_code, 0) << bench.err;
  const Json lossy = Json::parse(content(file)).at("with_loss").at("rows");
  ASSERT_EQ(lossy.size(), 2u);
  for (const auto& row : lossy) {
    const int lost = row.at("one_way").at("lost").get<int>();
    if (row.at("row") == "best-effort") {
      EXPECT_GT(lost, 0);
    }
    if (row.at("row") == "topic") {
      EXPECT_EQ(lost, 0);
    }
  }
}

TEST(BenchLatency, RealtimeThatIsNotPermittedIsRefusedInOneLine) {
  SystemUnderTest system(Domain::kBenchRefused);
  // A core that no machine has: refused whatever rights the test runs with.
  const Finished bench = system.run("zerodrift_bench", {"latency", "--realtime", "--cores", "1023",
                                                        "--domain", domain_of(system)});
  EXPECT_EQ(bench.exit_code, 2);
  EXPECT_EQ(lines_of(bench.err), 1u) << bench.err;
  EXPECT_NE(bench.err.find("--realtime: "), std::string::npos) << bench.err;
  EXPECT_TRUE(bench.out.empty()) << bench.out;
}

TEST(BenchEndToEnd, ManyGyrosAreAnsweredUntilTheRateGoesNoFurther) {
  SystemUnderTest system(Domain::kBenchGyros);
  const auto file = system.path("load.json");
  // 10 s to be late: at 20 Hz a gyro, only a chain that stands still is.
  const Finished bench = system.run(
      "zerodrift_bench",
      {"end-to-end", "--gyros", "1,5", "--rate", "20", "--largest-rate", "30", "--seconds", "0.5",
       "--deadline", "10000", "--json", file.string(), "--domain", domain_of(system)});
  ASSERT_EQ(bench.exit_code, 0) << bench.err;
  const Json outcomes = Json::parse(content(file));
  ASSERT_EQ(outcomes.size(), 2u);
  for (const auto& outcome : outcomes) {
    ASSERT_TRUE(outcome.contains("last_good")) << outcome;
    EXPECT_FALSE(outcome.contains("first_bad")) << outcome;
    EXPECT_EQ(outcome.at("last_good").at("lost"), 0);
    EXPECT_EQ(outcome.at("last_good").at("sent").get<int>(), 15 * outcome.at("gyros").get<int>());
    EXPECT_GT(outcome.at("last_good").at("compensation_resident_kb").get<int>(), 0);
  }
}

TEST(BenchEndToEnd, SaysWhatIsMissing) {
  SystemUnderTest system(Domain::kBenchUsage);
  const Finished bench = system.run("zerodrift_bench", {"end-to-end"});
  EXPECT_EQ(bench.exit_code, 2);
  EXPECT_EQ(lines_of(bench.err), 1u) << bench.err;
  EXPECT_NE(bench.err.find("--gyros"), std::string::npos) << bench.err;
}

}  // namespace
}  // namespace zerodrift::system_test
