// SPDX-License-Identifier: Apache-2.0
#include "services/console/metrics_text.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <regex>
#include <set>
#include <sstream>

#include "tests/support/exposition_format.h"
#include "tests/unit/console/samples.h"

namespace zerodrift::services {
namespace {

telemetry::ServiceStatus status(const std::string& service,
                                std::vector<std::tuple<std::string, std::string, double>> metrics) {
  telemetry::ServiceStatus made;
  made.set_service(service);
  made.set_alive(true);
  for (const auto& [name, unit, value] : metrics) {
    auto& metric = *made.add_metrics();
    metric.set_name(name);
    metric.set_unit(unit);
    metric.set_value(value);
  }
  return made;
}

// Value by the whole of what stands before it, e.g. `name{a="b"}`.
using Values = std::map<std::string, double>;

Values parsed(const std::string& text) {
  // Of the text format: a name, labels, a value.
  static const std::regex kLine(
      R"re(^([a-zA-Z_:][a-zA-Z0-9_:]*(\{([a-zA-Z_]\w*="([^"\\]|\\.)*",?)*\})?) (\S+)$)re");
  Values values;
  std::set<std::string> types;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("# TYPE ")) {
      EXPECT_TRUE(types.insert(line.substr(7, line.rfind(' ') - 7)).second) << line;
    }
    if (line.starts_with("#")) continue;
    std::smatch match;
    EXPECT_TRUE(std::regex_match(line, match, kLine)) << line;
    const std::string value = match[5];
    EXPECT_TRUE(values
                    .emplace(match[1], value == "Nan" || value == "NaN"
                                           ? std::nan("")
                                           : std::strtod(value.c_str(), nullptr))
                    .second)
        << "twice: " << line;
  }
  return values;
}

class Metrics : public testing::Test {
 protected:
  void add(const telemetry::ServiceStatus& one) { services_[one.service()] = one; }
  [[nodiscard]] Values values() const {
    const std::string text = metrics_text({.services = services_, .allan = allan_, .unix_ns = 1});
    EXPECT_EQ(test_support::exposition_problems(text), std::vector<std::string>{});
    return parsed(text);
  }
  std::map<std::string, telemetry::ServiceStatus> services_;
  std::map<Gateway::GyroAxisStream, telemetry::AllanReport> allan_;
};

TEST_F(Metrics, CarryBaseUnitsAndLabels) {
  add(status("compensation", {{"samples_in", "1", 5.0}, {"arrival_p99", "us", 250.0}}));
  add(status("compensation:1", {{"drift_x", "deg/h", 2.5},
                                {"temperature", "degC", 21.0},
                                {"scale_factor_z", "ppm", 300.0}}));
  const Values all = values();
  EXPECT_DOUBLE_EQ(
      all.at(R"(zerodrift_scale_factor_ratio{axis="z",part="1",service="compensation"})"), 300e-6);
  EXPECT_EQ(all.at(R"(zerodrift_samples_in{service="compensation"})"), 5.0);
  EXPECT_DOUBLE_EQ(all.at(R"(zerodrift_arrival_p99_seconds{service="compensation"})"), 250e-6);
  EXPECT_EQ(all.at(R"(zerodrift_drift_degrees_per_hour{axis="x",part="1",service="compensation"})"),
            2.5);
  EXPECT_EQ(all.at(R"(zerodrift_temperature_celsius{part="1",service="compensation"})"), 21.0);
  EXPECT_EQ(all.at(R"(zerodrift_service_up{service="compensation"})"), 1.0);
}

TEST_F(Metrics, BucketsBecomeAHistogramThatGrowsToItsCount) {
  add(status("compensation:latency", {{"arrival_le_1ms", "1", 7.0},
                                      {"arrival_le_50us", "1", 3.0},
                                      {"arrival_le_1s", "1", 9.0},
                                      {"arrival_count", "1", 10.0},
                                      {"arrival_incomparable", "1", 4.0}}));
  const Values all = values();
  const auto bucket = [&](const std::string& bound) {
    return all.at(
        R"(zerodrift_hop_latency_seconds_bucket{hop="arrival",service="compensation",le=")" +
        bound + "\"}");
  };
  EXPECT_EQ(bucket("5e-05") + bucket("0.001") + bucket("1"), 3.0 + 7.0 + 9.0);
  EXPECT_EQ(bucket("+Inf"), 10.0);
  const std::string of = R"({hop="arrival",service="compensation"})";
  EXPECT_EQ(all.at("zerodrift_hop_latency_seconds_count" + of), 10.0);
  EXPECT_TRUE(std::isnan(all.at("zerodrift_hop_latency_seconds_sum" + of)));
  EXPECT_TRUE(
      all.contains(R"(zerodrift_arrival_incomparable{part="latency",service="compensation"})"));
}

TEST_F(Metrics, AllanCoefficientsOfBothStreams) {
  telemetry::AllanReport report;
  auto& coefficient = *report.add_coefficients();
  coefficient.set_symbol("N");
  coefficient.set_unit("deg/sqrt(h)");
  coefficient.set_value(0.01);
  coefficient.set_upper(0.02);
  coefficient.set_identified(1);
  allan_[{1, 2, 0}] = report;
  coefficient.set_identified(2);  // an upper bound is no value
  allan_[{1, 2, 1}] = report;
  coefficient.set_identified(3);  // and what is withheld is no figure
  allan_[{1, 1, 0}] = report;
  const Values all = values();
  const auto of = [](const char* stream) {
    return std::string(R"({axis="z",gyro="1",stream=")") + stream +
           R"re(",symbol="N",unit="deg/sqrt(h)"})re";
  };
  EXPECT_EQ(all.at("zerodrift_allan_coefficient" + of("raw")), 0.01);
  EXPECT_FALSE(all.contains("zerodrift_allan_coefficient" + of("compensated")));
  EXPECT_EQ(all.at("zerodrift_allan_coefficient_upper" + of("compensated")), 0.02);
  EXPECT_TRUE(std::none_of(all.begin(), all.end(), [](const auto& value) {
    return value.first.find(R"({axis="y")") != std::string::npos;
  }));
}

TEST_F(Metrics, NamesAndTextsOfAnySortKeepTheFormat) {
  add(status("a\"b\\c\nd:e{}", {{"x y-z/0", "1", 1.0},
                                {"x_y_z_0", "1", 2.0},  // the same name once it is safe
                                {"", "1", 3.0},
                                {"infinite", "1", std::numeric_limits<double>::infinity()},
                                {"none", "1", std::nan("")}}));
  EXPECT_GE(values().size(), 5U);  // parsed() holds each line to the format and each name to once
}

}  // namespace
}  // namespace zerodrift::services
