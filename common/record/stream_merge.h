// SPDX-License-Identifier: Apache-2.0
// In which order the samples of a recording's streams come: by their stamps, as far as these can be
// compared. Where a clock was set back, the order in the file tells what was measured before it and
// what behind.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "common/core/samples.h"
#include "common/record/message_stream.h"
#include "common/record/record_reader.h"

namespace zerodrift::record {

// A stream beside the rates. Its clock may be set back before the one of the rates is, behind it,
// or alone.
template <typename Sample>
class StreamBeside {
 public:
  explicit StreamBeside(MessageStream<Sample>&& stream) : stream_(std::move(stream)) {}

  [[nodiscard]] const std::optional<Sample>& head() const { return stream_.head(); }
  [[nodiscard]] Place place() const { return stream_.place(); }
  [[nodiscard]] bool is_head_ahead() { return stream_.is_head_ahead(); }
  // Whether the head's stamp can be compared with those of the rates.
  [[nodiscard]] bool is_level() const { return !rates_were_set_back_ && !is_set_back(); }

  std::optional<Sample> take() {
    if (head()) newest_ = std::max(newest_.value_or(head()->time), head()->time);
    return drop();
  }
  // As take(), of a sample whose stamp is not believed.
  std::optional<Sample> drop() {
    std::optional<Sample> dropped = stream_.take();
    if (rates_were_set_back_ && is_set_back()) begin_anew();
    return dropped;
  }

  void note_rates_set_back() {
    if (is_set_back()) return begin_anew();
    rates_were_set_back_ = true;
  }
  void note_rates_caught_up() { rates_were_set_back_ = false; }

 private:
  [[nodiscard]] bool is_set_back() const { return newest_ && head() && head()->time < *newest_; }
  void begin_anew() {
    newest_.reset();
    rates_were_set_back_ = false;
  }

  MessageStream<Sample> stream_;
  std::optional<core::SensorTime> newest_;  // taken since both were set back
  bool rates_were_set_back_ = false;        // and this stream was not yet
};

class StreamMerge {
 public:
  // Strictly increasing times: always by the stamps.
  StreamMerge(MessageStreams streams, TimeOrder order);

  // There is something to take: there are rates.
  [[nodiscard]] bool has_next() const { return rates_.head().has_value(); }
  // The stamp of what comes next. What is not a rate and is stamped far ahead of what comes behind
  // it would hold up all of its stream: it is dropped. A rate of that kind comes in its turn, as it
  // was live, and draws nothing along.
  [[nodiscard]] core::SensorTime next_time();
  // Those that come at next_time(), which was called since the last of them was taken.
  [[nodiscard]] std::optional<core::AngularRateSample> take_rate(core::SensorTime time);
  [[nodiscard]] std::optional<core::RateReferenceSample> take_reference(core::SensorTime time) {
    return take(references_, time);
  }
  [[nodiscard]] std::optional<core::EnvironmentSample> take_environment(core::SensorTime time) {
    return take(environment_, time);
  }
  [[nodiscard]] std::optional<core::TemperatureSample> take_temperature(std::size_t probe,
                                                                        core::SensorTime time) {
    return take(probes_[probe], time);
  }
  // The clock of the rates was set back before the next one.
  [[nodiscard]] bool begins_anew() const { return begins_anew_; }
  // How many with a value were dropped.
  [[nodiscard]] std::uint64_t dropped() const { return dropped_; }

  // Each stream but the rates.
  template <typename Visit>
  void visit_others(const Visit& visit) {
    visit(references_);
    visit(environment_);
    for (auto& probe : probes_) visit(probe);
  }

 private:
  // Recorded before the next rate, which its stamp can't be compared with.
  template <typename Sample>
  [[nodiscard]] bool is_overdue(const StreamBeside<Sample>& stream) const {
    return stream.head() && stream.place() < rates_.place() &&
           (rates_are_set_back_ || !stream.is_level());
  }
  template <typename Sample>
  [[nodiscard]] bool is_due(const StreamBeside<Sample>& stream) const {
    if (!stream.head()) return false;
    if (order_ == TimeOrder::kStrictlyIncreasing) return true;
    return any_overdue_ ? is_overdue(stream) : stream.is_level();
  }
  template <typename Sample>
  [[nodiscard]] std::optional<Sample> take(StreamBeside<Sample>& stream, core::SensorTime time) {
    if (!is_due(stream) || stream.head()->time != time) return std::nullopt;
    return stream.take();
  }

  void look_for_clocks_set_back();
  void follow_rates_back();
  [[nodiscard]] core::SensorTime earliest();

  TimeOrder order_;
  MessageStream<core::AngularRateSample> rates_;
  StreamBeside<core::RateReferenceSample> references_;
  StreamBeside<core::EnvironmentSample> environment_;
  std::vector<StreamBeside<core::TemperatureSample>> probes_;
  std::optional<core::SensorTime> newest_rate_;    // since the clock of the rates was set back
  std::optional<core::SensorTime> set_back_from_;  // until they are there again
  bool rates_are_set_back_ = false;                // with the next one
  bool begins_anew_ = false;
  bool any_overdue_ = false;
  bool is_rate_wild_ = false;  // the next one's stamp is not believed
  std::uint64_t dropped_ = 0;
};

// Whether anything was measured. Blank ones say that time went on, or that nothing more comes.
[[nodiscard]] inline bool has_value(const core::TemperatureSample& sample) {
  return sample.measured;
}
[[nodiscard]] inline bool has_value(const core::EnvironmentSample& sample) {
  return core::is_any_measured(sample.values);
}
[[nodiscard]] inline bool has_value(const core::RateReferenceSample& sample) {
  return sample.valid != core::PerAxis<bool>{};
}

}  // namespace zerodrift::record
