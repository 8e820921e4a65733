// SPDX-License-Identifier: Apache-2.0
// What a running system publishes, as the rows of a record: one a rate sample, with the true rate
// known at that time and the temperatures read since the row before. Rows come in sensor time and
// are the same in whatever order the streams arrived; a replayed record gives back its own rows.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "common/core/bounded_table.h"
#include "common/core/samples.h"
#include "common/record/record_reader.h"

namespace zerodrift::measurement {

// Time stamps of a stream in order. One that is far ahead is believed when the next one confirms
// it, so that a wild stamp costs one sample and not the stream.
class TimeGate {
 public:
  [[nodiscard]] bool admits(core::SensorTime time) noexcept;

 private:
  static constexpr core::SensorTime kLargestStep = std::chrono::hours(1);
  std::optional<core::SensorTime> newest_;
  std::optional<core::SensorTime> doubted_;
};

struct LiveRowsOptions {
  // Rates gathered before the first row: whoever has spoken by then is waited for.
  std::size_t rates_before_start = 512;
  // Rates and readings of one probe that wait at most; then nobody is waited for.
  std::size_t most_waiting = 16'384;
  // Thermometers used at most: those that are heard first.
  std::size_t most_probes = 64;
};

struct LiveCounts {
  std::uint64_t rates_refused = 0;     // a time stamp not after the one before, or wild
  std::uint64_t readings_refused = 0;  // likewise, or of one probe too many
  std::uint64_t late_probes = 0;       // readings of probes first heard after the start
  std::uint64_t late_references = 0;   // true rates first heard after the start
  std::uint64_t without_reference =
      0;  // rows whose true rate nobody said; their rates are left out
};

// Memory: what waits, O(most_waiting) a stream. One thread at a time.
class LiveRows {
 public:
  explicit LiveRows(const LiveRowsOptions& options = {})
      : options_(options), probes_(options.most_probes) {}

  void push(const core::AngularRateSample& sample);
  // What a navigation filter gives back rests on the compensation and is passed over.
  void push(const core::RateReferenceSample& reference);
  void push(const core::TemperatureSample& reading);
  // Nothing more comes: nobody is waited for from now on.
  void finish();

  // The next row, valid until the next call; nullptr: not complete yet, or none.
  [[nodiscard]] const record::RecordRow* next();

  [[nodiscard]] std::size_t waiting() const noexcept { return rates_.size(); }
  [[nodiscard]] const LiveCounts& counts() const noexcept { return counts_; }
  // Known from the first row on. Probes in the twin's order of places, others by name.
  [[nodiscard]] const std::vector<std::string>& probes() const noexcept { return probe_names_; }
  [[nodiscard]] bool has_reference() const noexcept { return has_reference_; }
  // Median of the first hundred steps, as of a record; 0 of a single sample.
  [[nodiscard]] double sample_period_s() const noexcept { return sample_period_s_; }

 private:
  struct Reading {
    core::SensorTime time{0};
    double temperature_degc = 0.0;
  };
  struct Stream {
    TimeGate gate;
    core::SensorTime spoken_to{core::kNever};
    bool waited_for = true;

    void advance(core::SensorTime time) noexcept;
    [[nodiscard]] bool holds_up(core::SensorTime time) const noexcept {
      return waited_for && spoken_to < time;
    }
  };
  struct Probe : Stream {
    std::deque<Reading> readings{};
  };

  void start();
  [[nodiscard]] bool is_complete(core::SensorTime time) const;
  void stop_waiting(core::SensorTime time);
  void take_temperatures(core::SensorTime time);
  void take_reference(core::SensorTime time);

  LiveRowsOptions options_;
  bool started_ = false;
  bool finished_ = false;
  TimeGate gate_;
  std::deque<core::AngularRateSample> rates_;
  core::BoundedTable<std::string, Probe> probes_;
  std::vector<std::string> probe_names_;
  Stream reference_;
  std::deque<core::RateReferenceSample> references_;
  std::optional<core::RateReferenceSample> newest_reference_;
  bool has_reference_ = false;
  double sample_period_s_ = 0.0;
  std::optional<core::SensorTime> previous_;
  record::RecordRow row_;
  LiveCounts counts_;
};

}  // namespace zerodrift::measurement
