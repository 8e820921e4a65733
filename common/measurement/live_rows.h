// SPDX-License-Identifier: Apache-2.0
// What a running system publishes, as the rows of a record: one a rate sample, with the true rate
// known at that time, the temperatures and the environment measured since the row before. Rows come
// in sensor time and are the same in whatever order the streams arrived; a replayed record gives
// back its own rows.
#pragma once

#include <array>
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
  // Rates that wait at most; then nobody is waited for.
  std::size_t most_waiting = 16'384;
  // Readings of one probe or channel: 10 s ahead of the rates at 3 kHz.
  std::size_t most_readings = 32'768;
  // Thermometers used at most: those that are received first.
  std::size_t most_probes = 64;
};

struct LiveCounts {
  std::uint64_t rates_refused = 0;     // a time stamp not after the one before, or wild
  std::uint64_t readings_refused = 0;  // likewise, or of one probe too many
  std::uint64_t late_probes = 0;       // readings of probes first received after the start
  std::uint64_t late_channels = 0;     // likewise of channels of the environment
  std::uint64_t readings_lost = 0;     // came after the row of their time, or more than can wait
  std::uint64_t late_references = 0;   // true rates first received after the start
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
  void push(const core::EnvironmentSample& sample);
  // Whoever is behind is not waited for until it speaks again.
  void stop_waiting();
  // Nothing more comes: nobody is waited for from now on.
  void finish();

  // The next row, valid until the next call; nullptr: not complete yet, or none.
  [[nodiscard]] const record::RecordRow* next();

  [[nodiscard]] std::size_t waiting() const noexcept { return rates_.size(); }
  [[nodiscard]] const LiveCounts& counts() const noexcept { return counts_; }
  // Known from the first row on. Probes in the twin's order of places, others by name.
  [[nodiscard]] const std::vector<std::string>& probes() const noexcept { return probe_names_; }
  [[nodiscard]] bool has_reference() const noexcept { return has_reference_; }
  [[nodiscard]] core::EnvironmentChannels environment() const noexcept { return environment_; }
  // Median of the first hundred steps, as of a record; 0 of a single sample.
  [[nodiscard]] double sample_period_s() const noexcept { return sample_period_s_; }

 private:
  struct Reading {
    core::SensorTime time{0};
    double value = 0.0;
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
  struct Sensor : Stream {
    std::deque<Reading> readings{};

    // The mean of the readings up to `time`, which are taken; NaN of none.
    [[nodiscard]] double take_mean(core::SensorTime time);
  };

  void start();
  [[nodiscard]] bool is_complete(core::SensorTime time) const;
  void stop_waiting(core::SensorTime time);
  void take(Sensor& sensor, core::SensorTime time, double value);
  void take_readings(core::SensorTime time);
  void take_reference(core::SensorTime time);

  LiveRowsOptions options_;
  bool started_ = false;
  bool finished_ = false;
  TimeGate gate_;
  std::deque<core::AngularRateSample> rates_;
  core::BoundedTable<std::string, Sensor> probes_;
  std::array<Sensor, core::kEnvironmentChannels> channels_;
  core::EnvironmentChannels environment_ = 0;  // those that had spoken at the start
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
