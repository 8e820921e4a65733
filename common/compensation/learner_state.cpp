// SPDX-License-Identifier: Apache-2.0
// Saving and restoring a learner. Each function that saves takes its object apart by structured
// bindings that name every member: a member added later does not compile until it is saved too, or
// is said here to follow from the options.
#include "common/compensation/learner_state.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "common/core/integer_time.h"

namespace zerodrift::compensation {
namespace {

constexpr double kLargestRadps = 1e6;     // no gyro measures that: the number is corrupt
constexpr double kLargestFigure = 1e100;  // sums whose products must stay finite
constexpr std::size_t kMostEvents = 100000;
constexpr double kShortestHorizonS = 1.0;
constexpr double kLongestHorizonS = 1e12;  // of labels as long as options allow

void require(bool condition, const char* field, const char* expected) {
  if (condition) return;
  throw std::invalid_argument(std::string("learner state: ") + field + ": expected " + expected);
}

// False for NaN.
bool is_within(double value, double low, double high) {
  return value >= low && value <= high;
}

bool is_rate(double value) {
  return is_within(value, -kLargestRadps, kLargestRadps);
}

bool is_variance(double value) {
  return is_within(value, 0.0, kLargestFigure);
}

void check(const AxisLabel& label, const char* field) {
  require(core::is_usable(label.time), field, "times within 73 years of the epoch");
  require(is_rate(label.drift_radps), field, "drifts within 1e6 rad/s");
  require(is_variance(label.variance), field, "variances that are not negative");
  if (!label.features) return;
  require(std::all_of(label.features->begin(), label.features->end(),
                      [](double x) { return std::abs(x) <= kLargestFigure; }),
          field, "finite features");
}

void check(const DriftModelState& model, const char* field) {
  require(model.time == core::kNever || core::is_usable(model.time), field,
          "a time within 73 years of the epoch");
  require(is_rate(model.held_radps) && is_rate(model.predicted_held_radps) &&
              is_rate(model.offset_radps),
          field, "drifts within 1e6 rad/s");
  require(!model.held_slope_radps2 || std::abs(*model.held_slope_radps2) <= kLargestFigure, field,
          "a finite slope");
  require(is_variance(model.held_variance), field, "a variance that is not negative");
  require(model.scale_radps > 0.0 && model.scale_radps <= kLargestFigure, field, "a scale above 0");
}

DriftModelState state_of(const DriftModel& model) {
  const auto& [time, held, slope, held_variance, predicted_held, trained, offset, scale, predictor,
               domain] = model;
  static_cast<void>(predictor), static_cast<void>(domain);  // with the caller
  return {.time = time,
          .held_radps = held,
          .held_slope_radps2 = slope,
          .held_variance = held_variance,
          .predicted_held_radps = predicted_held,
          .trained = trained,
          .offset_radps = offset,
          .scale_radps = scale};
}

void restore(DriftModel& model, const DriftModelState& state) {
  model.time = state.time;
  model.held_radps = state.held_radps;
  model.held_slope_radps2 = state.held_slope_radps2;
  model.held_variance = state.held_variance;
  model.predicted_held_radps = state.predicted_held_radps;
  model.trained = state.trained;
  model.offset_radps = state.offset_radps;
  model.scale_radps = state.scale_radps;
}

std::optional<KeptModelState> kept_state_of(const DriftModel& model) {
  if (!model.holds()) return std::nullopt;
  return KeptModelState{.drift = state_of(model),
                        .predictor = model.predictor.export_state(),
                        .domain = model.domain.export_samples()};
}

void restore(DriftModel& model, const std::optional<KeptModelState>& state) {
  model.time = core::kNever;
  if (!state) return;
  check(state->drift, "kept model");
  require(state->drift.trained && state->drift.time != core::kNever, "kept model",
          "a trained model with a time");
  restore(model, state->drift);
  model.predictor.restore(state->predictor);
  model.domain.restore(state->domain);
}

void check(const ForecastJudge::Experience& seen) {
  const auto& [windows, error_scale, scale_windows, change_change, change_level, level_level,
               change_error, level_error, forecast_loss, held_loss, model_loss, forecast_square,
               held_square, square_weight, label_variance, weights] = seen;
  for (const double figure :
       {windows, error_scale, scale_windows, change_change, level_level, forecast_loss, held_loss,
        model_loss, forecast_square, held_square, square_weight, label_variance}) {
    require(is_within(figure, 0.0, kLargestFigure), "experience", "sums that are not negative");
  }
  for (const double figure : {change_level, change_error, level_error}) {
    require(std::abs(figure) <= kLargestFigure, "experience", "finite sums");
  }
  require(is_within(weights.change, 0.0, 1.0) && is_within(weights.level, 0.0, 1.0), "experience",
          "weights from 0 to 1");
}

void check(const ForecastTrust& trust) {
  const auto& [weights, forecast_variance, held_variance] = trust;
  require(is_within(weights.change, 0.0, 1.0) && is_within(weights.level, 0.0, 1.0), "trust",
          "weights from 0 to 1");
  for (const double variance : {forecast_variance, held_variance}) {
    require(variance == -1.0 || is_variance(variance), "trust",
            "variances that are not negative, or -1");
  }
}

void check(const TrustTable& table) {
  const auto& [learned, beyond, horizon_s, largest_change_radps] = table;
  for (const auto& trust : learned) check(trust);
  for (const auto& trust : beyond) check(trust);
  double shorter_s = 0.0;
  for (const double horizon : horizon_s) {
    require(is_within(horizon, kShortestHorizonS, kLongestHorizonS) && horizon > shorter_s, "trust",
            "growing horizons of a second or more");
    shorter_s = horizon;
  }
  for (const double change : largest_change_radps) {
    require(is_within(change, 0.0, kLargestFigure), "trust", "changes that are not negative");
  }
}

// What the learner never chooses itself must be as configured; the rest OnlineSvr checks.
void check_svr_options(const regression::OnlineSvrOptions& saved,
                       const regression::OnlineSvrOptions& configured) {
  require(saved.dimension == configured.dimension, "SVR dimension", "the number of features");
  require(saved.capacity == configured.capacity, "SVR capacity", "svr.capacity");
  require(saved.box_constraint == configured.box_constraint, "SVR box", "svr.box_constraint");
  require(saved.kkt_tolerance == configured.kkt_tolerance, "SVR tolerance", "the learner's");
  require(saved.window == configured.window, "SVR window", "svr.window");
  require(saved.recent_capacity == configured.recent_capacity, "SVR window", "half the capacity");
  require(saved.event_budget <= kMostEvents, "SVR event budget", "a bounded one");
}

// The initial set as it stands; afterwards nothing reads it.
void check_initial(const AxisLearnerState& state, std::size_t initial_labels) {
  for (const auto& label : state.initial) {
    check(label, "initial set");
    require(label.features.has_value(), "initial set", "labels with features");
  }
  require(state.model.trained ? state.initial.empty() : state.initial.size() < initial_labels,
          "initial set", "fewer labels than make it complete, none once it is");
}

// The minute's last label is the model's newest.
void check_minute(const AxisLearnerState& state, std::size_t capacity) {
  const auto& minute = state.minute;
  require(minute.size() <= capacity, "last minute", "as many labels as fit");
  for (std::size_t i = 0; i < minute.size(); ++i) {
    check(minute[i].label, "last minute");
    require(i == 0 || minute[i - 1].label.time < minute[i].label.time, "last minute",
            "labels in order of time");
    if (!minute[i].slot) continue;
    require(minute[i].label.features && *minute[i].slot < state.svr.sets.size(), "last minute",
            "slots of the SVR, of labels with features");
  }
  const core::SensorTime newest = minute.empty() ? core::kNever : minute.back().label.time;
  require(newest == state.model.time, "last minute", "the model's newest label at its end");
}

}  // namespace

ForecastJudgeState ForecastJudge::export_state() const {
  const auto& [horizons, table] = *this;
  ForecastJudgeState state;
  state.table = table;
  for (std::size_t k = 0; k < kHorizons; ++k) {
    const auto& [age_s, judged, waiting, learned, beyond, moved_square, moved_weight, aged,
                 last_judged] = horizons[k];
    static_cast<void>(age_s);  // by the options
    state.horizons[k] = {.judged = kept_state_of(judged),
                         .waiting = kept_state_of(waiting),
                         .learned = learned,
                         .beyond = beyond,
                         .moved_square = moved_square,
                         .moved_weight = moved_weight,
                         .aged = aged,
                         .last_judged = last_judged};
  }
  return state;
}

void ForecastJudge::restore(const ForecastJudgeState& state) {
  check(state.table);
  table_ = state.table;
  for (std::size_t k = 0; k < kHorizons; ++k) {
    const HorizonState& saved = state.horizons[k];
    Horizon& horizon = horizons_[k];
    check(saved.learned);
    check(saved.beyond);
    for (const double figure : {saved.moved_square, saved.moved_weight, saved.aged}) {
      require(is_within(figure, 0.0, kLargestFigure), "horizon", "sums that are not negative");
    }
    require(saved.last_judged == core::kNever || core::is_usable(saved.last_judged), "horizon",
            "a time within 73 years of the epoch");
    compensation::restore(horizon.judged, saved.judged);
    compensation::restore(horizon.waiting, saved.waiting);
    horizon.learned = saved.learned;
    horizon.beyond = saved.beyond;
    horizon.moved_square = saved.moved_square;
    horizon.moved_weight = saved.moved_weight;
    horizon.aged = saved.aged;
    horizon.last_judged = saved.last_judged;
  }
}

AxisLearnerState AxisLearner::export_state() const {
  const auto& [svr_options, initial_labels, selection, initial, svr, labels, next_selection, minute,
               model, judge] = *this;
  static_cast<void>(svr_options), static_cast<void>(initial_labels);  // by the options
  static_cast<void>(selection);
  AxisLearnerState state{.svr_options = svr.options(),
                         .svr = svr.export_state(),
                         .labels = labels,
                         .next_selection = next_selection,
                         .model = state_of(model),
                         .judge = judge.export_state()};
  if (!model.trained) state.initial = initial;
  for (std::size_t i = 0; i < minute.size(); ++i) {
    const auto& [label, slot, arrival] = minute[i];
    HeldLabelState held{.label = label, .slot = {}, .arrival = arrival};
    if (slot != regression::SampleWindow::kNoSlot) held.slot = slot;
    state.minute.push_back(held);
  }
  // What is left in a vacant slot decides nothing and doesn't survive a restore.
  for (std::size_t slot = 0; slot < state.svr.sets.size(); ++slot) {
    if (state.svr.sets[slot] == regression::SampleSet::kVacant) state.svr.arrivals[slot] = 0;
  }
  return state;
}

AxisLearner AxisLearner::from_state(const CompensationOptions& options, std::size_t dimension,
                                    const AxisLearnerState& state) {
  AxisLearner learner(options, dimension);
  check(state.model, "model");
  check_initial(state, learner.initial_labels_);
  check_minute(state, learner.minute_.capacity());
  learner.initial_.assign(state.initial.begin(), state.initial.end());
  check_svr_options(state.svr_options, learner.svr_options_);
  learner.svr_ = regression::OnlineSvr::from_state(state.svr_options, state.svr);
  learner.labels_ = state.labels;
  learner.next_selection_ = state.next_selection;
  for (const auto& [label, slot, arrival] : state.minute)
    learner.minute_.push({label, slot.value_or(regression::SampleWindow::kNoSlot), arrival});
  compensation::restore(learner.model_, state.model);
  if (state.model.trained) {
    learner.model_.predictor.assign(learner.svr_);
    learner.model_.domain.assign(learner.svr_);
  }
  learner.judge_.restore(state.judge);
  return learner;
}

core::SensorTime LearnerState::newest_label() const noexcept {
  core::SensorTime newest = core::kNever;
  for (const auto& axis : axes) newest = std::max(newest, axis.model.time);
  return newest;
}

RestoredLearner::RestoredLearner(const CompensationOptions& options) {
  axes.reserve(core::kAxisCount);
  for (std::size_t i = 0; i < core::kAxisCount; ++i)
    axes.emplace_back(options, options.features.size());
}

RestoredLearner::RestoredLearner(const CompensationOptions& options, const LearnerState& state)
    : epoch(state.epoch), labels(state.labels) {
  require(epoch < kNotYet / 2, "epoch", "a number that can be counted up");
  axes.reserve(core::kAxisCount);
  for (const auto& axis : state.axes)
    axes.push_back(AxisLearner::from_state(options, options.features.size(), axis));
}

LearnerState Learner::export_state() const {
  const auto& [exchange, axes, epoch, job, labels] = *this;
  static_cast<void>(exchange);  // what is on its way is not yet known
  LearnerState state;
  for (std::size_t i = 0; i < core::kAxisCount; ++i) state.axes[i] = axes[i].export_state();
  state.epoch = epoch;
  state.labels = labels.load(std::memory_order_relaxed);
  return state;
}

// A learner that has given no model yet goes on from the saved epoch, which is that of the very
// same model; any other never gives an epoch twice.
std::uint64_t Learner::install(RestoredLearner& restored) noexcept {
  axes_.swap(restored.axes);
  labels_.store(restored.labels, std::memory_order_relaxed);
  return std::max(epoch_ == 0 ? 0 : epoch_ + 1, restored.epoch);
}

// The newest epoch goes with neither: both learners count on from it.
std::uint64_t Learner::trade(RestoredLearner& other) noexcept {
  for (std::size_t i = 0; i < core::kAxisCount; ++i) {
    if (other.exchanged[i]) std::swap(axes_[i], other.axes[i]);
  }
  return epoch_ + 1;
}

}  // namespace zerodrift::compensation
