// SPDX-License-Identifier: Apache-2.0
// What a gyro did in the last hours: one row a second of sensor time, bounded. Sensor time alone
// drives it.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "common/dds/topics.h"
#include "idl/proto/telemetry.pb.h"
#include "services/console/rate_comparison.h"

namespace zerodrift::services {

struct HistoryOptions {
  std::int64_t kept_s = 12 * 3600;
  std::size_t most_probes = 8;  // others are left out
};

// What is kept of a probe's reading.
struct ProbeReading {
  std::int64_t sensor_time_ns = 0;
  double temperature_degc = 0.0;
  double rate_degc_per_min = 0.0;
};

class GyroHistory {
 public:
  explicit GyroHistory(std::uint32_t gyro_id, const HistoryOptions& options = {})
      : gyro_id_(gyro_id), options_(options) {}

  // A row is complete with the first sample of a later second. A sample of an earlier one is left
  // out; once three in a row are earlier than the row before, the source has begun anew, and so
  // does the history.
  void add(const msg::CompensatedRate& sample);
  // For the second it is of, when that is complete: may come before its samples, by up to 64 s.
  // True rates alone: a filter's residual is none.
  void add(const msg::RateReference& reference);
  // A row has each probe's newest reading by its end, if not older than a minute.
  void add(const std::string& probe, const ProbeReading& reading);

  // Rows that were completed since the last call; none: nothing. After a new begin all of them, as
  // a backlog.
  std::optional<telemetry::History> take_new();
  // The same, without a look at them.
  void forget_new() {
    taken_ = rows_.size();
    began_anew_ = false;
  }
  // All that is kept.
  [[nodiscard]] telemetry::History backlog() const;

  // Of all that is kept, and whether the axis moves now.
  [[nodiscard]] telemetry::RateComparison comparison(std::size_t axis, bool moves) const {
    return comparisons_[axis].result(moves);
  }

  [[nodiscard]] std::size_t rows() const { return rows_.size(); }
  [[nodiscard]] std::uint64_t left_out() const { return left_out_; }

 private:
  // Single precision: relative 6e-8, for pictures; half the memory.
  struct AxisRow {
    float raw_min, raw_mean, raw_max;
    float compensated_min, compensated_mean, compensated_max;
    float drift_mean, drift_sigma, reference_mean;
    std::uint8_t mode;
  };
  struct ProbeCell {
    float temperature_degc, rate_degc_per_min;
  };
  struct Row {
    std::int64_t second = 0;
    std::array<AxisRow, 3> axes{};
    std::vector<ProbeCell> probes{};
  };
  struct Spread {
    double min = 0.0, max = 0.0, sum = 0.0;
    std::uint64_t count = 0;
    void add(double value);
    [[nodiscard]] double mean() const;
  };
  struct OpenAxis {
    Spread raw, compensated, drift;
    double sigma = 0.0;
    std::uint8_t mode = 0;
    bool moves = false;
    bool rests = false;
  };
  struct OpenReference {
    std::int64_t second = -1;
    std::array<Spread, 3> axes{};
  };
  struct Probe {
    std::string name;
    std::deque<ProbeReading> readings{};  // from the open second on, and the one before
  };
  static void forget_readings(Probe& probe, std::int64_t second);
  void close_row();
  [[nodiscard]] const ProbeReading* reading_of(const Probe& probe, std::int64_t second) const;
  void append_row(const Row& row, telemetry::History& out) const;
  [[nodiscard]] telemetry::History table(std::size_t from) const;

  static constexpr std::size_t kReferenceSeconds = 64;

  std::uint32_t gyro_id_;
  HistoryOptions options_;
  std::deque<Row> rows_;
  std::size_t taken_ = 0;  // of rows_, by take_new()
  bool began_anew_ = false;
  std::optional<std::int64_t> open_second_;
  std::array<OpenAxis, 3> open_{};
  std::array<RateComparison, 3> comparisons_{};
  std::array<OpenReference, kReferenceSeconds> references_{};
  std::vector<Probe> probes_;
  int earlier_in_a_row_ = 0;
  std::uint64_t left_out_ = 0;
};

}  // namespace zerodrift::services
