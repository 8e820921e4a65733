// SPDX-License-Identifier: Apache-2.0
#include "common/compensation/compensator.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "common/core/integer_time.h"
#include "common/navigation/earth_rate.h"

namespace zerodrift::compensation {

using core::index;
using core::kAxes;

namespace {

constexpr std::size_t kWaiting = 4096;  // raw samples; publishers of records keep far below it
constexpr double kBlockS = 1.0;
constexpr double kSlowestIntervalS = 86400.0;  // of a record that is still a stream

// A label interval that is still open gets its usual value.
CompensationOptions checked(const CompensationOptions& options) {
  if (auto line = options.validate()) throw std::invalid_argument(*line);
  return options.for_samples_every(0.0);
}

core::SensorTime three_intervals(const core::AngularRateSample& sample) noexcept {
  const bool slow = sample.interval_s > 0.0 && sample.interval_s < kSlowestIntervalS;
  return core::from_seconds(slow ? 3.0 * sample.interval_s : 0.0);
}

// Forward, of a stamp that needs no second one to be believed.
core::SensorTime largest_step(const core::AngularRateSample& sample) noexcept {
  return std::max(core::kLargestStep, three_intervals(sample));
}

thermal::FeatureBuilderOptions builder_options(const CompensationOptions& options) {
  return {.features = options.features, .max_temperature_age_s = options.temperature_stale_s};
}

}  // namespace

Compensator::Compensator(const CompensationOptions& options)
    : options_(checked(options)),
      handover_(core::from_seconds(options_.learning.handover_s)),
      features_(builder_options(options_), options_.probes()),
      temperatures_(options_, features_.longest_lag_s()),
      references_(options_.reference),
      mounting_(options_.mounting),
      waiting_(kWaiting),
      blocks_(kBlockS),
      gate_(options_.learning.rest),
      polarity_(options_.learning.rest.max_level_radps),
      scale_(options_.learning.rest),
      labels_(options_.learning.label_interval_s, options_.learning.confirm_s),
      models_(options_) {
  if (options_.prior) prior_ = std::make_unique<DriftPrior>(*options_.prior, probes());
}

Compensator::~Compensator() = default;

// --------------------------------------------------------------------------------------- taking in

Admission Compensator::push(const core::AngularRateSample& sample, std::int64_t publish_time_ns,
                            std::int64_t ingress_time_ns) noexcept {
  if (waiting_.full()) return Admission::kQueueFull;
  const Admission admission = sequences_.admit(sample.sequence);
  ++counts_.samples_in;
  if (admission == Admission::kDuplicate) ++counts_.duplicates;
  if (admission == Admission::kTooOld) ++counts_.too_old;
  if (admission == Admission::kLate) ++counts_.late;
  if (admission == Admission::kInOrder || admission == Admission::kLate) {
    waiting_.push(
        {mounting_.in_b(sample), publish_time_ns, ingress_time_ns, admission == Admission::kLate});
    temperatures_.note_rate();
  }
  return admission;
}

Readiness Compensator::readiness() noexcept {
  if (waiting_.empty()) return Readiness::kNothing;
  const Pending& next = waiting_.front();
  if (next.late || !is_timely(next.sample)) return Readiness::kReady;
  const core::SensorTime time = next.sample.time;
  if (!temperatures_.complete_for(time)) return Readiness::kAwaitsTemperature;
  if (!references_.complete_for(next.sample, stream_began_)) return Readiness::kAwaitsReference;
  if (models_.is_awaited(time)) return Readiness::kAwaitsModel;
  return Readiness::kReady;
}

core::SensorTime Compensator::needed_time() const noexcept {
  return waiting_.empty() ? newest_ : waiting_.front().sample.time;
}

void Compensator::give_up_waiting() noexcept {
  if (waiting_.empty()) return;
  temperatures_.give_up_waiting(waiting_.front().sample.time);
  references_.give_up_waiting();
}

void Compensator::restart_stream() noexcept {
  sequences_.restart();
  for (std::size_t i = 0; i < waiting_.size(); ++i) waiting_[i].late = true;
  temperatures_.restart_ended();
  references_.restart_ended();
  restart_histories();
}

// Of what was, not of what waits.
void Compensator::restart_histories() noexcept {
  temperatures_.forget_time();
  references_.forget_time();
  referenced_ = uncovered_ = {};
  blocks_.restart();
  gate_.restart();
  polarity_.restart();
  own_output_.restart();
  prior_check_.restart();
  scale_.restart();
  labels_.discard();
  if (prior_) prior_->restart();
  stream_began_ = core::kNever;
  ++streams_;
  for (auto& axis : axes_) axis.forget_time();
  models_.forget_time();
  newest_ = doubted_ = core::kNever;
  estimate_outdated_ = true;
}

bool Compensator::reset_models() noexcept {
  if (!models_.submit({.kind = TrainingJob::Kind::kReset, .label = {}}, newest_)) return false;
  axes_ = {};
  polarity_ = PolarityCheck(options_.learning.rest.max_level_radps);
  own_output_ = {};
  scale_ = ScaleFactor(options_.learning.rest);
  labels_.discard();
  estimate_outdated_ = true;
  return true;
}

bool Compensator::restore_models(std::shared_ptr<RestoredLearner> restored) noexcept {
  if (!models_.submit(
          {.kind = TrainingJob::Kind::kRestore, .label = {}, .restored = std::move(restored)},
          newest_)) {
    return false;
  }
  for (auto& axis : axes_) axis.forget_record();  // of the model before
  labels_.discard();                              // predicted by the model before
  estimate_outdated_ = true;
  return true;
}

bool Compensator::change_prior(std::shared_ptr<PriorChange> change) noexcept {
  change->in_force = false;
  for (const auto axis : kAxes) {
    const bool had = changes_due_ > 0 || prior_covers(axis);
    change->learner->exchanged[index(axis)] = had || (change->prior && change->prior->covers(axis));
  }
  change->learner->installed_as = RestoredLearner::kNotYet;
  TrainingJob job{.kind = TrainingJob::Kind::kExchange, .label = {}, .restored = change->learner};
  if (!models_.submit(std::move(job), newest_, std::move(change))) return false;
  ++changes_due_;
  labels_.discard();  // measured against the prior before
  return true;
}

// All that was derived from the prior before is void.
void Compensator::bring_into_force(PriorChange& change) noexcept {
  prior_.swap(change.prior);
  if (prior_ && change.stream != streams_) prior_->restart();
  change.stream = streams_;
  for (const auto axis : kAxes) {
    if (change.learner->exchanged[index(axis)]) axes_[index(axis)] = {};
  }
  prior_check_ = {};
  labels_.discard();
  --changes_due_;
  change.in_force = true;
}

void Compensator::finish_learning() noexcept {
  while (const auto step = models_.finish_next()) {
    if (step->change) bring_into_force(*step->change);
  }
  estimate_outdated_ = true;
}

// --------------------------------------------------------------------------------------- answering

core::CompensatedSample Compensator::answer_next() noexcept {
  label_confirmed_ = false;
  Pending pending = waiting_.front();
  waiting_.pop();
  const core::AngularRateSample& sample = pending.sample;
  if (!pending.late && !is_timely(sample)) {
    ++counts_.time_faults;
    doubted_ = core::is_usable(sample.time) ? sample.time : core::kNever;
    pending.late = true;  // answered with the drift in force; moves nothing forward
  }
  if (!pending.late) {
    if (newest_ != core::kNever && sample.time < newest_) {  // the clock was set back
      temperatures_.restart();
      references_.restart();
      restart_histories();
    } else if (newest_ != core::kNever && sample.time - newest_ > largest_step(sample)) {
      gate_.skip(sample.time - newest_);  // the clock was set forward
      labels_.discard();
    }
    newest_ = sample.time;
    if (stream_began_ == core::kNever) stream_began_ = newest_;
    doubted_ = core::kNever;
    clock_ = sample.clock;
    if (temperatures_.take_for(sample.time)) estimate_outdated_ = true;
    take_model(sample.time);
    observe(sample);
    if (prior_) step_prior(sample.time);
    if (estimate_outdated_) estimate(sample.time);
    take_residual(sample.time);
  }
  ++counts_.samples_out;
  return answer(pending);
}

// A stamp that jumps by more than core::kLargestStep forward, or core::kLargestStepBack back,
// and three intervals, is believed when a second sample follows it.
bool Compensator::is_timely(const core::AngularRateSample& sample) const noexcept {
  if (!core::is_usable(sample.time)) return false;
  if (newest_ == core::kNever) return true;
  const core::SensorTime largest = largest_step(sample);
  const core::SensorTime step = sample.time - newest_;
  if (step >= -std::max(core::kLargestStepBack, three_intervals(sample)) && step <= largest)
    return step > core::SensorTime{0};
  const core::SensorTime since_doubted = core::saturating_difference(sample.time, doubted_);
  return since_doubted > core::SensorTime{0} && since_doubted <= largest;
}

core::CompensatedSample Compensator::answer(const Pending& pending) const noexcept {
  const core::AngularRateSample& sample = pending.sample;
  core::CompensatedSample out;
  out.raw = sample;
  out.late = pending.late;
  out.publish_time_ns = pending.publish_time_ns;
  out.ingress_time_ns = pending.ingress_time_ns;
  out.model_epoch = models_.epoch();
  for (const auto axis : kAxes) {
    const std::size_t i = index(axis);
    const AxisDrift& drift = axes_[i];
    const bool usable = is_usable(sample, i);
    out.raw.valid[i] = usable;
    out.applied_drift_radps[i] = usable ? drift.applied_radps() : 0.0;
    const double correction = references_.correction_radps(i);
    if (usable && correction != 0.0) out.applied_drift_radps[i] += correction;
    out.rate_radps[i] = sample.rate_radps[i] - out.applied_drift_radps[i];
    out.drift_variance[i] = usable ? drift.variance() : -1.0;
    out.sensor_variance[i] = gate_.knows(axis) ? gate_.sample_variance(axis) : -1.0;
    out.mode[i] = usable ? drift.mode() : core::Mode::kPassthrough;
    out.reason[i] = usable ? drift.reason() : core::Reason::kInvalidInput;
    out.rung[i] = usable ? drift.rung() : core::Rung::kNone;
    if (options_.learning.scale_factor && out.rung[i] != core::Rung::kNone)
      take_scale_error_off(axis, out);
  }
  return out;
}

std::optional<double> Compensator::scale_temperature_degc() const noexcept {
  const double temperature_degc = temperatures_.first_degc();
  return std::isnan(temperature_degc) ? std::nullopt : std::optional(temperature_degc);
}

void Compensator::take_scale_error_off(core::Axis axis,
                                       core::CompensatedSample& out) const noexcept {
  const std::size_t i = index(axis);
  const auto temperature_degc = scale_temperature_degc();
  const double rate_radps = out.rate_radps[i];
  out.applied_drift_radps[i] += scale_.error_radps(axis, rate_radps, temperature_degc);
  out.rate_radps[i] = out.raw.rate_radps[i] - out.applied_drift_radps[i];
  if (out.drift_variance[i] >= 0.0)
    out.drift_variance[i] += scale_.variance_radps2(axis, rate_radps, temperature_degc);
}

void Compensator::take_model(core::SensorTime now) noexcept {
  const ModelSchedule::Step step = models_.step(now);
  if (step.is_late) ++counts_.late_models;
  if (step.change) bring_into_force(*step.change);
  if (step.in_force) estimate_outdated_ = true;
}

void Compensator::step_prior(core::SensorTime now) noexcept {
  if (!prior_->is_due(now)) return;
  core::PerAxis<PriorStatus> before{};
  for (const auto axis : kAxes) before[index(axis)] = prior_->status(axis);
  prior_->step(now, stream_began_, temperatures_.readings(now));
  // Estimates are made at the same samples as without a prior, unless it comes or goes.
  for (const auto axis : kAxes) {
    const bool stays = axes_[index(axis)].follow_prior(prior_drift(axis));
    if (!stays || prior_->status(axis) != before[index(axis)]) estimate_outdated_ = true;
  }
}

std::optional<double> Compensator::prior_drift(core::Axis axis) const noexcept {
  return prior_covers(axis) ? prior_->drift_radps(axis) : std::nullopt;
}

// -------------------------------------------------------------------------------------- estimating

core::Reason Compensator::gate_reason() const noexcept {
  return commanded_freeze_ ? core::Reason::kCommanded : reason_of(gate_.state());
}

// Unknown, Earth rate is an error of up to 15 deg/h in every label: only a gyro noisier than that
// may learn without a reference.
bool Compensator::earth_rate_matters() const noexcept {
  if (earth_rate_mode(clock_) != EarthRateMode::kUnknown) return false;
  return !std::all_of(kAxes.begin(), kAxes.end(), [&](core::Axis axis) {
    return gate_.block_sigma(axis) > navigation::kUnknownAttitudeSigmaRadps;
  });
}

void Compensator::estimate(core::SensorTime now) noexcept {
  estimate_outdated_ = false;
  const core::Reason common = gate_reason();
  const bool earth_matters = earth_rate_matters();
  for (const auto axis : kAxes) {
    AxisDrift& drift = axes_[index(axis)];
    const bool is_blind = earth_matters && !referenced_[index(axis)];
    AxisInputs inputs{.now = now,
                      .model = active_model(axis),
                      .thermal = &temperatures_.thermal_state(),
                      .gate = common == core::Reason::kNone && is_blind
                                  ? core::Reason::kEarthRateUnknown
                                  : common,
                      .prior_covers = prior_covers(axis),
                      .factory_radps = factory_drift(axis)};
    thermal::PulseTerms pulse;
    if (inputs.model != nullptr) {
      pulse = {.mean_radps = inputs.model->drift.held_radps,
               .slope_radps2 = inputs.model->drift.held_slope_radps2};
    }
    const thermal::FeatureVector vector = features_.build(now, temperatures_.tracks(), pulse);
    inputs.features = &vector.values;
    if (polarity_.is_reversed(axis)) inputs.gate = core::Reason::kPolarityReversed;
    drift.note_prior(prior_drift(axis));
    inputs.input = temperatures_.reason(vector.status, now);
    if (inputs.input == core::Reason::kNone)
      inputs.input = prior_covers(axis) ? prior_->reason(axis) : core::Reason::kNone;
    drift.estimate(options_.scheme, inputs);
  }
}

// The model of an axis with at least one label, if there is one.
const AxisModel* Compensator::active_model(core::Axis axis) const noexcept {
  const ModelSnapshot* snapshot = models_.active();
  if (snapshot == nullptr || !snapshot->axes[index(axis)].drift.holds()) return nullptr;
  return &snapshot->axes[index(axis)];
}

std::optional<double> Compensator::factory_drift(core::Axis axis) const noexcept {
  const auto& coefficients = options_.factory_polynomial_radps[index(axis)];
  const double temperature_degc = temperatures_.first_degc();
  if (coefficients.empty() || std::isnan(temperature_degc)) return std::nullopt;
  double drift = 0.0;
  for (auto c = coefficients.rbegin(); c != coefficients.rend(); ++c)
    drift = drift * temperature_degc + *c;
  return drift;
}

// -------------------------------------------------------------------------------- state, telling

void Compensator::carry(core::StateArchive& archive) {
  archive(sequences_, temperatures_, references_, blocks_, gate_, polarity_, own_output_, labels_);
  if (options_.learning.scale_factor) archive(scale_);
  if (prior_) archive(*prior_, prior_check_);
  archive(stream_began_, streams_, axes_, counts_, newest_, doubted_, clock_, referenced_,
          uncovered_, measured_, estimate_outdated_, commanded_freeze_);
}

CompensatorCounts Compensator::counts() const noexcept {
  CompensatorCounts counts = counts_;
  counts.missing = sequences_.missing();
  counts.temperatures = temperatures_.received();
  counts.references = references_.counts();
  counts.reversed_axes = polarity_.found();
  counts.own_outputs = own_output_.found();
  counts.costly_priors = prior_check_.found();
  counts.unforeseen_starts = gate_.unforeseen_starts();
  return counts;
}

std::optional<ScaleFactorState> Compensator::scale_factor(core::Axis axis) const noexcept {
  if (!options_.learning.scale_factor) return std::nullopt;
  return scale_.state(axis, scale_temperature_degc());
}

std::size_t Compensator::support_vectors(core::Axis axis) const noexcept {
  const AxisModel* model = active_model(axis);
  return model && model->drift.trained ? model->drift.predictor.support_size() : 0;
}

const ThermalCoverage* Compensator::coverage(core::Axis axis) const noexcept {
  const AxisModel* model = active_model(axis);
  return model == nullptr ? nullptr : &model->coverage;
}

std::optional<StackState> Compensator::stack_state(core::Axis axis) const noexcept {
  const AxisModel* model = active_model(axis);
  if (model == nullptr) return std::nullopt;
  const AxisDrift& drift = axes_[index(axis)];
  const bool by_time =
      drift.rung() == core::Rung::kStack && core::lacks_temperature(drift.reason());
  const experts::StackForecast& stack = by_time ? model->in_time : model->stack;
  if (!stack.knows()) return std::nullopt;
  std::optional<experts::SvrForecast> by_svr;
  if (!by_time && model->drift.trained) {
    const bool is_beyond = drift.mode() == core::Mode::kOutOfDomain;
    by_svr = {.interpolates = !is_beyond,
              .holds = !is_in_force(model->drift, model->trust, is_beyond, newest_)};
  }
  return StackState{stack.shares(model->stack_time_s(newest_) - stack.time_s, by_svr),
                    stack.longest_judged_s()};
}

}  // namespace zerodrift::compensation
