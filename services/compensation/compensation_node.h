// SPDX-License-Identifier: Apache-2.0
// Subscribes, converts, hands to common/compensation, publishes. A sample is answered on the thread
// that received it; learning happens on a thread of its own, reading and writing checkpoints and
// models on another.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <future>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "common/compensation/compensator.h"
#include "common/compensation/learner_state.h"
#include "common/core/spsc_queue.h"
#include "common/dds/participant.h"
#include "common/service/host.h"
#include "common/service/latency_histogram.h"
#include "common/service/replay_pacer.h"

namespace zerodrift::services {

struct CompensationNodeOptions {
  dds::NetworkOptions network;
  compensation::CompensationOptions compensation;
  std::uint32_t instance = 0;
  std::uint32_t ownership_strength = 0;
  int await_subscribers = 0;
  std::filesystem::path checkpoint_dir{};  // empty: no checkpoints
};

class CompensationNode {
 public:
  explicit CompensationNode(const CompensationNodeOptions& options);
  ~CompensationNode();

  // Until a stop signal.
  void run();

 private:
  // One gyro: its compensator, whom it listens to, and what its stream did.
  struct Gyro {
    Gyro(std::uint32_t gyro_id, const compensation::CompensationOptions& configured)
        : id(gyro_id), options(configured), compensator(configured) {}
    std::uint32_t id;
    // As configured, with the prior that was adopted last; the request thread's.
    compensation::CompensationOptions options;
    // Given to the compensator last, and then what it was given for; the request thread's.
    std::shared_ptr<compensation::PriorChange> change{};
    std::optional<twin::Model> prior_before{};
    bool can_revert = false;
    compensation::Compensator compensator;
    // Made outside of the receiving thread; samples wait for it in the compensator.
    std::unique_ptr<dds::Writer<msg::CompensatedRate>> writer;
    bool heard_by_all = false;           // as many subscribers as were asked for
    bool subscribers_were_here = false;  // a tick ago
    eprosima::fastrtps::rtps::GUID_t publisher{};
    bool has_publisher = false;
    std::int64_t heard_ns = 0;          // monotonic
    std::int64_t waiting_since_ns = 0;  // 0: not waiting for another stream
    std::uint64_t rejected = 0;         // samples of a second publisher of the same id
    std::uint64_t unwritten = 0;        // the middleware refused them
    std::uint64_t answered_since_report = 0;
    std::uint64_t newest_sequence = 0;
    core::SensorTime reported_needed{core::kNever};
    compensation::CompensatedSample newest;
    compensation::CompensatorCounts told;  // what events have told so far
    std::uint64_t told_rejected = 0;
    core::PerAxis<compensation::Mode> told_mode{};
    core::PerAxis<compensation::Reason> told_reason{};
    compensation::Reason told_temperature_fault = compensation::Reason::kNone;
  };

  // What becomes of a command.
  enum class Outcome : std::uint8_t { kRefused, kAccepted, kLater };
  struct Verdict {
    Outcome outcome = Outcome::kRefused;
    std::string text{};
    std::uint64_t model_epoch = 0;
  };
  // A command that needs files; served on the request thread.
  struct Request {
    msg::Command command{};
    std::string argument{};
    std::vector<Gyro*> gyros{};
  };

  void on_rate(const msg::AngularRate& message, const dds::SampleOrigin& origin);
  void on_temperature(const msg::Temperature& message);
  void on_reference(const msg::RateReference& message);
  void on_command(const msg::Command& command);

  Gyro& gyro(std::uint32_t gyro_id);
  [[nodiscard]] bool may_write(Gyro& gyro) const;
  bool accepts(Gyro& gyro, const dds::SampleOrigin& origin, std::int64_t now_ns);
  void drain(Gyro& gyro);
  void answer(Gyro& gyro);
  void report_progress(Gyro& gyro);
  void tick();
  void make_writers();
  void note_subscribers(Gyro& gyro);
  void tell_of_faults(Gyro& gyro);
  void tell_of_modes(Gyro& gyro);
  void tell_of_temperature(Gyro& gyro);
  service::Status status();
  static service::StatusPart part(const Gyro& source);
  void learn_until_stopped();
  void wake_learner();
  Verdict obey(const msg::Command& command);
  std::string obey(Gyro& gyro, std::string_view command, bool& accepted);
  void reply(const msg::Command& command, const Verdict& verdict);

  // requests.cpp
  Verdict hand_over(const msg::Command& command);
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
  compensation::LearnerState learned_by(Gyro& source);
  [[nodiscard]] std::filesystem::path checkpoint_file(std::uint32_t gyro_id,
                                                      const std::string& name) const;

  // prior_requests.cpp
  void tell_of_prior();
  Verdict adopt(const Request& request);
  Verdict revert(const Request& request);
  Verdict change_prior(Gyro& source, std::shared_ptr<compensation::PriorChange> change,
                       const std::string& what);

  CompensationNodeOptions options_;
  service::Host host_;
  std::mutex
      data_mutex_;  // between the receiving thread and the status thread; never the learner's
  std::vector<std::unique_ptr<Gyro>> gyros_;
  core::SpscQueue<Gyro*> newcomers_{128};  // gyros the learner has not seen yet
  msg::CompensatedRate message_;
  service::LatencyHistogram compute_latency_;  // ingress to egress
  service::LatencyHistogram arrival_latency_;  // publisher's write to ingress

  std::atomic<std::uint32_t> learner_wakeups_{0};
  std::atomic<std::uint32_t> models_delivered_{0};
  std::atomic<bool> stopping_{false};
  std::thread learner_thread_;

  // From the request thread to the learner: to be answered between two labels.
  core::SpscQueue<std::packaged_task<compensation::LearnerState()>> questions_{1};
  std::mutex requests_mutex_;  // held for a push or a pop
  std::condition_variable requests_changed_;
  std::deque<Request> requests_;
  std::atomic<bool> requests_closed_{false};
  std::thread request_thread_;

  dds::Writer<msg::CommandReply> reply_writer_;
  service::ReplayProgressReporter progress_;
  dds::Reader<msg::Command> command_reader_;
  dds::Reader<msg::RateReference> reference_reader_;
  dds::Reader<msg::Temperature> temperature_reader_;
  dds::Reader<msg::AngularRate> rate_reader_;
};

}  // namespace zerodrift::services
