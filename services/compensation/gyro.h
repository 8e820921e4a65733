// SPDX-License-Identifier: Apache-2.0
// One gyro as the service has it: the way of its samples, who publishes its inputs, and what its
// answers are written with.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>
#include <variant>
#include <vector>

#include "common/compensation/compensator.h"
#include "common/dds/participant.h"
#include "common/dds/ros2_imu.h"
#include "common/service/followed_writer.h"
#include "common/service/gyro_pipeline.h"
#include "common/service/hop_latency.h"
#include "common/service/replay_pacer.h"
#include "services/compensation/arriving_state.h"
#include "services/compensation/gyro_events.h"
#include "services/compensation/learner_thread.h"

namespace zerodrift::services {

class Gyro final : private service::GyroPipeline<compensation::Compensator>::Port {
 public:
  using Pipeline = service::GyroPipeline<compensation::Compensator>;
  using Guid = eprosima::fastrtps::rtps::GUID_t;

  // What all gyros of the service have in common.
  struct Surroundings {
    std::uint32_t instance = 0;
    bool is_redundant = false;
    int await_subscribers = 0;
    service::Host& host;
    LearnerThread& learner;
    service::ReplayProgressReporter& progress;
    service::HopLatency& compute_latency;
  };
  // A temperature or reference, with whom published it.
  struct Arrived {
    std::variant<core::TemperatureSample, core::RateReferenceSample> sample{};
    Guid writer{};
  };

  // `interval_s`: of its first sample.
  Gyro(std::uint32_t gyro_id, const compensation::CompensationOptions& as_configured,
       double interval_s, bool has_ros2, const Surroundings& surroundings);

  const std::uint32_t id;
  const compensation::CompensationOptions configured;  // for the spacing of its samples
  [[nodiscard]] Pipeline& pipeline() noexcept { return pipeline_; }
  [[nodiscard]] const Pipeline& pipeline() const noexcept { return pipeline_; }
  [[nodiscard]] compensation::Compensator& compensator() noexcept { return pipeline_.engine(); }
  [[nodiscard]] const compensation::Compensator& compensator() const noexcept {
    return pipeline_.engine();
  }
  [[nodiscard]] const core::CompensatedSample& newest() const noexcept {
    return pipeline_.newest();
  }
  [[nodiscard]] bool is_paced() const noexcept {
    return core::is_paced_by_consumers(compensator().waiting_clock());
  }
  [[nodiscard]] bool leads() const noexcept { return pipeline_.sync().leads(); }
  // Since the newest sample was answered, to a tick.
  [[nodiscard]] std::chrono::nanoseconds silence(std::int64_t now_ns) const noexcept {
    return std::chrono::nanoseconds(answered_ns_ == 0 ? 0 : now_ns - answered_ns_);
  }

  // ---- the data path
  void take(const msg::AngularRate& message, std::uint64_t run, std::int64_t now_ns);
  void take(const Arrived& arrived, std::int64_t now_ns);
  void limit_probes(std::string_view published, std::int64_t now_ns);
  // Nothing more comes of writers that left: a rate that waits for them goes on.
  void end_inputs_of(const std::vector<Guid>& left, std::int64_t now_ns);
  // So it is for a compensator that goes on instead.
  void end_what_left(compensation::Compensator& compensator) const;

  // ---- the tick
  void set_writers(std::unique_ptr<dds::Writer<msg::CompensatedRate>> writer,
                   std::unique_ptr<dds::RosImuWriter> ros2_writer);
  [[nodiscard]] bool has_writer() const noexcept { return writer_ != nullptr; }
  void note_subscribers(std::int64_t now_ns);
  // Since when answers wait for subscribers; 0: they don't. As of the last tick.
  [[nodiscard]] std::int64_t awaits_subscribers_since_ns() const noexcept {
    return subscribers_awaited_ns_;
  }
  void tick(std::int64_t now_ns);
  // The learner hangs: a model is late.
  [[nodiscard]] bool hangs() const noexcept { return hangs_; }
  // Of a second publisher of the probe, by the compensator's probes.
  [[nodiscard]] std::uint64_t temperatures_rejected(std::size_t probe) const noexcept {
    return temperature_writers_[probe].rejected();
  }
  [[nodiscard]] std::uint64_t temperatures_rejected() const noexcept;
  // What is said of a gyro's rate is followed by itself: the true rate, rest, a filter's residual.
  static constexpr std::array kReferencePlaces{core::ReferenceKind::kRecord,
                                               core::ReferenceKind::kRest,
                                               core::ReferenceKind::kNavigationResidual};
  // Of a second publisher, by the place.
  [[nodiscard]] std::uint64_t references_rejected(std::size_t place) const noexcept {
    return reference_writers_[place].rejected();
  }
  [[nodiscard]] std::uint64_t references_rejected() const noexcept;
  // An input ended in mid-run, or while rates waited for it; once.
  [[nodiscard]] bool take_input_ended() noexcept;
  [[nodiscard]] core::SensorTime newest_temperature() const noexcept { return stamps_.newest; }
  // How far behind the rates the last two readings of a probe were stamped as they came, the
  // lesser: one alone may have been kept for who comes late.
  [[nodiscard]] core::SensorTime temperature_behind() const noexcept { return stamps_.behind; }
  [[nodiscard]] std::uint64_t unwritten() const noexcept { return unwritten_; }

  // ---- the request thread
  // Until all readers have what was written.
  void wait_until_received(std::chrono::milliseconds at_most);
  compensation::CompensationOptions options;  // as configured, with the prior adopted last
  // Given to the compensator last, and then what it was given for.
  std::shared_ptr<compensation::PriorChange> change{};
  std::optional<twin::Model> prior_before{};
  bool can_revert = false;

  bool is_saved = true;  // from time to time, where anything is; no other process saves it

  ArrivingState arriving{};
  GyroEvents events;

 private:
  using ReferenceWriter = service::FollowedWriter<Guid, core::RateReferenceSample>;
  // Of temperatures that a clock has stamped.
  struct Stamps {
    core::SensorTime newest{core::kNever};
    std::vector<core::SensorTime> lags;  // of each probe's newest reading behind the rates
    core::SensorTime behind{0};          // the lesser of the last two of a probe
  };
  [[nodiscard]] bool awaits_subscribers() const;
  // True: an input has ended with it.
  bool note_left(const Guid& writer, std::int64_t now_ns);
  void push(const core::TemperatureSample& temperature, std::size_t probe, std::int64_t now_ns);

  // Port
  service::AnswerMark prepare(const core::CompensatedSample& answer, std::uint64_t run,
                              std::uint32_t answered) noexcept override;
  void write_prepared(bool leads) noexcept override;
  void write_prepared_alone() noexcept override;
  [[nodiscard]] bool has_output_of_one() const noexcept override { return has_ros2_; }
  [[nodiscard]] bool can_write() const noexcept override { return has_writer(); }
  bool is_open() override;
  void begin_run() override;
  bool await_model() override;
  void report_progress(std::uint64_t newest, core::SensorTime needed) override;
  void notify_learner() override { surroundings_.learner.notify(); }

  Surroundings surroundings_;
  bool has_ros2_;
  Pipeline pipeline_;
  std::vector<service::FollowedWriter<Guid>> temperature_writers_;  // by probe
  std::array<ReferenceWriter, kReferencePlaces.size()> reference_writers_;
  bool input_ended_ = false;
  Stamps stamps_;
  std::uint32_t clock_locked_ = 0;  // as the newest rate says
  std::int64_t clock_offset_ns_ = 0;
  // Made outside of the receiving thread; samples wait for them in the compensator.
  std::unique_ptr<dds::Writer<msg::CompensatedRate>> writer_{};
  std::unique_ptr<dds::RosImuWriter> ros2_writer_{};  // where asked for
  msg::CompensatedRate message_{};
  bool received_by_all_ = false;    // as many subscribers as were asked for
  int ticks_with_subscribers_ = 0;  // without a break
  std::int64_t subscribers_awaited_ns_ = 0;
  std::uint64_t unwritten_ = 0;  // the middleware refused them
  bool hangs_ = false;
  std::uint64_t answered_ = 0;    // as the last tick found it
  std::int64_t answered_ns_ = 0;  // when a tick found more; 0: none yet
};

}  // namespace zerodrift::services
