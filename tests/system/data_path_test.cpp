// SPDX-License-Identifier: Apache-2.0
// The running service's data path, counted from outside (data_path_audit.h): it takes and gives
// back no memory, waits for nothing, and takes no lock that the learner ever takes, whatever comes
// in and whatever the learner does; and a learner that stands still costs labels, not samples.
//
// The test is the gyro, with a hardware clock, which the service never lets wait.
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <map>
#include <memory>
#include <random>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>

#include "common/core/mode.h"
#include "common/core/units.h"
#include "common/dds/conversions.h"
#include "tests/support/sanitized.h"
#include "tests/system/data_path_audit.h"
#include "tests/system/files.h"
#include "tests/system/mapped_file.h"
#include "tests/system/system_under_test.h"

namespace zerodrift::system_test {
namespace {

using core::radps_from_deg_h;
using namespace std::chrono_literals;

constexpr std::uint32_t kGyroId = 1;
constexpr double kRateHz = 200.0;
constexpr int kSecond = static_cast<int>(kRateHz);
constexpr std::uint64_t kAhead = 400;  // samples, far below the 2000 that a writer keeps

// The counters, in a file that a process maps.
class Audit {
 public:
  explicit Audit(const std::filesystem::path& file) : counters_(file) {}

  DataPathAudit* operator->() const { return &*counters_; }
  static std::set<std::uintptr_t> locks(const LockSet& set) {
    std::set<std::uintptr_t> result;
    for (const auto& lock : set.locks)
      if (lock != 0) result.insert(lock);
    return result;
  }
  // Locks of both.
  [[nodiscard]] std::size_t shared_locks() const {
    const auto data_path = locks(counters_->of_data_path);
    const auto learner = locks(counters_->of_learner);
    return static_cast<std::size_t>(std::count_if(
        data_path.begin(), data_path.end(), [&](auto lock) { return learner.contains(lock); }));
  }

 private:
  MappedFile<DataPathAudit> counters_;
};

// A program with the audit loaded, the gyro that it hears, and what it answers.
class Audited {
 public:
  Audited(Domain domain, const std::string& program, const Arguments& arguments = {},
          bool learner_stands_still = false)
      : system(domain),
        audit(system.path("audit")),
        participant_("test", system.network()),
        answers_(participant_,
                 [this](const msg::CompensatedRate& m, const dds::SampleOrigin&) { note(m); }),
        statuses(participant_),
        events(participant_),
        gyro_(participant_),
        coil_(participant_) {
    audit->hold_learner = learner_stands_still ? 1 : 0;
    Arguments all = arguments;
    all.insert(all.end(), {"--domain", std::to_string(system.network().domain)});
    service_ = &system.start_foreign(
        program, all,
        {{"LD_PRELOAD", std::string(ZERODRIFT_BIN_DIR) + "/libdata_path_audit.so"},
         {kAuditFile, system.path("audit").string()}});
  }

  // Sends until an answer comes back, and some more, so that everything has begun.
  void connect() {
    ASSERT_TRUE(eventually([&] { return gyro_.matched() > 0; }));
    ASSERT_TRUE(eventually([&] {
      send(next_sample());
      std::this_thread::sleep_for(20ms);
      return answered_ > 0;
    }));
    await(next_sequence_ - 1);
  }
  void arm() {
    await(next_sequence_ - 1);
    audit->armed = 1;
  }
  void disarm() {
    await(next_sequence_ - 1);
    audit->armed = 0;
  }

  core::AngularRateSample next_sample(double rate_radps = 0.0) {
    time_s_ += 1.0 / kRateHz;
    core::AngularRateSample sample;
    sample.sequence = next_sequence_++;
    sample.time = core::from_seconds(time_s_);
    sample.interval_s = 1.0 / kRateHz;
    sample.valid = {true, true, true};
    sample.clock = core::ClockSource::kHardware;
    for (double& rate : sample.rate_radps)
      rate = rate_radps + radps_from_deg_h(coil_degc_) + noise_(random_);
    return sample;
  }
  void send(const core::AngularRateSample& sample) {
    auto message = dds::to_message(sample, kGyroId, 0);
    ASSERT_TRUE(gyro_.write(message));
    ++sent_;
    newest_sent_ = std::max(newest_sent_, sample.sequence);
    if (sent_ % kAhead == 0) await(newest_sent_);
  }
  void send_temperature(double coil_degc) {
    coil_degc_ = coil_degc;
    core::TemperatureSample sample;
    sample.probe = "coil";
    sample.sequence = ++readings_;
    sample.time = core::from_seconds(time_s_);
    sample.temperature_degc = coil_degc;
    sample.clock = core::ClockSource::kHardware;
    auto message = dds::to_message(sample, kGyroId);
    ASSERT_TRUE(coil_.write(message));
  }
  // A ramp, one reading a second.
  void ramp(int seconds, double degc_per_s, double rate_radps = 0.0) {
    for (int second = 0; second < seconds; ++second) {
      send_temperature(coil_degc_ + degc_per_s);
      for (int k = 0; k < kSecond; ++k) send(next_sample(rate_radps));
    }
  }
  void skip_sequences(std::uint64_t count) { next_sequence_ += count; }
  void await(std::uint64_t sequence) {
    ASSERT_TRUE(eventually([&] { return newest_answered_ >= sequence; })) << sequence;
  }
  // Of the service, or of its gyro.
  double figure(const std::string& name) {
    return metric(statuses, "compensation:" + std::to_string(kGyroId), name);
  }
  void stop() {
    service_->send(SIGTERM);
    EXPECT_EQ(service_->wait(2500ms), 0);
  }

  [[nodiscard]] std::uint64_t sent() const { return sent_; }
  [[nodiscard]] std::uint64_t answered() const { return answered_; }
  [[nodiscard]] std::uint64_t modes_seen(core::Mode mode) const {
    return modes_[static_cast<std::size_t>(mode)];
  }
  [[nodiscard]] std::uint64_t epochs_seen() const { return epochs_; }

  SystemUnderTest system;
  Audit audit;

 private:
  void note(const msg::CompensatedRate& answer) {
    ++modes_[std::min<std::size_t>(answer.mode()[0], modes_.size() - 1)];
    if (answer.model_epoch() != newest_epoch_) ++epochs_;
    newest_epoch_ = answer.model_epoch();
    ++answered_;
    newest_answered_ = std::max(newest_answered_.load(), answer.sequence_number());
  }

  dds::Participant participant_;
  std::array<std::atomic<std::uint64_t>, 8> modes_{};
  std::atomic<std::uint64_t> answered_{0};
  std::atomic<std::uint64_t> newest_answered_{0};
  std::atomic<std::uint64_t> epochs_{0};
  std::uint64_t newest_epoch_ = 0;
  dds::Reader<msg::CompensatedRate> answers_;

 public:
  Collector<msg::ServiceStatus> statuses;
  Collector<msg::Event> events;

 private:
  dds::Writer<msg::AngularRate> gyro_;
  dds::Writer<msg::Temperature> coil_;
  ChildProcess* service_ = nullptr;
  std::mt19937_64 random_{20260101};
  std::normal_distribution<double> noise_{0.0, radps_from_deg_h(0.02)};
  double coil_degc_ = 20.0;
  double time_s_ = 1000.0;
  std::uint64_t next_sequence_ = 1;
  std::uint64_t newest_sent_ = 0;
  std::uint64_t sent_ = 0;
  std::uint64_t readings_ = 0;
};

const char* const kConfig =
    "earth_rate: {mode: included}\nfeatures: [{kind: temperature, probe: coil}]\n"
    "svr: {capacity: 40}\n";

std::filesystem::path config_in(const std::string& name) {
  const auto file = std::filesystem::temp_directory_path() / name;
  write(file, kConfig);
  return file;
}

void expect_ok(const Finished& command) {
  EXPECT_EQ(command.exit_code, 0) << command.out << command.err;
}

// Every kind of bad sample.
void send_bad_samples(Audited& service) {
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e300}) {
    auto sample = service.next_sample();
    sample.rate_radps[0] = bad;
    service.send(sample);
  }
  const auto earlier = service.next_sample();
  const auto later = service.next_sample();
  service.send(later);
  service.send(earlier);  // late
  service.send(later);    // twice
  service.skip_sequences(5);
  auto stuck_clock = service.next_sample();
  stuck_clock.time -= 1s;
  service.send(stuck_clock);
  for (int k = 0; k < kSecond; ++k) service.send(service.next_sample());
}

// Rule: from the second sample on, nothing that a stream or an operator does makes the data path
// take memory, give it back, wait, or take a lock that is also the learner's.
TEST(DataPath, TakesNoMemoryWaitsForNothingAndSharesNoLockWithTheLearner) {
  if (kIsSanitized) GTEST_SKIP() << "a sanitizer replaces the same functions";
  const auto config = config_in("zerodrift-data-path.yaml");
  const auto checkpoints = std::filesystem::temp_directory_path() / "zerodrift-data-path";
  std::filesystem::remove_all(checkpoints);
  std::filesystem::create_directories(checkpoints);
  Audited service(Domain::kDataPath, "compensation",
                  {"--config", config, "--checkpoint-dir", checkpoints});
  service.connect();
  service.arm();

  // A window of 40 labels of 5 s fills and forgets; the kernel is chosen anew on the way.
  service.ramp(300, 0.02);
  send_bad_samples(service);
  service.ramp(30, 0.02, 0.1);  // a turn: learning freezes
  service.ramp(30, 0.02);
  expect_ok(service.system.control({"checkpoint"}));
  expect_ok(service.system.control({"freeze"}));
  service.ramp(10, 0.02);
  expect_ok(service.system.control({"learn"}));
  expect_ok(service.system.control({"restore"}));
  service.ramp(30, 0.02);
  service.ramp(20, 2.0);  // far out of what was learned
  expect_ok(service.system.control({"reset"}));
  service.ramp(30, -0.02);
  service.disarm();

  EXPECT_EQ(service.audit->taken, 0U) << service.audit->first_finding.data();
  EXPECT_EQ(service.audit->given_back, 0U) << service.audit->first_finding.data();
  EXPECT_EQ(service.audit->waits, 0U);
  EXPECT_EQ(service.audit.shared_locks(), 0U);
  // That all of it was there to be counted.
  EXPECT_EQ(service.audit->learners, 1U);
  EXPECT_GT(service.audit->samples, 80'000U);
  EXPECT_GT(service.audit->writes, 80'000U);
  EXPECT_GT(service.audit->of_data_path.taken, 80'000U);
  EXPECT_EQ(service.audit->of_data_path.left_out, 0U);
  EXPECT_EQ(service.audit->of_learner.left_out, 0U);
  using core::Mode;
  for (const Mode mode : {Mode::kLearning, Mode::kFrozen, Mode::kOutOfDomain})
    EXPECT_GT(service.modes_seen(mode), 0U) << core::name(mode);
  // The stream is far faster than real time: of several models that are ready the newest counts.
  EXPECT_GT(service.epochs_seen(), 20U) << "models handed over";
  std::printf("%lu samples, %lu locks taken by the data path (%zu different), %lu by the learner\n",
              service.audit->samples.load(), service.audit->of_data_path.taken.load(),
              Audit::locks(service.audit->of_data_path).size(),
              service.audit->of_learner.taken.load());
  service.stop();
  std::filesystem::remove_all(checkpoints);
  std::filesystem::remove(config);
}

// Rule: with a learner that stands still, each sample is answered; its queue fills, and what finds
// no room is skipped and counted; when it goes on, it learns what waited.
TEST(DataPath, AnswersEverySampleWhileTheLearnerStandsStill) {
  if (kIsSanitized) GTEST_SKIP() << "a sanitizer replaces the same functions";
  constexpr double kQueue = 64.0;  // labels
  const auto config = config_in("zerodrift-data-path-still.yaml");
  Audited service(Domain::kDataPathOverload, "compensation", {"--config", config},
                  /*learner_stands_still=*/true);
  service.connect();
  const std::uint64_t unheard = service.sent() - service.answered();
  service.arm();
  service.ramp(900, 0.02);  // up to 180 labels
  service.disarm();
  EXPECT_EQ(service.answered() + unheard, service.sent());
  EXPECT_EQ(service.audit->taken, 0U) << service.audit->first_finding.data();
  EXPECT_EQ(service.audit->waits, 0U);
  EXPECT_EQ(service.modes_seen(core::Mode::kLearning), 0U);
  EXPECT_TRUE(eventually([&] { return service.figure("labels_skipped") > 0.0; }))
      << service.figure("labels") << " labels";
  // What came before the queue was full is in it; the confirmed label at the end may be neither.
  EXPECT_NEAR(service.figure("labels") - service.figure("labels_skipped"), kQueue, 1.0);
  EXPECT_TRUE(eventually([&] { return told(service.events, "skipped_label"); }));
  EXPECT_TRUE(eventually([&] { return told(service.events, "late_model"); }));

  service.audit->hold_learner = 0;
  service.ramp(60, 0.02);
  EXPECT_TRUE(eventually([&] {
    service.ramp(1, 0.02);
    return service.modes_seen(core::Mode::kLearning) > 0;
  }));
  service.stop();
  std::filesystem::remove(config);
}

// Rule: the audit finds what it looks for.
TEST(DataPath, AnAuditOfAServiceThatBreaksEveryRuleFindsIt) {
  if (kIsSanitized) GTEST_SKIP() << "a sanitizer replaces the same functions";
  Audited service(Domain::kDataPathFixture, "data_path_fixture");
  service.connect();
  service.arm();
  for (int k = 0; k < 200; ++k) service.send(service.next_sample());
  service.disarm();
  EXPECT_GE(service.audit->taken, 200U);
  EXPECT_GT(service.audit->waits, 0U);
  EXPECT_EQ(service.audit.shared_locks(), 1U);
  EXPECT_NE(std::string(service.audit->first_finding.data()).find("data_path_fixture"),
            std::string::npos)
      << service.audit->first_finding.data();
  service.stop();
}

}  // namespace
}  // namespace zerodrift::system_test
