// SPDX-License-Identifier: Apache-2.0
// The reference subscriber: navigates by the compensated and, beside them, by the raw rates of each
// gyro that is received, and gives rate_reference back.
//
// Two threads: samples are navigated by on the middleware's receiving thread, which also writes the
// references; states are published on the host's. Between them a lock.
#pragma once

#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "common/core/bounded_table.h"
#include "common/dds/participant.h"
#include "common/navigation/gyro_navigation.h"
#include "common/service/consumer_pace.h"
#include "common/service/followed_writer.h"
#include "common/service/hop_latency.h"
#include "common/service/host.h"
#include "common/service/replay_pacer.h"

namespace zerodrift::services {

struct NavigationFilterOptions {
  dds::NetworkOptions network;
  service::Supervision supervision{};
  navigation::GyroNavigationOptions navigation;
  double period_s = 0.25;
  std::size_t max_gyros = 16;  // 0.4 MB each
  bool gives_references = true;
};

class NavigationFilterNode {
 public:
  // Throws std::invalid_argument where the options cannot work.
  explicit NavigationFilterNode(const NavigationFilterOptions& options);
  int run();  // exit code

 private:
  using Guid = eprosima::fastrtps::rtps::GUID_t;
  struct Gyro {
    Gyro(std::uint32_t gyro_id, const navigation::GyroNavigationOptions& options)
        : id(gyro_id), navigation(options) {}
    void push_truth(const core::RateReferenceSample& reference) {
      navigation.push_truth(reference.time, reference.rate_radps);
    }
    const std::uint32_t id;
    service::ConsumerPace pace{};
    navigation::GyroNavigation navigation;
    // True rates of two publishers would be one truth.
    service::FollowedWriter<Guid, core::RateReferenceSample> truth_writer{
        core::SensorTime{service::kSilentPublisherNs}};
    navigation::NavigationCounts reported{};
    navigation::Phase reported_phase = navigation::Phase::kWaiting;
    bool reported_compass = false;
    bool reported_doubt = false;
    core::SensorTime reported_truth_lost_at = core::kNever;
    bool reported_truth_doubt = false;
  };
  // Of one gyro, as plain values.
  struct Seen;

  // Receiving threads, under the lock.
  void on_sample(const msg::CompensatedRate& message);
  void on_reference(const msg::RateReference& message, const Guid& writer);
  Gyro* gyro(std::uint32_t gyro_id);
  void keep_pace(std::uint32_t gyro_id, service::ConsumerPace& pace,
                 const msg::CompensatedRate& message);
  void give_references(Gyro& source);
  void report_progress(std::uint32_t gyro_id, service::ConsumerPace& pace);

  // The host's thread.
  void tick();
  void publish_states(Gyro& source);
  void report_counts(Gyro& source);
  void report_truth(Gyro& source);
  service::Status status();

  NavigationFilterOptions options_;
  service::Host host_;
  std::mutex mutex_;
  core::BoundedTable<std::uint32_t, Gyro> gyros_;
  core::BoundedTable<std::uint32_t, service::ConsumerPace> strangers_;
  std::uint64_t stranger_samples_ = 0;
  std::uint64_t reported_stranger_samples_ = 0;
  std::uint64_t unwritten_ = 0;
  std::optional<std::int64_t> published_ns_;
  service::HopLatency delivery_latency_{"delivery"};
  service::HopLatency chain_latency_{"chain"};
  dds::Writer<msg::NavigationState> state_writer_;
  dds::Writer<msg::RateReference> reference_writer_;
  service::ReplayProgressReporter progress_;
  dds::Reader<msg::RateReference> reference_reader_;
  dds::Reader<msg::CompensatedRate> rate_reader_;
};

}  // namespace zerodrift::services
