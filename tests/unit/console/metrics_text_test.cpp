// SPDX-License-Identifier: Apache-2.0
#include "services/console/metrics_text.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <regex>
#include <set>
#include <sstream>

#include "services/console/telemetry.h"
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
    const std::string text = metrics_text({.services = services_,
                                           .gyros = gyros_,
                                           .allan = allan_,
                                           .monotonic_ns = 1,
                                           .version = "1.2.3",
                                           .commit = "abc1234"});
    EXPECT_EQ(test_support::exposition_problems(text), std::vector<std::string>{});
    return parsed(text);
  }
  std::map<std::string, telemetry::ServiceStatus> services_;
  std::map<std::uint32_t, Gateway::GyroFigures> gyros_;
  std::map<Gateway::GyroAxisStream, telemetry::AllanReport> allan_;
};

TEST_F(Metrics, CarryBaseUnitsAndLabels) {
  add(status("compensation", {{"samples_in", "1", 5.0}, {"arrival_p99", "us", 250.0}}));
  add(status("compensation:1", {{"drift_x", "deg/h", 2.5},
                                {"temperature", "degC", 21.0},
                                {"temperature_rate", "degC/min", 6.0},
                                {"share_online_svr_y", "1", 0.25},
                                {"references_at_rest", "1", 3.0},
                                {"scale_factor_z", "ppm", 300.0}}));
  const Values all = values();
  const std::string of = R"(gyro="1",service="compensation"})";
  EXPECT_DOUBLE_EQ(all.at(R"(zerodrift_scale_factor_error_ratio{axis="z",)" + of), 300e-6);
  EXPECT_EQ(all.at(R"(zerodrift_samples_in_total{service="compensation"})"), 5.0);
  EXPECT_DOUBLE_EQ(
      all.at(R"(zerodrift_hop_latency_p99_seconds{hop="arrival",service="compensation"})"), 250e-6);
  EXPECT_EQ(all.at(R"(zerodrift_drift_degrees_per_hour{axis="x",)" + of), 2.5);
  EXPECT_EQ(all.at("zerodrift_temperature_celsius{" + of), 21.0);
  EXPECT_DOUBLE_EQ(all.at("zerodrift_temperature_rate_celsius_per_second{" + of), 0.1);
  EXPECT_EQ(all.at(R"re(zerodrift_expert_share{axis="y",expert="online_svr",)re" + of), 0.25);
  EXPECT_EQ(all.at("zerodrift_references_total{" + of.substr(0, of.size() - 1) +
                   R"(,verdict="at_rest"})"),
            3.0);
  EXPECT_EQ(all.at(R"(zerodrift_service_up{service="compensation"})"), 1.0);
  EXPECT_EQ(all.at("zerodrift_console_members_unknown"), 0.0);
  EXPECT_EQ(all.at(R"(zerodrift_build_info{commit="abc1234",version="1.2.3"})"), 1.0);
}

TEST_F(Metrics, WhatIsInNoCatalogueIsCountedAndNotServed) {
  add(status("compensation", {{"samples_in", "us", 5.0},  // of another unit
                              {"drift_w", "deg/h", 1.0},
                              {"anything", "1", 1.0}}));
  const Values all = values();
  EXPECT_EQ(all.at("zerodrift_console_members_unknown"), 3.0);
  EXPECT_TRUE(std::none_of(all.begin(), all.end(), [](const auto& value) {
    return value.first.find("samples_in") != std::string::npos ||
           value.first.find("anything") != std::string::npos;
  }));
}

// Two consoles' statuses have one name: each serves its own figures alone.
TEST_F(Metrics, AConsolesStatusDoesntSpeakForThisOne) {
  add(status("console", {{"clients", "1", 7.0}, {"commands", "1", 2.0}}));
  const Values all = values();
  EXPECT_EQ(all.at("zerodrift_console_clients"), 0.0);
  EXPECT_EQ(all.at(R"(zerodrift_console_commands_total{service="console"})"), 2.0);
  EXPECT_EQ(all.at("zerodrift_console_members_unknown"), 0.0);
}

TEST_F(Metrics, CountsOfTheMiddlewareAreOneFamilyByTopicAndEvent) {
  add(status("console", {{"compensated_rate_deadline_missed", "1", 2.0},
                         {"rt/imu/left_sample_lost", "1", 3.0},
                         {"peer_lost", "1", 1.0}}));
  const Values all = values();
  const auto of = [](const std::string& event, const std::string& topic) {
    return R"(zerodrift_endpoint_events_total{event=")" + event + R"(",service="console")" + topic +
           "}";
  };
  EXPECT_EQ(all.at(of("deadline_missed", R"(,topic="compensated_rate")")), 2.0);
  EXPECT_EQ(all.at(of("sample_lost", R"(,topic="rt/imu/left")")), 3.0);
  EXPECT_EQ(all.at(of("peer_lost", "")), 1.0);
}

TEST_F(Metrics, OneThatEndedInOrderLeavesTheTimeOfItsEndAlone) {
  telemetry::ServiceStatus ended = status("recorder", {{"messages", "1", 9.0}});
  ended.set_state("stopping");
  ended.set_alive(false);
  ended.mutable_timestamp()->set_seconds(1'700'000'000);
  telemetry::ServiceStatus part = ended;
  part.set_service("recorder:1");
  telemetry::ServiceStatus died = status("gyro_publisher:7", {{"finished", "1", 0.0}});
  died.set_state("running");
  died.set_alive(false);
  for (const auto& one : {ended, part, died}) add(one);
  const Values all = values();
  EXPECT_EQ(all.at(R"(zerodrift_service_ended_timestamp_seconds{service="recorder"})"), 1.7e9);
  EXPECT_EQ(std::count_if(all.begin(), all.end(),
                          [](const auto& value) {
                            return value.first.find("recorder") != std::string::npos;
                          }),
            1);
  EXPECT_EQ(all.at(R"(zerodrift_service_up{gyro="7",service="gyro_publisher"})"), 0.0);
  EXPECT_TRUE(all.contains(R"(zerodrift_finished{gyro="7",service="gyro_publisher"})"));
}

// Under the name alone their words replace each other: an uptime that jumps would be restarts.
TEST_F(Metrics, PublishersOfOneNameAreToldApartByTheirGyros) {
  telemetry::ServiceStatus shared = status("gyro_publisher", {{"peer_lost", "1", 9.0}});
  shared.set_uptime_s(1.0);
  telemetry::ServiceStatus first = status("gyro_publisher:1", {{"peer_lost", "1", 2.0}});
  first.set_uptime_s(600.0);
  telemetry::ServiceStatus second = status("gyro_publisher:2", {});
  second.set_uptime_s(1.0);
  second.set_alive(false);
  telemetry::ServiceStatus thermal = status("thermal_publisher:2", {});
  thermal.set_state("stopping");
  for (const auto& one : {shared, first, second, thermal}) add(one);
  const Values all = values();
  EXPECT_EQ(all.at(R"(zerodrift_service_up{gyro="1",service="gyro_publisher"})"), 1.0);
  EXPECT_EQ(all.at(R"(zerodrift_service_up{gyro="2",service="gyro_publisher"})"), 0.0);
  EXPECT_EQ(all.at(R"(zerodrift_service_uptime_seconds{gyro="1",service="gyro_publisher"})"),
            600.0);
  EXPECT_EQ(all.at(R"(zerodrift_endpoint_events_total{event="peer_lost",gyro="1",)"
                   R"(service="gyro_publisher"})"),
            2.0);
  EXPECT_TRUE(all.contains(
      R"(zerodrift_service_ended_timestamp_seconds{gyro="2",service="thermal_publisher"})"));
  EXPECT_TRUE(std::none_of(all.begin(), all.end(), [](const auto& value) {
    return value.first.find(R"({service="gyro_publisher"})") != std::string::npos;
  }));
}

std::vector<std::tuple<std::string, std::string, double>> arrival_buckets() {
  return {{"arrival_le_1ms", "1", 7.0},  {"arrival_le_50us", "1", 3.0},
          {"arrival_le_1s", "1", 9.0},   {"arrival_count", "1", 10.0},
          {"arrival_sum", "us", 2500.0}, {"arrival_incomparable", "1", 4.0}};
}

TEST_F(Metrics, BucketsBecomeAHistogramThatGrowsToItsCount) {
  add(status("compensation:latency", arrival_buckets()));
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
  EXPECT_DOUBLE_EQ(all.at("zerodrift_hop_latency_seconds_sum" + of), 2500e-6);
  EXPECT_EQ(all.at("zerodrift_hop_incomparable_total" + of), 4.0);
}

// A service of another version.
TEST_F(Metrics, BucketsWithoutTheirSumAreNoHistogram) {
  auto buckets = arrival_buckets();
  std::erase_if(buckets, [](const auto& one) { return std::get<0>(one) == "arrival_sum"; });
  add(status("compensation:latency", buckets));
  for (const auto& [name, value] : values())
    EXPECT_FALSE(name.starts_with("zerodrift_hop_latency_seconds")) << name;
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

// Rule: an axis that was never measured has no mode. Before: that of a gyro of one axis was
// passthrough for the two others, for which the alert called for ever.
TEST_F(Metrics, OnlyAnAxisThatWasMeasuredHasAModeADriftAndASigma) {
  auto sample = sample_at(0, 1.0, 0.5);
  sample.mode() = {2, 0, 0};
  gyros_[1] = {.samples = 1, .newest = to_telemetry(sample), .measured = {true, false, true}};
  const Values all = values();
  for (const char* name : {"zerodrift_axis_mode", "zerodrift_axis_drift_degrees_per_hour",
                           "zerodrift_axis_drift_sigma_degrees_per_hour"}) {
    const auto of = [&](const char* axis) {
      return std::string(name) + R"({axis=")" + axis + R"(",gyro="1"})";
    };
    EXPECT_TRUE(all.contains(of("x"))) << name;
    EXPECT_FALSE(all.contains(of("y"))) << name;
    EXPECT_TRUE(all.contains(of("z"))) << name;
  }
}

// As the gateway, to whom these are no gyros.
TEST_F(Metrics, APartIsAGyroOnlyWhereItIsTheNumberOfOne) {
  for (const char* part : {"7", "0", "007", "4294967295", "4294967296", "7a", "-7", "+7", ""})
    add(status(std::string("publisher:") + part, {{"samples", "1", 1.0}}));
  const Values all = values();
  std::set<std::string> of_gyros;
  for (const auto& [name, value] : all)
    if (name.find("gyro=") != std::string::npos) of_gyros.insert(name);
  EXPECT_EQ(of_gyros, (std::set<std::string>{
                          R"(zerodrift_samples_total{gyro="4294967295",service="publisher"})",
                          R"(zerodrift_samples_total{gyro="7",service="publisher"})"}));
}

TEST_F(Metrics, NamesAndTextsOfAnySortKeepTheFormat) {
  add(status("a\"b\\c\nd:e{}", {{"samples", "1", 1.0},
                                {"samples", "1", 2.0},  // twice
                                {"", "1", 3.0},
                                {"\"}\n_sample_lost", "1", std::numeric_limits<double>::infinity()},
                                {"gaps", "1", std::nan("")}}));
  // parsed() holds each line to the format and each name to once.
  const Values all = values();
  EXPECT_EQ(all.at(R"re(zerodrift_samples_total{part="e{}",service="a\"b\\c\nd"})re"), 1.0);
  EXPECT_EQ(all.at("zerodrift_console_members_unknown"), 1.0);
}

}  // namespace
}  // namespace zerodrift::services
