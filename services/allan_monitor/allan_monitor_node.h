// SPDX-License-Identifier: Apache-2.0
// One pair of statistics, raw and compensated, for each axis of each gyro that is heard. Both
// streams are read from compensated_rate (raw = compensated + applied drift), so that they hold
// exactly the same samples.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "common/allan/block_statistics.h"
#include "common/allan/rolling_allan.h"
#include "common/core/axis.h"
#include "common/core/time.h"
#include "common/dds/participant.h"
#include "common/service/host.h"
#include "common/service/latency_histogram.h"
#include "common/service/replay_pacer.h"

namespace zerodrift::services {

struct AllanMonitorOptions {
  dds::NetworkOptions network;
  double window_s = 3600.0;
  double longest_tau_s = 1e4;
  double period_s = 1.0;
};

class AllanMonitorNode {
 public:
  explicit AllanMonitorNode(const AllanMonitorOptions& options);
  void run();

 private:
  struct Stream {
    Stream(const allan::RollingAllanOptions& allan_options,
           const allan::BlockStatisticsOptions& block_options)
        : deviations(allan_options), blocks(block_options) {}
    allan::RollingAllan deviations;
    allan::BlockStatistics blocks;  // since the axis was first compensated
  };
  struct Axis {
    std::optional<Stream> raw;
    std::optional<Stream> compensated;
    bool compensating = false;
  };
  struct Gyro {
    std::uint32_t id = 0;
    double interval_s = 0.0;
    std::uint64_t newest_sequence = 0;
    std::uint64_t out_of_order = 0;
    std::uint64_t gaps = 0;
    std::uint64_t samples = 0;
    core::SensorTime newest{0};
    std::uint64_t since_report = 0;
    bool paced = false;
    core::PerAxis<Axis> axes;
  };

  void on_sample(const msg::CompensatedRate& message);
  void start(Gyro& gyro, const msg::CompensatedRate& message);
  void feed(Gyro& gyro, const msg::CompensatedRate& message, std::uint64_t missing);
  Gyro& gyro(std::uint32_t gyro_id);
  void report_progress(Gyro& gyro);
  void tick();
  void publish(const Gyro& gyro, core::Axis axis, std::uint32_t stream, const Stream& statistics);
  service::Status status();

  AllanMonitorOptions options_;
  service::Host host_;
  std::mutex mutex_;  // between the receiving thread and the reports
  std::vector<std::unique_ptr<Gyro>> gyros_;
  service::LatencyHistogram chain_latency_;  // publisher's write to arrival here
  std::int64_t reported_ns_ = 0;
  dds::Writer<msg::AllanReport> writer_;
  service::ReplayProgressReporter progress_;
  dds::Reader<msg::CompensatedRate> reader_;
};

}  // namespace zerodrift::services
