// SPDX-License-Identifier: Apache-2.0
#include "common/record/stream_merge.h"

#include "common/core/integer_time.h"

namespace zerodrift::record {

StreamMerge::StreamMerge(MessageStreams streams, TimeOrder order)
    : order_(order),
      rates_(std::move(streams.rates)),
      references_(std::move(streams.references)),
      environment_(std::move(streams.environment)) {
  for (auto& probe : streams.probes) probes_.emplace_back(std::move(probe));
}

core::SensorTime StreamMerge::next_time() {
  if (order_ == TimeOrder::kAsFound) look_for_clocks_set_back();
  const core::SensorTime before = earliest();
  const auto is_wild = [before](auto& stream) {
    return core::is_far_ahead(stream.head()->time, before) && stream.is_head_ahead();
  };
  is_rate_wild_ = false;
  if (any_overdue_) return before;
  visit_others([&](auto& stream) {
    while (is_due(stream) && is_wild(stream)) {
      if (has_value(*stream.drop())) ++dropped_;
    }
  });
  is_rate_wild_ = is_wild(rates_);
  return is_rate_wild_ ? rates_.head()->time : earliest();
}

// A single rate with an earlier stamp is a wrong stamp; a second one, a clock that was set back.
void StreamMerge::look_for_clocks_set_back() {
  const auto is_back = [this](core::SensorTime time) {
    return newest_rate_ &&
           core::saturating_difference(*newest_rate_, time) > core::kLargestStepBack;
  };
  rates_are_set_back_ = false;
  if (is_back(rates_.head()->time)) {
    const core::AngularRateSample* second = rates_.second();
    rates_are_set_back_ = second != nullptr && is_back(second->time);
  }
  any_overdue_ = false;
  visit_others([this](auto& stream) { any_overdue_ = any_overdue_ || is_overdue(stream); });
  if (rates_are_set_back_ && !any_overdue_) follow_rates_back();
}

void StreamMerge::follow_rates_back() {
  rates_are_set_back_ = false;
  set_back_from_ = newest_rate_;
  newest_rate_.reset();
  begins_anew_ = true;
  visit_others([](auto& stream) { stream.note_rates_set_back(); });
}

// Of what is due.
core::SensorTime StreamMerge::earliest() {
  std::optional<core::SensorTime> time;
  if (!any_overdue_) time = rates_.head()->time;
  visit_others([&](auto& stream) {
    if (is_due(stream)) time = std::min(time.value_or(stream.head()->time), stream.head()->time);
  });
  return time.value_or(rates_.head()->time);
}

std::optional<core::AngularRateSample> StreamMerge::take_rate(core::SensorTime time) {
  if (any_overdue_ || rates_.head()->time != time) return std::nullopt;
  if (!is_rate_wild_) newest_rate_ = std::max(newest_rate_.value_or(time), time);
  if (set_back_from_ && time >= *set_back_from_) {
    set_back_from_.reset();
    visit_others([](auto& stream) { stream.note_rates_caught_up(); });
  }
  begins_anew_ = false;
  return rates_.take();
}

}  // namespace zerodrift::record
