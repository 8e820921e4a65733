// SPDX-License-Identifier: Apache-2.0
// Bad streams over DDS. The test is the gyro and the thermometers, with a hardware clock, which the
// service never lets wait. Rules: every accepted sample is answered exactly once, what is wrong is
// named by an event or a mode with its reason, and the service goes on.
#include <gtest/gtest.h>
#include <signal.h>

#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "common/core/mode.h"
#include "common/core/units.h"
#include "common/dds/conversions.h"
#include "tests/system/files.h"
#include "tests/system/system_under_test.h"

namespace zerodrift::system_test {
namespace {

using core::Mode;
using core::radps_from_deg_h;
using core::Reason;
using core::Rung;
using namespace std::chrono_literals;

constexpr double kRateHz = 50.0;
constexpr std::uint32_t kGyroId = 1;

core::AngularRateSample sample_at(std::uint64_t sequence, double time_s) {
  core::AngularRateSample sample;
  sample.sequence = sequence;
  sample.time = core::from_seconds(time_s);
  sample.interval_s = 1.0 / kRateHz;
  sample.rate_radps = {1e-6, 2e-6, 3e-6};
  sample.valid = {true, true, true};
  sample.clock = core::ClockSource::kHardware;
  return sample;
}

// A compensation service, and all that it hears and says.
class Bench {
 public:
  Bench(Domain domain, const std::string& config)
      : system(domain),
        participant_("test", system.network()),
        answers(participant_),
        events(participant_),
        gyro_(participant_) {
    write(system.path("compensation.yaml"), config);
    service_ = &system.start("compensation", {"--config", system.path("compensation.yaml")});
  }

  // Sends until an answer comes back: from then on nothing can be missed on either side.
  void connect() {
    ASSERT_TRUE(eventually([&] { return gyro_.matched() > 0; }));
    ASSERT_TRUE(eventually([&] {
      if (answers.size() > 0) return true;
      send(next_sample());
      std::this_thread::sleep_for(10ms);
      return false;
    }));
    await_answer(sequence_ - 1);
  }

  // One period later than the one before, sequence up by one, a little noise and a drift that
  // follows the temperature: 1 deg/h per °C.
  core::AngularRateSample next_sample() {
    time_s_ += 1.0 / kRateHz;
    core::AngularRateSample sample = sample_at(sequence_++, time_s_);
    for (double& rate : sample.rate_radps) rate += radps_from_deg_h(drift_deg_h_) + noise_(random_);
    return sample;
  }

  void send(const core::AngularRateSample& sample) {
    auto message = dds::to_message(sample, kGyroId, 0);
    ASSERT_TRUE(gyro_.write(message));
    sent_.insert(sample.sequence);
    // Far below the 2000 samples that a writer keeps.
    if (++since_answer_ < 500) return;
    await_answer(sample.sequence);
  }

  void send_temperature(const std::string& probe, double temperature_degc,
                        double stamped_behind_s = 0.0) {
    auto& writer = probes_[probe];
    if (!writer) {
      writer = std::make_unique<dds::Writer<msg::Temperature>>(participant_);
      ASSERT_TRUE(eventually([&] { return writer->matched() > 0; }));
    }
    core::TemperatureSample sample;
    sample.probe = probe;
    sample.sequence = ++readings_;
    sample.time = core::from_seconds(time_s_ - stamped_behind_s);
    sample.temperature_degc = temperature_degc;
    sample.clock = core::ClockSource::kHardware;
    auto message = dds::to_message(sample, kGyroId);
    ASSERT_TRUE(writer->write(message));
    // A reading reaches the service before the rates that it belongs to.
    ASSERT_TRUE(writer->wait_until_received(5000ms));
    if (probe == "coil") drift_deg_h_ = temperature_degc;
  }

  void send_normal(int samples) {
    for (int k = 0; k < samples; ++k) send(next_sample());
  }

  void await_answer(std::uint64_t sequence) {
    ASSERT_TRUE(eventually([&] {
      return answers.any([&](const auto& answer) { return answer.sequence_number() == sequence; });
    })) << "no answer to sequence "
        << sequence;
    since_answer_ = 0;
  }

  // Answers by sequence number. Fails unless each sample sent was answered exactly once and nothing
  // else was.
  std::map<std::uint64_t, msg::CompensatedRate> settled_answers(std::uint64_t unheard = 0) {
    send_normal(1);
    await_answer(sequence_ - 1);
    std::map<std::uint64_t, msg::CompensatedRate> by_sequence;
    for (const auto& answer : answers.all()) {
      EXPECT_TRUE(by_sequence.emplace(answer.sequence_number(), answer).second)
          << "sequence " << answer.sequence_number() << " was answered twice";
      EXPECT_TRUE(sent_.contains(answer.sequence_number())) << answer.sequence_number();
    }
    for (const std::uint64_t sequence : sent_) {
      EXPECT_TRUE(sequence < unheard || by_sequence.contains(sequence))
          << sequence << " was not answered";
    }
    return by_sequence;
  }

  void expect_event(const std::string& code, const std::string& text = "") {
    EXPECT_TRUE(eventually([&] { return told(events, code, text); })) << code << " " << text;
  }

  // What every test ends with: the service is alive, and stops when told.
  void expect_alive_then_stop() {
    EXPECT_TRUE(service_->running());
    service_->send(SIGTERM);
    EXPECT_EQ(service_->wait(2000ms), 0);
  }

  [[nodiscard]] std::uint64_t next_sequence() const { return sequence_; }
  void skip_sequences(std::uint64_t count) { sequence_ += count; }
  [[nodiscard]] double time_s() const { return time_s_; }

  SystemUnderTest system;

 private:
  dds::Participant participant_;

 public:
  Collector<msg::CompensatedRate> answers;
  Collector<msg::Event> events;

 private:
  dds::Writer<msg::AngularRate> gyro_;
  std::map<std::string, std::unique_ptr<dds::Writer<msg::Temperature>>> probes_;
  ChildProcess* service_ = nullptr;
  std::set<std::uint64_t> sent_;
  std::mt19937_64 random_{20260101};
  std::normal_distribution<double> noise_{0.0, radps_from_deg_h(0.02)};
  double drift_deg_h_ = 0.0;
  double time_s_ = 1000.0;
  std::uint64_t sequence_ = 0;
  std::uint64_t readings_ = 0;
  int since_answer_ = 0;
};

void expect_mode(const msg::CompensatedRate& answer, Mode mode, Reason reason) {
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(core::name(static_cast<Mode>(answer.mode()[i])), core::name(mode));
    EXPECT_EQ(core::name(static_cast<Reason>(answer.reason()[i])), core::name(reason));
  }
}

TEST(BadStream, EveryBadSampleIsAnsweredOnceAndNamed) {
  Bench bench(Domain::kBadSamples, "");
  bench.connect();
  const std::uint64_t first =
      bench.next_sequence();  // what came before the connection isn't judged
  bench.send_normal(100);

  auto not_a_number = bench.next_sample();
  not_a_number.rate_radps[0] = std::numeric_limits<double>::quiet_NaN();
  bench.send(not_a_number);
  auto infinite = bench.next_sample();
  infinite.rate_radps[1] = -std::numeric_limits<double>::infinity();
  bench.send(infinite);
  auto absurd = bench.next_sample();
  absurd.rate_radps[2] = 1e5;
  bench.send(absurd);
  bench.send_normal(10);

  const auto twice = bench.next_sample();
  bench.send(twice);
  bench.send(twice);
  bench.send_normal(10);

  const auto earlier = bench.next_sample();
  const auto later = bench.next_sample();
  bench.send(later);
  bench.send(earlier);
  bench.send_normal(10);

  bench.skip_sequences(3);
  bench.send_normal(10);

  auto stuck_clock = bench.next_sample();
  stuck_clock.time -= 1s;
  bench.send(stuck_clock);
  bench.send_normal(100);

  const auto answers = bench.settled_answers(first);
  // The bad axis passes as it came, marked; the others are as good as ever.
  for (const auto& [bad, axis] :
       {std::pair{not_a_number, 0U}, std::pair{infinite, 1U}, std::pair{absurd, 2U}}) {
    const auto& answer = answers.at(bad.sequence);
    EXPECT_EQ(answer.reason()[axis], static_cast<std::uint8_t>(Reason::kInvalidInput));
    EXPECT_EQ(answer.mode()[axis], static_cast<std::uint8_t>(Mode::kPassthrough));
    EXPECT_EQ(answer.applied_drift_radps()[axis], 0.0);
    EXPECT_EQ(answer.validity() >> axis & 1U, 0U);
    EXPECT_NE(answer.reason()[(axis + 1) % 3], static_cast<std::uint8_t>(Reason::kInvalidInput));
    EXPECT_EQ(answer.validity() >> ((axis + 1) % 3) & 1U, 1U);
  }
  EXPECT_TRUE(std::isnan(answers.at(not_a_number.sequence).rate_radps()[0]));
  EXPECT_EQ(answers.at(infinite.sequence).rate_radps()[1], infinite.rate_radps[1]);
  EXPECT_EQ(answers.at(earlier.sequence).order(), 1);
  EXPECT_EQ(answers.at(later.sequence).order(), 0);
  for (const char* code :
       {"invalid_sample", "duplicate_sample", "late_sample", "missing_sample", "time_fault"}) {
    bench.expect_event(code);
  }
  bench.expect_alive_then_stop();
}

// 200 s of a ramp of 0.02 °C/s: labels from second 10 on, each 5 s; the initial set of twelve is
// complete, confirmed and handed over about second 80, and from the third label judged after that
// the model may be trusted.
void learn_on_a_ramp(Bench& bench) {
  for (int second = 0; second < 200; ++second) {
    bench.send_temperature("coil", 20.0 + 0.02 * second);
    bench.send_normal(static_cast<int>(kRateHz));
  }
}

TEST(BadStream, ATemperatureStreamThatStopsEndsInTheFallbackAfterTemperatureStaleS) {
  Bench bench(Domain::kTemperatureStops,
              "temperature_stale_s: 30\nearth_rate: {mode: included}\n"
              "features: [{kind: temperature, probe: coil}]\n");
  bench.connect();
  const std::uint64_t first = bench.next_sequence();
  learn_on_a_ramp(bench);
  const double last_reading_s =
      bench.time_s() - 1.0;  // stamped before the second of rates that followed it
  const std::uint64_t last_second = bench.next_sequence();
  bench.send_normal(static_cast<int>(40.0 * kRateHz));

  const auto answers = bench.settled_answers(first);
  expect_mode(answers.at(last_second), Mode::kLearning, Reason::kNone);
  double stale_since_s = 0.0;
  for (const auto& [sequence, answer] : answers) {
    if (answer.reason()[0] != static_cast<std::uint8_t>(Reason::kTemperatureStale)) continue;
    stale_since_s = static_cast<double>(answer.sensor_time_ns()) * 1e-9;
    break;
  }
  // Ages are looked at once a block, that is within a second and one sample.
  EXPECT_GT(stale_since_s, last_reading_s + 30.0);
  EXPECT_LT(stale_since_s, last_reading_s + 31.0 + 2.0 / kRateHz);
  expect_mode(answers.rbegin()->second, Mode::kFallback, Reason::kTemperatureStale);
  EXPECT_EQ(answers.rbegin()->second.rung()[0], static_cast<std::uint8_t>(Rung::kStack));
  bench.expect_event("mode_x", "fallback (temperature_stale)");
  bench.expect_event("temperature_stale");

  // It comes back.
  bench.send_temperature("coil", 22.4);
  bench.send_normal(static_cast<int>(2.0 * kRateHz));
  const auto healed = bench.settled_answers(first);
  EXPECT_NE(healed.rbegin()->second.reason()[0],
            static_cast<std::uint8_t>(Reason::kTemperatureStale));
  EXPECT_FALSE(told(bench.events, "clocks_disagree", ""));
  // Before: of readings that came, stamped by a clock that is behind, it was said that they
  // stopped.
  for (int reading = 0; reading < 2; ++reading) {
    bench.send_temperature("coil", 22.4, 40.0);
    bench.send_normal(static_cast<int>(kRateHz));
  }
  bench.expect_event("clocks_disagree", "a temperature is stamped 40.000000 s behind the rates");
  // Before: "a temperature is not finite, implausible or out of order", whichever it was.
  bench.send_temperature("coil", 298.15);
  bench.send_normal(static_cast<int>(kRateHz));
  bench.expect_event(
      "refused_temperature",
      "a temperature of probe coil is 298.15, expected -100 to 250 degC (25 degC, if "
      "it is in kelvin); not used");
  bench.expect_alive_then_stop();
}

TEST(BadStream, AProbeThatIsStuckEndsInTheFallback) {
  Bench bench(Domain::kProbeStuck,
              "probe_stuck_s: 20\nearth_rate: {mode: included}\nfeatures:\n"
              "  - {kind: temperature, probe: coil}\n  - {kind: temperature, probe: case}\n");
  bench.connect();
  const std::uint64_t first = bench.next_sequence();
  // 0.02 °C/s for a minute, in which a bias is learned; then the coil's probe says the same for
  // ever while the case moves by more than 1 °C in 20 s.
  double case_degc = 20.0;
  for (int second = 0; second < 100; ++second) {
    const bool stuck = second >= 60;
    case_degc += stuck ? 0.06 : 0.02;
    bench.send_temperature("case", case_degc);
    bench.send_temperature("coil", stuck ? 21.2 : case_degc);
    bench.send_normal(static_cast<int>(kRateHz));
  }
  expect_mode(bench.settled_answers(first).rbegin()->second, Mode::kFallback, Reason::kProbeStuck);
  bench.expect_event("mode_x", "fallback (probe_stuck)");
  bench.expect_event("probe_stuck");
  bench.expect_alive_then_stop();
}

TEST(BadStream, OfTwoPublishersWithOneIdOnlyTheFirstIsHeardAndLosesNothing) {
  Bench bench(Domain::kTwoPublishersOneId, "");
  bench.connect();
  const std::uint64_t first = bench.next_sequence();
  dds::Participant participant("impostor", bench.system.network());
  dds::Writer<msg::AngularRate> impostor(participant);
  dds::Writer<msg::Temperature> impostors_thermometer(participant);
  ASSERT_TRUE(
      eventually([&] { return impostor.matched() > 0 && impostors_thermometer.matched() > 0; }));
  for (int k = 0; k < 500; ++k) {
    bench.send_normal(1);  // never silent for a second
    if (k % 100 == 0) {
      bench.send_temperature("coil", 20.0);
      auto warmer = dds::to_message(
          core::TemperatureSample{.probe = "coil",
                                  .sequence = 1000000U + static_cast<std::uint64_t>(k),
                                  .time = core::from_seconds(bench.time_s()),
                                  .temperature_degc = 21.5,
                                  .clock = core::ClockSource::kHardware},
          kGyroId);
      ASSERT_TRUE(impostors_thermometer.write(warmer));
      ASSERT_TRUE(impostors_thermometer.wait_until_received(5000ms));
    }
    auto other = dds::to_message(
        sample_at(1000000U + static_cast<std::uint64_t>(k), bench.time_s()), kGyroId, 0);
    ASSERT_TRUE(impostor.write(other));
  }
  ASSERT_TRUE(impostor.wait_until_received(5000ms));
  bench.settled_answers(first);  // fails for any answer to the impostor
  bench.expect_event("duplicate_publisher", "uses this id");
  bench.expect_event("duplicate_publisher", "temperatures of coil");
  bench.expect_alive_then_stop();
}

// Before: both were used, and the drift was off by as much as they disagree.
TEST(BadStream, OfTwoReferencesOnlyTheFirstTeaches) {
  Bench bench(Domain::kTwoReferences, "earth_rate: {mode: unknown}\n");
  bench.connect();
  dds::Participant participant("tables", bench.system.network());
  dds::Writer<msg::RateReference> table(participant);
  dds::Writer<msg::RateReference> other(participant);
  ASSERT_TRUE(eventually([&] { return table.matched() > 0 && other.matched() > 0; }));
  const auto say = [&](dds::Writer<msg::RateReference>& writer, double rate_deg_h) {
    const double rate = radps_from_deg_h(rate_deg_h);
    auto message =
        dds::to_message(core::RateReferenceSample{.time = core::from_seconds(bench.time_s()),
                                                  .rate_radps = {rate, rate, rate},
                                                  .valid = {true, true, true},
                                                  .kind = core::ReferenceKind::kRateTable},
                        kGyroId);
    ASSERT_TRUE(writer.write(message));
    ASSERT_TRUE(writer.wait_until_received(5000ms));
  };
  for (int second = 0; second < 30; ++second) {
    say(table, 0.0);
    say(other, second % 2 == 0 ? 40.0 : -40.0);
    bench.send_normal(static_cast<int>(kRateHz));
  }
  const msg::CompensatedRate newest = bench.settled_answers().rbegin()->second;
  EXPECT_NE(newest.mode()[0], static_cast<std::uint8_t>(Mode::kPassthrough));
  EXPECT_NEAR(newest.applied_drift_radps()[0], 1e-6, radps_from_deg_h(0.1));
  bench.expect_event("duplicate_publisher", "a second publisher says what the true rate is");
  bench.expect_alive_then_stop();
}

// A publisher that was killed says nothing; its successor sends before anybody can know. Rule: what
// it sends is answered from its first sample on, once each and in order.
TEST(BadStream, OfAPublisherThatFollowsOneThatFellSilentNothingIsLost) {
  Bench bench(Domain::kSuccessor, "");
  bench.connect();
  bench.send_normal(100);
  dds::Participant participant("successor", bench.system.network());
  dds::Writer<msg::AngularRate> successor(participant);
  ASSERT_TRUE(eventually([&] { return successor.matched() > 0; }));
  bench.send_normal(1);
  bench.await_answer(bench.next_sequence() - 1);
  constexpr std::uint64_t kSamples = 400;  // fewer than a writer keeps
  for (std::uint64_t k = 1; k <= kSamples; ++k) {
    auto message = dds::to_message(sample_at(k, bench.time_s() + static_cast<double>(k) / kRateHz),
                                   kGyroId, 0);
    ASSERT_TRUE(successor.write(message));
  }
  const std::uint64_t before = bench.answers.all().front().run_id();
  std::vector<std::uint64_t> answered;
  EXPECT_TRUE(eventually([&] {
    answered.clear();
    for (const auto& answer : bench.answers.all()) {
      if (answer.run_id() != before) answered.push_back(answer.sequence_number());
    }
    return answered.size() >= kSamples;
  }));
  std::vector<std::uint64_t> sent(kSamples);
  std::iota(sent.begin(), sent.end(), 1U);
  EXPECT_EQ(answered, sent);
  bench.expect_alive_then_stop();
}

}  // namespace
}  // namespace zerodrift::system_test
