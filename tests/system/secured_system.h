// SPDX-License-Identifier: Apache-2.0
// A compensation service, with or without security, and a gyro and a listener that are the test's
// own. Keys and certificates are made anew for each test.
#pragma once

#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <set>
#include <string>

#include "common/core/units.h"
#include "common/dds/conversions.h"
#include "tests/system/system_under_test.h"

namespace zerodrift::system_test {

// Runs deploy/security/make_certificates.sh.
inline Finished make_certificates(SystemUnderTest& system, const Arguments& arguments) {
  ChildProcess process(
      {std::filesystem::path(ZERODRIFT_SOURCE_DIR) / "deploy/security/make_certificates.sh",
       arguments,
       {},
       system.path("make_certificates")});
  const auto code = process.wait(std::chrono::seconds(60));
  return {code.value_or(-1), process.out(), process.err()};
}

inline dds::NetworkOptions with_security(const SystemUnderTest& system,
                                         const std::filesystem::path& folder) {
  dds::NetworkOptions network = system.network();
  network.security_dir = folder;
  return network;
}

class SecuredSystem {
 public:
  static constexpr std::uint32_t kGyroId = 1;

  // An empty folder: without security.
  SecuredSystem(SystemUnderTest& system, const std::filesystem::path& folder)
      : newcomers_network_(with_security(system, folder)),
        listening_("console", with_security(system, folder)),
        measuring_("gyro_publisher", with_security(system, folder)),
        answers(listening_),
        events(listening_),
        replies(listening_),
        statuses(listening_),
        gyro_(measuring_) {
    Arguments arguments;
    if (!folder.empty()) arguments = {"--security", folder};
    service_ = &system.start("compensation", arguments);
  }

  // Until an answer comes back: from then on nothing can be missed on either side.
  void connect() {
    ASSERT_TRUE(eventually([&] {
      if (answers.size() > 0) return true;
      if (gyro_.matched() > 0) send();
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
      return false;
    }));
    await(sequence_);
    counted_from_ = sequence_ + 1;
  }

  // The next sample of a gyro with a hardware clock, 10 ms after the one before.
  void send() {
    core::AngularRateSample sample;
    sample.sequence = ++sequence_;
    sample.time = core::from_seconds(0.01 * static_cast<double>(sequence_));
    sample.interval_s = 0.01;
    sample.rate_radps = {1e-6, 2e-6, 3e-6};
    sample.valid = {true, true, true};
    sample.clock = core::ClockSource::kHardware;
    auto message = dds::to_message(sample, kGyroId, 0);
    ASSERT_TRUE(gyro_.write(message));
  }

  // Each sample sent since connect() was answered exactly once, and nothing else was.
  void expect_one_answer_each() {
    send();
    await(sequence_);
    std::multiset<std::uint64_t> answered;
    for (const auto& answer : answers.all()) answered.insert(answer.sequence_number());
    for (std::uint64_t k = counted_from_; k <= sequence_; ++k) {
      EXPECT_EQ(answered.count(k), 1U) << "sequence " << k;
    }
    EXPECT_LE(*answered.rbegin(), sequence_) << "an answer to what the gyro never sent";
    EXPECT_EQ(std::set<std::uint64_t>(answered.begin(), answered.end()).size(), answered.size());
  }

  void expect_event(const std::string& code, const std::string& text = "") {
    EXPECT_TRUE(eventually([&] { return told(events, code, text); })) << code << ' ' << text;
  }

  // How often the service told of it, as last published.
  [[nodiscard]] std::uint64_t count_of(const std::string& code) const {
    std::uint64_t count = 0;
    for (const auto& event : events.all()) {
      if (code == event.code().c_str()) count = std::max<std::uint64_t>(count, event.count());
    }
    return count;
  }

  // One that starts only now hears it.
  void expect_newcomer_meets_the_service() const {
    dds::Participant newcomer("console", newcomers_network_);
    const Collector<msg::ServiceStatus> heard(newcomer);
    EXPECT_TRUE(eventually([&] { return heard.size() > 0; }));
  }

  void expect_alive_then_stop() {
    EXPECT_TRUE(service_->running());
    service_->send(SIGTERM);
    EXPECT_EQ(service_->wait(std::chrono::seconds(2)), 0);
  }

 private:
  void await(std::uint64_t sequence) {
    ASSERT_TRUE(eventually([&] {
      return answers.any([&](const auto& answer) { return answer.sequence_number() == sequence; });
    })) << "no answer to sequence "
        << sequence;
  }

  dds::NetworkOptions newcomers_network_;
  dds::Participant listening_;
  dds::Participant measuring_;

 public:
  Collector<msg::CompensatedRate> answers;
  Collector<msg::Event> events;
  Collector<msg::CommandReply> replies;
  Collector<msg::ServiceStatus> statuses;

 private:
  dds::Writer<msg::AngularRate> gyro_;
  ChildProcess* service_ = nullptr;
  std::uint64_t sequence_ = 0;
  std::uint64_t counted_from_ = 1;
};

}  // namespace zerodrift::system_test
