// SPDX-License-Identifier: Apache-2.0
// Longer than other files for one reason: calls, events and sets of one algorithm, whose invariants
// hold only between its steps.
#include "common/regression/online_svr.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>

#include "common/core/require.h"
#include "common/regression/vector_operations.h"

namespace zerodrift::regression {
namespace {

constexpr std::size_t kNoSlot = SampleWindow::kNoSlot;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// In units of the bound on KKT violations: half-width of the targets' jitter, and the difference
// below which residuals count as equal. The first is far below the bound, the second is far below
// the first, and rounding is below both.
constexpr double kJitter = 1e-4;
constexpr double kResolution = 1e-5;
// Margin residual, in the same unit, from which the margin is recentred.
constexpr double kOffMargin = 1e-2;
// A row for a residual costs a twentieth of a call; what rounding adds in eight calls stays far
// below the margin's.
constexpr std::uint64_t kSamplesARefresh = 8;
// Uniform in [-1, 1) from a counter: splitmix64 (Steele, Lea & Flood 2014).
double hash_to_unit(std::uint64_t counter) {
  std::uint64_t z = (counter + 1) * 0x9e3779b97f4a7c15ULL;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  z ^= z >> 31;
  return static_cast<double>(static_cast<std::int64_t>(z) >> 11) * 0x1p-52;
}

bool is_in_range(double value) {
  return std::fabs(value) <= kLargestMagnitude;
}  // false for NaN

const OnlineSvrOptions& checked(const OnlineSvrOptions& options) {
  if (const auto error = options.validate()) throw std::invalid_argument("online SVR: " + *error);
  return options;
}

}  // namespace

OnlineSvr::OnlineSvr(const OnlineSvrOptions& options)
    : options_(checked(options)),
      rows_(options.kernel, options.dimension, options.capacity + 1),
      margin_(slot_count()),
      window_(options.window, slot_count(), options.recent_capacity),
      target_(rows_.stride()),
      weight_(rows_.stride(), 1.0),
      theta_(rows_.stride()),
      residual_(rows_.stride()),
      upper_(rows_.stride(), kInfinity),
      lower_(rows_.stride(), -kInfinity),
      set_(slot_count(), SampleSet::kVacant),
      is_leaving_(slot_count(), 0),
      was_driven_(slot_count(), 0),
      residual_rate_(rows_.stride()),
      margin_offset_(slot_count()) {
  pending_.reserve(slot_count());
}

// ---- Calls ----

UpdateReport OnlineSvr::add(std::span<const double> x, double y, double weight) noexcept {
  UpdateReport report;
  if (!accepts(x, y, weight)) return report;
  begin_call();
  if (!resolve(report.events)) {
    report.outcome = UpdateOutcome::kBusy;
    return report;
  }
  if (size() == options_.capacity) evict(window_.victim(), report.events);
  report.slot = insert(x, y, weight);
  report.prior_residual = residual_[report.slot];
  report.outcome = learn(report.slot, report.events);
  maintain();
  return report;
}

UpdateReport OnlineSvr::forget(std::size_t slot) noexcept {
  UpdateReport report;
  if (slot >= slot_count() || set_[slot] == SampleSet::kVacant || is_leaving_[slot]) return report;
  begin_call();
  if (!resolve(report.events)) {
    report.outcome = UpdateOutcome::kBusy;
    return report;
  }
  report.slot = slot;
  evict(slot, report.events);
  report.outcome = has_finished() ? UpdateOutcome::kForgotten : UpdateOutcome::kUnfinished;
  maintain();
  return report;
}

bool OnlineSvr::finish_pending() noexcept {
  std::size_t events = 0;
  begin_call();
  const bool finished = resolve(events);
  maintain();
  return finished;
}

// What is remembered of events is of one call only: a learner that is saved and restored between
// two calls goes the same way.
void OnlineSvr::begin_call() noexcept {
  margin_.begin_call();
  refused_ = kNoSlot;
  std::fill(was_driven_.begin(), was_driven_.end(), char{0});
}

void OnlineSvr::clear() noexcept {
  margin_.clear();
  rows_.clear();
  driver_ = kNoSlot;
  pending_.clear();
  for (std::size_t slot = 0; slot < slot_count(); ++slot) {
    theta_[slot] = 0.0;
    residual_[slot] = 0.0;
    is_leaving_[slot] = 0;
    assign_set(slot, SampleSet::kVacant);
  }
  window_.clear();
  bias_ = 0.0;
  arrival_count_ = 0;
  refresh_cursor_ = 0;
}

bool OnlineSvr::accepts(std::span<const double> x, double y, double weight) const noexcept {
  if (x.size() != options_.dimension || !is_in_range(y)) return false;
  if (!options_.is_weight(weight)) return false;
  if (!std::all_of(x.begin(), x.end(), is_in_range)) return false;
  return is_in_range(self_value(options_.kernel, x.data(), x.size()));
}

std::size_t OnlineSvr::insert(std::span<const double> x, double y, double weight) noexcept {
  const std::size_t slot = next_vacant(0);
  core::require(slot < slot_count(), "an online SVR has a vacant slot for a new sample");
  target_[slot] = y + kJitter * options_.kkt_bound() * hash_to_unit(arrival_count_);
  weight_[slot] = weight;
  theta_[slot] = 0.0;
  release_driver();
  const double* kernel_row = rows_.insert(slot, x);
  driver_ = slot;
  if (size() == 0) bias_ = target_[slot];
  residual_[slot] = dot(kernel_row, theta_.data(), rows_.stride()) + bias_ - target_[slot];
  window_.insert(slot, arrival_count_++, rows_.columns());
  return slot;
}

// A sample inside the tube joins R and the model stays as it is.
UpdateOutcome OnlineSvr::learn(std::size_t slot, std::size_t& events) noexcept {
  const bool fits = std::fabs(residual_[slot]) <= options_.epsilon;
  if (fits) {
    assign_set(slot, SampleSet::kRemaining);
  } else {
    push_pending(slot);
  }
  if (!resolve(events)) return UpdateOutcome::kUnfinished;
  return fits ? UpdateOutcome::kFitsAlready : UpdateOutcome::kLearned;
}

void OnlineSvr::evict(std::size_t slot, std::size_t& events) noexcept {
  if (set_[slot] == SampleSet::kMargin) {
    detach_from_margin(margin_.position_of(slot));
  }
  is_leaving_[slot] = 1;
  push_pending(slot);
  resolve(events);
}

void OnlineSvr::vacate(std::size_t slot) noexcept {
  window_.remove(slot, rows_.columns());
  theta_[slot] = 0.0;
  is_leaving_[slot] = 0;
  assign_set(slot, SampleSet::kVacant);
  if (driver_ == slot) release_driver();
  rows_.drop(slot);
}

// ---- Events ----

// Drives pending samples, the last first, until none is left (true) or the budget is spent.
bool OnlineSvr::resolve(std::size_t& events) noexcept {
  while (!pending_.empty()) {
    const std::size_t driver = pending_.back();
    if (try_to_finish(driver)) continue;
    if (events == options_.event_budget) return false;
    ++events;
    advance(driver);
  }
  return true;
}

// Files the driver under the set whose conditions it meets without being on the margin.
bool OnlineSvr::try_to_finish(std::size_t driver) noexcept {
  const double theta = theta_[driver], h = residual_[driver];
  if (is_leaving_[driver]) {
    if (theta != 0.0) return false;
    erase_pending(driver);
    vacate(driver);
    return true;
  }
  const double resolution = kResolution * options_.kkt_bound();
  const bool remaining = theta == 0.0 && std::fabs(h) <= options_.epsilon + resolution;
  const bool error = std::fabs(theta) == box_of(driver) &&
                     -h * std::copysign(1.0, theta) >= options_.epsilon - resolution;
  if (!remaining && !error) return false;
  was_driven_[driver] = 1;
  erase_pending(driver);
  assign_set(driver, remaining ? SampleSet::kRemaining : SampleSet::kError);
  return true;
}

void OnlineSvr::advance(std::size_t driver) noexcept {
  const MarginSample sample = take_driver(driver);
  const Drive drive = plan(driver);
  const Direction direction = margin_.solve(sample, drive.sign, residual_rate_);
  const Event event = next_event(driver, drive, direction);
  apply(driver, drive, direction, event.step);
  if (drive.stops_at_margin && !reaches_margin(driver, direction)) {
    keep_before_margin(driver, drive);
  }
  handle(event, driver, drive);
}

// The residual rate of a driver that can't reach its margin counts as zero. Yet a coefficient that
// moves far takes the residual along, and once past the margin the driver would be sent back the
// whole way, and forth again without end. It stays on the side from which it came.
void OnlineSvr::keep_before_margin(std::size_t driver, const Drive& drive) noexcept {
  const double before =
      drive.residual_target - drive.sign * 2.0 * kResolution * options_.kkt_bound();
  if ((residual_[driver] - before) * drive.sign > 0.0) residual_[driver] = before;
}

OnlineSvr::Drive OnlineSvr::plan(std::size_t slot) const noexcept {
  const double theta = theta_[slot], h = residual_[slot];
  if (is_leaving_[slot]) return {theta > 0.0 ? -1.0 : 1.0, 0.0, 0.0, false};
  const double side = theta != 0.0 ? std::copysign(1.0, theta) : -std::copysign(1.0, h);
  const double target = -side * options_.epsilon;
  const double sign = h < target ? 1.0 : -1.0;
  const double limit = sign == side ? side * box_of(slot) : 0.0;
  return {sign, limit, target, true};
}

MarginSample OnlineSvr::take_driver(std::size_t driver) noexcept {
  if (driver_ != driver) {
    release_driver();
    (void)rows_.take(driver);
    driver_ = driver;
  }
  return {driver, rows_.row(driver), rows_.magnitude(driver)};
}

void OnlineSvr::release_driver() noexcept {
  if (driver_ != kNoSlot) rows_.park(driver_);
  driver_ = kNoSlot;
}

// Whether the driver's residual can be brought to its margin by its own coefficient.
bool OnlineSvr::reaches_margin(std::size_t driver, const Direction& direction) const noexcept {
  if (margin_.size() == 0) return true;
  return driver != refused_ &&
         direction.own_residual_rate >
             MarginSystem::smallest_pivot(direction, was_driven_[driver] != 0);
}

// The step at which a margin coefficient moving at the given rate meets 0 or its box constraint.
double OnlineSvr::step_to_bound(std::size_t slot, double rate) const noexcept {
  const double side = residual_[slot] > 0.0 ? -1.0 : 1.0;
  const double bound = rate * side > 0.0 ? side * box_of(slot) : 0.0;
  return std::max(0.0, (bound - theta_[slot]) / rate);
}

// The smallest step at which something changes; on a tie the first found of: driver, margin by
// position, others by slot.
OnlineSvr::Event OnlineSvr::next_event(std::size_t driver, const Drive& drive,
                                       const Direction& direction) const noexcept {
  Event event{Event::Kind::kDriverAtLimit, kInfinity, driver};
  const double residual_rate = direction.own_residual_rate;
  if (drive.stops_at_margin && reaches_margin(driver, direction)) {
    const double distance = std::fabs(residual_[driver] - drive.residual_target);
    event = {Event::Kind::kDriverAtMargin, distance / residual_rate, driver};
  }
  if (margin_.size() > 0) {
    const double distance = std::fabs(drive.theta_limit - theta_[driver]);
    if (distance < event.step) event = {Event::Kind::kDriverAtLimit, distance, driver};
  }
  for (std::size_t p = 0; p < margin_.size(); ++p) {
    const std::size_t slot = margin_.slot(p);
    const double rate = drive.sign * margin_.rate(p);
    if (rate == 0.0) continue;
    const double step = step_to_bound(slot, rate);
    if (step < event.step) event = {Event::Kind::kMarginLeaves, step, p};
  }
  const Crossing crossing = first_crossing(
      {residual_.data(), residual_rate_.data(), upper_.data(), lower_.data(), direction.threshold},
      event.step, rows_.stride());
  if (crossing.step < event.step) {
    event = {Event::Kind::kSampleMeets, crossing.step, crossing.index};
  }
  return event;
}

void OnlineSvr::apply(std::size_t driver, const Drive& drive, const Direction& direction,
                      double step) noexcept {
  if (step == kInfinity) return;
  if (margin_.size() > 0) theta_[driver] += drive.sign * step;
  for (std::size_t p = 0; p < margin_.size(); ++p) {
    theta_[margin_.slot(p)] += drive.sign * step * margin_.rate(p);
  }
  bias_ += drive.sign * step * direction.bias_rate;
  add_scaled(step, residual_rate_.data(), residual_.data(), rows_.stride());
}

void OnlineSvr::handle(const Event& event, std::size_t driver, const Drive& drive) noexcept {
  switch (event.kind) {
    case Event::Kind::kDriverAtMargin:
      if (theta_[driver] == 0.0) return;
      if (enter_margin(driver)) {
        erase_pending(driver);
      } else if (was_driven_[driver]) {
        refused_ = driver;
      }
      was_driven_[driver] = 1;
      return;  // with theta = 0 it now fits, which the next try_to_finish() sees
    case Event::Kind::kDriverAtLimit: theta_[driver] = drive.theta_limit; return;
    case Event::Kind::kMarginLeaves: leave_margin(event.position); return;
    case Event::Kind::kSampleMeets: meet_border(event.position); return;
  }
}

// The sample's residual has just met a border of its set. It enters the margin; or it fits, if it
// was waiting to be learned with theta = 0; or, its feature vector being in the span of the
// margin's, it becomes the driver: its coefficient then displaces one of the margin until it can
// enter.
void OnlineSvr::meet_border(std::size_t slot) noexcept {
  const bool is_waiting = set_[slot] == SampleSet::kPending;
  if (is_waiting && theta_[slot] == 0.0) {
    erase_pending(slot);
    assign_set(slot, SampleSet::kRemaining);
    return;
  }
  const double rate = residual_rate_[slot];
  const double border = rate > 0.0 ? upper_[slot] : lower_[slot];
  if (enter_margin(slot)) {
    if (is_waiting) erase_pending(slot);
    return;
  }
  put_past_border(slot, border, std::copysign(1.0, rate));
  if (is_waiting) {
    await(slot);
  } else {
    push_pending(slot);
  }
}

// Makes it plain which side of its border a sample is on that has crossed it but can't enter the
// margin.
void OnlineSvr::put_past_border(std::size_t slot, double border, double side) noexcept {
  const double past = border + side * 2.0 * kResolution * options_.kkt_bound();
  if ((past - residual_[slot]) * side > 0.0) residual_[slot] = past;
}

// ---- Sets ----

// False, and nothing changed, if the margin factor would become singular.
bool OnlineSvr::enter_margin(std::size_t slot) noexcept {
  const bool is_driver = driver_ == slot;
  const double* kernel_row = is_driver ? rows_.row(slot) : rows_.take(slot);
  if (!margin_.enter({slot, kernel_row, rows_.magnitude(slot)}, was_driven_[slot] != 0)) {
    if (!is_driver) rows_.park(slot);
    return false;
  }
  if (is_driver) driver_ = kNoSlot;
  assign_set(slot, SampleSet::kMargin);
  refused_ = kNoSlot;
  return true;
}

void OnlineSvr::detach_from_margin(std::size_t position) noexcept {
  refused_ = kNoSlot;
  rows_.park(margin_.slot(position));
  margin_.leave(position);
}

// Puts the coefficient exactly on the bound it has met and files the sample by it.
void OnlineSvr::leave_margin(std::size_t position) noexcept {
  const std::size_t slot = margin_.slot(position);
  detach_from_margin(position);
  const bool to_error = std::fabs(theta_[slot]) > 0.5 * box_of(slot);
  theta_[slot] = to_error ? std::copysign(box_of(slot), -residual_[slot]) : 0.0;
  assign_set(slot, to_error ? SampleSet::kError : SampleSet::kRemaining);
}

// Files the sample and sets the residuals at which it changes set again.
void OnlineSvr::assign_set(std::size_t slot, SampleSet set) noexcept {
  set_[slot] = set;
  upper_[slot] = kInfinity;
  lower_[slot] = -kInfinity;
  if (set == SampleSet::kRemaining) {
    upper_[slot] = options_.epsilon;
    lower_[slot] = -options_.epsilon;
  } else if (set == SampleSet::kError) {
    (theta_[slot] > 0.0 ? upper_ : lower_)[slot] = -std::copysign(options_.epsilon, theta_[slot]);
  }
}

// A pending sample that isn't driven keeps its place until its residual meets its margin.
void OnlineSvr::await(std::size_t slot) noexcept {
  assign_set(slot, SampleSet::kPending);
  if (is_leaving_[slot]) return;
  const double target = plan(slot).residual_target;
  (residual_[slot] < target ? upper_ : lower_)[slot] = target;
}

void OnlineSvr::push_pending(std::size_t slot) noexcept {
  if (!pending_.empty()) await(pending_.back());
  pending_.push_back(slot);
  assign_set(slot, SampleSet::kPending);
}

void OnlineSvr::erase_pending(std::size_t slot) noexcept {
  pending_.erase(std::find(pending_.begin(), pending_.end(), slot));
  if (!pending_.empty()) assign_set(pending_.back(), SampleSet::kPending);
}

// ---- Upkeep ----

void OnlineSvr::maintain() noexcept {
  if (arrival_count_ % kSamplesARefresh == 0) refresh_one_residual();
  recentre_margin();
}

void OnlineSvr::refresh_one_residual() noexcept {
  const std::size_t slot = refresh_cursor_;
  refresh_cursor_ = (refresh_cursor_ + 1) % slot_count();
  if (refresh_cursor_ == 0) balance_thetas();
  if (set_[slot] == SampleSet::kVacant) return;
  residual_[slot] =
      dot(rows_.evaluate(slot), theta_.data(), rows_.stride()) + bias_ - target_[slot];
}

// Takes what rounding has left of sum theta off the margin coefficient that is farthest from its
// bounds.
void OnlineSvr::balance_thetas() noexcept {
  if (margin_.size() == 0) return;
  const auto room = [&](std::size_t p) {
    const std::size_t slot = margin_.slot(p);
    return std::min(std::fabs(theta_[slot]), box_of(slot) - std::fabs(theta_[slot]));
  };
  std::size_t widest = 0;
  for (std::size_t p = 1; p < margin_.size(); ++p) {
    if (room(p) > room(widest)) widest = p;
  }
  const double excess = sum(theta_.data(), rows_.stride());
  if (std::fabs(excess) >= room(widest)) return;
  theta_[margin_.slot(widest)] -= excess;
  add_scaled(-excess, margin_.row(widest), residual_.data(), rows_.stride());
}

// Brings the margin samples back to h = -/+epsilon once rounding has taken one too far off.
void OnlineSvr::recentre_margin() noexcept {
  const std::size_t n = margin_.size();
  double largest = 0.0;
  for (std::size_t p = 0; p < n; ++p) {
    const double h = residual_[margin_.slot(p)];
    margin_offset_[p] = h - std::copysign(options_.epsilon, h);
    largest = std::max(largest, std::fabs(margin_offset_[p]));
  }
  if (largest <= kOffMargin * options_.kkt_bound()) return;

  const double bias_change = margin_.solve_shift({margin_offset_.data(), n}, residual_rate_);
  double step = 1.0;
  for (std::size_t p = 0; p < n; ++p) {
    if (margin_.rate(p) == 0.0) continue;
    step = std::min(step, step_to_bound(margin_.slot(p), margin_.rate(p)));
  }
  for (std::size_t p = 0; p < n; ++p) theta_[margin_.slot(p)] += step * margin_.rate(p);
  bias_ += step * bias_change;
  add_scaled(step, residual_rate_.data(), residual_.data(), rows_.stride());
}

// ---- Queries ----

// Support vectors in the order of their slots, in blocks: the same sum as SvrPredictor's, to the
// bit.
double OnlineSvr::predict(std::span<const double> x) const noexcept {
  core::require(x.size() == options_.dimension, "features are as many as the online SVR learns");
  std::array<double, kMaxDimension * kExpansionBlock> features{};
  std::array<double, kExpansionBlock> weights{};
  KernelExpansion expansion(options_.kernel, x.data());
  std::size_t count = 0;
  const auto flush = [&] {
    expansion.add_block({features.data(), kExpansionBlock, options_.dimension, padded(count)},
                        weights.data());
    weights.fill(0.0);
    count = 0;
  };
  for (std::size_t slot = 0; slot < slot_count(); ++slot) {
    if (theta_[slot] == 0.0) continue;
    for (std::size_t d = 0; d < options_.dimension; ++d) {
      features[d * kExpansionBlock + count] = feature(slot, d);
    }
    weights[count] = theta_[slot];
    if (++count == kExpansionBlock) flush();
  }
  flush();
  return expansion.total() + bias_;
}

std::size_t OnlineSvr::next_vacant(std::size_t slot) const noexcept {
  static_assert(sizeof(SampleSet) == 1);
  const SampleSet* const begin = set_.data() + slot;
  const void* found = std::memchr(begin, static_cast<int>(SampleSet::kVacant), set_.size() - slot);
  if (found == nullptr) return set_.size();
  return slot + static_cast<std::size_t>(static_cast<const SampleSet*>(found) - begin);
}

SetCounts OnlineSvr::set_counts() const noexcept {
  SetCounts counts;
  for (const SampleSet set : set_) {
    counts.remaining += set == SampleSet::kRemaining;
    counts.margin += set == SampleSet::kMargin;
    counts.error += set == SampleSet::kError;
    counts.pending += set == SampleSet::kPending;
  }
  return counts;
}

double OnlineSvr::theta_sum() const noexcept {
  return sum(theta_.data(), rows_.stride());
}

double OnlineSvr::max_kkt_violation() const noexcept {
  double largest = 0.0;
  for (std::size_t slot = 0; slot < slot_count(); ++slot) {
    if (set_[slot] == SampleSet::kVacant || set_[slot] == SampleSet::kPending) continue;
    const auto x = rows_.sample(slot);
    const double h = predict({x.data(), options_.dimension}) - target_[slot];
    const double outside = -std::copysign(1.0, theta_[slot]) * h - options_.epsilon;
    double violation = std::fabs(outside);
    if (theta_[slot] == 0.0) violation = std::fabs(h) - options_.epsilon;
    if (std::fabs(theta_[slot]) >= box_of(slot)) violation = -outside;
    largest = std::max({largest, violation, std::fabs(theta_[slot]) - box_of(slot)});
  }
  return largest;
}

}  // namespace zerodrift::regression
