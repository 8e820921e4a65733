// SPDX-License-Identifier: Apache-2.0
#include "common/compensation/learner.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <stdexcept>
#include <string_view>

#include "common/experts/thermal_basis.h"
#include "common/regression/vector_operations.h"

namespace zerodrift::compensation {

using core::index;
using core::kAxes;

namespace {

// Features are scaled to some units each: a narrower kernel would see every label alone.
constexpr double kNarrowestGamma = 1.0;
constexpr double kScaleInSigmas = 100.0;
constexpr double kSmallestWeight = 1e-4;
constexpr int kFinishRounds = 8;
constexpr int kRelearnRounds = 64;  // of all samples together, at another kernel
constexpr double kSmallestScaleRadps =
    1e-10;  // 2e-5 deg/h: keeps a noise-free record from dividing by zero
constexpr double kStationaryMinuteS = 60.0;
constexpr double kSecondsPerMinute = 60.0;
constexpr std::size_t kLabelsInAMinute = 64;
constexpr double kLabelsThatSettle = 12.0;  // the mean of a minute is taken to be no better
constexpr double kShortestHorizonS = 8.0;   // of labels of 5 s, learned 6 s after their end
constexpr double kHorizonInLabels = 1.6;
// The kernel is chosen when there are so many labels, then whenever their number has doubled, and
// from then on every kRarestSelection.
constexpr std::uint64_t kFirstSelection = 36;
constexpr std::uint64_t kRarestSelection = 2304;
constexpr double kTubeInNoise = 0.5;  // half-width of the tube in standard deviations of the noise
constexpr std::size_t kSelectionSamples = 48;  // a selection takes some 10 ms

// Whether the gyro may have been off since the last label, which had features or not: the clock was
// set back; or after a pause there is no history of temperature yet where there was one, or the
// longest memory of heat has passed. Its bias is learned anew then; what is known of temperature is
// not.
bool begins_anew(const AxisLabel& label, const DriftModel& before, bool had_features) {
  if (!before.holds()) return false;
  const double pause_s = core::seconds(label.time - before.time);
  if (pause_s <= 0.0) return true;
  if (pause_s <= kStationaryMinuteS) return false;
  return pause_s > experts::kMemoryTimesS.back() || (!label.features && had_features);
}

regression::OnlineSvrOptions svr_options(const CompensationOptions& options,
                                         std::size_t dimension) {
  regression::OnlineSvrOptions svr;
  svr.dimension = dimension;
  svr.capacity = options.model.capacity;
  svr.kernel = options.model.kernel;
  svr.epsilon = options.model.epsilon;
  svr.box_constraint = options.model.box_constraint;
  svr.window = options.model.window;
  svr.recent_capacity = options.model.capacity / 2;
  return svr;
}

}  // namespace

AxisLearner::AxisLearner(const CompensationOptions& options, std::size_t dimension)
    : svr_options_(svr_options(options, dimension)),
      initial_labels_(std::max<std::size_t>(1, options.learning.initial_labels)),
      settling_labels_(std::clamp(kStationaryMinuteS / options.learning.label_interval_s, 1.0,
                                  kLabelsThatSettle)),
      selection_(options.model.selection),
      svr_(svr_options_),
      next_selection_(kFirstSelection),
      minute_(kLabelsInAMinute),
      model_(dimension, options.model.capacity),
      judge_(std::max(kShortestHorizonS, kHorizonInLabels * options.learning.label_interval_s),
             dimension, options.model.capacity) {
  initial_.reserve(initial_labels_);
  if (options.scheme == Scheme::kStack) stack_.emplace(dimension, options.model.capacity);
  if (!options.probes().empty()) scales_.emplace(options);
}

void AxisLearner::learn(const AxisLabel& label) noexcept {
  const bool had_features = !minute_.empty() && minute_.back().label.features.has_value();
  if (begins_anew(label, model_, had_features)) {
    minute_.clear();
    judge_.restart();
    if (stack_) stack_->restart();
  }
  // The stack is given what the SVR says of the label before that learns it.
  if (stack_) stack_->learn(label);
  std::size_t slot = regression::SampleWindow::kNoSlot;
  const bool is_added = label.features && model_.trained;
  if (label.features) {
    if (is_added) {
      judge_.judge({label.time, label.drift_radps, label.variance, *label.features});
      slot = add(label);
    } else {
      initial_.push_back(label);
      if (initial_.size() == initial_labels_) begin();
    }
  }
  if (label.features && scales_) {
    coverage_.note(label.thermal.temperature * scales_->temperature_degc,
                   label.thermal.rate * scales_->rate_degc_per_s * kSecondsPerMinute);
  }
  hold(label, slot);
  // Behind hold(): with another SVR all slots are void.
  if (is_added && selection_ && labels_ >= next_selection_) reselect_kernel();
  update_model();
  if (!model_.trained) return;
  judge_.keep(model_);
  if (stack_ && label.features) stack_->keep(model_, judge_.trust());
}

void AxisLearner::begin() noexcept {
  double drift = 0.0;
  double variance = 0.0;
  for (const auto& label : initial_) {
    drift += label.drift_radps;
    variance += label.variance;
  }
  const auto n = static_cast<double>(initial_.size());
  model_.offset_radps = drift / n;
  model_.scale_radps = std::max(kScaleInSigmas * std::sqrt(variance / n), kSmallestScaleRadps);
  model_.trained = true;
  for (const auto& label : initial_) add(label);
  initial_.clear();
}

// Where the SVR keeps the label.
std::size_t AxisLearner::add(const AxisLabel& label) noexcept {
  const std::span x(label.features->data(), svr_options_.dimension);
  const double y = (label.drift_radps - model_.offset_radps) / model_.scale_radps;
  // A label less certain than those of the initial set pulls less.
  const double sigma = model_.scale_radps / kScaleInSigmas;
  const double weight =
      label.variance > 0.0 ? std::clamp(sigma * sigma / label.variance, kSmallestWeight, 1.0) : 1.0;
  auto report = svr_.add(x, y, weight);
  // A label in some seconds leaves time to finish what an event budget cut short; the bound keeps
  // one job bounded.
  for (int round = 0; round < kFinishRounds && !svr_.has_finished(); ++round) svr_.finish_pending();
  if (report.outcome == regression::UpdateOutcome::kBusy) report = svr_.add(x, y, weight);
  ++labels_;
  return report.slot;
}

// The samples of the window judge the kernel; if another one is materially better, the SVR learns
// them anew with it, in their order.
void AxisLearner::reselect_kernel() {
  next_selection_ = std::min(2 * next_selection_, next_selection_ + kRarestSelection);
  const std::vector<std::size_t> slots = svr_.slots_by_arrival();
  const std::size_t dimension = svr_options_.dimension;
  const std::size_t stride = regression::padded(slots.size());
  std::vector<double> features(dimension * stride, 0.0);
  std::vector<double> targets;
  for (std::size_t i = 0; i < slots.size(); ++i) {
    for (std::size_t d = 0; d < dimension; ++d)
      features[d * stride + i] = svr_.feature(slots[i], d);
    targets.push_back(svr_.target(slots[i]));
  }
  regression::KernelSelectionOptions options;
  options.criterion = *selection_;
  options.label_noise = 1.0 / kScaleInSigmas;
  options.dictionary_capacity = kSelectionSamples;
  options.gamma_highest = kNarrowestGamma;
  const regression::SampleColumns samples{features.data(), stride, dimension, slots.size()};
  const auto selection =
      regression::select_kernel(options, samples, targets, svr_.options().kernel);
  if (!regression::is_materially_better(options, selection)) return;

  regression::OnlineSvrOptions svr_options = svr_.options();
  svr_options.kernel = selection.best.kernel;
  // What the features don't explain is not for the tube to follow.
  svr_options.epsilon = std::max(svr_options_.epsilon, kTubeInNoise * selection.best.noise_sigma);
  regression::OnlineSvr svr(svr_options);
  int rounds = 0;
  for (std::size_t i = 0; i < slots.size(); ++i) {
    std::array<double, regression::kMaxDimension> x{};
    for (std::size_t d = 0; d < dimension; ++d) x[d] = svr_.feature(slots[i], d);
    svr.add({x.data(), dimension}, targets[i], svr_.weight(slots[i]));
    for (; rounds < kRelearnRounds && !svr.has_finished(); ++rounds) svr.finish_pending();
    if (!svr.has_finished())
      return;  // a kernel that the samples aren't learned with is none to take
  }
  svr_ = std::move(svr);
  for (std::size_t i = 0; i < minute_.size(); ++i)
    minute_[i].slot = regression::SampleWindow::kNoSlot;
}

void AxisLearner::hold(const AxisLabel& label, std::size_t slot) noexcept {
  while (!minute_.empty() &&
         core::seconds(label.time - minute_.front().label.time) >= kStationaryMinuteS) {
    minute_.pop();
  }
  const bool kept = slot != regression::SampleWindow::kNoSlot;
  minute_.push_overwriting({label, slot, kept ? svr_.arrival(slot) : 0});
}

// The model's drift at a held label: from the SVR's own books while it keeps the label.
double AxisLearner::fitted(const HeldLabel& held) const noexcept {
  const bool kept = held.slot != regression::SampleWindow::kNoSlot &&
                    svr_.set_of(held.slot) != regression::SampleSet::kVacant &&
                    svr_.arrival(held.slot) == held.arrival;
  if (!kept) return model_.predict(*held.label.features);
  return model_.offset_radps + model_.scale_radps * svr_.fitted(held.slot);
}

// O(labels of a minute + samples).
void AxisLearner::update_model() noexcept {
  if (model_.trained) {
    model_.predictor.assign(svr_);
    model_.domain.assign(svr_);
  }
  const auto n = static_cast<double>(minute_.size());
  double drift = 0.0;
  double variance = 0.0;
  double predicted = 0.0;
  double labels = 0.0;
  for (std::size_t i = 0; i < minute_.size(); ++i) {
    const HeldLabel& held = minute_[i];
    drift += held.label.drift_radps;
    variance += held.label.variance;
    if (!model_.trained || !held.label.features) continue;
    predicted += fitted(held);
    labels += 1.0;
  }
  const AxisLabel& first = minute_.front().label;
  const AxisLabel& last = minute_.back().label;
  const double gap = model_.predicted_held_radps - model_.held_radps;
  model_.time = last.time;
  model_.held_radps = drift / n;
  model_.held_variance = variance / (n * n);
  note_unsettled();
  model_.held_slope_radps2.reset();
  if (minute_.size() > 1) {
    model_.held_slope_radps2 =
        (last.drift_radps - first.drift_radps) / core::seconds(last.time - first.time);
  }
  if (!model_.trained) return;
  // Without any features in the minute nothing is known of the model there: its gap to what was
  // measured stays as it was.
  model_.predicted_held_radps = labels > 0.0 ? predicted / labels : model_.held_radps + gap;
}

// Of a mean of n labels with variance v each v / n is not known, and v / settling_labels_ of one of
// a whole minute.
void AxisLearner::note_unsettled() noexcept {
  const auto n = static_cast<double>(minute_.size());
  model_.unsettled_variance =
      minute_.empty() ? 0.0 : model_.held_variance * std::max(0.0, 1.0 - n / settling_labels_);
}

void AxisLearner::forget_age() noexcept {
  if (!model_.holds()) return;
  minute_.clear();
  note_unsettled();
  model_.time = core::kLatestUsableTime;
}

void AxisLearner::write(AxisModel& model) const noexcept {
  model.drift = model_;
  model.trust = judge_.trust();
  if (stack_) {
    model.stack = stack_->forecast();
    model.in_time = stack_->forecast_in_time();
  }
  model.coverage = coverage_;
  model.held_thermal = held_thermal();
}

std::optional<experts::ThermalState> AxisLearner::held_thermal() const noexcept {
  experts::ThermalState sum;
  for (std::size_t i = 0; i < minute_.size(); ++i) {
    if (!minute_[i].label.has_temperature()) return std::nullopt;
    sum.add(minute_[i].label.thermal);
  }
  if (minute_.empty()) return std::nullopt;
  return sum.over(static_cast<double>(minute_.size()));
}

void AxisLearner::reset() noexcept {
  model_.time = core::kNever;
  model_.trained = false;
  initial_.clear();
  minute_.clear();
  note_unsettled();
  if (svr_.options() == svr_options_) {
    svr_.clear();
  } else {
    svr_ = regression::OnlineSvr(svr_options_);  // the kernel had been chosen anew
  }
  labels_ = 0;
  next_selection_ = kFirstSelection;
  judge_.reset();
  if (stack_) stack_->reset();
  coverage_.reset();
}

// ------------------------------------------------------------------------------------------- state

void AxisLearner::choose(const ChosenKernel& chosen) {
  regression::OnlineSvrOptions options = svr_options_;
  options.kernel = chosen.kernel;
  options.epsilon = chosen.epsilon;
  if (options == svr_options_) return;
  if (!selection_) throw std::invalid_argument("kernel: expected the one that is configured");
  svr_ = regression::OnlineSvr(options);
}

void AxisLearner::carry(core::StateArchive& archive) {
  archive.list(initial_, initial_labels_);
  archive(svr_, labels_, next_selection_, minute_, judge_, coverage_);
  model_.carry_level(archive);
  require_sense(archive);
  if (stack_) archive(*stack_);
  if (!archive.reads() || !archive.ok()) return;
  note_unsettled();
  if (!model_.trained) return;
  model_.predictor.assign(svr_);
  model_.domain.assign(svr_);
}

// The initial set is there until it is complete; the last minute ends with the model's newest
// label, unless that is of unknown age.
void AxisLearner::require_sense(core::StateArchive& archive) const {
  archive.require(model_.trained ? initial_.empty() : initial_.size() < initial_labels_);
  for (const AxisLabel& label : initial_) archive.require(label.features.has_value());
  core::SensorTime newest = core::kNever;
  for (std::size_t i = 0; i < minute_.size(); ++i) {
    const auto& [label, slot, arrival] = minute_[i];
    archive.require(slot == regression::SampleWindow::kNoSlot ||
                    (label.features && slot < svr_.slot_count()));
    archive.require(label.time > newest);
    newest = label.time;
  }
  const bool is_of_unknown_age = minute_.empty() && model_.time == core::kLatestUsableTime;
  archive.require(newest == model_.time || is_of_unknown_age);
}

namespace {

void carry_all(core::StateArchive& archive, std::uint64_t& labels, std::vector<AxisLearner>& axes) {
  archive(labels);
  for (AxisLearner& axis : axes) archive(axis);
}

}  // namespace

RestoredLearner::RestoredLearner(const CompensationOptions& options) {
  axes.reserve(core::kAxisCount);
  for (std::size_t i = 0; i < core::kAxisCount; ++i)
    axes.emplace_back(options, options.features.size());
}

RestoredLearner::RestoredLearner(const CompensationOptions& options, const LearnerState& state)
    : RestoredLearner(options) {
  if (state.epoch >= kNotYet / 2)
    throw std::invalid_argument("epoch: expected a number that can be counted up");
  epoch = state.epoch;
  for (std::size_t i = 0; i < core::kAxisCount; ++i) axes[i].choose(state.kernels[i]);
  if (state.bytes.empty()) return;
  core::StateArchive archive{std::string_view(state.bytes)};
  carry_all(archive, labels, axes);
  if (!archive.ok() || !archive.at_end())
    throw std::invalid_argument("learner's state: expected one that fits the options");
}

LearnerState Learner::export_state() {
  LearnerState state{.epoch = epoch_};
  for (std::size_t i = 0; i < core::kAxisCount; ++i) state.kernels[i] = axes_[i].kernel();
  core::StateArchive archive(state.bytes);
  std::uint64_t labels = labels_learned();
  carry_all(archive, labels, axes_);
  state.is_whole = archive.ok();
  state.bytes.shrink_to_fit();  // the state is kept: what doubled while it grew is given back
  return state;
}

// ---------------------------------------------------------------------------------- model exchange

ModelExchange::ModelExchange(const CompensationOptions& options) {
  const std::size_t dimension = options.features.size();
  snapshots_.reserve(kSnapshots);
  for (std::size_t i = 0; i < kSnapshots; ++i) {
    const AxisModel model(dimension, options.model.capacity);
    snapshots_.push_back({0, 0, {model, model, model}});
    free_.push(i);
  }
}

bool ModelExchange::delivered(std::uint64_t job) noexcept {
  const std::size_t* slot = ready_.front();
  return slot != nullptr && snapshots_[*slot].job <= job;
}

void ModelExchange::activate_next() noexcept {
  const std::size_t* slot = ready_.front();
  if (slot == nullptr) return;
  if (active_) free_.push(*active_);
  active_ = *slot;
  ready_.pop();
}

ModelSnapshot* ModelExchange::free_snapshot() noexcept {
  const std::size_t* slot = free_.front();
  return slot ? &snapshots_[*slot] : nullptr;
}

void ModelExchange::deliver() noexcept {
  const std::size_t* slot = free_.front();
  if (slot == nullptr) return;
  ready_.push(*slot);
  free_.pop();
}

Learner::Learner(const CompensationOptions& options, ModelExchange& exchange)
    : exchange_(exchange) {
  axes_.reserve(core::kAxisCount);
  for (std::size_t i = 0; i < core::kAxisCount; ++i)
    axes_.emplace_back(options, options.features.size());
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

bool Learner::run_one() noexcept {
  TrainingJob* job = exchange_.next_job();
  if (job == nullptr) return false;
  ModelSnapshot* snapshot = exchange_.free_snapshot();
  if (snapshot == nullptr) return false;
  std::uint64_t epoch = epoch_ + 1;
  if (job->restored) {
    epoch =
        job->kind == TrainingJob::Kind::kExchange ? trade(*job->restored) : install(*job->restored);
  }
  for (const auto axis : kAxes) {
    AxisLearner& learner = axes_[index(axis)];
    const Label& label = job->label;
    const std::size_t i = index(axis);
    if (job->kind == TrainingJob::Kind::kReset) {
      learner.reset();
    } else if (label.valid[i]) {
      AxisLabel own{.time = label.end,
                    .duration_s = core::seconds(label.end - label.begin),
                    .drift_radps = label.drift_radps[i] - label.prior_radps[i],
                    .variance = label.variance_radps2[i]};
      if (label.features_ready[i]) own.features = label.features[i];
      own.thermal = label.thermal;
      learner.learn(own);
    }
    learner.write(snapshot->axes[index(axis)]);
  }
  snapshot->job = job_ = job->number;
  snapshot->epoch = epoch_ = epoch;
  labels_.fetch_add(job->kind == TrainingJob::Kind::kLabel ? 1 : 0, std::memory_order_relaxed);
  exchange_.deliver();
  if (job->restored) {
    job->restored->installed_as = epoch;
    job->restored.reset();
  }
  exchange_.job_done();
  return true;
}

}  // namespace zerodrift::compensation
