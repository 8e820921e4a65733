// SPDX-License-Identifier: Apache-2.0
#include "common/compensation/compensator.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "common/core/integer_time.h"
#include "common/navigation/earth_rate.h"

namespace zerodrift::compensation {

using core::index;
using core::kAxes;

namespace {

constexpr std::size_t kWaiting = 4096;  // raw samples; publishers of records keep far below it
constexpr std::size_t kTemperaturesWaiting = 4096;
constexpr std::size_t kDue = 64;
constexpr double kBlockS = 1.0;
constexpr double kSlowestIntervalS = 86400.0;  // of a record that is still a stream
// Above this true rate a scale-factor error of 100 ppm passes for .036 deg/h of drift: not learned
// from.
constexpr double kLargestReferenceRadps = 0.1 * core::kRadPerDeg;
// Time that goes back further is no disorder but a clock that was set back.
constexpr core::SensorTime kLargestStepBack{500'000'000};
constexpr double kLargestRateRadps =
    1e3;  // 57 000 deg/s: no gyro measures that, the number is corrupt
constexpr double kLargestTemperatureDegc = 1e6;  // nor any thermometer that
constexpr double kReturnToSafeS =
    10.0;  // time constant of the return to the stationary bias out of domain
constexpr double kMseGain = 1.0 / 12.0;  // memory of 12 labels
constexpr double kMovedDegc = 1.0;       // a probe counts as moving past this

bool is_usable(const core::AngularRateSample& sample, std::size_t axis) {
  return sample.valid[axis] &&
         std::abs(sample.rate_radps[axis]) <= kLargestRateRadps;  // false for NaN
}

std::size_t checked_probe_count(const CompensationOptions& options) {
  if (auto line = options.validate()) throw std::invalid_argument(*line);
  return options.probes().size();
}

thermal::FeatureBuilderOptions builder_options(const CompensationOptions& options) {
  return {.features = options.features, .max_temperature_age_s = options.temperature_stale_s};
}

}  // namespace

PriorChange::PriorChange(const CompensationOptions& options,
                         const std::optional<twin::Model>& model)
    : learner(std::make_shared<RestoredLearner>(options)) {
  if (model) prior = std::make_unique<DriftPrior>(*model, options.probes());
}

// As the features that the compensator's regression has: of the first temperature and of the first
// rate.
Compensator::ThermalInput::ThermalInput(const CompensationOptions& options,
                                        const std::vector<std::string>& probes) {
  const auto first = [&](thermal::FeatureKind kind) {
    return std::find_if(options.features.begin(), options.features.end(),
                        [&](const auto& feature) { return feature.kind == kind; });
  };
  const auto scale_of = [&](thermal::FeatureKind kind) {
    const auto found = first(kind);
    const auto scale = found == options.features.end() ? std::nullopt : found->scale;
    return scale.value_or(thermal::default_scale(kind));
  };
  temperature_scale_degc = scale_of(thermal::FeatureKind::kTemperature);
  rate_scale_degc_per_s = scale_of(thermal::FeatureKind::kTemperatureRate);
  const auto temperature = first(thermal::FeatureKind::kTemperature);
  if (probes.empty()) return;
  probe = 0;
  if (temperature == options.features.end()) return;
  probe = static_cast<std::size_t>(std::find(probes.begin(), probes.end(), temperature->probe) -
                                   probes.begin());
}

Compensator::Compensator(const CompensationOptions& options)
    : options_(options),
      probes_(options.probes()),
      temperature_delay_(core::from_seconds(options.temperature_delay_s)),
      handover_(core::from_seconds(options.learning.handover_s)),
      features_(builder_options(options), probes_),
      thermal_input_(options, probes_),
      waiting_(kWaiting),
      temperatures_(checked_probe_count(options), kTemperaturesWaiting),
      references_(kWaiting),
      rests_(kWaiting),
      residuals_(kWaiting),
      correction_(options.reference),
      blocks_(kBlockS),
      gate_(options.learning.rest),
      labels_(options.learning.label_interval_s, options.learning.confirm_s),
      readings_(probes_.size()),
      exchange_(options),
      learner_(options, exchange_),
      due_(kDue) {
  thermal::TemperatureTrackOptions track = options.track;
  track.history_span_s = std::max(track.history_span_s, features_.longest_lag_s() + 60.0);
  for (std::size_t i = 0; i < probes_.size(); ++i) tracks_.emplace_back(track);
  if (options.prior) prior_ = std::make_unique<DriftPrior>(*options.prior, probes_);
  if (options.reference.await_feedback) rests_.expect();
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
    waiting_.push({sample, publish_time_ns, ingress_time_ns, admission == Admission::kLate});
    temperatures_.note_rate();
  }
  return admission;
}

void Compensator::push(const core::TemperatureSample& sample) noexcept {
  const auto probe = std::find(probes_.begin(), probes_.end(), sample.probe);
  if (probe == probes_.end()) return;
  ++counts_.temperatures;
  const bool usable =
      sample.measured && std::abs(sample.temperature_degc) <= kLargestTemperatureDegc;
  const bool timely = core::is_usable(sample.time);
  if (!timely || (sample.measured && !usable)) ++counts_.temperatures_refused;
  if (!timely) return;
  temperatures_.push({static_cast<std::size_t>(probe - probes_.begin()), sample.time,
                      usable ? sample.temperature_degc : 0.0, usable});
}

void Compensator::push(const core::RateReferenceSample& sample) noexcept {
  core::RateReferenceSample reference = sample;
  const ReferenceVerdict verdict = screen(options_.reference, reference);
  const bool is_residual = sample.kind == core::ReferenceKind::kNavigationResidual;
  // A residual that can be used is judged, and counted, when it is due.
  if (!is_residual || verdict != ReferenceVerdict::kTaken) count(verdict);
  if (verdict == ReferenceVerdict::kUnknownKind || verdict == ReferenceVerdict::kNotAccepted ||
      verdict == ReferenceVerdict::kTimeUnusable) {
    return;
  }
  references_of(sample.kind).push(reference);
}

ReferenceQueue& Compensator::references_of(core::ReferenceKind kind) noexcept {
  if (kind == core::ReferenceKind::kNavigationResidual) return residuals_;
  return kind == core::ReferenceKind::kRest ? rests_ : references_;
}

Readiness Compensator::readiness() noexcept {
  if (waiting_.empty()) return Readiness::kNothing;
  const Pending& next = waiting_.front();
  if (next.late || !is_timely(next.sample)) return Readiness::kReady;
  const core::SensorTime time = next.sample.time;
  if (!temperatures_.complete_to(time - temperature_delay_)) return Readiness::kAwaitsTemperature;
  if (!references_.complete_to(time) || !feedback_complete(next.sample))
    return Readiness::kAwaitsReference;
  if (!due_.empty() && due_.front().time <= time && !exchange_.delivered(due_.front().job)) {
    return Readiness::kAwaitsModel;
  }
  return Readiness::kReady;
}

core::SensorTime Compensator::needed_time() const noexcept {
  return waiting_.empty() ? newest_ : waiting_.front().sample.time;
}

void Compensator::give_up_waiting() noexcept {
  if (waiting_.empty()) return;
  temperatures_.give_up_waiting(waiting_.front().sample.time - temperature_delay_);
  references_.give_up_waiting();
  rests_.give_up_waiting();
}

void Compensator::limit_probes(std::string_view published) noexcept {
  const auto is_named = [published](std::string_view probe) {
    for (std::string_view left = published; !left.empty();) {
      const std::size_t comma = std::min(left.find(','), left.size());
      if (left.substr(0, comma) == probe) return true;
      left.remove_prefix(std::min(comma + 1, left.size()));
    }
    return false;
  };
  for (std::size_t p = 0; p < probes_.size(); ++p) {
    if (temperatures_.spoken_to(p) == core::kNever && !is_named(probes_[p])) temperatures_.end(p);
  }
}

void Compensator::restart_stream() noexcept {
  sequences_.restart();
  for (std::size_t i = 0; i < waiting_.size(); ++i) waiting_[i].late = true;
  temperatures_.restart_ended();
  references_.restart_ended();
  rests_.restart_ended();
  residuals_.restart_ended();
  restart_histories();
}

// Of what was, not of what waits.
void Compensator::restart_histories() noexcept {
  correction_.restart();
  if (options_.reference.await_feedback) rests_.expect();
  referenced_ = uncovered_ = {};
  for (auto& track : tracks_) track.reset();
  thermal_.restart();
  blocks_.restart();
  gate_.restart();
  labels_.discard();
  if (prior_) prior_->restart();
  stream_began_ = core::kNever;
  ++streams_;
  for (auto& axis : axes_) axis.safe_time = core::kNever;
  for (std::size_t i = 0; i < due_.size(); ++i) due_[i].time = core::kNever;  // due at once
  newest_ = doubted_ = core::kNever;
  estimate_outdated_ = true;
}

bool Compensator::reset_models() noexcept {
  TrainingJob job{.number = jobs_ + 1, .kind = TrainingJob::Kind::kReset, .label = {}};
  if (due_.full() || !exchange_.submit(job)) return false;
  ++jobs_;
  due_.push({.time = newest_, .job = jobs_});
  axes_ = {};
  labels_.discard();
  estimate_outdated_ = true;
  return true;
}

bool Compensator::restore_models(std::shared_ptr<RestoredLearner> restored) noexcept {
  TrainingJob job{.number = jobs_ + 1,
                  .kind = TrainingJob::Kind::kRestore,
                  .label = {},
                  .restored = std::move(restored)};
  if (due_.full() || !exchange_.submit(job)) return false;
  ++jobs_;
  due_.push({.time = newest_, .job = jobs_});
  for (auto& axis : axes_) axis.record = {};  // of the model before
  labels_.discard();                          // predicted by the model before
  estimate_outdated_ = true;
  return true;
}

bool Compensator::change_prior(std::shared_ptr<PriorChange> change) noexcept {
  change->in_force = false;
  for (const auto axis : kAxes) {
    const bool had = changes_due_ > 0 || (prior_ && prior_->covers(axis));
    change->learner->exchanged[index(axis)] = had || (change->prior && change->prior->covers(axis));
  }
  change->learner->installed_as = RestoredLearner::kNotYet;
  TrainingJob job{.number = jobs_ + 1,
                  .kind = TrainingJob::Kind::kExchange,
                  .label = {},
                  .restored = change->learner};
  if (due_.full() || !exchange_.submit(job)) return false;
  ++jobs_;
  due_.push({.time = newest_, .job = jobs_, .change = std::move(change)});
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
  labels_.discard();
  --changes_due_;
  change.in_force = true;
}

void Compensator::finish_learning() noexcept {
  while (!due_.empty()) {
    if (!exchange_.delivered(due_.front().job) && !learner_.run_one()) return;
    activate_next();
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
      rests_.restart();
      residuals_.restart();
      restart_histories();
    }
    newest_ = sample.time;
    if (stream_began_ == core::kNever) stream_began_ = newest_;
    doubted_ = core::kNever;
    clock_ = sample.clock;
    take_temperatures(sample.time - temperature_delay_);
    take_models(sample.time);
    observe(sample);
    if (prior_) step_prior(sample.time);
    if (estimate_outdated_) estimate(sample.time);
    if (options_.reference.navigation_residual == ReferencePolicy::kAccept)
      hear_residual(sample.time);
  }
  ++counts_.samples_out;
  return answer(pending);
}

// A stamp that jumps by more than kLargestStep forward, or kLargestStepBack back, and three
// intervals, is believed when a second sample follows it.
bool Compensator::is_timely(const core::AngularRateSample& sample) const noexcept {
  if (!core::is_usable(sample.time)) return false;
  if (newest_ == core::kNever) return true;
  const bool slow = sample.interval_s > 0.0 && sample.interval_s < kSlowestIntervalS;
  const core::SensorTime slowest = core::from_seconds(slow ? 3.0 * sample.interval_s : 0.0);
  const core::SensorTime largest = std::max(kLargestStep, slowest);
  const core::SensorTime step = sample.time - newest_;
  if (step >= -std::max(kLargestStepBack, slowest) && step <= largest)
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
  const ModelSnapshot* model = exchange_.active();
  out.model_epoch = model ? model->epoch : 0;
  for (const auto axis : kAxes) {
    const std::size_t i = index(axis);
    const AxisState& state = axes_[i];
    const bool usable = is_usable(sample, i);
    out.applied_drift_radps[i] = usable ? state.applied_radps : 0.0;
    const double correction = correction_.correction_radps(i);
    if (usable && correction != 0.0) out.applied_drift_radps[i] += correction;
    out.rate_radps[i] = sample.rate_radps[i] - out.applied_drift_radps[i];
    out.drift_variance[i] = usable ? state.variance : -1.0;
    out.sensor_variance[i] = gate_.state() != RestState::kInitial && gate_.knows(axis)
                                 ? gate_.sample_variance(axis)
                                 : -1.0;
    out.mode[i] = usable ? state.mode : core::Mode::kPassthrough;
    out.reason[i] = usable ? state.reason : core::Reason::kInvalidInput;
    out.rung[i] = usable ? state.rung : core::Rung::kNone;
  }
  return out;
}

void Compensator::take_temperatures(core::SensorTime until) noexcept {
  while (const auto reading = temperatures_.pop_until(until)) {
    core::TemperatureSample sample;
    sample.time = reading->time;
    sample.temperature_degc = reading->temperature_degc;
    sample.measured = reading->measured;
    const auto verdict = tracks_[reading->probe].add(sample);
    if (verdict == thermal::ReadingVerdict::kAccepted) {
      estimate_outdated_ = true;
      if (reading->probe == thermal_input_.probe) {
        thermal_.advance(core::seconds(reading->time),
                         reading->temperature_degc / thermal_input_.temperature_scale_degc,
                         tracks_[reading->probe].rate_degc_per_s().value_or(0.0) /
                             thermal_input_.rate_scale_degc_per_s);
      }
    } else if (reading->measured) {
      ++counts_.temperatures_refused;
    }
  }
}

// One a sample, even if several are due: readiness() asks for one, and the learner can't have more
// than three ready.
void Compensator::take_models(core::SensorTime now) noexcept {
  if (due_.empty() || due_.front().time > now) return;
  if (!exchange_.delivered(due_.front().job)) {
    if (!due_.front().counted_late) ++counts_.late_models;
    due_.front().counted_late = true;
    return;
  }
  activate_next();
  estimate_outdated_ = true;
}

void Compensator::activate_next() noexcept {
  exchange_.activate_next();
  if (due_.front().change) bring_into_force(*due_.front().change);
  due_.front().change.reset();  // the queue keeps what was popped: nothing may live on in it
  due_.pop();
}

void Compensator::step_prior(core::SensorTime now) noexcept {
  if (!prior_->is_due(now)) return;
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    readings_[i] = {};
    const auto age = tracks_[i].age(now);
    if (!age || *age > core::from_seconds(options_.temperature_stale_s)) continue;
    readings_[i].temperature_degc = tracks_[i].newest()->temperature_degc;
    if (const auto rate = tracks_[i].rate_degc_per_s()) readings_[i].rate_degc_per_s = *rate;
  }
  core::PerAxis<PriorStatus> before{};
  for (const auto axis : kAxes) before[index(axis)] = prior_->status(axis);
  prior_->step(now, stream_began_, readings_);
  for (const auto axis : kAxes) follow_prior(axis, before[index(axis)]);
}

// The remainder's estimate stays as it is: estimates are made at the same samples as without a
// prior, unless the prior comes or goes.
void Compensator::follow_prior(core::Axis axis, PriorStatus before) noexcept {
  AxisState& state = axes_[index(axis)];
  const auto drift_radps = prior_->covers(axis) ? prior_->drift_radps(axis) : std::nullopt;
  if (state.on_prior != drift_radps.has_value() || prior_->status(axis) != before)
    estimate_outdated_ = true;
  if (!state.on_prior || !drift_radps || !state.adds_prior) return;
  const double change = *drift_radps - state.context.prior_radps;
  state.context.prior_radps = *drift_radps;
  state.applied_radps = state.remainder_radps + *drift_radps;
  if (state.context.applied_radps) state.context.applied_radps = state.applied_radps;
  if (state.context.held_radps) *state.context.held_radps += change;
}

// --------------------------------------------------------------------------------------- observing

EarthRateMode Compensator::earth_rate_mode(core::ClockSource clock) const noexcept {
  if (options_.earth_rate.mode != EarthRateMode::kAuto) return options_.earth_rate.mode;
  return core::is_paced_by_consumers(clock) ? EarthRateMode::kIncluded : EarthRateMode::kUnknown;
}

void Compensator::observe(const core::AngularRateSample& sample) noexcept {
  const auto closed = blocks_.advance(sample.time, sample.interval_s);
  if (closed) {
    estimate_outdated_ = true;  // ages grow even when no temperature comes
    close_block(*closed);
  }
  const core::RateReferenceSample* reference = references_.at(sample.time, kOldestReference);
  // Who declares rest may be wrong, so the level is still looked at; a true rate explains any
  // level.
  if (reference != nullptr) blocks_.mark_reference();
  if (reference == nullptr) reference = rest_reference(sample);
  referenced_ = {};
  const bool earth_known = earth_rate_mode(sample.clock) == EarthRateMode::kKnown;
  bool any_invalid = false;
  for (const auto axis : kAxes) {
    const std::size_t i = index(axis);
    referenced_[i] = reference != nullptr && reference->valid[i];
    if (!is_usable(sample, i)) {
      any_invalid = true;
      continue;
    }
    uncovered_[i] = uncovered_[i] || !referenced_[i];
    if (sample.clipped[i]) {
      blocks_.mark_turning();  // a saturated axis says nothing of its drift
      continue;
    }
    double known_radps = 0.0;
    double variance = 0.0;
    if (referenced_[i]) {
      known_radps = reference->rate_radps[i];
      variance = reference->variance[i];
      if (std::abs(known_radps) > kLargestReferenceRadps) blocks_.mark_turning();
    } else if (earth_known) {
      known_radps = options_.earth_rate.rate_radps[i];
    }
    blocks_.add(axis, sample.rate_radps[i] - known_radps, variance);
  }
  if (any_invalid) ++counts_.invalid;
}

bool Compensator::feedback_complete(const core::AngularRateSample& sample) const noexcept {
  // A filter of a slower gyro can't have answered by then.
  if (!(sample.interval_s <= 0.5 * core::seconds(kFeedbackDelay))) return true;
  if (stream_began_ == core::kNever || sample.time - kFeedbackDelay < stream_began_) return true;
  return rests_.complete_to(sample.time - kFeedbackDelay);
}

const core::RateReferenceSample* Compensator::rest_reference(
    const core::AngularRateSample& sample) noexcept {
  const core::RateReferenceSample* rest =
      rests_.at(sample.time - kFeedbackDelay, kOldestReference - kFeedbackDelay);
  if (rest == nullptr || rest->valid == core::PerAxis<bool>{}) return nullptr;
  if (earth_rate_mode(sample.clock) != EarthRateMode::kIncluded) return rest;
  if (rest->time != refused_rest_) count(ReferenceVerdict::kEarthRateIncluded);
  refused_rest_ = rest->time;
  return nullptr;
}

void Compensator::hear_residual(core::SensorTime now) noexcept {
  const ModelSnapshot* model = exchange_.active();
  correction_.note_epoch(now, model ? model->epoch : 0);
  const core::RateReferenceSample* residual =
      residuals_.at(now - kFeedbackDelay, kOldestReference - kFeedbackDelay);
  if (residual != nullptr && residual->valid != core::PerAxis<bool>{} &&
      residual->time != heard_residual_) {
    heard_residual_ = residual->time;
    core::PerAxis<OwnForecast> forecast;
    for (std::size_t i = 0; i < forecast.size(); ++i)
      forecast[i] = {axes_[i].applied_radps, axes_[i].variance};
    count(correction_.hear(*residual, gate_.state() == RestState::kRest, forecast));
  }
  correction_.step(now);
}

void Compensator::close_block(DriftBlock block) noexcept {
  const core::PerAxis<bool> uncovered = uncovered_;
  uncovered_ = {};
  const bool measured = block.count != core::PerAxis<std::size_t>{};
  if (!measured && !blocks_.turning()) return;
  const RestState state = blocks_.turning() ? gate_.motion() : gate_.add(block);
  if (state != RestState::kRest || gate_reason() != core::Reason::kNone) {
    labels_.discard();
    return;
  }
  if (earth_rate_matters()) {
    for (const auto axis : kAxes) {
      if (uncovered[index(axis)]) block.count[index(axis)] = 0;
    }
    if (block.count == core::PerAxis<std::size_t>{}) {
      labels_.discard();
      return;
    }
  }
  core::PerAxis<AxisContext> context;
  core::PerAxis<double> variance;
  for (const auto axis : kAxes) {
    const double sigma = gate_.block_sigma(axis);
    context[index(axis)] = axes_[index(axis)].context;
    variance[index(axis)] = sigma * sigma;
    if (!gate_.knows(axis)) block.count[index(axis)] = 0;  // its motion would go unnoticed
    // What the prior leaves can't be told without it.
    const bool needs_prior = prior_ && prior_->covers(axis);
    if (needs_prior && !context[index(axis)].prior_ready) block.count[index(axis)] = 0;
  }
  if (const auto label = labels_.add(block, context, thermal_.state(), variance))
    learn_from(*label);
}

void Compensator::learn_from(const Label& label) noexcept {
  ++counts_.labels;
  confirmed_label_ = label;
  label_confirmed_ = true;
  for (const auto axis : kAxes) {
    const std::size_t i = index(axis);
    if (!label.valid[i]) continue;
    judge(axes_[i], label, i);
  }
  if (options_.scheme == Scheme::kNone || changes_due_ > 0) return;
  TrainingJob job{.number = jobs_ + 1, .kind = TrainingJob::Kind::kLabel, .label = label};
  if (due_.full() || !exchange_.submit(job)) {
    ++counts_.labels_skipped;
    return;
  }
  ++jobs_;
  due_.push({.time = newest_ + handover_, .job = jobs_});
}

// Test-then-train: the label judges what was predicted for its time before it was known.
void Compensator::judge(AxisState& axis, const Label& label, std::size_t i) noexcept {
  if (!label.applied_radps[i] || !label.held_radps[i]) return;
  const double applied_error = label.drift_radps[i] - *label.applied_radps[i];
  const double held_error = label.drift_radps[i] - *label.held_radps[i];
  TestThenTrain& record = axis.record;
  ++record.labels;
  const double gain = std::max(kMseGain, 1.0 / static_cast<double>(record.labels));
  record.applied_mse += gain * (applied_error * applied_error - record.applied_mse);
  record.held_mse += gain * (held_error * held_error - record.held_mse);
}

// -------------------------------------------------------------------------------------- estimating

core::Reason Compensator::gate_reason() const noexcept {
  if (commanded_freeze_) return core::Reason::kCommanded;
  switch (gate_.state()) {
    case RestState::kInitial:
      return core::Reason::kNoEstimateYet;
    case RestState::kMotion:
      return core::Reason::kMotion;
    case RestState::kLevelImplausible:
      return core::Reason::kLevelImplausible;
    case RestState::kSettling:
      return core::Reason::kSettling;
    case RestState::kRest:
      break;
  }
  return core::Reason::kNone;
}

// Unknown, Earth rate is an error of up to 15 deg/h in every label: only a gyro noisier than that
// may learn without a reference.
bool Compensator::earth_rate_matters() const noexcept {
  if (earth_rate_mode(clock_) != EarthRateMode::kUnknown) return false;
  return !std::all_of(kAxes.begin(), kAxes.end(), [&](core::Axis axis) {
    return gate_.block_sigma(axis) > navigation::kUnknownAttitudeSigmaRadps;
  });
}

bool Compensator::a_probe_is_stuck(core::SensorTime now) const noexcept {
  const core::SensorTime limit = core::from_seconds(options_.probe_stuck_s);
  for (const auto& track : tracks_) {
    const auto unchanged = track.unchanged_for(now);
    if (!unchanged || *unchanged < limit) continue;
    const bool another_moved =
        std::any_of(tracks_.begin(), tracks_.end(), [&](const thermal::TemperatureTrack& other) {
          const auto then = other.temperature_degc_at(now - limit);
          return then && other.newest() &&
                 std::abs(other.newest()->temperature_degc - *then) > kMovedDegc;
        });
    if (another_moved) return true;
  }
  return false;
}

core::Reason Compensator::input_reason(thermal::FeatureStatus status,
                                       core::SensorTime now) const noexcept {
  switch (status) {
    case thermal::FeatureStatus::kReady:
      return a_probe_is_stuck(now) ? core::Reason::kProbeStuck : core::Reason::kNone;
    case thermal::FeatureStatus::kNoTemperature:
      return core::Reason::kTemperatureMissing;
    case thermal::FeatureStatus::kTemperatureStale:
      return core::Reason::kTemperatureStale;
    default:
      return core::Reason::kRateNotReady;
  }
}

void Compensator::estimate(core::SensorTime now) noexcept {
  estimate_outdated_ = false;
  const core::Reason common = gate_reason();
  const bool earth_matters = earth_rate_matters();
  for (const auto axis : kAxes) {
    AxisState& state = axes_[index(axis)];
    const bool is_blind = earth_matters && !referenced_[index(axis)];
    const core::Reason gate =
        common == core::Reason::kNone && is_blind ? core::Reason::kEarthRateUnknown : common;
    thermal::PulseTerms pulse;
    if (const AxisModel* model = active_model(axis)) {
      pulse = {.mean_radps = model->drift.held_radps,
               .slope_radps2 = model->drift.held_slope_radps2};
    }
    const thermal::FeatureVector vector = features_.build(now, tracks_, pulse);
    note_prior(axis);
    core::Reason input = input_reason(vector.status, now);
    if (input == core::Reason::kNone) input = prior_reason(axis);
    state.context.features_ready = input == core::Reason::kNone;
    state.context.features = vector.values;
    estimate_axis(axis, now, gate, input);
  }
}

void Compensator::note_prior(core::Axis axis) noexcept {
  AxisState& state = axes_[index(axis)];
  const bool covered = prior_ && prior_->covers(axis);
  const auto drift_radps = covered ? prior_->drift_radps(axis) : std::nullopt;
  state.on_prior = drift_radps.has_value();
  state.context.prior_ready = state.on_prior;
  state.context.prior_radps = drift_radps.value_or(0.0);
}

// Why the prior of an axis has no value, or one that stands still.
core::Reason Compensator::prior_reason(core::Axis axis) const noexcept {
  if (!prior_ || !prior_->covers(axis)) return core::Reason::kNone;
  switch (prior_->status(axis)) {
    case PriorStatus::kReady:
      return core::Reason::kNone;
    case PriorStatus::kRateNotReady:
      return core::Reason::kRateNotReady;
    case PriorStatus::kTemperatureMissing:
      break;
  }
  return prior_->drift_radps(axis) ? core::Reason::kTemperatureStale
                                   : core::Reason::kTemperatureMissing;
}

// The model of an axis with at least one label, if there is one.
const AxisModel* Compensator::active_model(core::Axis axis) const noexcept {
  const ModelSnapshot* snapshot = exchange_.active();
  if (snapshot == nullptr || !snapshot->axes[index(axis)].drift.holds()) return nullptr;
  return &snapshot->axes[index(axis)];
}

void Compensator::estimate_axis(core::Axis axis, core::SensorTime now, core::Reason gate,
                                core::Reason input) noexcept {
  AxisState& state = axes_[index(axis)];
  state.context.applied_radps.reset();
  state.context.held_radps.reset();
  if (options_.scheme == Scheme::kNone) {
    return apply(state, core::Rung::kNone, core::Mode::kPassthrough, core::Reason::kSchemeNone, 0.0,
                 -1.0);
  }
  const AxisModel* model = active_model(axis);
  // What a learner knows of the remainder is no drift without the prior.
  const bool lacks_prior = prior_ && prior_->covers(axis) && !state.on_prior;
  if (model == nullptr || lacks_prior) return apply_without_labels(axis, gate, input);
  if (forecasts(*model) && input == core::Reason::kNone) {
    apply_forecast(state, *model, now, gate);
  } else {
    const core::Reason reason = input == core::Reason::kNone ? core::Reason::kInitialSet : input;
    apply(state, core::Rung::kStationaryBias, core::Mode::kFallback, reason,
          model->drift.held_radps, held_variance(model->drift, model->trust, now));
  }
  state.context.applied_radps = state.applied_radps;
  state.context.held_radps = model->drift.held_radps;
  if (state.on_prior) *state.context.held_radps += state.context.prior_radps;
}

// More than the last stationary minute.
bool Compensator::forecasts(const AxisModel& model) const noexcept {
  return options_.scheme == Scheme::kStack ? model.stack.knows() : model.drift.trained;
}

void Compensator::apply_forecast(AxisState& axis, const AxisModel& model, core::SensorTime now,
                                 core::Reason gate) noexcept {
  const bool is_stack = options_.scheme == Scheme::kStack;
  const Forecast made = is_stack
                            ? stack_forecast(model, axis.context.features, thermal_.state(), now)
                            : forecast(model.drift, model.trust, axis.context.features, now);
  if (made.kind == ForecastKind::kModel || made.kind == ForecastKind::kStack) {
    const core::Rung rung = is_stack ? core::Rung::kStack : core::Rung::kOnlineSvr;
    axis.safe_radps = made.drift_radps;
    axis.safe_time = now;
    if (made.beyond_learned) {
      return apply(axis, rung, core::Mode::kOutOfDomain, core::Reason::kOutsideLearned,
                   made.drift_radps, made.variance);
    }
    const core::Mode mode =
        gate == core::Reason::kNone ? core::Mode::kLearning : core::Mode::kFrozen;
    return apply(axis, rung, mode, gate, made.drift_radps, made.variance);
  }
  // Back to the last stationary minute, without a jump.
  double drift = made.drift_radps;
  if (axis.safe_radps && axis.safe_time != core::kNever) {
    const double weight = std::exp(-core::seconds(now - axis.safe_time) / kReturnToSafeS);
    drift += weight * (*axis.safe_radps - drift);
  }
  const bool beyond = made.kind == ForecastKind::kBeyond;
  apply(axis, core::Rung::kStationaryBias,
        beyond ? core::Mode::kOutOfDomain : core::Mode::kFallback,
        beyond ? core::Reason::kOutsideLearned : core::Reason::kModelWorseThanBias, drift,
        made.variance);
}

void Compensator::apply_without_labels(core::Axis axis, core::Reason gate,
                                       core::Reason input) noexcept {
  AxisState& state = axes_[index(axis)];
  const bool temperature_bad = input == core::Reason::kTemperatureMissing ||
                               input == core::Reason::kTemperatureStale ||
                               input == core::Reason::kProbeStuck;
  if (state.on_prior) {
    return apply(state, core::Rung::kPrior, core::Mode::kFallback,
                 temperature_bad ? input : core::Reason::kNoEstimateYet, 0.0, -1.0);
  }
  const auto factory = temperature_bad ? std::nullopt : factory_drift(axis);
  if (factory) {
    return apply(state, core::Rung::kFactoryPolynomial, core::Mode::kFallback,
                 core::Reason::kNoEstimateYet, *factory, -1.0);
  }
  const bool lacks_prior = prior_ && prior_->covers(axis);
  const core::Reason idle = temperature_bad || lacks_prior ? input : core::Reason::kNoEstimateYet;
  const bool is_idle = gate == core::Reason::kNone || lacks_prior;
  apply(state, core::Rung::kNone, core::Mode::kPassthrough, is_idle ? idle : gate, 0.0, -1.0);
}

// `drift_radps`: with a prior, what it leaves; except on the rungs below it.
void Compensator::apply(AxisState& axis, core::Rung rung, core::Mode mode, core::Reason reason,
                        double drift_radps, double variance) noexcept {
  axis.adds_prior =
      axis.on_prior && rung != core::Rung::kNone && rung != core::Rung::kFactoryPolynomial;
  axis.rung = rung;
  axis.mode = mode;
  axis.reason = reason;
  axis.remainder_radps = drift_radps;
  axis.applied_radps = axis.adds_prior ? drift_radps + axis.context.prior_radps : drift_radps;
  axis.variance = variance;
}

std::optional<double> Compensator::factory_drift(core::Axis axis) const noexcept {
  const auto& coefficients = options_.factory_polynomial_radps[index(axis)];
  if (coefficients.empty() || tracks_.empty() || !tracks_.front().newest()) return std::nullopt;
  const double temperature_degc = tracks_.front().newest()->temperature_degc;
  double drift = 0.0;
  for (auto c = coefficients.rbegin(); c != coefficients.rend(); ++c)
    drift = drift * temperature_degc + *c;
  return drift;
}

// ------------------------------------------------------------------------------------------- state

void Compensator::carry(core::StateArchive& archive) {
  archive(sequences_, temperatures_, references_, rests_, residuals_, correction_, blocks_, gate_,
          labels_);
  if (prior_) archive(*prior_);
  for (auto& track : tracks_) archive(track);
  archive(thermal_);
  archive(stream_began_, streams_, axes_, counts_, newest_, doubted_, clock_, referenced_,
          uncovered_, refused_rest_, heard_residual_, estimate_outdated_, commanded_freeze_);
}

bool Compensator::has_heard(const core::TemperatureSample& sample) const noexcept {
  const auto probe = std::find(probes_.begin(), probes_.end(), sample.probe);
  if (probe == probes_.end()) return true;
  return sample.time <= temperatures_.spoken_to(static_cast<std::size_t>(probe - probes_.begin()));
}

bool Compensator::has_heard(const core::RateReferenceSample& sample) const noexcept {
  if (sample.kind == core::ReferenceKind::kNavigationResidual)
    return sample.time <= residuals_.spoken_to();
  if (sample.kind == core::ReferenceKind::kRest) return sample.time <= rests_.spoken_to();
  return sample.time <= references_.spoken_to();
}

core::SensorTime Compensator::model_late_by() noexcept {
  if (due_.empty() || due_.front().time == core::kNever || newest_ <= due_.front().time ||
      exchange_.delivered(due_.front().job)) {
    return core::SensorTime{0};
  }
  return newest_ - due_.front().time;
}

// ----------------------------------------------------------------------------------------- telling

CompensatorCounts Compensator::counts() const noexcept {
  CompensatorCounts counts = counts_;
  counts.missing = sequences_.missing();
  return counts;
}

double Compensator::temperature_degc() const noexcept {
  if (tracks_.empty() || !tracks_.front().newest()) return std::numeric_limits<double>::quiet_NaN();
  return tracks_.front().newest()->temperature_degc;
}

double Compensator::temperature_rate_degc_per_s() const noexcept {
  if (tracks_.empty()) return std::numeric_limits<double>::quiet_NaN();
  return tracks_.front().rate_degc_per_s().value_or(std::numeric_limits<double>::quiet_NaN());
}

std::size_t Compensator::support_vectors(core::Axis axis) const noexcept {
  const AxisModel* model = active_model(axis);
  return model && model->drift.trained ? model->drift.predictor.support_size() : 0;
}

std::optional<StackState> Compensator::stack_state(core::Axis axis) const noexcept {
  const AxisModel* model = active_model(axis);
  if (model == nullptr || !model->stack.knows()) return std::nullopt;
  const bool interpolates =
      model->drift.trained && axes_[index(axis)].mode != core::Mode::kOutOfDomain;
  return StackState{model->stack.shares(core::seconds(newest_) - model->stack.time_s, interpolates),
                    model->stack.longest_judged_s()};
}

}  // namespace zerodrift::compensation
