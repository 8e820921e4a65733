// SPDX-License-Identifier: Apache-2.0
// Subscribes, converts, hands to common/compensation, publishes. A sample is answered on the thread
// that received it; learning happens on a thread of its own, reading and writing checkpoints and
// models on another.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <future>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <variant>
#include <vector>

#include "common/checkpoint/save_schedule.h"
#include "common/compensation/compensator.h"
#include "common/compensation/learner_state.h"
#include "common/core/spsc_queue.h"
#include "common/dds/participant.h"
#include "common/dds/ros2_imu.h"
#include "common/service/command_server.h"
#include "common/service/early_inputs.h"
#include "common/service/hop_latency.h"
#include "common/service/host.h"
#include "common/service/hot_standby.h"
#include "common/service/replay_pacer.h"

namespace zerodrift::services {

struct CompensationNodeOptions {
  dds::NetworkOptions network;
  service::Supervision supervision{};
  compensation::CompensationOptions compensation;
  std::uint32_t instance = 0;
  // 0: alone; else one of several, the strongest of which is the active one at first.
  std::uint32_t ownership_strength = 0;
  int await_subscribers = 0;
  std::size_t max_gyros = 16;              // about 5 MB each
  std::filesystem::path checkpoint_dir{};  // empty: no checkpoints
  std::chrono::seconds checkpoint_period{60};
  std::filesystem::path model_dir{};  // what `adopt` takes models from; empty: none
  std::map<std::uint32_t, dds::RosImuOptions> ros2_imu{};  // by gyro id
};

class CompensationNode {
 public:
  static constexpr std::size_t kMostGyros = 128;  // as many keys as the topics of samples hold

  explicit CompensationNode(const CompensationNodeOptions& options);
  ~CompensationNode();

  // Until a stop signal.
  int run();  // exit code

 private:
  // An input as it arrived, for a standby to repeat after the state it is given.
  using Input =
      std::variant<core::AngularRateSample, core::TemperatureSample, core::RateReferenceSample>;
  // With whom published it.
  struct Arrived {
    Input input;
    eprosima::fastrtps::rtps::GUID_t writer{};
  };
  // Who published a stream of inputs last.
  struct InputWriter {
    eprosima::fastrtps::rtps::GUID_t writer{};
    bool left = false;        // and nobody has since
    bool in_mid_run = false;  // what it said last was a measurement, not that nothing more comes
  };
  // A standby on its way to the active instance's state.
  struct CatchUp {
    bool logging = false;      // from before the state was asked for
    std::vector<Input> log{};  // in order of arrival
    std::int64_t asked_ns = 0;
    // The state's parts so far.
    std::uint32_t instance = 0;
    std::uint64_t sequence = 0;
    std::uint32_t parts = 0;
    std::string bytes{};
  };

  // One gyro: its compensator, whom it listens to, and what its stream did.
  struct Gyro {
    Gyro(std::uint32_t gyro_id, const compensation::CompensationOptions& configured,
         const service::HotStandby& role)
        : id(gyro_id),
          options(configured),
          compensator(std::make_unique<compensation::Compensator>(configured)),
          standby(role),
          temperature_writers(compensator->probes().size()) {}
    std::uint32_t id;
    // As configured, with the prior that was adopted last; the request thread's.
    compensation::CompensationOptions options;
    // Given to the compensator last, and then what it was given for; the request thread's.
    std::shared_ptr<compensation::PriorChange> change{};
    std::optional<twin::Model> prior_before{};
    bool can_revert = false;
    std::unique_ptr<compensation::Compensator> compensator;
    service::HotStandby standby;
    CatchUp catch_up{};
    std::vector<InputWriter> temperature_writers;  // by probe
    std::array<InputWriter, 3> reference_writers{};
    core::SensorTime newest_temperature{core::kNever};  // stamped by a clock
    bool told_clocks = false;
    // As the newest rate says.
    std::uint32_t clock_locked = 0;
    std::int64_t clock_offset_ns = 0;
    bool input_ended = false;  // in mid-run, or while rates waited for it; the tick tells it
    // Made outside of the receiving thread; samples wait for it in the compensator.
    std::unique_ptr<dds::Writer<msg::CompensatedRate>> writer;
    std::unique_ptr<dds::RosImuWriter> ros2_writer{};  // where asked for; made with the other
    bool heard_by_all = false;                         // as many subscribers as were asked for
    int ticks_with_subscribers = 0;                    // without a break
    eprosima::fastrtps::rtps::GUID_t publisher{};
    bool has_publisher = false;
    bool publisher_left = false;        // another may follow at once
    std::int64_t heard_ns = 0;          // monotonic
    std::int64_t waiting_since_ns = 0;  // 0: not waiting for another stream
    bool told_waiting = false;
    std::uint64_t rejected = 0;   // samples of a second publisher of the same id
    std::uint64_t unwritten = 0;  // the middleware refused them
    std::uint64_t answered_since_report = 0;
    std::uint64_t newest_sequence = 0;
    core::SensorTime reported_needed{core::kNever};
    compensation::CompensatedSample newest;
    compensation::CompensatorCounts told;  // what events have told so far
    std::uint64_t told_rejected = 0;
    service::HotStandby::Counts told_standby{};
    bool told_hanging = false;
    core::PerAxis<compensation::Mode> told_mode{};
    core::PerAxis<compensation::Reason> told_reason{};
    compensation::Reason told_temperature_fault = compensation::Reason::kNone;
  };

  static constexpr const char* kStandbyText =
      "this instance is a standby and follows the active one; send it there (ctl status tells "
      "which is active)";

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
  Verdict on_command(const msg::Command& command);

  [[nodiscard]] Gyro* known(std::uint32_t gyro_id) noexcept;
  // Of a rate; null where there are as many as there may be.
  Gyro* gyro(std::uint32_t gyro_id);
  // Of a gyro that is not known yet it is kept until the first rate comes.
  void take_in(std::uint32_t gyro_id, Arrived arrived);
  static void take_in(Gyro& gyro, const Arrived& arrived);
  void note_departure(const eprosima::fastrtps::rtps::GUID_t& writer, dds::Departure departure);
  void take_departures();
  static bool end_inputs(Gyro& gyro, const eprosima::fastrtps::rtps::GUID_t& writer);
  static void end_what_left(Gyro& gyro);
  [[nodiscard]] bool may_write(Gyro& gyro) const;
  bool accepts(Gyro& gyro, const dds::SampleOrigin& origin, std::int64_t now_ns);
  void drain(Gyro& gyro);
  void answer(Gyro& gyro);
  void write(Gyro& gyro, msg::CompensatedRate& message);
  void report_progress(Gyro& gyro);
  void tick();
  void make_writers();
  void note_subscribers(Gyro& gyro);
  void tell_of_waiting(Gyro& gyro, std::int64_t now_ns);
  void tell_of_clocks(Gyro& gyro);
  void tell_of_strangers();
  void tell_of_faults(Gyro& gyro);
  void tell_of_modes(Gyro& gyro);
  void tell_of_temperature(Gyro& gyro);

  // status.cpp
  struct Seen;  // of one gyro, as plain values
  service::Status status();
  static Seen see(const Gyro& source);
  static service::StatusPart part(const Seen& seen);

  void learn_until_stopped();
  void resume_after_model();
  void wake_learner();
  Verdict obey(const msg::Command& command);
  std::string obey(Gyro& gyro, std::string_view command, bool& accepted);

  // requests.cpp
  Verdict hand_over(const msg::Command& command);
  // False: too many wait already.
  bool ask_request_thread(Task task);
  // Has the learner run it between two labels, and waits for that. Throws where it doesn't in time:
  // so the task holds on to nothing of its caller's, it may still be run.
  void ask_learner(Task question);
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

  // hot_standby.cpp
  void on_peer(const msg::CompensatedRate& message);
  void on_checkpoint(const msg::CheckpointPart& part);
  void take_over_until_stopped();
  void look_after_standby(Gyro& source);
  void give_state(Gyro& source);
  std::optional<std::string> running_state(Gyro& source, std::uint64_t& sequence);
  void catch_up(Gyro& source, const std::string& state, std::uint64_t sequence);
  void renew_writer(Gyro& source);
  void relieve(compensation::Compensator& before,
               std::unique_ptr<compensation::Compensator>& after);
  void tell_of_standby(Gyro& source);
  bool continues(Gyro& source, std::uint64_t sequence);
  // The commands that change a model are the active instance's.
  [[nodiscard]] std::vector<Gyro*> active_gyros() const;
  std::unique_ptr<dds::Writer<msg::CompensatedRate>> make_writer(std::uint32_t strength);
  std::unique_ptr<dds::RosImuWriter> make_ros2_writer(std::uint32_t gyro_id);
  [[nodiscard]] bool is_one_of_several() const noexcept { return options_.ownership_strength > 0; }

  // prior_requests.cpp
  void tell_of_prior();
  Verdict adopt(const Request& request);
  Verdict revert(const Request& request);
  Verdict change_prior(Gyro& source, std::shared_ptr<compensation::PriorChange> change,
                       const std::string& what);

  CompensationNodeOptions options_;
  std::uint32_t strength_;  // of a writer that nobody was heard before
  service::Host host_;
  std::mutex
      data_mutex_;  // between the receiving thread and the status thread; never the learner's
  std::vector<std::unique_ptr<Gyro>> gyros_;
  service::EarlyInputs<Arrived> early_;
  std::uint64_t strangers_ = 0;  // samples of gyros beyond max_gyros
  std::uint64_t told_strangers_ = 0;
  std::uint32_t newest_stranger_ = 0;
  std::mutex departures_mutex_;  // held for a push or a swap
  std::vector<eprosima::fastrtps::rtps::GUID_t> departures_;
  std::atomic<bool> any_departed_{false};
  core::SpscQueue<compensation::Compensator*> newcomers_{kMostGyros};  // the learner has not seen
  msg::CompensatedRate message_;
  service::HopLatency sensor_latency_{"sensor"};  // see there; the receiving thread's
  service::HopLatency arrival_latency_{"arrival"};
  service::HopLatency compute_latency_{"compute"};

  std::atomic<std::uint32_t> learner_wakeups_{0};
  std::atomic<bool> model_awaited_{false};  // by samples of a record or simulation
  std::atomic<bool> stopping_{false};
  std::vector<compensation::Compensator*> roster_;  // the learner's
  std::vector<std::unique_ptr<compensation::Compensator>> abandoned_;
  std::thread learner_thread_;

  // From the request thread to the learner: to be answered between two labels.
  core::SpscQueue<Task> questions_{4};
  std::mutex requests_mutex_;  // held for a push or a pop
  std::condition_variable requests_changed_;
  std::deque<Task> requests_;
  std::atomic<bool> requests_closed_{false};
  std::thread request_thread_;
  checkpoint::SaveSchedule save_schedule_;  // under data_mutex_
  std::atomic<bool> stopping_takeovers_{false};
  std::thread takeover_thread_;

  service::CommandServer commands_;
  service::ReplayProgressReporter progress_;
  dds::Reader<msg::ReplayProgress> replay_reader_;
  dds::Reader<msg::RateReference> reference_reader_;
  dds::Reader<msg::Temperature> temperature_reader_;
  dds::Reader<msg::AngularRate> rate_reader_;
  // One of several: what the others answer, and how they catch up.
  std::optional<dds::Writer<msg::CheckpointPart>> checkpoint_writer_;
  std::optional<dds::Reader<msg::CheckpointPart>> checkpoint_reader_;
  std::optional<dds::Reader<msg::CompensatedRate>> peer_reader_;
};

}  // namespace zerodrift::services
