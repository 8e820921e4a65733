// SPDX-License-Identifier: Apache-2.0
// What every system test has: a DDS domain and a folder of its own, the processes it started, and
// the certainty that nothing is left of them.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/dds/participant.h"
#include "tests/system/child_process.h"
#include "tests/system/domains.h"
#include "tests/unit/dds/test_domain.h"

namespace zerodrift::system_test {

using dds::eventually;

struct Finished {
  int exit_code = -1;
  std::string out;
  std::string err;
};

class SystemUnderTest {
 public:
  explicit SystemUnderTest(Domain domain);
  // Stops what still runs; fails the test where a shared-memory segment is left, and shows what the
  // processes wrote where the test failed.
  ~SystemUnderTest();
  SystemUnderTest(const SystemUnderTest&) = delete;
  SystemUnderTest& operator=(const SystemUnderTest&) = delete;

  [[nodiscard]] std::filesystem::path path(const std::string& name) const { return folder_ / name; }
  [[nodiscard]] const dds::NetworkOptions& network() const { return domain_.network(); }

  // Starts a program of the build's bin/ in this test's domain: `--domain` is added. The object
  // lives as long as this one.
  ChildProcess& start(const std::string& program, const Arguments& arguments);
  // A program that knows no --domain.
  ChildProcess& start_foreign(const std::string& program, const Arguments& arguments,
                              const Environment& environment = {});
  // Runs one to its end, as it is: no argument is added. Exit code -1: it took longer than
  // `at_most` and was stopped.
  Finished run(const std::string& program, const Arguments& arguments,
               std::chrono::milliseconds at_most = std::chrono::seconds(60));
  // `zerodrift ctl ...` in this test's domain.
  Finished control(const Arguments& arguments);

 private:
  dds::TestDomain domain_;
  std::set<std::string> segments_before_;
  std::filesystem::path folder_;
  std::vector<std::unique_ptr<ChildProcess>> processes_;
};

// Everything that is published on a topic, in order of arrival. Any thread.
template <typename Message>
class Collector {
 public:
  explicit Collector(dds::Participant& participant)
      : reader_(participant, [this](const Message& message, const dds::SampleOrigin&) {
          const std::lock_guard lock(mutex_);
          messages_.push_back(message);
        }) {}

  [[nodiscard]] std::size_t size() const {
    const std::lock_guard lock(mutex_);
    return messages_.size();
  }
  [[nodiscard]] std::vector<Message> all() const {
    const std::lock_guard lock(mutex_);
    return messages_;
  }
  // There is one.
  [[nodiscard]] Message newest() const {
    const std::lock_guard lock(mutex_);
    return messages_.back();
  }
  // Index of the first from the `from`-th on that is so. Nothing is copied: a test that waits looks
  // often, and messages are not taken meanwhile.
  [[nodiscard]] std::optional<std::size_t> first(const std::function<bool(const Message&)>& is_so,
                                                 std::size_t from = 0) const {
    const std::lock_guard lock(mutex_);
    for (std::size_t i = from; i < messages_.size(); ++i) {
      if (is_so(messages_[i])) return i;
    }
    return std::nullopt;
  }
  [[nodiscard]] bool any(const std::function<bool(const Message&)>& is_so,
                         std::size_t from = 0) const {
    return first(is_so, from).has_value();
  }
  void for_each(const std::function<void(const Message&)>& look) const {
    const std::lock_guard lock(mutex_);
    for (const auto& message : messages_) look(message);
  }
  [[nodiscard]] int matched() const { return reader_.matched(); }

 private:
  mutable std::mutex mutex_;
  std::vector<Message> messages_;
  dds::Reader<Message> reader_;
};

// True if an event of this code was published; `text` is part of its line.
[[nodiscard]] bool told(const Collector<msg::Event>& events, const std::string& code,
                        const std::string& text = "");

// What a service last said of itself; NaN where it has not said it.
[[nodiscard]] double metric(const Collector<msg::ServiceStatus>& statuses,
                            const std::string& service, const std::string& name);

// What each service last said of itself, a line each: for a test that fails.
[[nodiscard]] std::string newest_of_each(const Collector<msg::ServiceStatus>& statuses);

}  // namespace zerodrift::system_test
