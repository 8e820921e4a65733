// SPDX-License-Identifier: Apache-2.0
// `zerodrift allan` as its users call it: a published table reproduced from the raw log, gaps and
// faults told and not hidden, and bad input refused in one line.
#include <gtest/gtest.h>
#include <stdlib.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>
#include <string>

#include "tests/system/files.h"
#include "tests/system/system_under_test.h"

namespace zerodrift::system_test {
namespace {

using namespace std::chrono_literals;
using Json = nlohmann::ordered_json;

constexpr double kPeriod = 0.01;
constexpr double kSigma = 1e-5;  // rad/s
constexpr double kRadPerDeg = 3.14159265358979323846 / 180.0;

struct Sample {
  double time_s = 0.0;
  double rate_radps = 0.0;
  bool is_blank = false;
  bool is_dropped = false;
};

using Change = std::function<void(std::vector<Sample>&)>;

// White noise on one axis at 100 Hz, changed and written as a record.
std::string record(std::size_t samples, const Change& change = {}) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> noise(0.0, kSigma);
  std::vector<Sample> all(samples);
  for (std::size_t i = 0; i < samples; ++i)
    all[i] = {kPeriod * static_cast<double>(i), noise(random)};
  if (change) change(all);
  std::string text = "time_s,rate_z_rad_s\n";
  char row[64];
  for (const Sample& one : all) {
    if (one.is_dropped) continue;
    if (one.is_blank) {
      std::snprintf(row, sizeof row, "%.6f,\n", one.time_s);
    } else {
      std::snprintf(row, sizeof row, "%.6f,%.12e\n", one.time_s, one.rate_radps);
    }
    text += row;
  }
  return text;
}

Finished allan(SystemUnderTest& system, const std::filesystem::path& file, Arguments more = {}) {
  Arguments arguments{"allan", "--record", file, "--json", system.path("out.json")};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return system.run("zerodrift", arguments, 60s);
}

Json json_of(const std::filesystem::path& file) {
  return Json::parse(content(file));
}

struct Analysed {
  Finished end;
  Json raw;  // of axis z
};

Analysed analysed(SystemUnderTest& system, const std::string& text, const Arguments& more = {}) {
  write(system.path("r.csv"), text);
  Analysed result{allan(system, system.path("r.csv"), more), {}};
  EXPECT_EQ(result.end.exit_code, 0) << result.end.err;
  if (result.end.exit_code == 0)
    result.raw = json_of(system.path("out.json")).at("axis").at("z").at("raw");
  return result;
}

std::ptrdiff_t lines(const std::string& text) {
  return std::count(text.begin(), text.end(), '\n');
}

const Json& at_tau(const Json& points, double tau_s) {
  for (const Json& point : points) {
    if (std::abs(point.at("tau_s").get<double>() / tau_s - 1.0) < 1e-6) return point;
  }
  throw std::out_of_range("no point at tau " + std::to_string(tau_s));
}

double deviation(const Json& points, double tau_s) {
  return at_tau(points, tau_s).at("deviation_rad_s").get<double>();
}

// 5 sigma of the estimate, on the log scale.
void expect_white(const Json& raw, double tau_s, double also = 0.0) {
  const Json& p = at_tau(raw.at("oadev"), tau_s);
  const double edf = p.at("degrees_of_freedom").get<double>();
  EXPECT_NEAR(std::log(p.at("deviation_rad_s").get<double>() / kSigma * std::sqrt(tau_s / kPeriod)),
              0.0, also + 5.0 / std::sqrt(2.0 * edf))
      << "tau " << tau_s;
}

// ------------------------------------------------------------------------------------- answers

// Columns of the published table: sensor,axis,fs_hz,n_samples,tau_s,avar,adev,...; deg/s. It has
// six digits; 1e-5 is what was promised.
TEST(AllanCommand, ReproducesThePublishedTableOfAStaticLog) {
  const std::filesystem::path folder =
      std::filesystem::path(ZERODRIFT_SHARED_DIR) / "data/adis16405_static";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "not here: " << folder;
  SystemUnderTest system(Domain::kAllanCommand);
  const Finished end =
      allan(system, folder / "adis16405_run1.csv.xz",
            {"--columns",
             "rate_x=gx_lsb*0.05[deg/s],rate_y=gy_lsb*0.05[deg/s],rate_z=gz_lsb*0.05[deg/"
             "s],time=row*0.01"});
  ASSERT_EQ(end.exit_code, 0) << end.err;
  const Json axes = json_of(system.path("out.json")).at("axis");
  std::ifstream table(folder / "expected_oadev_run1.csv");
  std::string line;
  std::getline(table, line);
  int compared = 0;
  double worst = 0.0;
  while (std::getline(table, line)) {
    std::stringstream cells(line);
    std::vector<std::string> cell;
    for (std::string one; std::getline(cells, one, ',');) cell.push_back(one);
    const std::string axis = cell.at(1) == "X" ? "x" : cell.at(1) == "Y" ? "y" : "z";
    const double found =
        deviation(axes.at(axis).at("raw").at("oadev"), std::stod(cell.at(4))) / kRadPerDeg;
    worst = std::max(worst, std::abs(found / std::stod(cell.at(6)) - 1.0));
    ++compared;
  }
  std::printf("%d published values, worst relative difference %.1e\n", compared, worst);
  EXPECT_EQ(compared, 54);
  EXPECT_LT(worst, 1e-5);
}

TEST(AllanCommand, EqualInputGivesEqualBytesWithTheMarksOnThePage) {
  SystemUnderTest system(Domain::kAllanCommand);
  write(system.path("r.csv"), record(20000));
  ASSERT_EQ(::setenv("SOURCE_DATE_EPOCH", "951782400", 1), 0);
  const Arguments arguments{"allan",
                            "--record",
                            system.path("r.csv"),
                            "--json",
                            system.path("out.json"),
                            "--html",
                            system.path("out.html")};
  for (const std::string name : {"a", "b"}) {
    const Finished end = system.run("zerodrift", arguments);
    ASSERT_EQ(end.exit_code, 0) << end.err;
    EXPECT_EQ(end.err, "");
    for (const std::string kind : {".json", ".html"})
      std::filesystem::rename(system.path("out" + kind), system.path(name + kind));
  }
  EXPECT_EQ(first_difference(system.path("a.json"), system.path("b.json")), "");
  EXPECT_EQ(first_difference(system.path("a.html"), system.path("b.html")), "");
  const std::string page = content(system.path("a.html"));
  EXPECT_TRUE(page.ends_with("</html>\n"));
  for (const auto* mark : {"<svg", "overlapping Allan deviation", "fitted model", "slopes -1",
                           "at 1.00 s", "at 3.00 s", "√3 s", "√2 s", "deg/√h"})
    EXPECT_NE(page.find(mark), std::string::npos) << mark;
  const Json json = json_of(system.path("a.json"));
  const Json& raw = json.at("axis").at("z").at("raw");
  EXPECT_EQ(raw.at("method"), "full_overlap");
  const Json& n = raw.at("coefficients").at("angle_random_walk_rad_rts");
  // 5 sigma of the shortest tau's estimate, which weighs most: 15 652 degrees of freedom.
  EXPECT_NEAR(std::log(n.at("value").get<double>() / (kSigma * std::sqrt(kPeriod))), 0.0,
              5.0 / std::sqrt(2.0 * 15652.0));
  EXPECT_LT(n.at("lower").get<double>(), n.at("value").get<double>());
  EXPECT_GT(n.at("upper").get<double>(), n.at("value").get<double>());
  expect_white(raw, 0.01);
  expect_white(raw, 0.64);
}

TEST(AllanCommand, GivesEveryStatisticOnEitherGrid) {
  SystemUnderTest system(Domain::kAllanCommand);
  const auto found = analysed(system, record(3000),
                              {"--statistic", "oadev,adev,mdev,tdev,hdev,ohdev,totdev", "--taus",
                               "quarter", "--confidence", "0.683"});
  for (const auto* name : {"oadev", "adev", "mdev", "hdev", "ohdev", "totdev"}) {
    const Json& p = at_tau(found.raw.at(name), 0.19);
    EXPECT_LT(p.at("lower_rad_s").get<double>(), p.at("deviation_rad_s").get<double>()) << name;
    EXPECT_GT(p.at("upper_rad_s").get<double>(), p.at("deviation_rad_s").get<double>()) << name;
    EXPECT_NE(found.end.out.find(name), std::string::npos) << name;
  }
  EXPECT_GT(at_tau(found.raw.at("tdev"), 0.19).at("deviation_rad").get<double>(), 0.0);
}

// 500 deg/h of true rotation, told by the reference; the drift is what is left.
TEST(AllanCommand, WhereThereIsAReferenceTheDriftIsAnalysed) {
  SystemUnderTest system(Domain::kAllanCommand);
  std::string text = "time_s,rate_z_deg_h,reference_z_deg_h\n";
  std::mt19937_64 random(2);
  std::normal_distribution<double> noise(0.0, 1.0);
  for (int i = 0; i < 4000; ++i) {
    const double truth = i % 1000 < 500 ? 0.0 : 500.0;
    text += std::to_string(0.01 * i) + "," + std::to_string(truth + noise(random)) + "," +
            std::to_string(truth) + "\n";
  }
  const auto found = analysed(system, text);
  EXPECT_NE(found.end.out.find("rate - reference"), std::string::npos);
  EXPECT_TRUE(json_of(system.path("out.json")).at("axis").at("z").at("less_reference"));
  EXPECT_LT(deviation(found.raw.at("oadev"), 5.12), 1.0 * kRadPerDeg / 3600.0);
}

TEST(AllanCommand, ACompensatedRecordIsAnalysedBesideWhatItWas) {
  SystemUnderTest system(Domain::kAllanCommand);
  std::string text = "# stream: compensated\ntime_s,rate_z_rad_s,applied_drift_z_rad_s\n";
  std::mt19937_64 random(3);
  std::normal_distribution<double> noise(0.0, kSigma);
  for (int i = 0; i < 20000; ++i) {
    char row[96];
    std::snprintf(row, sizeof row, "%.2f,%.12e,%.12e\n", 0.01 * i, noise(random), 1e-6 * 0.01 * i);
    text += row;
  }
  const auto found = analysed(system, text, {"--html", system.path("out.html")});
  EXPECT_EQ(found.end.err, "");
  const std::string verdict = json_of(system.path("out.json")).at("verdict");
  EXPECT_NE(verdict.find("compensated over raw: N "), std::string::npos) << verdict;
  const Json axis = json_of(system.path("out.json")).at("axis").at("z");
  // A ramp R gives R tau / sqrt(2), far above the white noise here.
  EXPECT_NEAR(deviation(axis.at("raw").at("oadev"), 40.96), 1e-6 * 40.96 / std::sqrt(2.0), 1e-6);
  EXPECT_LT(deviation(axis.at("compensated").at("oadev"), 40.96), 1e-6);
}

TEST(AllanCommand, ThroughTheCascadeItSaysTheSame) {
  SystemUnderTest system(Domain::kAllanCommand);
  const auto kept = analysed(system, record(40000));
  const auto streamed =
      analysed(system, record(40000), {"--memory", "0", "--statistic", "oadev,mdev"});
  EXPECT_EQ(streamed.raw.at("method"), "cascade");
  EXPECT_NE(streamed.end.err.find("left out: mdev"), std::string::npos) << streamed.end.err;
  for (const Json& point : kept.raw.at("oadev")) {
    const double tau_s = point.at("tau_s").get<double>();
    const double edf = point.at("degrees_of_freedom").get<double>();
    // A sixteenth of the differences: within a third of a sigma. Up to 16 samples the same
    // differences, of an angle in steps of 2^-40 rad beside a noise of 1e-7 rad.
    const double tolerance = tau_s < 0.17 ? 2e-5 : 2e-5 + 0.35 / std::sqrt(2.0 * edf);
    EXPECT_NEAR(std::log(deviation(streamed.raw.at("oadev"), tau_s) /
                         point.at("deviation_rad_s").get<double>()),
                0.0, tolerance)
        << tau_s;
  }
}

// --------------------------------------------------------------------------------- gaps, faults

TEST(AllanCommandFaults, BlankAndDroppedSamplesAreGapsAndTheNoiseStays) {
  for (const bool blank : {true, false}) {
    SystemUnderTest system(Domain::kAllanCommand);
    std::mt19937_64 random(4);
    std::bernoulli_distribution lost(0.01);
    const auto found = analysed(system, record(40000, [&](std::vector<Sample>& all) {
                                  for (std::size_t i = 1; i + 1 < all.size(); ++i) {
                                    if (lost(random))
                                      (blank ? all[i].is_blank : all[i].is_dropped) = true;
                                  }
                                }));
    EXPECT_EQ(lines(found.end.err), 1) << found.end.err;
    EXPECT_NE(found.end.err.find("missing"), std::string::npos);
    EXPECT_EQ(found.raw.at("method"), "full_overlap_with_gaps");
    EXPECT_NEAR(found.raw.at("missing_samples").get<double>(), 400.0, 100.0);  // 5 sigma
    for (const double tau_s : {0.01, 0.16, 1.28, 10.24}) expect_white(found.raw, tau_s, 0.01);
  }
}

TEST(AllanCommandFaults, AnOutageIsAGapAndOtherStatisticsTakeTheLongestStretch) {
  SystemUnderTest system(Domain::kAllanCommand);
  const auto found = analysed(system,
                              record(30000,
                                     [](std::vector<Sample>& all) {
                                       for (std::size_t i = 10000; i < all.size(); ++i)
                                         all[i].time_s += 600.0;
                                     }),
                              {"--statistic", "oadev,mdev"});
  EXPECT_EQ(lines(found.end.err), 2) << found.end.err;
  EXPECT_NE(found.end.err.find("60000 samples"), std::string::npos) << found.end.err;
  EXPECT_EQ(found.raw.at("gaps"), 1);
  EXPECT_EQ(found.raw.at("mdev_stretch").at("samples"), 20000);
  for (const double tau_s : {0.01, 1.28, 10.24}) expect_white(found.raw, tau_s);
}

TEST(AllanCommandFaults, SpikesAreToldAndStayInTheFigures) {
  SystemUnderTest system(Domain::kAllanCommand);
  const auto clean = analysed(system, record(20000));
  const auto found = analysed(system, record(20000, [](std::vector<Sample>& all) {
                                all[5000].rate_radps = 1e9 * kSigma;
                                all[12000].rate_radps = -1e9 * kSigma;
                              }));
  EXPECT_EQ(lines(found.end.err), 1) << found.end.err;
  EXPECT_NE(found.end.err.find("2 samples"), std::string::npos) << found.end.err;
  EXPECT_NE(found.end.err.find("50.0"), std::string::npos) << found.end.err;
  EXPECT_EQ(found.raw.at("outliers"), 2);
  // Each spike is in two differences of 20 000 at m = 1.
  EXPECT_NEAR(deviation(found.raw.at("oadev"), 0.01), 1e9 * kSigma * std::sqrt(4.0 / 2.0 / 19999.0),
              1.0);
  EXPECT_LT(deviation(clean.raw.at("oadev"), 0.01), 1.1 * kSigma);
}

// What loggers write for nothing, and what overflows: as finite as any number, but no rate.
TEST(AllanCommandFaults, AReadingThatCanBeNoRateIsAGapThatIsTold) {
  for (const double absurd : {9.96921e36, -1e300, 1e308}) {
    SystemUnderTest system(Domain::kAllanCommand);
    const auto found = analysed(system,
                                record(20000,
                                       [&](std::vector<Sample>& all) {
                                         all[5000].rate_radps = absurd;
                                         all[5001].rate_radps = absurd;
                                       }),
                                {"--html", system.path("page.html")});
    EXPECT_NE(found.end.out.find("2 of 20000 readings"), std::string::npos) << found.end.out;
    EXPECT_EQ(found.raw.at("missing_samples"), 2);
    EXPECT_TRUE(content(system.path("page.html")).ends_with("</html>\n"));
    for (const double tau_s : {0.01, 0.16, 1.28}) expect_white(found.raw, tau_s, 0.05);
  }
}

TEST(AllanCommandFaults, AStuckSensorIsTold) {
  SystemUnderTest system(Domain::kAllanCommand);
  const auto found = analysed(system, record(20000, [](std::vector<Sample>& all) {
                                for (std::size_t i = 7000; i < 7300; ++i)
                                  all[i].rate_radps = all[6999].rate_radps;
                              }));
  EXPECT_EQ(lines(found.end.err), 1) << found.end.err;
  EXPECT_NE(found.end.err.find("stuck: 301 samples"), std::string::npos) << found.end.err;
  EXPECT_TRUE(found.raw.at("is_stuck"));
}

TEST(AllanCommandFaults, JitterOfTheStampsIsNoGap) {
  SystemUnderTest system(Domain::kAllanCommand);
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> jitter(-0.15, 0.15);
  const auto found = analysed(system, record(20000, [&](std::vector<Sample>& all) {
                                for (Sample& one : all) one.time_s += kPeriod * jitter(random);
                              }));
  EXPECT_EQ(found.end.err, "");
  EXPECT_EQ(found.raw.at("missing_samples"), 0);
  EXPECT_NEAR(json_of(system.path("out.json")).at("sample_period_s").get<double>(), kPeriod, 1e-6);
}

// ------------------------------------------------------------------------------------- refusals

TEST(AllanCommandRefusals, BadInputEndsWithCodeTwoOneLineAndNoFile) {
  SystemUnderTest system(Domain::kAllanCommand);
  write(system.path("good.csv"), record(500));
  write(system.path("one.csv"), record(1));
  write(system.path("header.csv"), "time_s,rate_z_rad_s\n");
  write(system.path("empty.csv"), "");
  write(system.path("no_rate.csv"), "time_s,temperature_coil_degC\n0,20\n1,21\n2,22\n");
  write(system.path("blank.csv"), "time_s,rate_z_rad_s\n0,\n1,\n2,nan\n");
  write(system.path("text.csv"), "time_s,rate_z_rad_s\n0,1\n1,many\n2,1\n");
  write(system.path("constant.csv"), "time_s,rate_z_rad_s\n0,1\n1,1\n2,1\n3,1\n");
  write(system.path("back.csv"),
        record(500, [](std::vector<Sample>& all) { all[300].time_s = all[100].time_s; }));
  write(system.path("two_rates.csv"), record(1000, [](std::vector<Sample>& all) {
          for (std::size_t i = 600; i < all.size(); ++i)
            all[i].time_s = all[599].time_s + 0.005 * static_cast<double>(i - 599);
        }));
  struct Case {
    std::string record;
    Arguments arguments;
    std::vector<std::string> named;
  };
  const std::vector<Case> cases{
      {"none.csv", {}, {"none.csv"}},
      {"one.csv", {}, {"one.csv", "one row"}},
      {"header.csv", {}, {"header.csv"}},
      {"empty.csv", {}, {"empty.csv"}},
      {"no_rate.csv", {}, {"no_rate.csv", "rate_x_deg_h", "--columns"}},
      {"blank.csv", {}, {"blank.csv", "no row"}},
      {"text.csv", {}, {"text.csv:3", "many"}},
      {"constant.csv", {}, {"constant.csv", "equal"}},
      {"back.csv", {}, {"back.csv:302", "strictly increases"}},
      {"two_rates.csv", {}, {"two_rates.csv", "row 601", "0.01000 s", "0.005000 s"}},
      {"good.csv", {"--statistic", "sigma"}, {"--statistic", "sigma"}},
      {"good.csv", {"--statistic", "mdev,mdev"}, {"--statistic", "mdev"}},
      {"good.csv", {"--taus", "all"}, {"--taus", "all"}},
      {"good.csv", {"--confidence", "95"}, {"--confidence", "95"}},
      {"good.csv", {"--confidence", "nan"}, {"--confidence"}},
      {"good.csv", {"--memory", "-1"}, {"--memory"}},
      {"good.csv", {"--columns", "rate_x=gyro[deg/s]"}, {"gyro"}},
      {"good.csv", {"--columns", "rate_z=rate_z_rad_s[furlong]"}, {"furlong"}},
      {"good.csv", {"--html", system.path("nowhere/out.html")}, {"nowhere"}}};
  for (const Case& bad : cases) {
    SCOPED_TRACE(bad.record + (bad.arguments.empty() ? "" : " " + bad.arguments.back()));
    const Finished end = allan(system, system.path(bad.record), bad.arguments);
    EXPECT_EQ(end.exit_code, 2) << end.out << end.err;
    EXPECT_EQ(lines(end.err), 1) << end.err;
    EXPECT_EQ(end.out, "");
    for (const auto& name : bad.named)
      EXPECT_NE(end.err.find(name), std::string::npos) << name << " is not named in: " << end.err;
  }
  EXPECT_FALSE(std::filesystem::exists(system.path("out.json")));
}

}  // namespace
}  // namespace zerodrift::system_test
