// SPDX-License-Identifier: Apache-2.0
// How often one event was raised, when it is to be published anew, and whether that is news for the
// log. Time is an argument, ns of any clock that only grows.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace zerodrift::service {

class EventTally {
 public:
  static constexpr std::int64_t kPeriodNs = 1000000000;  // between two publications of one event

  struct Publication {
    std::uint64_t count = 0;  // since the start
    bool is_news = false;     // to be logged
  };

  void raised(std::uint64_t times, std::int64_t now_ns);
  // Counts one that is published and logged by itself; gives its number.
  std::uint64_t published_by_itself() { return published_ = ++count_; }

  // Something was raised that isn't published, and the last publication is a period ago.
  [[nodiscard]] bool is_due(std::int64_t now_ns) const;
  // An event is news the first time, where none was raised for a whole period after it was
  // published, and where its text differs from the one logged last by more than its numbers: what
  // goes on is one line, however long it lasts and whatever it counts.
  Publication publish(std::string_view text, std::int64_t now_ns);

 private:
  std::uint64_t count_ = 0;
  std::uint64_t published_ = 0;
  std::int64_t raised_at_ns_ = 0;  // the first of what isn't published
  std::int64_t published_at_ns_ = 0;
  std::string logged_words_;
};

}  // namespace zerodrift::service
