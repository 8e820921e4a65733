// SPDX-License-Identifier: Apache-2.0
// Publishes the temperatures and the environment of a record or simulation as far ahead as the
// consumers of the rates need them.
#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/replay/record_source.h"
#include "common/service/host.h"
#include "common/service/replay_clock.h"
#include "common/service/replay_pacer.h"

namespace zerodrift::replay {

class TemperatureReplay {
 public:
  // `speed` counts where nobody is waited for.
  TemperatureReplay(service::Host& host, std::uint32_t gyro_id, const std::string& speed,
                    std::vector<std::string> wait_for);

  // Until the source ends or `stopping` is set; says before which probes there are, and then for
  // each that nothing more comes. One thread. Throws what the source throws; what went out before
  // is received then.
  void publish(const ThermalSource& source, const std::atomic<bool>& stopping);

  // One reading at once.
  void publish(const core::TemperatureSample& sample, const std::atomic<bool>& stopping);
  void publish(const core::EnvironmentSample& sample, const std::atomic<bool>& stopping);

  // The rates are over: what is left is needed at once. Any thread.
  void need_all() noexcept { needs_all_ = true; }

  // Any thread.
  [[nodiscard]] std::uint64_t published() const noexcept { return published_; }

 private:
  // A writer a probe, and one of the environment (topics.h says why); late matches get what was
  // written before.
  template <typename Message>
  struct Stream {
    std::unique_ptr<dds::Writer<Message>> writer{};
    std::uint64_t next_sequence = 0;
    core::SensorTime spoken_to{core::kNever};
    std::uint64_t in_flight = 0;  // since all was last received
  };

  template <typename Message>
  void open(Stream<Message>& stream);
  template <typename Message, typename Sample>
  void send(Stream<Message>& stream, const Sample& sample, const std::atomic<bool>& stopping);
  void publish_all(const ThermalSource& source, const std::atomic<bool>& stopping);
  bool wait_until_needed(core::SensorTime time, const std::atomic<bool>& stopping);
  void fill_pauses(const ThermalSource& source, core::SensorTime first, core::SensorTime before,
                   const std::atomic<bool>& stopping);
  void mark_the_end(const ThermalSource& source, core::SensorTime newest,
                    const std::atomic<bool>& stopping);
  void publish_blank(const std::string& name, core::SensorTime time,
                     const std::atomic<bool>& stopping);
  void publish_blank(core::EnvironmentChannels channels, core::SensorTime time,
                     const std::atomic<bool>& stopping);
  template <typename Message>
  void wait_for_receipt(Stream<Message>& stream, const std::atomic<bool>& stopping);
  void wait_for_receipts(const std::atomic<bool>& stopping);

  service::Host& host_;
  std::uint32_t gyro_id_;
  service::ReplayPacer pacer_;
  service::ReplayClock clock_;
  std::optional<service::ReplayProgressReporter> probes_announced_{};
  std::map<std::string, Stream<msg::Temperature>> probes_;
  Stream<msg::Environment> environment_;
  std::atomic<std::uint64_t> published_{0};
  std::atomic<bool> needs_all_{false};
};

}  // namespace zerodrift::replay
