// SPDX-License-Identifier: Apache-2.0
// Statistics, raw and compensated, for each axis of each gyro that is received. Both streams are
// read from compensated_rate (raw = compensated + applied drift), so that they hold exactly the
// same samples.
//
// Two threads: samples are counted on the middleware's receiving thread; reports and the watches
// run on the host's. Between them only a copy of the sums is made under the lock, see
// StreamStatistics.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "common/allan/noise_watch.h"
#include "common/allan/stream_statistics.h"
#include "common/allan/stream_timing.h"
#include "common/core/axis.h"
#include "common/core/bounded_table.h"
#include "common/core/compensated_sample.h"
#include "common/core/time.h"
#include "common/dds/participant.h"
#include "common/service/consumer_pace.h"
#include "common/service/hop_latency.h"
#include "common/service/host.h"
#include "common/service/replay_pacer.h"
#include "services/allan_monitor/event_text.h"

namespace zerodrift::services {

struct AllanMonitorOptions {
  dds::NetworkOptions network;
  service::Supervision supervision{};
  double window_s = 3600.0;
  double longest_tau_s = 1e4;
  double period_s = 1.0;
  std::size_t max_gyros = 64;  // 0.4 MB each with the defaults at 200 Hz
};

class AllanMonitorNode {
 public:
  // Throws std::invalid_argument where the options cannot work.
  explicit AllanMonitorNode(const AllanMonitorOptions& options);
  int run();  // exit code

 private:
  struct Axis {
    std::optional<allan::StreamStatistics> raw;
    std::optional<allan::StreamStatistics> compensated;
    std::uint64_t invalid = 0;  // since the axis was first measured
    bool compensating = false;
  };
  struct Counts {
    std::uint64_t samples = 0;
    std::uint64_t gaps = 0;
    double missing_s = 0.0;  // by the interval that the stream had then
    double longest_gap_s = 0.0;
    std::uint64_t duplicates = 0;
    std::uint64_t out_of_order = 0;
    std::uint64_t refused = 0;  // for their interval
    std::uint64_t time_restarts = 0;
    std::uint64_t starts = 0;  // 1, and one more for each new sample interval
  };
  // What a report needs, in one piece.
  struct Statistics {
    core::SensorTime newest{0};
    double interval_s = 0.0;
    Counts counts;
    core::PerAxis<Axis> axes;
  };
  struct Gyro {
    explicit Gyro(std::uint32_t gyro_id) : id(gyro_id) {}
    const std::uint32_t id;
    service::ConsumerPace pace{};
    allan::StreamTiming timing;
    Statistics statistics;
  };
  // Of one code of one gyro: how much of a count was reported, and when.
  struct Reported {
    std::uint64_t count = 0;
    std::int64_t at_ns = 0;
  };
  struct AxisWatch {
    std::array<allan::GrowthWatch, 2> growth;  // by stream
    allan::ExcessWatch worse;
    allan::StuckDetector::Output output = allan::StuckDetector::Output::kAlive;
    bool compensating = false;  // as the statistics that were looked at last
    Reported invalid;
  };
  // What the reporting thread keeps of a gyro; no lock.
  struct Watch {
    Gyro* gyro = nullptr;
    Statistics statistics;  // the copy
    core::PerAxis<AxisWatch> axes;
    double reported_interval_s = 0.0;
    Reported gaps, out_of_order, duplicates, refused, time_restarts, starts;
  };

  // Receiving thread, under the lock.
  void on_sample(const msg::CompensatedRate& message);
  void place(Gyro& gyro, const core::CompensatedSample& sample);
  void start(Gyro& gyro);
  void begin_compensated(Axis& axis, double interval_s);
  void feed(Gyro& gyro, const core::CompensatedSample& sample, std::uint64_t missing);
  void leave_out(const core::CompensatedSample& sample, std::uint32_t gyro_id);
  void keep_pace(std::uint32_t gyro_id, service::ConsumerPace& pace,
                 const core::CompensatedSample& sample);

  // Either, under the lock.
  void report_progress(std::uint32_t gyro_id, service::ConsumerPace& pace);

  // Reporting thread.
  void tick();
  void report_all_progress();
  std::vector<Watch*> copy_statistics(bool due);
  void report(Watch& watch);
  void report(Watch& watch, core::Axis axis);
  void publish(const Watch& watch, core::Axis axis, Stream stream,
               const allan::StreamReport& report);
  void report_noise(Watch& watch, core::Axis axis, const allan::StreamReport& raw,
                    const allan::StreamReport& compensated);
  void report_output(Watch& watch, core::Axis axis, const allan::StreamReport& raw);
  void report_stream(Watch& watch);
  void raise(const Watch& watch, std::string code, service::Severity severity, std::string text,
             std::uint64_t times = 1);
  void report_counted(const Watch& watch, std::string code, const std::string& text,
                      std::uint64_t count, Reported& reported);
  service::Status status();

  AllanMonitorOptions options_;
  service::Host host_;
  std::mutex mutex_;                               // between the receiving thread and the reports
  core::BoundedTable<std::uint32_t, Gyro> gyros_;  // what it refuses are samples of others
  std::uint32_t newest_stranger_ = 0;
  core::BoundedTable<std::uint32_t, service::ConsumerPace> stranger_paces_;
  service::HopLatency delivery_latency_{"delivery"};
  service::HopLatency chain_latency_{"chain"};
  std::map<std::uint32_t, Watch> watches_;  // by gyro
  Reported reported_strangers_;
  std::optional<std::int64_t> reported_ns_;
  std::int64_t report_cost_ns_ = 0;  // of all gyros, the last time
  std::int64_t copy_cost_ns_ = 0;    // longest time the lock was held for a copy
  dds::Writer<msg::AllanReport> writer_;
  service::ReplayProgressReporter progress_;
  dds::Reader<msg::CompensatedRate> reader_;
};

}  // namespace zerodrift::services
