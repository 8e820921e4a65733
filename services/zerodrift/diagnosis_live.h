// SPDX-License-Identifier: Apache-2.0
// `zerodrift diagnose --live`: listens to a running system for a while, then diagnoses what it
// received as if it were a record.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "common/core/bounded_table.h"
#include "common/dds/participant.h"
#include "common/measurement/live_rows.h"
#include "common/measurement/measured_record.h"
#include "common/recording/discovery_complete.h"
#include "common/service/host.h"
#include "common/service/replay_pacer.h"
#include "services/zerodrift/diagnosis_run.h"
#include "services/zerodrift/twin_report.h"

namespace zerodrift::services {

struct LiveOptions {
  dds::NetworkOptions network;
  std::uint32_t gyro_id = 1;
  double duration_s = 3600.0;  // of sensor time
};

// The name that a live diagnosis gives what it listened to.
[[nodiscard]] std::string live_name(std::uint32_t gyro_id);

// Samples are taken on the middleware's thread, the diagnosis runs on one of its own, status and
// event on the host's.
// More members than other classes: what arrived so far is one state under one lock.
class LiveDiagnosis {
 public:
  LiveDiagnosis(const DiagnosisRequest& request, const LiveOptions& options);

  // Listens for the duration, to the end of a replay, or until a stop signal; diagnoses; hands the
  // result to `take`, then publishes event and reports. A second stop signal ends the process.
  // Throws as run_diagnosis() does, and where too little was received.
  void run(const std::function<void(const DiagnosisResult&)>& take);

 private:
  enum class Phase { kListening, kComplete, kDiagnosing, kDone };

  void on_rate(const msg::AngularRate& message, const dds::SampleOrigin& origin);
  template <typename Message>  // a temperature, a reference or the environment
  void on_companion(const Message& message, const dds::SampleOrigin& origin);
  // Leaves of a sample what its publisher is followed for. False: nothing is left.
  [[nodiscard]] bool keep_followed(core::RateReferenceSample& sample,
                                   const dds::SampleOrigin& origin);
  [[nodiscard]] bool keep_followed(core::TemperatureSample& sample,
                                   const dds::SampleOrigin& origin);
  [[nodiscard]] bool keep_followed(core::EnvironmentSample& sample,
                                   const dds::SampleOrigin& origin);
  [[nodiscard]] bool follows(const std::string& stream, const dds::SampleOrigin& origin);
  void note_left(const eprosima::fastrtps::rtps::GUID_t& writer);
  void note_companion_left(const eprosima::fastrtps::rtps::GUID_t& writer);  // waited for no more
  // Under the lock.
  void drain();
  void add_ready_rows();
  void complete();
  void report_progress();
  [[nodiscard]] measurement::MeasuredColumns columns() const;
  [[nodiscard]] measurement::MeasuredRecord finish();

  // Host's thread.
  void announce_once_discovered();
  void tick();
  service::Status status();

  DiagnosisRequest request_;
  LiveOptions options_;
  service::Host host_;
  // Never held while anything is published: the middleware tells of a lost publisher with its own
  // locks held.
  std::mutex publisher_mutex_;
  struct Stream {
    std::optional<eprosima::fastrtps::rtps::GUID_t> publisher{};  // the first, until it is gone
    std::uint64_t rejected = 0;                                   // samples of others
  };
  // Rates, true rates, channels of the environment and as many thermometers as are used.
  core::BoundedTable<std::string, Stream> streams_{2 + core::kEnvironmentChannels +
                                                   measurement::LiveRowsOptions{}.most_probes};
  std::mutex mutex_;
  Phase phase_ = Phase::kListening;
  measurement::LiveRows rows_;
  std::optional<measurement::MeasuredRecordBuilder> builder_;
  std::string failure_;
  std::optional<core::SensorTime> first_;
  core::SensorTime newest_{0};
  std::uint64_t newest_sequence_ = 0;
  std::uint64_t taken_sequence_ = 0;  // the newest while not too many waited
  std::uint64_t received_ = 0;
  bool paced_ = false;
  bool over_ = false;   // the duration has passed or the source has ended
  int ticks_over_ = 0;  // since then
  std::atomic<bool> companion_left_{false};
  std::optional<Finding> finding_;  // to be published
  dds::Writer<msg::TwinReport> report_writer_;
  recording::DiscoveryComplete discovery_;
  std::unique_ptr<service::ReplayProgressReporter> progress_;  // from then on
  dds::Reader<msg::RateReference> reference_reader_;
  dds::Reader<msg::Temperature> temperature_reader_;
  dds::Reader<msg::Environment> environment_reader_;
  dds::Reader<msg::AngularRate> rate_reader_;
};

}  // namespace zerodrift::services
