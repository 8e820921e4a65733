// SPDX-License-Identifier: Apache-2.0
#include "common/experts/expert_stack.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

namespace zerodrift::experts {
namespace {

// In nats.
constexpr double kHoldCredit = 1.0;
constexpr double kSvrCredit = 2.0;  // at the longest horizon
constexpr double kMemoryHorizons = 8.0;
constexpr double kFewestLabels = 30.0;  // that a memory of one ahead is made of
constexpr double kLongestStep = 3.0;    // in labels; a longer one is a pause
constexpr double kOldestInHorizons = 3.0;
constexpr double kOldestInLabels = 60.0;
constexpr double kCovered = 0.95;
constexpr double kLargestStep = 0.02;
constexpr double kLargestLogFactor = 3.0;
constexpr double kSmallestSquares = 1e-300;
constexpr double kMostLogAge = 50.0;  // of seconds, so that what a file says is a number
constexpr double kShortestSpacingS = 1e-3;
// The drift can't be known better than so many labels measure it.
constexpr double kLabelsInAMean = 12.0;

// Between labels, as a number to divide by.
double spacing_of(const StackForecast& forecast) {
  return std::max(forecast.spacing_s, kShortestSpacingS);
}

// An expert that says no number is as wrong as one can be.
double size_of(double error) {
  return std::abs(error) <= core::StateArchive::kLargestNumber ? std::abs(error)
                                                               : core::StateArchive::kLargestNumber;
}

// An expert that has lost by more is ruled out as well, but its share is still a number to divide
// by.
constexpr double kMostNats = 300.0;

// The 95 % quantile of Student's t of nu degrees of freedom over the normal one (Abramowitz and
// Stegun 26.7.5), within 3 % from two on. Of a single error, which it wants to be thirteen times as
// large for fear of how small it may be by chance, as much as of two.
double student_factor(double nu) {
  constexpr double kSquare = kNormalQuantile * kNormalQuantile;
  constexpr double kFirst = (kSquare + 1.0) / 4.0;
  constexpr double kSecond = ((5.0 * kSquare + 16.0) * kSquare + 3.0) / 96.0;
  constexpr double kThird = (((3.0 * kSquare + 19.0) * kSquare + 17.0) * kSquare - 15.0) / 384.0;
  const double by_one = 1.0 / std::max(nu, 2.0);
  return 1.0 + by_one * (kFirst + by_one * (kSecond + by_one * kThird));
}

using Logs = std::array<double, kExperts>;

double log_sum(std::span<const double> logs) {
  const double most = *std::max_element(logs.begin(), logs.end());
  double sum = 0.0;
  for (const double one : logs) sum += std::exp(one - most);
  return most + std::log(sum);
}

// Gives experts in time and those of the temperature what `sums` gives each of the two together.
void share_out_as(const Logs& sums, Logs& logs) {
  const std::span<double> all(logs);
  const std::span<const double> given(sums);
  for (const auto& [first, count] :
       {std::pair{std::size_t{0}, kFirstMap}, std::pair{kFirstMap, kExperts - kFirstMap}}) {
    const double shift = log_sum(given.subspan(first, count)) - log_sum(all.subspan(first, count));
    for (double& one : all.subspan(first, count)) one += shift;
  }
}

// Whoever is behind the last of `logs` has none.
std::array<double, kExperts> shares_of(std::span<const double> logs) {
  std::array<double, kExperts> shares{};
  const double most = *std::max_element(logs.begin(), logs.end());
  double sum = 0.0;
  for (std::size_t k = 0; k < logs.size(); ++k)
    sum += shares[k] = std::exp(std::max(logs[k] - most, -kMostNats));
  for (double& share : shares) share /= sum;
  return shares;
}

}  // namespace

void Hold::learn(const Labelled& label) {
  while (!held_.empty() && held_.front().time_s <= label.time_s - kWindowS) held_.pop();
  held_.push_overwriting({label.time_s, label.drift});
  average();
}

void Hold::average() noexcept {
  forecast_ = {};
  if (held_.empty()) return;
  forecast_.time_s = held_.back().time_s;
  for (std::size_t i = 0; i < held_.size(); ++i)
    forecast_.level += held_[i].drift / static_cast<double>(held_.size());
}

void Hold::carry(core::StateArchive& archive) {
  archive(held_);
  if (archive.reads()) average();
}

ExpertStack::ExpertStack(GoesBy goes_by) : linear_(goes_by == GoesBy::kTime ? kFirstMap : kSvr) {
  for (std::size_t k = 1; k < linear_; ++k) banks_.emplace_back(bank_options(kLinearExperts[k]));
  for (const double horizon_s : kHorizonsS) judged_.emplace_back(horizon_s, linear_);
  reset();
}

const LinearForecast& ExpertStack::forecast(Expert expert) const noexcept {
  const auto k = static_cast<std::size_t>(expert);
  return k == 0 ? hold_.forecast() : banks_[k - 1].forecast();
}

void ExpertStack::learn(const StackLabel& label, const Foretold& by_svr) {
  if (labels_ == 0) forecast_.reference_temperature = label.thermal.temperature;
  const Basis basis = basis_of(label.thermal, forecast_.reference_temperature);
  if (labels_ > 0) {
    // Of the first label after restart() nothing is known but that it came.
    const double step_s = label.time_s - forecast_.time_s;
    double& spacing_s = forecast_.spacing_s;
    if (step_s > 0.0) {
      const double of_no_pause_s = std::min(step_s, kLongestStep * spacing_s);
      spacing_s = spacing_s == 0.0
                      ? step_s
                      : std::min(spacing_s + 0.1 * (of_no_pause_s - spacing_s), step_s);
    }
    for (std::size_t h = 0; h < kHorizons; ++h) {
      const Snapshot* made = judged_[h].made.due(label.time_s);
      if (made != nullptr && is_of_horizon(h, label.time_s - made->mean.linear.time_s))
        judge(h, *made, label, basis, by_svr[h]);
      measure_width(h);
    }
  }
  note_level(label);
  const Labelled own{label.time_s, label.duration_s, label.drift, label.variance, basis};
  hold_.learn(own);
  for (KalmanBank& bank : banks_) bank.learn(own);
  note_doubt();
  ++labels_;
  if (has_maps()) {
    forecast_.doubt.temperature = label.thermal.temperature;
    forecast_.doubt.rate = label.thermal.rate;
  }
  forecast_.time_s = label.time_s;
  forecast_.label_variance = label.variance;
  weigh();
  for (std::size_t h = 0; h < kHorizons; ++h) keep(h);
}

// A label beside what was known before it, which after a pause is what the forecast over the pause
// was worth.
void ExpertStack::note_level(const StackLabel& label) {
  double before = forecast_.level_variance;
  if (!forecast_.knows()) before = 0.0;
  const double step_s = label.time_s - forecast_.time_s;
  if (before > 0.0 && forecast_.spacing_s > 0.0 && step_s > kLongestStep * forecast_.spacing_s)
    before = std::max(forecast_.intervals().variance_at(step_s), 0.0);
  const double own = 1.0 / label.variance;
  forecast_.level_variance =
      std::max(1.0 / (before > 0.0 ? own + 1.0 / before : own), label.variance / kLabelsInAMean);
}

void ExpertStack::note_doubt() {
  if (!has_maps()) return;
  const KalmanBank& linear = banks_[static_cast<std::size_t>(Expert::kLinear) - 1];
  ThermalDoubt& doubt = forecast_.doubt;
  doubt.temperature_variance = linear.coefficient_variance(kTemperature);
  doubt.rate_variance = linear.coefficient_variance(kTemperatureRate);
  doubt.covariance = linear.coefficient_correlation(kTemperature, kTemperatureRate) *
                     std::sqrt(doubt.temperature_variance * doubt.rate_variance);
}

// After a pause an old forecast says nothing of a horizon any more.
bool ExpertStack::is_of_horizon(std::size_t h, double age_s) const {
  return age_s <=
         std::max(kOldestInHorizons * kHorizonsS[h], kOldestInLabels * forecast_.spacing_s);
}

// The error of a label that follows a pause overlaps with none before it as far as the pause was
// long: it says as much as all the labels would that might have come in the meantime, and at most
// what a horizon's do.
double ExpertStack::evidence_step_s(std::size_t h, double since_last_s) const {
  const double spacing_s = spacing_of(forecast_);
  if (since_last_s <= kLongestStep * spacing_s) return spacing_s;
  return std::clamp(since_last_s, spacing_s, std::max(spacing_s, kHorizonsS[h]));
}

void ExpertStack::judge(std::size_t h, const Snapshot& made, const StackLabel& label,
                        const Basis& basis, const std::optional<SvrForecast>& by_svr) {
  Judged& judged = judged_[h];
  const double spacing_s = spacing_of(forecast_);
  const double memory_s = kMemoryHorizons * std::max(kHorizonsS[h], kFewestLabels * spacing_s);
  const double step_s = evidence_step_s(h, label.time_s - forecast_.time_s);
  const double kept = std::exp(-step_s / memory_s);
  const double labels = step_s / spacing_s;  // that it counts for
  judged.count = kept * judged.count + labels;
  for (std::size_t k = 0; k < linear_; ++k) {
    const double error = size_of(label.drift - made.expert[k].at(label.time_s, basis));
    judged.squares[k] = kept * judged.squares[k] + labels * error * error;
  }
  if (has_maps()) {
    // As long as the SVR says nothing it holds.
    const double by_hold = made.expert[0].at(label.time_s, basis);
    const double error = size_of(label.drift - (by_svr ? by_svr->drift : by_hold));
    judged.squares[kSvr] = kept * judged.squares[kSvr] + labels * error * error;
  }
  const double age_s = label.time_s - made.mean.linear.time_s;
  if (h == 0 && age_s > kLongestStep * spacing_s) return;
  // Of an error that the doubt of the temperature's effect makes room for, the interval's share.
  const double stated = made.stated.half_width_at(age_s);
  const double room = kNormalQuantile * std::sqrt(made.doubt.variance_at(label.thermal));
  const double share = stated > 0.0 ? stated / std::hypot(stated, room) : 1.0;
  const double own_error = share * size_of(label.drift - made.mean.at(label.time_s, basis, by_svr));
  note_error(h, label.time_s, own_error, age_s);
  if (made.stated.judged[h].half_width >= 0.0) follow_misses(h, own_error, stated);
}

void ExpertStack::follow_misses(std::size_t h, double error, double stated_half_width) {
  const double step = kHorizonsS[h] > 0.0
                          ? std::min(kLargestStep, forecast_.spacing_s / kHorizonsS[h])
                          : kLargestStep;
  const double missed = error > stated_half_width ? 1.0 : 0.0;
  double& log_factor = judged_[h].log_factor;
  log_factor = std::clamp(log_factor + step * (missed - (1.0 - kCovered)), -kLargestLogFactor,
                          kLargestLogFactor);
}

// Overlapping errors say the same again and again: one is kept in so long a time.
double ExpertStack::error_room_s(std::size_t h) {
  return kMemoryHorizons * kHorizonsS[h] / static_cast<double>(kErrors);
}

void ExpertStack::note_error(std::size_t h, double time_s, double error, double age_s) {
  auto& [made, squares, count, noted_s, errors, sorted, independent, log_ages, log_factor] =
      judged_[h];
  if (noted_s && time_s - *noted_s < error_room_s(h)) return;
  const bool overlaps = noted_s && time_s - *noted_s < kHorizonsS[h];
  const double own_part = overlaps ? (time_s - *noted_s) / kHorizonsS[h] : 1.0;
  noted_s = time_s;
  const double apart_s = std::max(spacing_of(forecast_), error_room_s(h));
  const double most =
      std::clamp(kMemoryHorizons * kHorizonsS[h] / apart_s, 40.0, static_cast<double>(kErrors));
  while (static_cast<double>(errors.size()) + 1.0 > most) {
    sorted.erase(std::lower_bound(sorted.begin(), sorted.end(), errors.front().size));
    independent -= errors.front().independent;
    log_ages -= errors.front().log_age;
    errors.pop();
  }
  errors.push_overwriting({error, own_part, std::log(std::max(age_s, kShortestSpacingS))});
  independent += own_part;
  log_ages += errors.back().log_age;
  sorted.insert(std::upper_bound(sorted.begin(), sorted.end(), error), error);
}

void ExpertStack::measure_width(std::size_t h) {
  const auto& sorted = judged_[h].sorted;
  auto& [mean, half_width, judged_age_s, shares] = forecast_.horizons[h];
  half_width = -1.0;
  if (sorted.empty()) return;
  const auto n = static_cast<double>(sorted.size());
  const double rank = std::clamp(std::ceil(kCovered * (n + 1.0)) - 1.0, 0.0, n - 1.0);
  const double independent = std::max(1.0, judged_[h].independent);
  half_width = sorted[static_cast<std::size_t>(rank)] * student_factor(independent) *
               std::exp(judged_[h].log_factor);
  judged_age_s = std::exp(judged_[h].log_ages / n);
  // Where few errors of this age are known they may all be small: an older forecast is no better
  // than a newer one.
  for (std::size_t i = 0; i < h; ++i) {
    if (forecast_.horizons[i].half_width < 0.0) continue;
    half_width = std::max(half_width, forecast_.horizons[i].half_width);
    judged_age_s = std::max(judged_age_s, forecast_.horizons[i].judged_age_s);
  }
}

Logs ExpertStack::log_likelihood(std::size_t h) const {
  const Judged& judged = judged_[h];
  const double independent =
      1.0 + (h == 0 ? 0.5 * judged.count : judged.count * forecast_.spacing_s / kHorizonsS[h]);
  Logs logs{};
  for (std::size_t k = 0; k < experts(); ++k)
    logs[k] = -0.5 * independent * std::log(std::max(judged.squares[k], kSmallestSquares));
  return logs;
}

void ExpertStack::weigh() {
  Logs own{};  // of this horizon; where it was never judged, of the longest one below that was
  Logs all{};  // of shorter ones as well
  bool is_judged = false;
  for (std::size_t h = 0; h < kHorizons; ++h) {
    if (judged_[h].count > 0.0) {
      own = log_likelihood(h);
      for (std::size_t k = 0; k < kExperts; ++k) all[k] += own[k];
      is_judged = true;
    } else {
      all = own;
    }
    if (is_judged) {
      Logs by_itself = own;
      Logs logs = all;
      for (Logs* credited : {&by_itself, &logs}) {
        credited->front() += kHoldCredit;
        if (h + 1 == kHorizons) credited->back() += kSvrCredit;
      }
      if (h + 1 == kHorizons && has_maps()) share_out_as(by_itself, logs);
      forecast_.horizons[h].shares = shares_of(std::span(logs).first(experts()));
    }
    average(h);
  }
}

void ExpertStack::average(std::size_t h) {
  auto& [mean, half_width, judged_age_s, shares] = forecast_.horizons[h];
  mean = {.linear = {.time_s = forecast_.time_s}, .svr_share = shares[kSvr]};
  const double linear = std::max(1.0 - shares[kSvr], 1e-12);
  for (std::size_t k = 0; k < linear_; ++k)
    mean.linear.add(shares[k] / linear, forecast(kLinearExperts[k]));
  if (h + 1 < kHorizons || !has_maps()) return;
  double linear_maps = 0.0;
  for (std::size_t k = kFirstMap; k < kSvr; ++k) linear_maps += shares[k];
  if (linear_maps == 0.0) return;  // before anything was judged
  mean.maps_share = linear_maps + shares[kSvr];
  mean.cubic = forecast(Expert::kCubic);
  mean.linear_maps.time_s = forecast_.time_s;
  for (std::size_t k = kFirstMap; k < kSvr; ++k)
    mean.linear_maps.add(shares[k] / linear_maps, forecast(kLinearExperts[k]));
}

void ExpertStack::keep(std::size_t h) {
  auto& made = judged_[h].made;
  if (!made.wants(forecast_.time_s)) return;
  Snapshot& snapshot = made.keep(forecast_.time_s);
  for (std::size_t k = 0; k < linear_; ++k) snapshot.expert[k] = forecast(kLinearExperts[k]);
  snapshot.mean = forecast_.horizons[h].mean;
  snapshot.stated = forecast_.intervals();
  snapshot.doubt = forecast_.doubt;
}

void ExpertStack::restart() noexcept {
  hold_.restart();
  for (KalmanBank& bank : banks_) bank.restart();
  for (Judged& judged : judged_) {
    judged.made.clear();
    judged.noted_s.reset();
  }
  forecast_.label_variance = 0.0;  // nothing is known of the level until the next label
}

void ExpertStack::reset() noexcept {
  labels_ = 0;
  hold_.restart();
  for (KalmanBank& bank : banks_) bank.reset();
  for (Judged& judged : judged_) {
    judged.made.clear();
    judged.squares = {};
    judged.count = 0.0;
    judged.noted_s.reset();
    judged.errors.clear();
    judged.sorted.clear();
    judged.independent = 0.0;
    judged.log_ages = 0.0;
    judged.log_factor = 0.0;
  }
  forecast_ = {};
  // Until a horizon was judged, the last minute is held.
  for (auto& horizon : forecast_.horizons) horizon.shares[0] = 1.0;
}

// What follows from the rest is made anew.
void ExpertStack::carry(core::StateArchive& archive) {
  if (archive.reads()) reset();
  archive(labels_, forecast_.time_s, forecast_.spacing_s, forecast_.label_variance,
          forecast_.level_variance, forecast_.reference_temperature, forecast_.doubt, hold_);
  archive.require(forecast_.spacing_s >= 0.0 && forecast_.label_variance >= 0.0 &&
                  forecast_.level_variance >= 0.0);
  for (KalmanBank& bank : banks_) archive(bank);
  for (Judged& judged : judged_) {
    archive(judged.made);
    for (double& square : judged.squares) {
      archive.sums(square);
      archive.require(square >= 0.0);
    }
    archive(judged.count, judged.noted_s, judged.errors, judged.independent, judged.log_ages,
            judged.log_factor);
    archive.require(judged.count >= 0.0 && std::abs(judged.log_factor) <= kLargestLogFactor);
    archive.require(std::abs(judged.log_ages) <= kMostLogAge * kErrors);
    for (std::size_t i = 0; i < judged.errors.size(); ++i) {
      archive.require(judged.errors[i].size >= 0.0);
      archive.require(std::abs(judged.errors[i].log_age) <= kMostLogAge);
    }
  }
  if (!archive.reads() || !archive.ok()) return;
  for (std::size_t h = 0; h < kHorizons; ++h) {
    auto& sorted = judged_[h].sorted;
    sorted.clear();
    for (std::size_t i = 0; i < judged_[h].errors.size(); ++i)
      sorted.push_back(judged_[h].errors[i].size);
    std::sort(sorted.begin(), sorted.end());
    measure_width(h);
  }
  if (labels_ == 0) return;
  weigh();
  note_doubt();
}

}  // namespace zerodrift::experts
