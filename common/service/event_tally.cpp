// SPDX-License-Identifier: Apache-2.0
#include "common/service/event_tally.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace zerodrift::service {
namespace {

std::string without_numbers(std::string_view text) {
  std::string words;
  std::copy_if(text.begin(), text.end(), std::back_inserter(words),
               [](char c) { return (c < '0' || c > '9') && c != '.' && c != '-' && c != '+'; });
  return words;
}

}  // namespace

void EventTally::raised(std::uint64_t times, std::int64_t now_ns) {
  if (count_ == published_) raised_at_ns_ = now_ns;
  count_ += times;
}

bool EventTally::is_due(std::int64_t now_ns) const {
  return count_ != published_ && (published_ == 0 || now_ns - published_at_ns_ >= kPeriodNs);
}

EventTally::Publication EventTally::publish(std::string_view text, std::int64_t now_ns) {
  std::string words = without_numbers(text);
  const bool is_news =
      published_ == 0 || raised_at_ns_ - published_at_ns_ >= kPeriodNs || words != logged_words_;
  if (is_news) logged_words_ = std::move(words);
  published_ = count_;
  published_at_ns_ = now_ns;
  return {count_, is_news};
}

}  // namespace zerodrift::service
