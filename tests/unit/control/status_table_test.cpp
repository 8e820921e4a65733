// SPDX-License-Identifier: Apache-2.0
// What `ctl status` shows of services that said these figures.
#include "services/control/status_table.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <sstream>

#include "common/core/mode.h"
#include "tests/unit/dds/test_domain.h"

namespace zerodrift::services {
namespace {

using dds::eventually;
using Figures = std::vector<std::pair<std::string, double>>;

constexpr std::uint32_t kDomain = 116;

msg::ServiceStatus status(const std::string& service, const Figures& figures) {
  msg::ServiceStatus said;
  said.service() = service;
  for (const auto& [name, value] : figures) {
    msg::Metric metric;
    metric.name() = name;
    metric.value() = value;
    said.metrics().push_back(metric);
  }
  return said;
}

// As long as they get in days of a fast gyro.
Figures of_gyro() {
  Figures figures{{"sensor_time", 8'640'000.5},   {"temperature", -23.4567},
                  {"temperature_rate", -0.01234}, {"labels", 1'728'000},
                  {"model_epoch", 1'728'000},     {"active", 1}};
  for (const std::string axis : {"_x", "_y", "_z"}) {
    figures.emplace_back("measured" + axis, 1.0);
    figures.emplace_back("drift" + axis, -12.345678);
    figures.emplace_back("mode" + axis, axis == "_z" ? 5.0 : 1.0);
    figures.emplace_back("reason" + axis, axis == "_z" ? 11.0 : 0.0);
  }
  return figures;
}

Figures latencies(const std::string& hop, double median_us) {
  return {{hop + "_p50", median_us},
          {hop + "_p99", 10 * median_us},
          {hop + "_p999", 100 * median_us},
          {hop + "_max", 1000 * median_us}};
}

class StatusTable : public testing::Test {
 protected:
  void say(msg::ServiceStatus said) {
    ASSERT_TRUE(status_.write(said));
    ASSERT_TRUE(eventually([&] { return board_.has(said.service().c_str()); }));
  }
  void say(const std::string& service, const Figures& figures) { say(status(service, figures)); }

  void say_all() {
    ASSERT_TRUE(eventually([&] { return status_.matched() > 0 && reports_.matched() > 0; }));
    say("gyro_publisher:1", {{"samples_published", 86'400'000}});
    Figures compensation = latencies("arrival", 27.26);
    const Figures counts{{"samples_in", 86'400'000},
                         {"samples_out", 86'400'000},
                         {"missing", 0},
                         {"duplicates", 0},
                         {"rejected", 0}};
    compensation.insert(compensation.end(), counts.begin(), counts.end());
    say("compensation", compensation);
    say("compensation:latency", {{"arrival_count", 86'400'000}});
    say("compensation/2:1", {{"health", 2},
                             {"active", 1},
                             {"compared", 86'400'000},
                             {"differing", 12},
                             {"takeovers", 3}});
    say("compensation:1", of_gyro());
  }

  [[nodiscard]] std::string line_with(const std::string& text) {
    std::istringstream table(board_.table());
    for (std::string line; std::getline(table, line);)
      if (line.find(text) != std::string::npos) return line;
    return "";
  }

  const dds::TestDomain domain_{kDomain};
  dds::Participant services_{"services", domain_.network()};
  dds::Writer<msg::ServiceStatus> status_{services_};
  dds::Writer<msg::AllanReport> reports_{services_};
  dds::Participant ctl_{"ctl", domain_.network()};
  StatusBoard board_{ctl_};
};

// Publishers of several gyros share a name; the compensation counts the samples of all.
TEST_F(StatusTable, CountsTheSamplesOfAllGyrosThatArePublished) {
  ASSERT_TRUE(eventually([&] { return status_.matched() > 0; }));
  const auto publisher = [](double published, bool is_at_the_end) {
    return Figures{{"samples_published", published}, {"finished", is_at_the_end ? 1.0 : 0.0}};
  };
  const auto compensation = [](double out) {
    return Figures{{"samples_in", out}, {"samples_out", out}, {"missing", 0}, {"unwritten", 0}};
  };
  const auto is_heard = [&](const std::string& totals) {
    return eventually([&] { return line_with("published").find(totals) != std::string::npos; });
  };
  say("gyro_publisher:1", publisher(600, true));
  say("gyro_publisher:2", publisher(300, false));
  say("gyro_publisher", {});
  say("compensation", compensation(600));
  say("allan_monitor", {{"samples", 600}});
  EXPECT_TRUE(is_heard("published 900  in 600  out 600"));
  EXPECT_FALSE(board_.finished()) << "one has come to its end, the other has not";
  EXPECT_FALSE(board_.nothing_lost());
  say("gyro_publisher:2", publisher(400, true));
  say("compensation", compensation(1000));
  EXPECT_TRUE(is_heard("published 1000  in 1000  out 1000"));
  EXPECT_TRUE(board_.finished());
  EXPECT_FALSE(board_.nothing_lost()) << "the monitor has 600";
  say("allan_monitor", {{"samples", 1000}});
  EXPECT_TRUE(is_heard("monitored 1000"));
  EXPECT_TRUE(board_.nothing_lost());
  say("replay:3", publisher(5, false));
  EXPECT_TRUE(is_heard("published 1005"));
  EXPECT_FALSE(board_.finished());
}

TEST_F(StatusTable, FitsATerminalOfEightyColumns) {
  say_all();
  msg::AllanReport report;
  report.gyro_id() = 1;
  report.since_start_blocks().blocks() = 1000;
  report.since_start_blocks().std_radps() = 0.0123456;
  report.since_start_blocks().block_s() = 300.0;
  msg::AllanPoint point;
  point.tau_s() = 64.0;
  point.deviation_radps() = 0.0123456;
  report.since_start().push_back(point);
  for (const std::uint32_t stream : {0U, 1U}) {
    report.stream() = stream;
    ASSERT_TRUE(reports_.write(report));
  }
  EXPECT_EQ(line_with("60 s means"), "");
  ASSERT_TRUE(eventually([&] { return !line_with("ADEV 64 s").empty(); }));
  EXPECT_NE(line_with("std of 300 s means"), "");
  std::istringstream lines(board_.table() + board_.summary());
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 80U) << line;
}

TEST_F(StatusTable, SaysWhyAnAxisIsCompensatedAsItIs) {
  say_all();
  EXPECT_EQ(line_with("learning"), "x, y: learning");
  EXPECT_EQ(line_with("holding"), "z: holding (model_worse_than_bias)");
}

// Before: an axis that was bad just now was nowhere, and a gyro that was silent was learning.
TEST_F(StatusTable, ShowsABadAxisAndSaysOfASilentGyroThatItIs) {
  ASSERT_TRUE(eventually([&] { return status_.matched() > 0; }));
  Figures gyro = of_gyro();
  for (auto& [name, value] : gyro) {
    if (name == "mode_x") value = static_cast<double>(core::Mode::kPassthrough);
    if (name == "reason_x") value = static_cast<double>(core::Reason::kInvalidInput);
    if (name == "measured_z") value = 0.0;
  }
  say("compensation:1", gyro);
  EXPECT_EQ(line_with("invalid_input"), "x: passthrough (invalid_input)");
  EXPECT_EQ(line_with("y: "), "y: learning");
  EXPECT_EQ(line_with("z: "), "");
  EXPECT_EQ(line_with("no sample"), "");
  gyro.emplace_back("silence", 30.4);
  say("compensation:1", gyro);
  ASSERT_TRUE(eventually([&] { return !line_with("no sample").empty(); }));
  EXPECT_EQ(line_with("no sample"), "no sample for 30 s; before:");
  EXPECT_NE(board_.json().find(R"("silence_s":30.4)"), std::string::npos);
}

TEST_F(StatusTable, GivesEachLatencyInAUnitThatPeopleRead) {
  say_all();
  const std::string line = line_with("publisher to compensation");
  for (const char* figure : {"27.3 us", "273 us", "2.73 ms", "27.3 ms"})
    EXPECT_NE(line.find(figure), std::string::npos) << line;
  EXPECT_EQ(board_.table().find("e+"), std::string::npos) << board_.table();
}

// A pair whose senior one is dead: the other answers everything.
TEST_F(StatusTable, ShowsWhatAnInstanceSaysWhoseNumberIsNotNought) {
  ASSERT_TRUE(eventually([&] { return status_.matched() > 0; }));
  EXPECT_FALSE(board_.has_compensation());
  say("gyro_publisher:1", {{"samples_published", 900}, {"finished", 1}});
  say("allan_monitor", {{"samples", 900}});
  Figures gyro = of_gyro();
  gyro.emplace_back("health", 0);
  say("compensation/1:1", gyro);
  say("compensation/1",
      {{"gyros", 1}, {"samples_in", 900}, {"samples_out", 900}, {"missing", 0}, {"unwritten", 0}});
  EXPECT_TRUE(board_.has_compensation());
  EXPECT_NE(line_with("published 900  in 900  out 900"), "") << board_.table();
  EXPECT_EQ(line_with("learning"), "x, y: learning");
  EXPECT_NE(line_with("compensation/1 of gyro 1: in sync, leads"), "");
  EXPECT_EQ(board_.sensor_time_s(), 8'640'000.5);
  EXPECT_TRUE(board_.finished());
  EXPECT_TRUE(board_.nothing_lost());
}

// Before: whoever followed a run waited for good for a publisher that was killed.
TEST_F(StatusTable, NothingMoreComesOfAPublisherThatIsGone) {
  auto other = std::make_unique<dds::Participant>("other", domain_.network());
  auto writer = std::make_unique<dds::Writer<msg::ServiceStatus>>(*other);
  ASSERT_TRUE(eventually([&] { return writer->matched() > 0 && status_.matched() > 0; }));
  msg::ServiceStatus seventh = status("gyro_publisher:7", {{"samples_published", 5}});
  ASSERT_TRUE(writer->write(seventh));
  ASSERT_TRUE(eventually([&] { return board_.has("gyro_publisher:7"); }));
  say("gyro_publisher:1", {{"samples_published", 5}, {"finished", 1}});
  say("compensation",
      {{"samples_in", 10}, {"samples_out", 10}, {"missing", 0}, {"unwritten", 0}, {"gyros", 2}});
  say("allan_monitor", {{"samples", 10}});
  ASSERT_TRUE(eventually([&] { return board_.nothing_lost(); }));
  EXPECT_FALSE(board_.counts().nothing_more_comes);
  writer.reset();
  other.reset();
  EXPECT_TRUE(eventually([&] { return board_.counts().nothing_more_comes; }));
  EXPECT_FALSE(board_.finished()) << "its source had more";
  EXPECT_TRUE(board_.summary().ends_with("gone before the end of its source: gyro_publisher:7\n"))
      << board_.summary();
}

TEST_F(StatusTable, SaysOfAServiceThatIsGoneThatItIs) {
  auto other = std::make_unique<dds::Participant>("other", domain_.network());
  auto writer = std::make_unique<dds::Writer<msg::ServiceStatus>>(*other);
  ASSERT_TRUE(eventually([&] { return writer->matched() > 0; }));
  Figures gyro = of_gyro();
  gyro.emplace_back("health", 0);
  for (msg::ServiceStatus said : {status("compensation", {{"gyros", 1}, {"samples_in", 900}}),
                                  status("compensation:1", gyro)}) {
    ASSERT_TRUE(writer->write(said));
    ASSERT_TRUE(eventually([&] { return board_.has(said.service().c_str()); }));
  }
  EXPECT_EQ(line_with("gone"), "");
  EXPECT_NE(line_with("in sync, leads"), "");
  writer.reset();
  other.reset();
  EXPECT_TRUE(eventually([&] { return !board_.has_compensation(); }));
  EXPECT_EQ(line_with("in sync, leads"), "");
  EXPECT_EQ(line_with("gyro 1: compensation is gone; its figures are"),
            "gyro 1: compensation is gone; its figures are 0 s old");
  EXPECT_EQ(line_with("its last status"), "compensation is gone; its last status is 0 s old");
  EXPECT_NE(board_.json().find(R"("gone":{"compensation":{)"), std::string::npos) << board_.json();
}

}  // namespace
}  // namespace zerodrift::services
