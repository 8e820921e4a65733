// SPDX-License-Identifier: Apache-2.0
// The one implementation of compensation that the service and `zerodrift compensate` share.
//
// Three streams go in, in any order of arrival; one compensated sample comes out for each raw
// sample. Everything is driven by sensor time, and a learned model takes effect at a fixed sensor
// time after the label it came from, so equal inputs give equal outputs to the bit as long as
// nobody had to go on without waiting (see readiness()).
//
//   raw sample -> ladder (stack or online SVR > stationary bias > prior > factory polynomial >
//   nothing) -> compensated sample
//        \-> one-second blocks -> rest gate -> labels -> learner (another thread) -> snapshot,
//        active at its due time
//
// With a prior (a model of the twin, drift_prior.h) the drift is prior + remainder: labels, held
// level, forecast, domain and variance are the remainder's, and the prior is added to what they
// give. The rest gate judges what was measured. Beyond what was learned the remainder goes back to
// its held level; the prior goes on, as a physical model extrapolates. While a temperature that the
// prior reads is missing, its value stands still and the axis counts as without temperature. Where
// the prior has never had a value yet, its axis learns nothing and has nothing taken off but the
// factory polynomial.
//
// With learning.scale_factor, where a drift is taken off, what the scale factor adds to the rest of
// the rate is taken off with it (scale_factor.h), and its variance is part of the drift's.
//
// Rates are turned into the vehicle's frame where they come in (mounting.h): raw, below, is in b.
//
// Data-path calls are noexcept, take no lock, allocate nothing and do bounded work.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "common/compensation/axis_drift.h"
#include "common/compensation/drift_prior.h"
#include "common/compensation/input_alignment.h"
#include "common/compensation/label_builder.h"
#include "common/compensation/model_schedule.h"
#include "common/compensation/mounting.h"
#include "common/compensation/options.h"
#include "common/compensation/own_output_check.h"
#include "common/compensation/polarity_check.h"
#include "common/compensation/prior_check.h"
#include "common/compensation/reference_inputs.h"
#include "common/compensation/rest_gate.h"
#include "common/compensation/scale_factor.h"
#include "common/compensation/temperature_inputs.h"
#include "common/core/compensated_sample.h"
#include "common/core/samples.h"
#include "common/experts/stack_forecast.h"
#include "common/experts/thermal_basis.h"

namespace zerodrift::compensation {

// Whether the oldest waiting sample can be answered with everything that sensor time says it should
// have.
enum class Readiness : std::uint8_t {
  kNothing,
  kReady,
  kAwaitsTemperature,
  kAwaitsReference,
  kAwaitsModel
};

struct CompensatorCounts {
  std::uint64_t samples_in = 0;
  std::uint64_t samples_out = 0;
  std::uint64_t duplicates = 0;
  std::uint64_t too_old = 0;
  std::uint64_t late = 0;
  // With no axis that can be used, or without one that was there before; a gyro of one or two axes
  // never has the others.
  std::uint64_t invalid = 0;
  core::PerAxis<std::uint64_t> invalid_axes{};  // of each, where they count
  std::uint64_t missing = 0;                    // sequence numbers never seen
  std::uint64_t time_faults =
      0;  // time stamps that did not increase, or jumped and were not confirmed
  std::uint64_t temperatures = 0;
  std::uint64_t labels = 0;             // confirmed
  std::uint64_t labels_skipped = 0;     // the learner's queue was full
  std::uint64_t short_rests = 0;        // the third in turn that ended before a label, and so on
  std::uint64_t late_models = 0;        // answered before the due model was there
  std::uint64_t reversed_axes = 0;      // found to turn the other way round
  std::uint64_t own_outputs = 0;        // axes found to be given what this gives out
  std::uint64_t costly_priors = 0;      // axes whose drift changes less than what the prior leaves
  std::uint64_t unforeseen_starts = 0;  // that stayed elsewhere than what was learned foretold
  ReferenceCounts references{};         // by verdict: when they came, residuals when due

  void carry(core::StateArchive& archive) {
    archive(samples_in, samples_out, duplicates, too_old, late, invalid, missing, time_faults,
            labels, labels_skipped, short_rests, late_models);
  }
};

// What the stack of an axis makes its forecast of.
struct StackState {
  std::array<double, experts::kExperts> shares{};  // by experts::Expert; they sum to 1
  std::optional<double> longest_judged_s{};  // beyond it the stated variance is an extrapolation
};

class Compensator {  // More members than other classes: one for each stage on a sample's way.
 public:
  // Throws std::invalid_argument with one line that names the wrong key.
  explicit Compensator(const CompensationOptions& options);
  ~Compensator();

  // --- data path: one thread
  Admission push(const core::AngularRateSample& sample, std::int64_t publish_time_ns = 0,
                 std::int64_t ingress_time_ns = 0) noexcept;
  void push(const core::TemperatureSample& sample) noexcept { temperatures_.push(sample); }
  void push(const core::RateReferenceSample& sample) noexcept { references_.push(sample); }

  [[nodiscard]] Readiness readiness() noexcept;
  // Sensor time up to which inputs are needed to go on: of the oldest waiting sample, else the
  // newest answered.
  [[nodiscard]] core::SensorTime needed_time() const noexcept;
  // Likewise whose clock stamps it.
  [[nodiscard]] core::ClockSource waiting_clock() const noexcept {
    return waiting_.empty() ? clock_ : waiting_.front().sample.clock;
  }
  // Answers the oldest waiting sample with what is there. Only when readiness() is not kNothing.
  core::CompensatedSample answer_next() noexcept;
  // The label that the sample answered last confirmed, if it did: what is learned from, whatever
  // the scheme.
  [[nodiscard]] const Label* confirmed_label() const noexcept {
    return label_confirmed_ ? &confirmed_label_ : nullptr;
  }
  // Stops waiting for streams that fell silent, until they speak again. For records that are all
  // there: live, that somebody is silent says nothing.
  void give_up_waiting() noexcept;
  // Whoever published them left, so that nobody waits for more; who publishes them next begins
  // anew. `probe` is one of probes().
  void end_temperature(std::size_t probe) noexcept { temperatures_.end(probe); }
  void end_references(core::ReferenceKind kind) noexcept { references_.end(kind); }
  // Nothing is published but the temperatures of the probes named, separated by commas: a probe
  // that is not among them and never came isn't waited for.
  void limit_probes(std::string_view published) noexcept { temperatures_.limit(published); }
  [[nodiscard]] const std::vector<std::string>& probes() const noexcept {
    return temperatures_.probes();
  }

  // The source started anew: sequence numbers and time may go back. Models are kept, histories are
  // not; inputs of publishers that have not left may already be of the new run, and are kept.
  // Samples still waiting are answered as late ones.
  void restart_stream() noexcept;
  void freeze() noexcept { commanded_freeze_ = true; }
  void learn() noexcept { commanded_freeze_ = false; }
  [[nodiscard]] bool is_commanded_to_freeze() const noexcept { return commanded_freeze_; }
  // Forgets everything learned. False: the learner's queue is full.
  bool reset_models() noexcept;
  // Puts a saved learner in the learner's place: in force as soon as the learner has answered,
  // after the models already due; given before the first sample, from that one on. False: the
  // learner's queue is full.
  bool restore_models(std::shared_ptr<RestoredLearner> restored) noexcept;
  // Makes another prior the one in force, with its learner, as restore_models() does with a
  // learner: both take effect with the same sample, from which on the model epoch is a new one.
  // Axes that neither prior has effects of keep what they learned. Labels not yet learned are
  // dropped. False: the learner's queue is full.
  bool change_prior(std::shared_ptr<PriorChange> change) noexcept;
  // The streams are over: learns what was confirmed and is not yet due. Only where one thread is
  // data path and learner.
  void finish_learning() noexcept;

  [[nodiscard]] CompensatorCounts counts() const noexcept;
  // By probe.
  [[nodiscard]] const std::vector<RefusedReadings>& refused_temperatures() const noexcept {
    return temperatures_.refused_by_probe();
  }
  [[nodiscard]] const TestThenTrain& test_then_train(core::Axis axis) const noexcept {
    return axes_[core::index(axis)].record();
  }
  [[nodiscard]] RestState rest_state() const noexcept { return gate_.state(); }
  // Whether a sample of the axis could ever be used.
  [[nodiscard]] const core::PerAxis<bool>& measured() const noexcept { return measured_; }
  // Its sign is the opposite of what its reference or the Earth says; nothing is learned from it.
  [[nodiscard]] bool is_reversed(core::Axis axis) const noexcept {
    return polarity_.is_reversed(axis);
  }
  // What is taken off comes back in it: it is given what this gives out.
  [[nodiscard]] bool is_given_own_output(core::Axis axis) const noexcept {
    return own_output_.is_own(axis);
  }
  // What is known of the axis's scale factor at the present temperature; nothing where it isn't
  // learned.
  [[nodiscard]] std::optional<ScaleFactorState> scale_factor(core::Axis axis) const noexcept;
  // Newest temperature and its rate of the first probe, NaN where there is none.
  [[nodiscard]] double temperature_degc() const noexcept { return temperatures_.first_degc(); }
  [[nodiscard]] double temperature_rate_degc_per_s() const noexcept {
    return temperatures_.first_rate_degc_per_s();
  }
  [[nodiscard]] std::size_t support_vectors(core::Axis axis) const noexcept;
  // Where the model in force has learned; null where there is none.
  [[nodiscard]] const ThermalCoverage* coverage(core::Axis axis) const noexcept;
  // Of the axis's experts at the present age of its newest label; nothing where the stack isn't the
  // scheme or knows nothing yet.
  [[nodiscard]] std::optional<StackState> stack_state(core::Axis axis) const noexcept;

  // --- its state, for another compensator of the same options that is to go on to the bit
  // No sample waits and no model is due: the learner's newest model is the one in force.
  [[nodiscard]] bool is_quiescent() const noexcept {
    return waiting_.empty() && models_.is_quiescent();
  }
  // The job whose model is in force once it is quiescent.
  [[nodiscard]] std::uint64_t newest_job() const noexcept { return models_.newest_job(); }
  // The data path's part, only while it is quiescent; to be read by one whose learner was restored
  // to the state after newest_job() (Learner::export_state) and that has seen no input.
  void carry(core::StateArchive& archive);
  // Part of the state already: not to be pushed again where inputs are repeated after it.
  [[nodiscard]] bool has_received(const core::TemperatureSample& sample) const noexcept {
    return temperatures_.has_received(sample);
  }
  [[nodiscard]] bool has_received(const core::RateReferenceSample& sample) const noexcept {
    return references_.has_received(sample);
  }
  // Sensor time by which the model due first is late; 0 where none is.
  [[nodiscard]] core::SensorTime model_late_by() noexcept { return models_.late_by(newest_); }

  // --- learner: one other thread, or the same one between samples
  Learner& learner() noexcept { return models_.learner(); }

 private:
  struct Pending {
    core::AngularRateSample sample;
    std::int64_t publish_time_ns = 0;
    std::int64_t ingress_time_ns = 0;
    bool late = false;
  };
  // The axis was measured, with a number that a gyro may have.
  [[nodiscard]] static bool is_usable(const core::AngularRateSample& sample,
                                      std::size_t axis) noexcept;
  [[nodiscard]] bool is_timely(const core::AngularRateSample& sample) const noexcept;
  void restart_histories() noexcept;
  void take_model(core::SensorTime now) noexcept;
  void bring_into_force(PriorChange& change) noexcept;
  void step_prior(core::SensorTime now) noexcept;
  [[nodiscard]] bool prior_covers(core::Axis axis) const noexcept {
    return prior_ && prior_->covers(axis);
  }
  // Its value of an axis; nothing where there is none.
  [[nodiscard]] std::optional<double> prior_drift(core::Axis axis) const noexcept;
  void observe(const core::AngularRateSample& sample) noexcept;
  void take_true_rate(const core::AngularRateSample& sample,
                      const core::RateReferenceSample& reference) noexcept;
  void close_scale_block(core::SensorTime now) noexcept;
  // By which the scale factor goes; nothing where there is none.
  [[nodiscard]] std::optional<double> scale_temperature_degc() const noexcept;
  void take_scale_error_off(core::Axis axis, core::CompensatedSample& out) const noexcept;
  void take_residual(core::SensorTime now) noexcept;
  // Whether the Earth's rate is neither known on an axis nor small against the noise.
  [[nodiscard]] bool earth_rate_matters() const noexcept;
  void close_block(DriftBlock block) noexcept;
  void end_of_rest() noexcept;
  void learn_from(const Label& label) noexcept;
  void estimate(core::SensorTime now) noexcept;
  [[nodiscard]] const AxisModel* active_model(core::Axis axis) const noexcept;
  [[nodiscard]] std::optional<double> factory_drift(core::Axis axis) const noexcept;
  [[nodiscard]] core::Reason gate_reason() const noexcept;
  [[nodiscard]] ExpectedLevels expected_levels() const noexcept;
  [[nodiscard]] EarthRateMode earth_rate_mode(core::ClockSource clock) const noexcept;
  [[nodiscard]] core::CompensatedSample answer(const Pending& pending) const noexcept;

  CompensationOptions options_;
  core::SensorTime handover_;
  thermal::FeatureBuilder features_;
  TemperatureInputs temperatures_;
  ReferenceInputs references_;

  Mounting mounting_;
  SequenceWindow sequences_;
  core::RingBuffer<Pending> waiting_;

  BlockAverager blocks_;
  RestGate gate_;
  PolarityCheck polarity_;
  OwnOutputCheck own_output_;
  PriorCheck prior_check_;
  ScaleFactor scale_;
  LabelBuilder labels_;
  std::unique_ptr<DriftPrior> prior_;            // null: none
  core::SensorTime stream_began_{core::kNever};  // taken for the time of power-on
  std::uint64_t streams_ = 0;                    // how often one began anew
  std::size_t changes_due_ = 0;                  // of the prior
  core::PerAxis<AxisDrift> axes_;
  Label confirmed_label_;
  bool label_confirmed_ = false;

  ModelSchedule models_;

  CompensatorCounts counts_;
  core::SensorTime newest_{core::kNever};
  core::SensorTime doubted_{
      core::kNever};  // a stamp that jumped; believed if the next sample follows it
  core::ClockSource clock_ = core::ClockSource::kUnknown;
  core::PerAxis<bool> referenced_{};  // the newest sample had a reference
  core::PerAxis<bool> uncovered_{};   // a sample of the block had none
  core::PerAxis<bool> measured_{};
  bool estimate_outdated_ = true;
  bool commanded_freeze_ = false;
};

}  // namespace zerodrift::compensation
