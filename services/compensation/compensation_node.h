// SPDX-License-Identifier: Apache-2.0
// Subscribes, converts, hands to common/compensation, publishes. A sample is answered on the thread
// that received it; learning happens on a thread of its own, reading and writing checkpoints and
// models on another.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "common/checkpoint/save_schedule.h"
#include "common/compensation/compensator.h"
#include "common/core/bounded_table.h"
#include "common/dds/participant.h"
#include "common/dds/ros2_imu.h"
#include "common/files/claimed_numbers.h"
#include "common/service/command_server.h"
#include "common/service/early_inputs.h"
#include "common/service/hop_latency.h"
#include "common/service/host.h"
#include "common/service/replay_pacer.h"
#include "services/compensation/coverage_reports.h"
#include "services/compensation/gyro.h"
#include "services/compensation/learner_thread.h"
#include "services/compensation/rival_watch.h"
#include "services/compensation/ros2_diagnostics.h"

namespace zerodrift::services {

struct CompensationNodeOptions {
  dds::NetworkOptions network;
  service::Supervision supervision{};
  compensation::CompensationOptions compensation;
  std::uint32_t instance = 0;
  bool redundant = false;  // one of several that answer the same
  int await_subscribers = 0;
  std::size_t max_gyros = 16;              // about 5 MB each
  std::filesystem::path checkpoint_dir{};  // empty: no checkpoints
  double checkpoint_period_s = 60.0;
  std::filesystem::path model_dir{};  // what `adopt` takes models from; empty: none
  std::map<std::uint32_t, dds::RosImuOptions> ros2_imu{};  // by gyro id
};

// More members than other classes: it wires eight topics to the gyros, the learner and the
// requests.
class CompensationNode {
 public:
  static constexpr std::size_t kMostGyros = 128;  // as many keys as the topics of samples hold

  explicit CompensationNode(const CompensationNodeOptions& options);
  ~CompensationNode();

  // Until a stop signal.
  int run();  // exit code

 private:
  // Each answer of the others, whoever was first.
  using PeerReader = dds::Reader<msg::CompensatedRate, dds::EveryCopy>;

  static constexpr const char* kOtherLeadsText =
      "another instance leads; send it there (ctl status tells which)";

  using Verdict = service::CommandVerdict;
  using Outcome = Verdict::Outcome;
  // A command that needs files; served on the request thread.
  struct Request {
    msg::Command command{};
    std::string argument{};
    std::vector<Gyro*> gyros{};
  };
  using Task = std::function<void()>;  // of the request thread

  void on_rate(const msg::AngularRate& message, const dds::SampleOrigin& origin);
  void note_arrival(const msg::AngularRate& message, std::int64_t ingress_ns) noexcept;
  void on_temperature(const msg::Temperature& message, const dds::SampleOrigin& origin);
  void on_reference(const msg::RateReference& message, const dds::SampleOrigin& origin);
  void on_replay(const msg::ReplayProgress& message);

  // Of a rate; null where there are as many as there may be.
  // `interval_s`: of its sample that came.
  Gyro* gyro(std::uint32_t gyro_id, double interval_s, std::int64_t now_ns);
  // Of a gyro that is not known yet it is kept until the first rate comes.
  void take_in(std::uint32_t gyro_id, Gyro::Arrived arrived);
  void note_departure(const eprosima::fastrtps::rtps::GUID_t& writer, dds::Departure departure);
  void take_departures(std::int64_t now_ns);
  void drain_all();
  void tick();
  void make_writers();
  std::unique_ptr<dds::RosImuWriter> make_ros2_writer(std::uint32_t gyro_id);
  void report_strangers();
  void report_to_ros2();
  void report_coverage();

  // status.cpp
  struct Seen;  // of one gyro, as plain values
  service::Status status();
  static Seen see(const Gyro& source);
  static service::StatusPart part(const Seen& seen);

  // commands.cpp
  Verdict on_command(const msg::Command& command);
  void overhear(const msg::Command& command);
  Verdict obey(const msg::Command& command);
  std::string obey(Gyro& gyro, std::string_view command, bool& accepted);
  // Before the first sample.
  Verdict obey_without_gyro(std::string_view command);
  // Whether a gyro that comes now is to learn.
  [[nodiscard]] bool is_commanded_to_freeze() const;
  // A learner takes one change at a time; those of the gyros before it have taken theirs.
  static std::string busy_text(const std::vector<Gyro*>& asked, std::size_t busy);
  // The commands that change a model are the leading instance's.
  [[nodiscard]] std::vector<Gyro*> led_gyros();

  // requests.cpp
  Verdict hand_over(const msg::Command& command);
  // False: too many wait already.
  bool ask_request_thread(Task task);
  void serve_requests_until_stopped();
  Verdict serve(const Request& request);
  // The model epoch from which on the learner is in the learner's place; nothing if that takes
  // longer than a reply waits.
  std::optional<std::uint64_t> installed(const compensation::RestoredLearner& learner);
  // A model of this gyro was adopted or taken back, and no sample has come since.
  [[nodiscard]] bool awaits_change(const Gyro& source);

  // checkpoint_requests.cpp
  Verdict save(const Request& request);
  Verdict restore(const Request& request);
  // What a learner knows, and after which of its jobs.
  struct Learned {
    std::optional<compensation::LearnerState> state{};
    std::uint64_t job = 0;
  };
  Learned learned(Gyro& source);
  compensation::LearnerState learned_by(Gyro& source);
  void save_from_time_to_time();
  void save_of_itself(const checkpoint::SaveSchedule::Model& model);
  void resume(Gyro& source);

  // state_exchange.cpp
  void on_peer(const msg::CompensatedRate& message);
  void on_checkpoint(const msg::CheckpointPart& part);
  void ask_for_state(Gyro& source, std::int64_t now_ns);
  void give_state(Gyro& source);
  std::optional<RunningState> running_state(Gyro& source);
  void catch_up(Gyro& source, const RunningState& state);

  // prior_requests.cpp
  void report_prior();
  Verdict adopt(const Request& request);
  Verdict revert(const Request& request);
  Verdict change_prior(Gyro& source, std::shared_ptr<compensation::PriorChange> change,
                       const std::string& what);

  CompensationNodeOptions options_;
  service::Host host_;
  std::mutex
      data_mutex_;  // between the receiving thread and the status thread; never the learner's
  core::BoundedTable<std::uint32_t, Gyro> gyros_;  // what it refuses are samples of others
  service::EarlyInputs<Gyro::Arrived> early_;
  bool first_is_frozen_ = false;  // by command: the first gyro; from then on the gyros know it
  std::uint64_t reported_strangers_ = 0;
  std::uint32_t newest_stranger_ = 0;
  std::mutex departures_mutex_;  // held for a push or a swap
  std::vector<Gyro::Guid> departures_;
  std::atomic<bool> any_departed_{false};
  service::HopLatency sensor_latency_{"sensor"};  // see there; the receiving thread's
  service::HopLatency arrival_latency_{"arrival"};
  service::HopLatency compute_latency_{"compute"};

  std::mutex requests_mutex_;  // held for a push or a pop
  std::condition_variable requests_changed_;
  std::deque<Task> requests_;
  std::atomic<bool> requests_closed_{false};
  std::thread request_thread_;
  checkpoint::SaveSchedule save_schedule_;  // under data_mutex_
  files::ClaimedNumbers saved_gyros_;       // of the checkpoint folder
  LearnerThread learner_;

  service::CommandServer commands_;
  service::ReplayProgressReporter progress_;
  dds::Reader<msg::ReplayProgress> replay_reader_;
  dds::Reader<msg::RateReference> reference_reader_;
  dds::Reader<msg::Temperature> temperature_reader_;
  dds::Reader<msg::AngularRate> rate_reader_;
  // One of several: what the others answer, and how they catch up.
  std::optional<dds::Writer<msg::CheckpointPart>> checkpoint_writer_;
  std::optional<dds::Reader<msg::CheckpointPart>> checkpoint_reader_;
  std::optional<PeerReader> peer_reader_;
  std::optional<Ros2Diagnostics> ros2_diagnostics_;  // with ROS 2's topics
  CoverageReports coverage_;
  RivalWatch rivals_;
};

}  // namespace zerodrift::services
