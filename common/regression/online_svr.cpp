// SPDX-License-Identifier: Apache-2.0
#include "common/regression/online_svr.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>

#include "common/regression/vector_operations.h"

namespace zerodrift::regression {
namespace {

constexpr std::size_t kNoSlot = SampleWindow::kNoSlot;
constexpr std::size_t kSpareRow = 0;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kEpsilonOfDouble = std::numeric_limits<double>::epsilon();

// In units of the bound on KKT violations: half-width of the targets' jitter, and the difference
// below which residuals count as equal. The first is far below the bound, the second is far below
// the first, and rounding is below both.
constexpr double kJitter = 1e-4;
constexpr double kResolution = 1e-5;
// Margin residual, in the same unit, from which the margin is recentred.
constexpr double kOffMargin = 1e-2;
// Rates and pivots below this share of the kernel's magnitude count as zero.
constexpr double kNegligible = 1e-13;
// What rounding may make of a refined pivot, as a share of the terms it is the sum of.
constexpr double kPivotRounding = 8.0 * kEpsilonOfDouble;
// Residual rates of margin samples, as a share of the terms they are the sum of, that are rounding.
constexpr double kRounding = 1e-14;
// Pivots below this share of the kernel's magnitude lose digits when computed as a difference.
constexpr double kSmallPivot = 1e-8;
// A refinement that corrects more than this share of a solution says that the factor has worn out;
// one that corrects less than the other share leaves nothing to correct, for the next would
// correct the square of it.
constexpr double kWornOut = 1e-6;
constexpr double kRefined = 1e-8;
constexpr int kMaxRefinements = 4;
// Kernel rows kept of samples that have left the margin: half of the rows that events need are
// among the last so many.
constexpr std::size_t kRowsParked = 32;
// Rows of the margin factor and of the kernel cache that are committed in the constructor.
constexpr std::size_t kRowsCommitted = 64;

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

std::string wrong(const std::string& key, const std::string& found, const std::string& expected) {
  return key + ": found " + found + ", expected " + expected;
}

bool is_positive(double value) {
  return std::isfinite(value) && value > 0.0;
}

const OnlineSvrOptions& checked(const OnlineSvrOptions& options) {
  if (const auto error = options.validate()) throw std::invalid_argument("online SVR: " + *error);
  return options;
}

}  // namespace

double OnlineSvrOptions::kkt_bound() const noexcept {
  return kkt_tolerance * std::max(1.0, box_constraint);
}

bool OnlineSvrOptions::is_weight(double weight) const noexcept {
  return weight > 0.0 && weight <= 1.0 && std::isnormal(weight * box_constraint);
}

std::optional<std::string> OnlineSvrOptions::validate() const {
  if (dimension < 1 || dimension > kMaxDimension) {
    return wrong("dimension", std::to_string(dimension), "1 to " + std::to_string(kMaxDimension));
  }
  if (capacity < 2) return wrong("capacity", std::to_string(capacity), "at least 2");
  if (auto error = kernel.validate()) return error;
  if (!is_positive(epsilon)) return wrong("epsilon", std::to_string(epsilon), "a number above 0");
  if (!is_positive(box_constraint)) {
    return wrong("box_constraint", std::to_string(box_constraint), "a number above 0");
  }
  if (!is_positive(kkt_tolerance)) {
    return wrong("kkt_tolerance", std::to_string(kkt_tolerance), "a number above 0");
  }
  if (!(epsilon > kkt_bound())) {
    return wrong("epsilon", std::to_string(epsilon), "more than kkt_tolerance max(1, C)");
  }
  if (event_budget < 1) return wrong("event_budget", "0", "at least 1");
  if (window == WindowPolicy::kTwoTier && (recent_capacity < 1 || recent_capacity >= capacity)) {
    return wrong("recent_capacity", std::to_string(recent_capacity), "1 to capacity - 1");
  }
  return std::nullopt;
}

OnlineSvr::OnlineSvr(const OnlineSvrOptions& options)
    : options_(checked(options)),
      slot_count_(options.capacity + 1),
      stride_(padded(slot_count_)),
      window_(options.window, slot_count_, options.recent_capacity),
      factor_(slot_count_),
      features_(options.dimension * stride_),
      target_(stride_),
      weight_(stride_, 1.0),
      theta_(stride_),
      residual_(stride_),
      self_(stride_),
      upper_(stride_, kInfinity),
      lower_(stride_, -kInfinity),
      set_(slot_count_, SampleSet::kVacant),
      is_leaving_(slot_count_, 0),
      was_driven_(slot_count_, 0),
      rows_(new (kCacheLine) double[(slot_count_ + 1) * stride_]),
      rates_(slot_count_),
      reduced_(slot_count_),
      correction_(slot_count_),
      row_pointers_(slot_count_ + 1),
      row_rates_(slot_count_ + 1),
      residual_rate_(stride_) {
  margin_slots_.reserve(slot_count_);
  margin_rows_.reserve(slot_count_);
  parked_slots_.reserve(kRowsParked);
  parked_rows_.reserve(kRowsParked);
  unsettled_.reserve(slot_count_);
  free_rows_.reserve(slot_count_);
  for (std::size_t i = slot_count_; i > kSpareRow; --i) free_rows_.push_back(i);
  std::fill_n(rows_.get(), std::min(kRowsCommitted, slot_count_ + 1) * stride_, 0.0);
}

SampleColumns OnlineSvr::columns() const noexcept {
  return {features_.data(), stride_, options_.dimension, stride_};
}

void OnlineSvr::gather(std::size_t slot, double* x) const noexcept {
  for (std::size_t d = 0; d < options_.dimension; ++d) x[d] = feature(slot, d);
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
  if (slot >= slot_count_ || set_[slot] == SampleSet::kVacant || is_leaving_[slot]) return report;
  begin_call();
  if (!resolve(report.events)) {
    report.outcome = UpdateOutcome::kBusy;
    return report;
  }
  report.slot = slot;
  evict(slot, report.events);
  report.outcome = is_settled() ? UpdateOutcome::kForgotten : UpdateOutcome::kUnfinished;
  maintain();
  return report;
}

bool OnlineSvr::settle() noexcept {
  std::size_t events = 0;
  begin_call();
  const bool settled = resolve(events);
  maintain();
  return settled;
}

// What is remembered of events is of one call only: a learner that is saved and restored between
// two calls goes the same way.
void OnlineSvr::begin_call() noexcept {
  may_refactor_ = true;
  is_factor_fresh_ = false;
  refused_ = kNoSlot;
  std::fill(was_driven_.begin(), was_driven_.end(), char{0});
}

void OnlineSvr::clear() noexcept {
  while (margin_size() > 0) free_rows_.push_back(detach_from_margin(margin_size() - 1));
  release_driver_row();
  while (!parked_slots_.empty()) unpark_row(parked_slots_.back());
  unsettled_.clear();
  for (std::size_t slot = 0; slot < slot_count_; ++slot) {
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
  const auto vacant = std::find(set_.begin(), set_.end(), SampleSet::kVacant);
  assert(vacant != set_.end());
  const auto slot = static_cast<std::size_t>(vacant - set_.begin());
  for (std::size_t d = 0; d < options_.dimension; ++d) features_[d * stride_ + slot] = x[d];
  target_[slot] = y + kJitter * options_.kkt_bound() * hash_to_unit(arrival_count_);
  weight_[slot] = weight;
  theta_[slot] = 0.0;
  self_[slot] = self_value(options_.kernel, x.data(), x.size());

  load_driver_row(slot);
  const double* kernel_row = row(driver_row_);
  for (std::size_t p = 0; p < margin_size(); ++p)
    row(margin_rows_[p])[slot] = kernel_row[margin_slots_[p]];
  for (std::size_t k = 0; k < parked_rows_.size(); ++k)
    row(parked_rows_[k])[slot] = kernel_row[parked_slots_[k]];
  if (size() == 0) bias_ = target_[slot];
  residual_[slot] = dot(kernel_row, theta_.data(), stride_) + bias_ - target_[slot];
  window_.insert(slot, arrival_count_++, columns());
  return slot;
}

// A sample inside the tube joins R and the model stays as it is.
UpdateOutcome OnlineSvr::learn(std::size_t slot, std::size_t& events) noexcept {
  const bool fits = std::fabs(residual_[slot]) <= options_.epsilon;
  if (fits) {
    assign_set(slot, SampleSet::kRemaining);
  } else {
    push_unsettled(slot);
  }
  if (!resolve(events)) return UpdateOutcome::kUnfinished;
  return fits ? UpdateOutcome::kFitsAlready : UpdateOutcome::kLearned;
}

void OnlineSvr::evict(std::size_t slot, std::size_t& events) noexcept {
  if (set_[slot] == SampleSet::kMargin) {
    const auto found = std::find(margin_slots_.begin(), margin_slots_.end(), slot);
    const auto position = static_cast<std::size_t>(found - margin_slots_.begin());
    park_row(slot, detach_from_margin(position));
  }
  is_leaving_[slot] = 1;
  push_unsettled(slot);
  resolve(events);
}

void OnlineSvr::vacate(std::size_t slot) noexcept {
  window_.remove(slot, columns());
  theta_[slot] = 0.0;
  is_leaving_[slot] = 0;
  assign_set(slot, SampleSet::kVacant);
  if (driver_row_slot_ == slot) release_driver_row();
  unpark_row(slot);
}

// ---- Events ----

// Drives unsettled samples, the last first, until none is left (true) or the budget is spent.
bool OnlineSvr::resolve(std::size_t& events) noexcept {
  while (!unsettled_.empty()) {
    const std::size_t driver = unsettled_.back();
    if (try_to_settle(driver)) continue;
    if (events == options_.event_budget) return false;
    ++events;
    advance(driver);
  }
  return true;
}

// Files the driver under the set whose conditions it meets without being on the margin.
bool OnlineSvr::try_to_settle(std::size_t driver) noexcept {
  const double theta = theta_[driver], h = residual_[driver];
  if (is_leaving_[driver]) {
    if (theta != 0.0) return false;
    erase_unsettled(driver);
    vacate(driver);
    return true;
  }
  const double resolution = kResolution * options_.kkt_bound();
  const bool remaining = theta == 0.0 && std::fabs(h) <= options_.epsilon + resolution;
  const bool error = std::fabs(theta) == box_of(driver) &&
                     -h * std::copysign(1.0, theta) >= options_.epsilon - resolution;
  if (!remaining && !error) return false;
  was_driven_[driver] = 1;
  erase_unsettled(driver);
  assign_set(driver, remaining ? SampleSet::kRemaining : SampleSet::kError);
  return true;
}

void OnlineSvr::advance(std::size_t driver) noexcept {
  load_driver_row(driver);
  const Drive drive = plan(driver);
  const Direction direction = solve_direction(drive, driver);
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

void OnlineSvr::load_driver_row(std::size_t driver) noexcept {
  if (driver_row_slot_ == driver) return;
  release_driver_row();
  driver_row_ = take_row(driver);
  driver_row_slot_ = driver;
}

void OnlineSvr::release_driver_row() noexcept {
  if (driver_row_slot_ != kNoSlot) park_row(driver_row_slot_, driver_row_);
  driver_row_slot_ = kNoSlot;
}

// A row that holds the kernel row of the slot: the one parked, or a free one filled now.
std::size_t OnlineSvr::take_row(std::size_t slot) noexcept {
  const bool is_filled = unpark_row(slot);
  const std::size_t kernel_row = free_rows_.back();
  free_rows_.pop_back();
  if (!is_filled) evaluate(slot, kernel_row);
  return kernel_row;
}

void OnlineSvr::evaluate(std::size_t slot, std::size_t kernel_row) noexcept {
  std::array<double, kMaxDimension> x;
  gather(slot, x.data());
  evaluate_row(options_.kernel, columns(), x.data(), row(kernel_row));
}

// Keeps the row for when its slot needs it again; the row parked longest makes room.
void OnlineSvr::park_row(std::size_t slot, std::size_t kernel_row) noexcept {
  if (parked_slots_.size() == kRowsParked) unpark_row(parked_slots_.front());
  parked_slots_.push_back(slot);
  parked_rows_.push_back(kernel_row);
}

// Frees the slot's parked row, if there is one; it is then the next to be taken.
bool OnlineSvr::unpark_row(std::size_t slot) noexcept {
  const auto found = std::find(parked_slots_.begin(), parked_slots_.end(), slot);
  if (found == parked_slots_.end()) return false;
  const auto position = found - parked_slots_.begin();
  free_rows_.push_back(parked_rows_[static_cast<std::size_t>(position)]);
  parked_slots_.erase(found);
  parked_rows_.erase(parked_rows_.begin() + position);
  return true;
}

double OnlineSvr::kernel_magnitude(std::size_t slot) const noexcept {
  return options_.kernel.is_stationary() ? 1.0 : self_[slot];
}

// <phi_i - phi_0, phi_c - phi_0> for the sample i in the slot and the sample c that the row belongs
// to.
double OnlineSvr::reduced_product(const double* kernel_row, std::size_t slot) const noexcept {
  const std::size_t reference = margin_slots_[0];
  return (kernel_row[slot] - kernel_row[reference]) -
         (margin_row(0)[slot] - margin_row(0)[reference]);
}

// The reference takes what makes the sum of all coefficients zero.
void OnlineSvr::balance_rates() noexcept {
  double total = 1.0;
  for (std::size_t p = 1; p < margin_size(); ++p) total += rates_[p];
  rates_[0] = -total;
}

// dh at a slot, less the bias, for a unit change of the coefficient that the kernel row belongs to.
double OnlineSvr::expansion_rate(const double* kernel_row, std::size_t slot) const noexcept {
  double rate = kernel_row[slot];
  for (std::size_t p = 0; p < margin_size(); ++p) rate += rates_[p] * margin_row(p)[slot];
  return rate;
}

// One refinement of rates_ by the residual of dh_p = dh_0, computed from the kernel rows. Returns
// the size of the correction relative to the rates. O(n_margin²).
double OnlineSvr::refine_rates(const double* kernel_row) noexcept {
  const double reference_rate = expansion_rate(kernel_row, margin_slots_[0]);
  for (std::size_t p = 1; p < margin_size(); ++p) {
    correction_[p] = expansion_rate(kernel_row, margin_slots_[p]) - reference_rate;
  }
  factor_.solve(correction_.data() + 1);
  double largest = std::numeric_limits<double>::min(), largest_correction = 0.0;
  for (std::size_t p = 1; p < margin_size(); ++p) {
    rates_[p] -= correction_[p];
    largest = std::max(largest, std::fabs(rates_[p]));
    largest_correction = std::max(largest_correction, std::fabs(correction_[p]));
  }
  balance_rates();
  return largest_correction / largest;
}

// Writes to rates_ how the margin coefficients follow a unit change of theta_slot: A beta =
// -reduced products.
void OnlineSvr::solve_rates(const double* kernel_row) noexcept {
  for (std::size_t p = 1; p < margin_size(); ++p) {
    reduced_[p] = reduced_product(kernel_row, margin_slots_[p]);
    rates_[p] = -reduced_[p];
  }
  factor_.solve(rates_.data() + 1);
  balance_rates();
}

// The same, refined until nothing is left to correct.
void OnlineSvr::solve_rates_refined(const double* kernel_row) noexcept {
  solve_rates(kernel_row);
  for (int i = 0; margin_size() > 1 && i < kMaxRefinements; ++i) {
    const double correction = refine_rates(kernel_row);
    if (correction > kWornOut && refactor()) return solve_rates_refined(kernel_row);
    if (correction < kRefined) break;
  }
}

// The direction given by rates_.
OnlineSvr::Direction OnlineSvr::direction_of(const double* kernel_row,
                                             std::size_t slot) const noexcept {
  if (margin_size() == 0) return {1.0, 1.0, 0.0, 0.0};  // only the bias moves
  double magnitude = kernel_magnitude(slot);
  const double own = magnitude;
  for (std::size_t p = 0; p < margin_size(); ++p) {
    magnitude += std::fabs(rates_[p]) * kernel_magnitude(margin_slots_[p]);
  }
  const double reference_rate = expansion_rate(kernel_row, margin_slots_[0]);
  return {-reference_rate, expansion_rate(kernel_row, slot) - reference_rate,
          kNegligible * own + kEpsilonOfDouble * magnitude, magnitude};
}

// The direction in which to drive the sample, and the residual rates. The solution is refined only
// if the margin's own residual rates, which should be zero, show more than rounding. A Schur
// complement below zero says that refining didn't converge, because removals have worn the factor
// out: with such a direction samples enter the margin and leave it at once, for ever.
OnlineSvr::Direction OnlineSvr::solve_direction(const Drive& drive, std::size_t driver) noexcept {
  const double* kernel_row = row(driver_row_);
  solve_rates(kernel_row);
  Direction direction = direction_of(kernel_row, driver);
  write_residual_rates(drive, direction);
  if (largest_margin_rate() > kRounding * direction.magnitude) {
    solve_rates_refined(kernel_row);
    direction = direction_of(kernel_row, driver);
    if (direction.own_residual_rate < -direction.threshold && !is_factor_fresh_) {
      renew_factor();
      solve_rates_refined(kernel_row);
      direction = direction_of(kernel_row, driver);
    }
    write_residual_rates(drive, direction);
  }
  return direction;
}

double OnlineSvr::largest_margin_rate() const noexcept {
  double largest = 0.0;
  for (const std::size_t slot : margin_slots_) {
    largest = std::max(largest, std::fabs(residual_rate_[slot]));
  }
  return largest;
}

// dh for a step of 1 in the drive's direction.
void OnlineSvr::write_residual_rates(const Drive& drive, const Direction& direction) noexcept {
  const std::size_t n = margin_size();
  if (n == 0) {
    std::fill(residual_rate_.begin(), residual_rate_.end(), drive.sign);
    return;
  }
  row_pointers_[0] = row(driver_row_);
  row_rates_[0] = drive.sign;
  for (std::size_t p = 0; p < n; ++p) {
    row_pointers_[p + 1] = margin_row(p);
    row_rates_[p + 1] = drive.sign * rates_[p];
  }
  combine_rows(row_pointers_.data(), row_rates_.data(), n + 1, drive.sign * direction.bias_rate,
               residual_rate_.data(), stride_);
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
                                       const Direction& direction) noexcept {
  Event event{Event::Kind::kDriverAtLimit, kInfinity, driver};
  const double residual_rate = direction.own_residual_rate;
  if (drive.stops_at_margin && reaches_margin(driver, direction)) {
    const double distance = std::fabs(residual_[driver] - drive.residual_target);
    event = {Event::Kind::kDriverAtMargin, distance / residual_rate, driver};
  }
  if (margin_size() > 0) {
    const double distance = std::fabs(drive.theta_limit - theta_[driver]);
    if (distance < event.step) event = {Event::Kind::kDriverAtLimit, distance, driver};
  }
  for (std::size_t p = 0; p < margin_size(); ++p) {
    const std::size_t slot = margin_slots_[p];
    const double rate = drive.sign * rates_[p];
    if (rate == 0.0) continue;
    const double step = step_to_bound(slot, rate);
    if (step < event.step) event = {Event::Kind::kMarginLeaves, step, p};
  }
  const Crossing crossing = first_crossing(
      {residual_.data(), residual_rate_.data(), upper_.data(), lower_.data(), direction.threshold},
      event.step, stride_);
  if (crossing.step < event.step) {
    event = {Event::Kind::kSampleMeets, crossing.step, crossing.index};
  }
  return event;
}

void OnlineSvr::apply(std::size_t driver, const Drive& drive, const Direction& direction,
                      double step) noexcept {
  if (step == kInfinity) return;
  if (margin_size() > 0) theta_[driver] += drive.sign * step;
  for (std::size_t p = 0; p < margin_size(); ++p) {
    theta_[margin_slots_[p]] += drive.sign * step * rates_[p];
  }
  bias_ += drive.sign * step * direction.bias_rate;
  add_scaled(step, residual_rate_.data(), residual_.data(), stride_);
}

void OnlineSvr::handle(const Event& event, std::size_t driver, const Drive& drive) noexcept {
  switch (event.kind) {
    case Event::Kind::kDriverAtMargin:
      if (theta_[driver] == 0.0) return;
      if (enter_margin(driver)) {
        erase_unsettled(driver);
      } else if (was_driven_[driver]) {
        refused_ = driver;
      }
      was_driven_[driver] = 1;
      return;  // with theta = 0 it now fits, which the next try_to_settle() sees
    case Event::Kind::kDriverAtLimit:
      theta_[driver] = drive.theta_limit;
      return;
    case Event::Kind::kMarginLeaves:
      leave_margin(event.position);
      return;
    case Event::Kind::kSampleMeets:
      meet_border(event.position);
      return;
  }
}

// The sample's residual has just met a border of its set. It enters the margin; or it fits, if it
// was waiting to be learned with theta = 0; or, its feature vector being in the span of the
// margin's, it becomes the driver: its coefficient then displaces one of the margin until it can
// enter.
void OnlineSvr::meet_border(std::size_t slot) noexcept {
  const bool is_waiting = set_[slot] == SampleSet::kUnsettled;
  if (is_waiting && theta_[slot] == 0.0) {
    erase_unsettled(slot);
    assign_set(slot, SampleSet::kRemaining);
    return;
  }
  const double rate = residual_rate_[slot];
  const double border = rate > 0.0 ? upper_[slot] : lower_[slot];
  if (enter_margin(slot)) {
    if (is_waiting) erase_unsettled(slot);
    return;
  }
  put_past_border(slot, border, std::copysign(1.0, rate));
  if (is_waiting) {
    await(slot);
  } else {
    push_unsettled(slot);
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
  const bool is_driver = driver_row_slot_ == slot;
  const std::size_t kernel_row = is_driver ? driver_row_ : take_row(slot);
  if (margin_size() > 0 && !append_to_factor(row(kernel_row), slot)) {
    if (!is_driver) park_row(slot, kernel_row);
    return false;
  }
  margin_slots_.push_back(slot);
  margin_rows_.push_back(kernel_row);
  if (is_driver) driver_row_slot_ = kNoSlot;
  assign_set(slot, SampleSet::kMargin);
  refused_ = kNoSlot;
  return true;
}

// The pivot above which a sample may enter the margin. Displacing a sample that is near the span of
// the margin's but not in it disturbs the others a little, so that two of them might displace each
// other in turn for ever: once driven in this call, a sample enters with any pivot that is more
// than rounding.
double OnlineSvr::smallest_pivot(std::size_t slot, const Direction& direction) const noexcept {
  return was_driven_[slot] ? kPivotRounding * direction.magnitude : direction.threshold;
}

// Whether the driver's residual can be brought to its margin by its own coefficient.
bool OnlineSvr::reaches_margin(std::size_t driver, const Direction& direction) const noexcept {
  if (margin_size() == 0) return true;
  return driver != refused_ && direction.own_residual_rate > smallest_pivot(driver, direction);
}

// False, and nothing changed, if the sample's pivot is lost in rounding. A small pivot is computed
// with care, as the residual rate of a refined solution.
bool OnlineSvr::append_to_factor(const double* kernel_row, std::size_t slot) noexcept {
  const std::size_t n = margin_size();
  for (std::size_t p = 1; p < n; ++p) reduced_[p] = reduced_product(kernel_row, margin_slots_[p]);
  factor_.solve_lower(reduced_.data() + 1);
  double pivot =
      reduced_product(kernel_row, slot) - dot(reduced_.data() + 1, reduced_.data() + 1, n - 1);
  const double magnitude = kernel_magnitude(slot) + kernel_magnitude(margin_slots_[0]);
  if (pivot < kSmallPivot * magnitude) {
    solve_rates_refined(kernel_row);
    const Direction direction = direction_of(kernel_row, slot);
    pivot = direction.own_residual_rate;
    if (!(pivot > smallest_pivot(slot, direction))) return false;
    factor_.solve_lower(reduced_.data() + 1);
  }
  factor_.append(reduced_.data() + 1, pivot);
  return true;
}

// Returns the sample's kernel row.
std::size_t OnlineSvr::detach_from_margin(std::size_t position) noexcept {
  const std::size_t kernel_row = margin_rows_[position];
  refused_ = kNoSlot;
  is_factor_fresh_ = false;
  margin_slots_.erase(margin_slots_.begin() + static_cast<std::ptrdiff_t>(position));
  margin_rows_.erase(margin_rows_.begin() + static_cast<std::ptrdiff_t>(position));
  if (position == 0) {
    factor_.remove_reference();
  } else {
    factor_.remove_row(position - 1);
  }
  return kernel_row;
}

// Puts the coefficient exactly on the bound it has met and files the sample by it.
void OnlineSvr::leave_margin(std::size_t position) noexcept {
  const std::size_t slot = margin_slots_[position];
  park_row(slot, detach_from_margin(position));
  const bool to_error = std::fabs(theta_[slot]) > 0.5 * box_of(slot);
  theta_[slot] = to_error ? std::copysign(box_of(slot), -residual_[slot]) : 0.0;
  assign_set(slot, to_error ? SampleSet::kError : SampleSet::kRemaining);
}

// Renews a factor that has worn out. False if it was already done in this call.
bool OnlineSvr::refactor() noexcept {
  if (!may_refactor_) return false;
  may_refactor_ = false;
  renew_factor();
  return true;
}

// Computes the factor anew from the kernel rows.
void OnlineSvr::renew_factor() noexcept {
  is_factor_fresh_ = true;
  factor_.clear();
  for (std::size_t p = 1; p < margin_size(); ++p) {
    const double* kernel_row = margin_row(p);
    for (std::size_t q = 1; q < p; ++q)
      correction_[q] = reduced_product(kernel_row, margin_slots_[q]);
    factor_.solve_lower(correction_.data() + 1);
    const double whole = reduced_product(kernel_row, margin_slots_[p]);
    const double pivot = whole - dot(correction_.data() + 1, correction_.data() + 1, p - 1);
    factor_.append(correction_.data() + 1,
                   std::max(pivot, kNegligible * kernel_magnitude(margin_slots_[p])));
  }
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

// An unsettled sample that isn't driven keeps its place until its residual meets its margin.
void OnlineSvr::await(std::size_t slot) noexcept {
  assign_set(slot, SampleSet::kUnsettled);
  if (is_leaving_[slot]) return;
  const double target = plan(slot).residual_target;
  (residual_[slot] < target ? upper_ : lower_)[slot] = target;
}

void OnlineSvr::push_unsettled(std::size_t slot) noexcept {
  if (!unsettled_.empty()) await(unsettled_.back());
  unsettled_.push_back(slot);
  assign_set(slot, SampleSet::kUnsettled);
}

void OnlineSvr::erase_unsettled(std::size_t slot) noexcept {
  unsettled_.erase(std::find(unsettled_.begin(), unsettled_.end(), slot));
  if (!unsettled_.empty()) assign_set(unsettled_.back(), SampleSet::kUnsettled);
}

// ---- Upkeep ----

void OnlineSvr::maintain() noexcept {
  refresh_one_residual();
  recentre_margin();
}

void OnlineSvr::refresh_one_residual() noexcept {
  const std::size_t slot = refresh_cursor_;
  refresh_cursor_ = (refresh_cursor_ + 1) % slot_count_;
  if (refresh_cursor_ == 0) balance_thetas();
  if (set_[slot] == SampleSet::kVacant) return;
  evaluate(slot, kSpareRow);
  residual_[slot] = dot(row(kSpareRow), theta_.data(), stride_) + bias_ - target_[slot];
}

// Takes what rounding has left of sum theta off the margin coefficient that is farthest from its
// bounds.
void OnlineSvr::balance_thetas() noexcept {
  if (margin_size() == 0) return;
  const auto room = [&](std::size_t p) {
    const std::size_t slot = margin_slots_[p];
    return std::min(std::fabs(theta_[slot]), box_of(slot) - std::fabs(theta_[slot]));
  };
  std::size_t widest = 0;
  for (std::size_t p = 1; p < margin_size(); ++p) {
    if (room(p) > room(widest)) widest = p;
  }
  const double excess = sum(theta_.data(), stride_);
  if (std::fabs(excess) >= room(widest)) return;
  theta_[margin_slots_[widest]] -= excess;
  add_scaled(-excess, margin_row(widest), residual_.data(), stride_);
}

// How far the margin sample is off its margin.
double OnlineSvr::margin_residual(std::size_t position) const noexcept {
  const double h = residual_[margin_slots_[position]];
  return h - std::copysign(options_.epsilon, h);
}

// Brings the margin samples back to h = -/+epsilon once rounding has taken one too far off: A
// delta = -(r_p - r_0).
void OnlineSvr::recentre_margin() noexcept {
  const std::size_t n = margin_size();
  double largest = 0.0;
  for (std::size_t p = 0; p < n; ++p) largest = std::max(largest, std::fabs(margin_residual(p)));
  if (largest <= kOffMargin * options_.kkt_bound()) return;

  const double reference = margin_residual(0);
  rates_[0] = 0.0;
  for (std::size_t p = 1; p < n; ++p) rates_[p] = reference - margin_residual(p);
  factor_.solve(rates_.data() + 1);
  for (std::size_t p = 1; p < n; ++p) rates_[0] -= rates_[p];

  double step = 1.0;
  for (std::size_t p = 0; p < n; ++p) {
    const std::size_t slot = margin_slots_[p];
    if (rates_[p] == 0.0) continue;
    step = std::min(step, step_to_bound(slot, rates_[p]));
  }
  for (std::size_t p = 0; p < n; ++p) row_pointers_[p] = margin_row(p);
  combine_rows(row_pointers_.data(), rates_.data(), n, 0.0, residual_rate_.data(), stride_);
  const double bias_rate = -reference - residual_rate_[margin_slots_[0]];
  for (double& rate : residual_rate_) rate += bias_rate;
  for (std::size_t p = 0; p < n; ++p) theta_[margin_slots_[p]] += step * rates_[p];
  bias_ += step * bias_rate;
  add_scaled(step, residual_rate_.data(), residual_.data(), stride_);
}

// ---- Queries ----

// Support vectors in the order of their slots, in blocks: the same sum as SvrPredictor's, to the
// bit.
double OnlineSvr::predict(std::span<const double> x) const noexcept {
  assert(x.size() == options_.dimension);
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
  for (std::size_t slot = 0; slot < slot_count_; ++slot) {
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

SetCounts OnlineSvr::set_counts() const noexcept {
  SetCounts counts;
  for (const SampleSet set : set_) {
    counts.remaining += set == SampleSet::kRemaining;
    counts.margin += set == SampleSet::kMargin;
    counts.error += set == SampleSet::kError;
    counts.unsettled += set == SampleSet::kUnsettled;
  }
  return counts;
}

double OnlineSvr::theta_sum() const noexcept {
  return sum(theta_.data(), stride_);
}

double OnlineSvr::max_kkt_violation() const noexcept {
  double largest = 0.0;
  std::array<double, kMaxDimension> x;
  for (std::size_t slot = 0; slot < slot_count_; ++slot) {
    if (set_[slot] == SampleSet::kVacant || set_[slot] == SampleSet::kUnsettled) continue;
    gather(slot, x.data());
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
