// SPDX-License-Identifier: Apache-2.0
// A gyro and its thermometer made up on the spot, for benches of running services.
#pragma once

#include <atomic>
#include <cstdint>
#include <thread>

#include "common/dds/participant.h"

namespace zerodrift::bench {

struct SyntheticGyroOptions {
  std::uint32_t gyro_id = 1;
  double rate_hz = 200.0;      // on the host's clock
  double sensor_speed = 10.0;  // sensor time over the host's
};

// Publishes from its making to its end, on a thread of its own, at rest: a drift that follows a
// slowly swinging temperature, and white noise. Its clock is a hardware clock: nobody waits for it.
class SyntheticGyro {
 public:
  SyntheticGyro(dds::Participant& participant, const SyntheticGyroOptions& options);
  ~SyntheticGyro();
  SyntheticGyro(const SyntheticGyro&) = delete;
  SyntheticGyro& operator=(const SyntheticGyro&) = delete;

  // Sequence number of the newest sample published.
  [[nodiscard]] std::uint64_t newest() const { return newest_; }

 private:
  void publish();

  SyntheticGyroOptions options_;
  dds::Writer<msg::AngularRate> rates_;
  dds::Writer<msg::Temperature> temperatures_;
  std::atomic<std::uint64_t> newest_{0};
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace zerodrift::bench
