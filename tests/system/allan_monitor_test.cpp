// SPDX-License-Identifier: Apache-2.0
// allan_monitor over DDS. The test is the compensation service, with a hardware clock; the events
// and reports are what a console would hear.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <map>
#include <memory>
#include <random>
#include <set>
#include <sstream>
#include <string>
#include <tuple>
#include <vector>

#include "common/allan/coefficients.h"
#include "common/allan/rolling_allan.h"
#include "common/core/units.h"
#include "common/dds/conversions.h"
#include "tests/system/files.h"
#include "tests/system/pipeline.h"

namespace zerodrift::system_test {
namespace {

using core::radps_from_deg_h;
using namespace std::chrono_literals;

constexpr double kRateHz = 50.0;
constexpr double kWindowS = 60.0;
constexpr std::size_t kInFlight = 500;  // far below the 2000 samples that a writer keeps
constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();

// A gyro as compensation publishes it: white noise of 1 deg/h (1 sigma, a sample) on each axis, and
// a drift that was taken off, another one each sample.
class Gyro {
 public:
  Gyro(dds::Participant& participant, std::uint32_t id, double first_rate_hz = kRateHz)
      : rate_hz(first_rate_hz), id_(id), writer_(participant), random_(id) {}

  void connect() {
    ASSERT_TRUE(eventually([&] { return writer_.matched() > 0; }));
  }

  std::uint64_t next_number() { return sequence_++; }
  core::CompensatedSample next() {
    time_s += 1.0 / rate_hz;
    core::CompensatedSample sample;
    sample.raw.sequence = next_number();
    sample.raw.time = core::from_seconds(time_s);
    sample.raw.interval_s = 1.0 / rate_hz;
    sample.raw.valid = {true, true, true};
    sample.raw.clock = clock;
    for (std::size_t i = 0; i < 3; ++i) {
      sample.applied_drift_radps[i] =
          radps_from_deg_h(0.3 + 1e-3 * std::sin(time_s)) + drift_noise[i] * normal_(random_);
      const double noise = noise_radps[i] * normal_(random_);
      const double raw = std::isnan(stuck_at[i]) ? radps_from_deg_h(5.0) + noise : stuck_at[i];
      sample.rate_radps[i] = raw - sample.applied_drift_radps[i];
    }
    return sample;
  }

  void send(const core::CompensatedSample& sample) {
    msg::CompensatedRate message;
    dds::to_message(sample, id_, 0, message);
    ASSERT_TRUE(writer_.write(message));
    if (++in_flight_ < kInFlight) return;
    settle();
  }
  void settle() {
    ASSERT_TRUE(writer_.wait_until_received(30000ms));
    in_flight_ = 0;
  }
  void send_for(double duration_s) {
    const auto samples = static_cast<int>(std::lround(duration_s * rate_hz));
    for (int k = 0; k < samples; ++k) send(next());
    settle();
  }

  double rate_hz;
  double time_s = 1000.0;
  core::ClockSource clock = core::ClockSource::kHardware;
  core::PerAxis<double> noise_radps{radps_from_deg_h(1.0), radps_from_deg_h(1.0),
                                    radps_from_deg_h(1.0)};
  core::PerAxis<double> drift_noise{};
  core::PerAxis<double> stuck_at{kNoNumber, kNoNumber, kNoNumber};

 private:
  std::uint32_t id_;
  std::uint64_t sequence_ = 0;
  dds::Writer<msg::CompensatedRate> writer_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  std::size_t in_flight_ = 0;
};

using Key = std::tuple<std::uint32_t, std::uint32_t, std::uint32_t>;  // gyro, axis, stream

class Bench {
 public:
  explicit Bench(Domain domain, const std::string& period_s = "0.1", const Arguments& options = {})
      : system(domain),
        participant("test", system.network()),
        reports(participant),
        events(participant),
        statuses(participant),
        progress(participant) {
    Arguments arguments{"--window", "60", "--longest-tau", "20", "--period", period_s};
    arguments.insert(arguments.end(), options.begin(), options.end());
    monitor = &system.start("allan_monitor", arguments);
  }

  [[nodiscard]] std::map<Key, msg::AllanReport> newest() const {
    std::map<Key, msg::AllanReport> result;
    for (const auto& report : reports.all())
      result[{report.gyro_id(), report.axis(), report.stream()}] = report;
    return result;
  }
  // The report of the newest sample of this gyro, all axes and streams.
  void await_report(std::uint32_t id, const Gyro& gyro) {
    const std::int64_t newest_ns = core::from_seconds(gyro.time_s).count();
    ASSERT_TRUE(eventually([&] {
      std::set<Key> there;
      for (const auto& report : reports.all()) {
        if (report.gyro_id() == id && report.sensor_time_ns() == newest_ns)
          there.insert({report.gyro_id(), report.axis(), report.stream()});
      }
      return there.size() == 6;
    })) << "no report of what was sent last";
  }
  // Half a window at a time, so that the watches look at least twice a window.
  void run(std::uint32_t id, Gyro& gyro, double windows) {
    for (int half = 0; half < static_cast<int>(2.0 * windows); ++half) {
      gyro.send_for(0.5 * kWindowS);
      await_report(id, gyro);
    }
  }
  [[nodiscard]] std::vector<msg::Event> told_with(const std::string& code) const {
    std::vector<msg::Event> result;
    for (const auto& event : events.all()) {
      if (code == event.code().c_str()) result.push_back(event);
    }
    return result;
  }
  void expect_once(const std::string& code, const std::string& text) {
    EXPECT_TRUE(eventually([&] { return told(events, code, text); }))
        << code << " with '" << text << "'";
    const auto all = told_with(code);
    EXPECT_EQ(all.size(), 1U) << code;
    if (!all.empty()) {
      EXPECT_EQ(all.back().count(), 1U) << code;
    }
  }
  void expect_alive_then_stop() {
    EXPECT_TRUE(monitor->running());
    monitor->send(SIGTERM);
    EXPECT_EQ(monitor->wait(2000ms), 0);
  }

  SystemUnderTest system;
  dds::Participant participant;
  Collector<msg::AllanReport> reports;
  Collector<msg::Event> events;
  Collector<msg::ServiceStatus> statuses;
  Collector<msg::ReplayProgress> progress;
  ChildProcess* monitor = nullptr;
};

void expect_finite(const msg::AllanReport& report) {
  for (const auto* points : {&report.since_start(), &report.rolling()}) {
    for (const auto& p : *points) {
      EXPECT_TRUE(std::isfinite(p.deviation_radps()) && std::isfinite(p.lower_radps()) &&
                  std::isfinite(p.upper_radps()) && std::isfinite(p.degrees_of_freedom()))
          << "tau " << p.tau_s();
    }
  }
  for (const auto* c :
       {&report.quantization(), &report.angle_random_walk(), &report.bias_instability(),
        &report.rate_random_walk(), &report.rate_ramp()}) {
    EXPECT_TRUE(std::isfinite(c->value()) && std::isfinite(c->lower()) &&
                std::isfinite(c->upper()));
  }
  EXPECT_TRUE(std::isfinite(report.reduced_chi_square()));
}

// 1 deg/h a sample at `rate_hz`.
double white_n(double rate_hz) {
  return radps_from_deg_h(1.0) / std::sqrt(rate_hz);
}

// 5 sigma: the shortest taus know N within 1 / sqrt(2 * 0.78 n).
void expect_white_noise(const msg::AllanReport& report, double rate_hz) {
  const auto& n = report.angle_random_walk();
  EXPECT_EQ(n.identified(), 1U);
  const double sigma = 1.0 / std::sqrt(1.5 * static_cast<double>(report.samples()));
  EXPECT_NEAR(n.value() / white_n(rate_hz), 1.0, 5.0 * sigma + 0.01);
}

// --------------------------------------------------------------------------------- reports

TEST(AllanMonitor, WhoJoinsLateGetsThePresentReport) {
  Bench bench(Domain::kAllanLateJoiner, "30");
  Gyro gyro(bench.participant, 1);
  gyro.connect();
  gyro.send_for(5.0);
  ASSERT_TRUE(eventually([&] { return bench.reports.size() == 6; }));
  dds::Participant late("late", bench.system.network());
  Collector<msg::AllanReport> joined(late);
  ASSERT_TRUE(eventually([&] { return joined.size() == 6; }));
  EXPECT_EQ(bench.reports.size(), 6U) << "they were published anew: nothing was shown";
  std::set<Key> keys;
  for (const auto& report : joined.all())
    keys.insert({report.gyro_id(), report.axis(), report.stream()});
  EXPECT_EQ(keys.size(), 6U);
}

// Before: the first sample ended the service.
TEST(AllanMonitor, AWindowThatSomeSpacingCannotHaveIsRefusedAtStart) {
  SystemUnderTest system(Domain::kAllanLateJoiner);
  ChildProcess& monitor = system.start("allan_monitor", {"--window", "1e9"});
  EXPECT_EQ(monitor.wait(std::chrono::seconds(10)), 2);
  EXPECT_NE(monitor.err().find("--window, --longest-tau: of samples 0.0001 s apart "),
            std::string::npos)
      << monitor.err();
}

TEST(AllanMonitor, GyrosAreFoundAsTheyComeUpToTheBound) {
  Bench bench(Domain::kAllanTwoGyros, "0.1", {"--max-gyros", "2"});
  Gyro first(bench.participant, 7);
  first.connect();
  first.send_for(60.0);
  bench.await_report(7, first);
  EXPECT_EQ(bench.newest().size(), 6U);

  Gyro second(bench.participant, 4000000000U, 100.0);
  second.connect();
  second.send_for(60.0);
  bench.await_report(4000000000U, second);
  first.send_for(10.0);
  bench.await_report(7, first);

  Gyro one_too_many(bench.participant, 8);
  one_too_many.connect();
  one_too_many.send_for(10.0);
  EXPECT_TRUE(eventually([&] { return told(bench.events, "too_many_gyros", "gyro 8"); }));
  EXPECT_TRUE(eventually(
      [&] { return metric(bench.statuses, "allan_monitor", "too_many_gyros") == 500.0; }));

  const auto newest = bench.newest();
  EXPECT_EQ(newest.size(), 12U);
  for (const auto& [key, report] : newest) {
    const bool is_first = std::get<0>(key) == 7;
    EXPECT_EQ(report.samples(), is_first ? 3500U : 6000U);
    EXPECT_EQ(report.gaps(), 0U);
    EXPECT_EQ(report.sample_interval_s(), is_first ? 0.02 : 0.01);
    expect_finite(report);
    expect_white_noise(report, is_first ? 50.0 : 100.0);
    for (const auto& p : report.rolling()) {
      if (p.degrees_of_freedom() > 100.0) {
        EXPECT_EQ(p.noise_exponent(), 0) << "white, at tau " << p.tau_s();
      }
    }
  }
  bench.expect_alive_then_stop();
}

// A replay that waits for the monitor would wait for ever.
TEST(AllanMonitor, AReplayIsToldOfSamplesThatAreLeftOutToo) {
  Bench bench(Domain::kAllanProgress, "0.1", {"--max-gyros", "1"});
  const auto taken = [&](std::uint32_t id, std::uint64_t sequence) {
    return eventually([&] {
      return bench.progress.any([&](const msg::ReplayProgress& p) {
        return p.gyro_id() == id && p.sequence_number() == sequence;
      });
    });
  };
  Gyro first(bench.participant, 7);
  first.clock = core::ClockSource::kReplay;
  first.connect();
  first.send_for(1.0);  // 0 to 49
  EXPECT_TRUE(taken(7, 49));
  for (int k = 0; k < 20; ++k) {
    auto odd = first.next();
    odd.raw.interval_s = 1e300;
    first.send(odd);
  }
  first.settle();
  EXPECT_TRUE(taken(7, 69)) << "samples that are refused";

  Gyro one_too_many(bench.participant, 8);
  one_too_many.clock = core::ClockSource::kReplay;
  one_too_many.connect();
  one_too_many.send_for(1.0);
  EXPECT_TRUE(taken(8, 49)) << "a gyro beyond the bound";
  bench.expect_alive_then_stop();
}

// ---------------------------------------------------------------------------------- events

TEST(AllanMonitor, ANoiseStepIsOneEventAndItsEndAnother) {
  Bench bench(Domain::kAllanNoiseStep);
  Gyro gyro(bench.participant, 3);
  gyro.connect();
  bench.run(3, gyro, 5);
  EXPECT_TRUE(bench.told_with("noise_grew_raw_y").empty());
  gyro.noise_radps[1] *= 1.5;
  bench.run(3, gyro, 4);
  EXPECT_EQ((bench.newest()[{3, 1, 0}].noise_grown()), 1U);
  EXPECT_EQ((bench.newest()[{3, 0, 0}].noise_grown()), 0U);
  gyro.noise_radps[1] /= 1.5;
  bench.run(3, gyro, 3);
  EXPECT_EQ((bench.newest()[{3, 1, 0}].noise_grown()), 0U);
  for (const char* stream : {"raw", "compensated"}) {
    const std::string name(stream);
    bench.expect_once("noise_grew_" + name + "_y", "gyro 3 axis y " + name + ": noise grew at tau");
    bench.expect_once("noise_normal_" + name + "_y", "gyro 3 axis y " + name + ": noise is back");
    for (const char* other : {"_x", "_z"})
      EXPECT_TRUE(bench.told_with("noise_grew_" + name + other).empty()) << name << other;
  }
  bench.expect_alive_then_stop();
}

TEST(AllanMonitor, ACompensationThatAddsNoiseIsToldOnce) {
  Bench bench(Domain::kAllanHarmfulCompensation);
  Gyro gyro(bench.participant, 1);
  gyro.connect();
  bench.run(1, gyro, 2);
  EXPECT_TRUE(bench.told_with("compensation_harms_z").empty());
  gyro.drift_noise[2] = radps_from_deg_h(1.0);
  bench.run(1, gyro, 2);
  EXPECT_EQ((bench.newest()[{1, 2, 1}].worse_than_raw()), 1U);
  gyro.drift_noise[2] = 0.0;
  bench.run(1, gyro, 2);
  EXPECT_EQ((bench.newest()[{1, 2, 1}].worse_than_raw()), 0U);
  bench.expect_once("compensation_harms_z", "gyro 1 axis z compensated: noisier than raw at tau");
  bench.expect_once("compensation_harms_no_more_z", "no longer noisier than raw");
  EXPECT_TRUE(bench.told_with("compensation_harms_x").empty());
  EXPECT_TRUE(bench.told_with("noise_grew_raw_z").empty());
  bench.expect_alive_then_stop();
}

// Rule: the first correction is a step of the whole drift, not noise that the compensation adds.
TEST(AllanMonitor, TheStepOfTheFirstCorrectionIsNoHarm) {
  Bench bench(Domain::kAllanFirstCorrection);
  Gyro gyro(bench.participant, 1);
  gyro.connect();
  constexpr int kBefore = 3000;  // samples: half a window
  for (int k = 0; k < kBefore; ++k) {
    auto sample = gyro.next();
    for (std::size_t i = 0; i < 3; ++i) sample.rate_radps[i] += sample.applied_drift_radps[i];
    sample.applied_drift_radps = {};
    gyro.send(sample);
  }
  gyro.settle();
  bench.await_report(1, gyro);
  EXPECT_EQ((bench.newest()[{1, 0, 1}].samples()), static_cast<std::uint64_t>(kBefore));
  constexpr int kAfter = 12000;
  for (int k = 0; k < kAfter; ++k) {
    auto sample = gyro.next();
    sample.mode.fill(core::Mode::kLearning);
    for (std::size_t i = 0; i < 3; ++i) {
      sample.rate_radps[i] -= radps_from_deg_h(5.0);  // the drift in all: the rest is noise
      sample.applied_drift_radps[i] += radps_from_deg_h(5.0);
    }
    gyro.send(sample);
    if (k % 1000 == 999) {
      gyro.settle();
      bench.await_report(1, gyro);
    }
  }
  for (std::uint32_t axis = 0; axis < 3; ++axis) {
    for (std::uint32_t stream = 0; stream < 2; ++stream) {
      const auto report = bench.newest()[{1, axis, stream}];
      EXPECT_EQ(report.samples(), static_cast<std::uint64_t>(kAfter));
      EXPECT_EQ(report.worse_than_raw(), 0U);
    }
  }
  for (const char* axis : {"x", "y", "z"})
    EXPECT_TRUE(bench.told_with(std::string("compensation_harms_") + axis).empty()) << axis;
  bench.expect_alive_then_stop();
}

// The raw rate is put together again from two that change, and still stands.
TEST(AllanMonitor, AStuckAxisIsToldAndSoIsItsRecovery) {
  Bench bench(Domain::kAllanStuck);
  Gyro gyro(bench.participant, 1);
  gyro.connect();
  gyro.send_for(20.0);
  bench.await_report(1, gyro);
  EXPECT_EQ((bench.newest()[{1, 0, 0}].stuck()), 0U);
  gyro.stuck_at[0] = radps_from_deg_h(5.123);
  gyro.send_for(10.0);
  bench.await_report(1, gyro);
  EXPECT_EQ((bench.newest()[{1, 0, 0}].stuck()), 1U);
  EXPECT_EQ((bench.newest()[{1, 1, 0}].stuck()), 0U);
  gyro.stuck_at[0] = kNoNumber;
  gyro.send_for(10.0);
  bench.await_report(1, gyro);
  EXPECT_EQ((bench.newest()[{1, 0, 0}].stuck()), 0U);
  bench.expect_once("output_stuck_x", "gyro 1 axis x raw: the output does not move");
  bench.expect_once("output_moves_x", "gyro 1 axis x raw: the output moves again");
  EXPECT_TRUE(bench.told_with("output_stuck_y").empty());
  bench.expect_alive_then_stop();
}

TEST(AllanMonitor, AGapOfTenMinutesIsOneEventAndLeavesFiniteFigures) {
  Bench bench(Domain::kAllanGap);
  Gyro gyro(bench.participant, 1);
  gyro.connect();
  gyro.send_for(60.0);
  bench.await_report(1, gyro);
  gyro.time_s += 600.0;
  gyro.send_for(60.0);
  bench.await_report(1, gyro);
  bench.expect_once("gap", "1 gap(s) in the stream, 600 s missing in all, the longest 600 s");
  for (const auto& [key, report] : bench.newest()) {
    EXPECT_EQ(report.gaps(), 1U);
    EXPECT_EQ(report.missing(), 30000U);
    EXPECT_NEAR(report.longest_gap_s(), 600.0, 1e-6);
    EXPECT_EQ(report.samples(), 6000U);
    expect_finite(report);
    expect_white_noise(report, kRateHz);
    EXPECT_EQ(report.noise_grown(), 0U);
  }
  // 300 lost samples, each a gap, are told in a few lines: one at once and one each ten seconds.
  for (int k = 0; k < 3000; ++k) {
    const auto sample = gyro.next();
    if (k % 10 != 5) gyro.send(sample);
  }
  gyro.settle();
  bench.await_report(1, gyro);
  EXPECT_EQ((bench.newest()[{1, 0, 0}].gaps()), 301U);
  EXPECT_LE(bench.told_with("gap").size(), 5U);
  bench.expect_alive_then_stop();
}

TEST(AllanMonitor, BadSamplesAreCountedAndPoisonNothing) {
  Bench bench(Domain::kAllanBadSamples);
  Gyro gyro(bench.participant, 1);
  gyro.connect();
  gyro.send_for(60.0);

  auto not_a_number = gyro.next();
  not_a_number.rate_radps[0] = kNoNumber;
  gyro.send(not_a_number);
  auto invalid = gyro.next();
  invalid.raw.valid[1] = false;
  gyro.send(invalid);
  auto absurd = gyro.next();
  absurd.rate_radps[2] = 1e300;
  gyro.send(absurd);
  auto twice = gyro.next();
  gyro.send(twice);
  twice.raw.sequence = gyro.next_number();  // the same time again, as another sample
  gyro.send(twice);
  auto earlier = gyro.next();
  earlier.raw.time -= std::chrono::seconds(5);
  gyro.send(earlier);
  for (const double interval_s : {0.0, -1.0, 1e-300, 1e300, kNoNumber}) {
    auto odd = gyro.next();
    odd.raw.interval_s = interval_s;
    gyro.send(odd);
  }
  gyro.send_for(60.0);
  bench.await_report(1, gyro);

  for (const char* code : {"invalid_sample_x", "invalid_sample_y", "duplicate_time",
                           "time_backwards", "interval_refused", "gap"}) {
    EXPECT_TRUE(eventually([&] { return told(bench.events, code, "gyro 1"); })) << code;
  }
  for (const auto& [key, report] : bench.newest()) {
    expect_finite(report);
    expect_white_noise(report, kRateHz);
  }
  EXPECT_EQ(metric(bench.statuses, "allan_monitor", "duplicates"), 1.0);
  EXPECT_EQ(metric(bench.statuses, "allan_monitor", "refused"), 5.0);
  EXPECT_EQ(metric(bench.statuses, "allan_monitor", "out_of_order"), 1.0);
  bench.expect_alive_then_stop();
}

TEST(AllanMonitor, AnotherRateBeginsTheStatisticsAnewAndATimeThatRestartsDoesNot) {
  Bench bench(Domain::kAllanNewRate);
  Gyro gyro(bench.participant, 1);
  gyro.connect();
  gyro.send_for(30.0);
  gyro.time_s += 60.0;
  gyro.send_for(30.0);
  bench.await_report(1, gyro);
  gyro.rate_hz = 100.0;
  gyro.send_for(60.0);
  bench.await_report(1, gyro);
  bench.expect_once("interval_changed", "gyro 1: the sample interval is 0.01 s, was 0.02 s");
  for (const auto& [key, report] : bench.newest()) {
    EXPECT_NEAR(report.sample_interval_s(), 0.01, 1e-15);  // a mean of 32
    EXPECT_LE(report.samples(), 6000U);
    EXPECT_GE(report.samples(), 5904U);  // three blocks of 32 to believe it
    expect_white_noise(report, 100.0);
  }
  gyro.time_s = 0.0;
  gyro.send_for(60.0);
  bench.await_report(1, gyro);
  bench.expect_once("time_restarted", "gyro 1: sensor time began anew");
  EXPECT_TRUE(eventually([&] {
    return told(bench.events, "gap",
                "2 gap(s) in the stream, 60.01 s missing in all, the longest 60 s");
  })) << "before: half of the first, counted in samples of the new interval";
  for (const auto& [key, report] : bench.newest()) {
    EXPECT_GT(report.samples(), 11000U);
    EXPECT_EQ(report.gaps(), 1U);
    expect_white_noise(report, 100.0);
  }
  bench.expect_alive_then_stop();
}

// -------------------------------------------------------------------------------- unchanged N

struct Columns {
  core::PerAxis<std::size_t> rate{};
  core::PerAxis<std::size_t> drift{};
};

// A temperature regressor cannot lower the true N, and must not raise it: N_compensated / N_raw = 1
// ± 0.02. Five hours of the paper's chamber at 20 Hz. N is read twice: at the shortest tau, 0.05 s,
// where white noise is all but a thousandth of the variance, known within 0.15 % and shared by both
// streams; and as identify_noise() gives it from the whole curve. The latter needs its terms on
// evidence: the compensation adds a hump between 1 s and 50 s (the noise of the temperature rates
// it learns from) that N, B and K have no shape for - a fit of these three alone is off by up to 3
// % - and that a Markov noise and a sinusoid describe as far as N is concerned. They describe it
// badly (reduced chi-square 10): what they say of the hump itself is not to be believed.
TEST(AllanMonitor, CompensationLeavesTheAngleRandomWalkAsItIs) {
  SystemUnderTest system(Domain::kAllanSameN);
  simulate(system,
           {.profile =
                std::filesystem::path(ZERODRIFT_SOURCE_DIR) / "config/profiles/paper_chamber.yaml",
            .rate_hz = 20},
           system.path("record.csv"));
  run_offline(system, system.path("record.csv"), system.path("compensated.csv"));

  std::ifstream file(system.path("compensated.csv"));
  std::string line;
  const auto cells_of = [](const std::string& row) {
    std::vector<std::string> cells;
    std::istringstream in(row);
    for (std::string cell; std::getline(in, cell, ',');) cells.push_back(cell);
    return cells;
  };
  while (std::getline(file, line) && line.starts_with('#')) {
  }
  const auto header = cells_of(line);
  const auto column = [&](const std::string& name) {
    const auto found = std::find(header.begin(), header.end(), name);
    EXPECT_NE(found, header.end()) << name;
    return static_cast<std::size_t>(found - header.begin());
  };
  Columns columns;
  for (const auto axis : core::kAxes) {
    const std::string name(core::name(axis));
    columns.rate[core::index(axis)] = column("rate_" + name + "_rad_s");
    columns.drift[core::index(axis)] = column("applied_drift_" + name + "_rad_s");
  }
  allan::RollingAllanOptions options;
  options.sample_interval_s = 1.0 / 20.0;
  options.longest_tau_s = 1000.0;
  std::vector<allan::RollingAllan> raw(3, allan::RollingAllan(options));
  std::vector<allan::RollingAllan> compensated(3, allan::RollingAllan(options));
  double largest_drift_radps = 0.0;
  while (std::getline(file, line)) {
    const auto cells = cells_of(line);
    for (std::size_t i = 0; i < 3; ++i) {
      const double rate = std::stod(cells.at(columns.rate[i]));
      const double drift = std::stod(cells.at(columns.drift[i]));
      compensated[i].add(rate);
      raw[i].add(rate + drift);
      largest_drift_radps = std::max(largest_drift_radps, std::abs(drift));
    }
  }
  EXPECT_GT(largest_drift_radps, radps_from_deg_h(0.5)) << "nothing was compensated";
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(raw[i].samples(), 360000U);
    const auto at_shortest_tau = [](const allan::RollingAllan& stream) {
      const auto shortest = stream.point(0, allan::Span::kSinceStart).value();
      return shortest.deviation_radps * std::sqrt(shortest.tau_s);
    };
    const auto identified = [](const allan::RollingAllan& stream) {
      const auto report = allan::identify_noise(stream.points(allan::Span::kSinceStart));
      return report[allan::NoiseTerm::kAngleRandomWalk].value;
    };
    for (const auto& [how, n_raw, n_compensated] :
         {std::tuple{"at the shortest tau", at_shortest_tau(raw[i]),
                     at_shortest_tau(compensated[i])},
          std::tuple{"identified", identified(raw[i]), identified(compensated[i])}}) {
      std::printf("axis %zu, N %s: raw %.5e, compensated %.5e rad/rt(s), ratio %.5f\n", i, how,
                  n_raw, n_compensated, n_compensated / n_raw);
      EXPECT_NEAR(n_compensated / n_raw, 1.0, 0.02) << how;
    }
  }
}

}  // namespace
}  // namespace zerodrift::system_test
