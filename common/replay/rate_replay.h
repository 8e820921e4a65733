// SPDX-License-Identifier: Apache-2.0
// Publishes the rates and references of a record or simulation at the pace of their consumers, none
// of which loses a sample.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "common/replay/record_source.h"
#include "common/service/host.h"
#include "common/service/replay_clock.h"
#include "common/service/replay_pacer.h"
#include "common/service/sensor_clock.h"

namespace zerodrift::replay {

class RateReplay {
 public:
  // Consumers named in `wait_for` are waited for, at the beginning and all the way.
  RateReplay(service::Host& host, std::uint32_t gyro_id, const std::string& speed,
             std::vector<std::string> wait_for);

  // Whether a sample goes out; may change it.
  enum class Delivery : std::uint8_t { kGive, kDrop };
  using Filter = std::function<Delivery(core::AngularRateSample&)>;

  // Until the source ends and every consumer has taken everything, or `stopping` is set. One
  // thread. Throws what the source throws; what went out before is received then.
  void publish(const GyroSource& source, const std::atomic<bool>& stopping,
               const Filter& filter = {});

  // Any thread.
  [[nodiscard]] service::ReplayClock& clock() noexcept { return clock_; }
  [[nodiscard]] int matched() const { return writer_.matched(); }  // readers of the rates
  [[nodiscard]] std::uint64_t published() const noexcept { return published_; }
  [[nodiscard]] std::uint64_t refused() const noexcept { return refused_; }  // by the middleware
  [[nodiscard]] bool finished() const noexcept { return finished_; }

  // One sample at once, outside of any replay.
  void publish(const core::AngularRateSample& sample,
               const service::ClockDiscipline& discipline = {});

 private:
  void publish_all(const GyroSource& source, const std::atomic<bool>& stopping,
                   const Filter& filter);
  void publish(const core::RateReferenceSample& reference);
  bool wait_for_consumers(const std::atomic<bool>& stopping);
  void wait_for_reference_readers(const std::atomic<bool>& stopping);
  bool wait_for_room(std::uint64_t sequence, const std::atomic<bool>& stopping);
  void finish(const std::atomic<bool>& stopping);
  // False: stopped first.
  bool wait_for_all_until(const std::atomic<bool>& stopping, const std::function<bool()>& is_there);

  service::Host& host_;
  std::uint32_t gyro_id_;
  service::ReplayPacer pacer_;
  service::ReplayClock clock_;
  dds::Writer<msg::AngularRate> writer_;
  dds::Writer<msg::RateReference> reference_writer_;
  std::atomic<std::uint64_t> published_{0};
  std::atomic<std::uint64_t> refused_{0};
  std::atomic<bool> finished_{false};
  std::uint64_t first_sequence_ = 0;
  std::uint64_t newest_sequence_ = 0;
};

}  // namespace zerodrift::replay
