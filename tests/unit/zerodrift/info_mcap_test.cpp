// SPDX-License-Identifier: Apache-2.0
// What `info` says of how long and how fast a recording is, whatever its clock did.
#include "services/zerodrift/info_mcap.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <fstream>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "common/dds/topics.h"
#include "common/mcap/mcap_writer.h"
#include "tests/support/scratch_folder.h"

namespace zerodrift::services {
namespace {

constexpr double kDayS = 86'400.0;
constexpr double kNowS = 1.7e9;

std::uint64_t ns(double time_s) {
  return static_cast<std::uint64_t>(std::llround(time_s * 1e9));
}

class InfoOfARecording : public ScratchFolder {
 protected:
  // Without a sensor time the recorder writes the log time.
  void add(const std::string& topic, double log_s, std::optional<double> sensor_s = {},
           std::string schema = {}) {
    for (const auto& spec : dds::kAllTopics)
      if (spec.name == topic) schema = spec.type;
    auto known = channels_.find(topic);
    if (known == channels_.end()) {
      const auto id = writer_.add_channel(writer_.add_schema(schema, "omgidl", ""), topic, "cdr");
      known = channels_.emplace(topic, id).first;
    }
    writer_.write({.channel_id = known->second,
                   .sequence = static_cast<std::uint32_t>(++sequence_[topic]),
                   .log_time_ns = ns(log_s),
                   .publish_time_ns = ns(sensor_s.value_or(log_s)),
                   .data = "payload"});
  }
  // Ten seconds: rates at 200 Hz, statuses at 4 Hz, as they come when the clock says `from_s`.
  void add_ten_seconds(double from_s) {
    for (int i = 0; i < 2000; ++i) {
      const double at_s = i / 200.0;
      add("angular_rate", from_s + at_s, sensor_s_ += 0.005);
      if (i % 50 == 0) add("service_status", from_s + at_s);
    }
  }
  McapSummary summary() {
    writer_.finish();
    const auto file = folder_ / "a.mcap";
    std::ofstream(file, std::ios::binary) << bytes_;
    return summarise(file.string());
  }
  static std::optional<double> rate_hz(const McapSummary& summary, const std::string& topic) {
    for (const auto& channel : summary.channels)
      if (channel.topic == topic) return channel.rate_hz;
    ADD_FAILURE() << topic;
    return std::nullopt;
  }

 private:
  std::string bytes_;
  mcap::Writer writer_{[this](std::string_view more) { bytes_.append(more); }, {}};
  std::map<std::string, std::uint16_t> channels_;
  std::map<std::string, std::uint32_t> sequence_;
  double sensor_s_ = 100.0;
};

// Before: "31622413.586 s", "angular_rate 0.000177 Hz".
TEST_F(InfoOfARecording, AClockThatWasSetChangesNeitherDurationNorRates) {
  add_ten_seconds(kNowS);
  add_ten_seconds(kNowS + 10.0 - kDayS);
  add_ten_seconds(kNowS + 20.0 + 365 * kDayS);
  add_ten_seconds(kNowS + 30.0);
  const McapSummary seen = summary();
  EXPECT_NEAR(seen.duration_s, 40.0, 0.03) << "a step is known to a sample";
  EXPECT_NEAR(rate_hz(seen, "angular_rate").value(), 200.0, 1e-4);
  EXPECT_NEAR(rate_hz(seen, "service_status").value(), 4.0, 0.01);
  ASSERT_EQ(seen.warnings.size(), 3U);
  const std::string& back = seen.warnings[0];
  EXPECT_NE(back.find(" s its log times go back by 86400 s, as the clock was set; "),
            std::string::npos)
      << back;
  EXPECT_NE(seen.warnings[1].find("jump ahead by"), std::string::npos) << seen.warnings[1];
  EXPECT_NE(seen.warnings[2].find("go back by"), std::string::npos) << seen.warnings[2];
  EXPECT_TRUE(seen.findings.empty()) << "a clock that was set is no damage";
}

// Before: "152248 Hz" of readings that a publisher had kept for who comes late.
TEST_F(InfoOfARecording, WhatCameInOneBurstHasTheRateOfItsSensorTimesOrNone) {
  add("temperature", kNowS);  // measured at time 0
  for (int i = 1; i < 100; ++i) add("temperature", kNowS + 1e-6 * i, i);
  for (int i = 0; i < 5; ++i) add("service_status", kNowS + 1e-4 + 1e-6 * i);
  add("event", kNowS + 1.0);
  const McapSummary seen = summary();
  EXPECT_NEAR(rate_hz(seen, "temperature").value(), 1.0, 1e-9);
  EXPECT_FALSE(rate_hz(seen, "service_status"));
  EXPECT_FALSE(rate_hz(seen, "event"));
  EXPECT_NEAR(seen.duration_s, 1.0, 1e-6);
  EXPECT_TRUE(seen.warnings.empty());
}

// Rule: a report's sensor time says how far it reaches, and reports come of a source that ended,
// too.
TEST_F(InfoOfARecording, ReportsHaveTheRateOfTheirArrival) {
  for (int i = 0; i <= 40; ++i) add("navigation", kNowS + 0.25 * i, 545.97);
  EXPECT_NEAR(rate_hz(summary(), "navigation").value(), 4.0, 1e-6);
}

// Rule: a second run of the publisher begins anew, and makes no interval of it.
TEST_F(InfoOfARecording, ASensorTimeThatBeginsAnewChangesNoRate) {
  for (const double from_s : {5000.0, 100.0, 300'000.0}) {
    for (int i = 0; i < 1000; ++i) add("angular_rate", kNowS + 0.001 * i, from_s + 0.005 * i);
  }
  EXPECT_NEAR(rate_hz(summary(), "angular_rate").value(), 200.0, 1e-4);
}

TEST_F(InfoOfARecording, WhatOthersWriteAsTimeOfPublishingIsNoSensorTime) {
  for (int i = 0; i <= 100; ++i) add("/imu", kNowS + 0.1 * i, 7.0 + i, "sensor_msgs/msg/Imu");
  EXPECT_NEAR(rate_hz(summary(), "/imu").value(), 10.0, 1e-6);
}

}  // namespace
}  // namespace zerodrift::services
