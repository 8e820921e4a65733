// SPDX-License-Identifier: Apache-2.0
#include "common/compensation/drift_forecast.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace zerodrift::compensation {
namespace {

constexpr std::array<double, kHorizons> kHorizonRatios{1.0, 2.5, 7.5, 25.0, 75.0, 250.0};
// A model is judged at ages from its horizon to twice that: 1.5 in the mean, until ages are known.
constexpr double kMeanAge = 1.5;
constexpr double kOldestMeanAge = 2.0;
constexpr double kOldestJudged = 3.0;
constexpr double kJudgedEvery = 0.125;  // of its horizon: errors within one are much the same
constexpr double kMemoryWindows = 8.0;
constexpr double kLongMemoryWindows = 64.0;
constexpr double kLargestChangeInRms = 3.0;
constexpr double kScaleWindows = 1.0;
constexpr double kVarianceWindows = 8.0;
constexpr double kVarianceLabels = 12.0;  // at least so many labels make a variance
// (2e-7 deg/h)²: keeps a noise-free record from dividing by zero.
constexpr double kSmallestVariance = 1e-24;
// Windows that the prior counts for: the next shorter horizon's weight, and holding for the
// shortest, which gathers experience of its own within minutes.
constexpr double kPriorWindows = 3.0;
constexpr double kPriorWindowsOfShortest = 0.3;
// Proof asked for within what was learned: half a window in which the forecast beat holding, and
// the model alone was not far behind it (1.4 times the error).
constexpr double kWindowsToProve = 0.5;
constexpr double kLargestLossRatio = 1.0;
constexpr double kLargestModelLossRatio = 2.0;
// What is proved stays so until it is this much worse than what it had to prove: the loss is a
// square, 5 % rms. Else noise alone changes the mode at every other label.
constexpr double kLossRatioToLeave = 1.1;
// Beyond it: two windows, and 0.7 times holding's error by forecast and model alike.
constexpr double kWindowsToProveBeyond = 2.0;
constexpr double kLargestLossRatioBeyond = 0.5;
// No gyro drifts so far: what predicts more was not learned but made up.
constexpr double kLargestDriftRadps = 1e6;
// Horizons of a state, s: of labels as long as options allow.
constexpr double kShortestKept = 1.0;
constexpr double kLongestKept = 1e12;

double clamped(double weight) {
  return std::clamp(weight, 0.0, 1.0);
}

// Position of a horizon among the table's, for interpolation over its logarithm.
struct Position {
  std::size_t below = 0;
  std::size_t above = 0;
  double share = 0.0;  // of `above`
};

Position position_of(double horizon_s, const TrustTable& table) {
  const auto& at = table.horizon_s;
  if (horizon_s <= at.front()) return {};
  if (horizon_s >= at.back()) return {kHorizons - 1, kHorizons - 1, 0.0};
  std::size_t below = 0;
  while (at[below + 1] <= horizon_s) ++below;
  return {below, below + 1, std::log(horizon_s / at[below]) / std::log(at[below + 1] / at[below])};
}

double horizon_of(const DriftModel& model, const TrustTable& trust, core::SensorTime now) {
  return model.is_of_unknown_age(now) ? trust.horizon_s.back() : core::seconds(now - model.time);
}

ForecastWeights weights_at(const std::array<ForecastTrust, kHorizons>& entries,
                           const Position& position) {
  const ForecastWeights& below = entries[position.below].weights;
  const ForecastWeights& above = entries[position.above].weights;
  return {(1.0 - position.share) * below.change + position.share * above.change,
          (1.0 - position.share) * below.level + position.share * above.level};
}

// The variance that experience states at a horizon, with that of a mean which has just begun on
// top; where there is none, that of the nearest shorter horizon with experience, growing like a
// random walk.
double variance_at(const std::array<ForecastTrust, kHorizons>& trust, const TrustTable& table,
                   double horizon_s, double ForecastTrust::*variance, double own_variance,
                   double unsettled_variance) {
  const Position position = position_of(horizon_s, table);
  const auto grown = [&](std::size_t entry) {
    for (std::size_t k = entry + 1; k-- > 0;) {
      if (trust[k].*variance >= 0.0) {
        return trust[k].*variance * std::max(1.0, horizon_s / table.horizon_s[k]) +
               unsettled_variance;
      }
    }
    return own_variance * std::max(1.0, horizon_s / table.horizon_s.front());
  };
  const auto entry = [&](std::size_t k) {
    return trust[k].*variance >= 0.0 ? trust[k].*variance + unsettled_variance : grown(k);
  };
  if (horizon_s > table.horizon_s.back()) return grown(kHorizons - 1);
  if (horizon_s < table.horizon_s.front()) {
    return std::lerp(std::min(own_variance, entry(0)), entry(0),
                     horizon_s / table.horizon_s.front());
  }
  return (1.0 - position.share) * entry(position.below) + position.share * entry(position.above);
}

}  // namespace

double DriftModel::predict(const FeatureArray& features) const noexcept {
  const double drift =
      offset_radps + scale_radps * predictor.predict({features.data(), predictor.dimension()});
  return std::abs(drift) <= kLargestDriftRadps ? drift : offset_radps;
}

bool DriftModel::has_learned_near(const FeatureArray& features) const noexcept {
  return domain.has_within({features.data(), predictor.dimension()}, kDomainRadius * kDomainRadius);
}

double held_variance(const DriftModel& model, const TrustTable& trust,
                     core::SensorTime now) noexcept {
  return variance_at(trust.learned, trust, horizon_of(model, trust, now),
                     &ForecastTrust::held_variance, model.held_variance, model.unsettled_variance);
}

double longest_held_variance(const DriftModel& model, const TrustTable& trust) noexcept {
  return variance_at(trust.learned, trust, trust.horizon_s.back(), &ForecastTrust::held_variance,
                     model.held_variance, model.unsettled_variance);
}

Forecast forecast(const DriftModel& model, const TrustTable& trust, const FeatureArray& features,
                  core::SensorTime now) noexcept {
  const double horizon_s = horizon_of(model, trust, now);
  const Position position = position_of(horizon_s, trust);
  Forecast out;
  out.beyond_learned = !model.has_learned_near(features);
  const auto& entries = out.beyond_learned ? trust.beyond : trust.learned;
  const ForecastWeights weights = weights_at(entries, position);
  const double changed = model.predict(features) - model.predicted_held_radps;
  const double most = std::lerp(trust.largest_change_radps[position.below],
                                trust.largest_change_radps[position.above], position.share);
  const double moved =
      weights.change * changed + weights.level * (model.predicted_held_radps - model.held_radps);
  out.drift_radps = model.held_radps + std::clamp(moved, -most, most);
  if (weights.are_proved()) {
    out.kind = ForecastKind::kModel;
    // As far as the model's level takes the held one's place, that one's error is none.
    const double held = 1.0 - weights.level;
    out.variance = variance_at(entries, trust, horizon_s, &ForecastTrust::forecast_variance,
                               model.held_variance, held * held * model.unsettled_variance);
    return out;
  }
  out.kind = out.beyond_learned ? ForecastKind::kBeyond : ForecastKind::kUnproved;
  out.variance = held_variance(model, trust, now);
  // Held beyond what was learned: what the model would have changed may be the error.
  if (out.beyond_learned) out.variance += changed * changed;
  return out;
}

bool is_in_force(const DriftModel& model, const TrustTable& trust, bool beyond_learned,
                 core::SensorTime now) noexcept {
  return weights_at(beyond_learned ? trust.beyond : trust.learned,
                    position_of(horizon_of(model, trust, now), trust))
      .are_proved();
}

ForecastWeights likeliest_weights(const WeightEvidence& evidence, double ridge,
                                  double prior_change) noexcept {
  const double a = evidence.change_change + ridge;
  const double c = evidence.level_level + ridge;
  const double b = evidence.change_level;
  const double u = evidence.change_error + ridge * prior_change;
  const double v = evidence.level_error;
  ForecastWeights best;
  double least = std::numeric_limits<double>::infinity();
  const auto consider = [&](double change, double level) {
    const double cost = a * change * change + 2.0 * b * change * level + c * level * level -
                        2.0 * (u * change + v * level);
    if (cost < least) {
      least = cost;
      best = {change, level};
    }
  };
  const double determinant = a * c - b * b;  // > 0 with a ridge unless a term is absent
  if (determinant > 0.0) {
    const double change = (u * c - v * b) / determinant;
    const double level = (a * v - b * u) / determinant;
    if (change >= 0.0 && change <= 1.0 && level >= 0.0 && level <= 1.0) consider(change, level);
  }
  for (const double edge : {0.0, 1.0}) {
    consider(edge, c > 0.0 ? clamped((v - b * edge) / c) : 0.0);
    consider(a > 0.0 ? clamped((u - b * edge) / a) : 0.0, edge);
  }
  return best;
}

// ------------------------------------------------------------------------------------------- state

void DriftModel::carry_level(core::StateArchive& archive) {
  archive(time, held_radps, held_slope_radps2, held_variance, predicted_held_radps, trained,
          offset_radps, scale_radps);
  for (const double drift : {held_radps, predicted_held_radps, offset_radps})
    archive.require(std::abs(drift) <= kLargestDriftRadps);
  archive.require(held_variance >= 0.0 && scale_radps > 0.0);
}

// Of a model that holds nothing nothing is kept.
void DriftModel::carry(core::StateArchive& archive) {
  bool there = holds();
  archive(there);
  if (!there) {
    time = core::kNever;
    return;
  }
  carry_level(archive);
  archive.require(holds() && trained);
  archive(predictor, domain);
}

void ForecastWeights::carry(core::StateArchive& archive) {
  archive(change, level);
  for (const double weight : {change, level}) archive.require(weight >= 0.0 && weight <= 1.0);
}

void ForecastTrust::carry(core::StateArchive& archive) {
  archive(weights, forecast_variance, held_variance);
  for (const double variance : {forecast_variance, held_variance})
    archive.require(variance >= 0.0 || variance == -1.0);
}

void TrustTable::carry(core::StateArchive& archive) {
  archive(learned, beyond, horizon_s, largest_change_radps);
  double shorter_s = 0.0;
  for (const double horizon : horizon_s) {
    archive.require(horizon >= kShortestKept && horizon <= kLongestKept && horizon > shorter_s);
    shorter_s = horizon;
  }
  for (const double change : largest_change_radps) archive.require(change >= 0.0);
}

// As long as nothing was judged, all is 0.
void ForecastJudge::Experience::carry(core::StateArchive& archive) {
  bool there = windows > 0.0;
  archive(there);
  if (!there) {
    *this = {};
    return;
  }
  archive.sums(windows, error_scale, scale_windows, change_change, change_level, level_level,
               change_error, level_error, forecast_loss, held_loss, model_loss, forecast_square,
               held_square, square_weight, label_variance);
  archive(weights);
  for (const double sum :
       {windows, error_scale, scale_windows, change_change, level_level, forecast_loss, held_loss,
        model_loss, forecast_square, held_square, square_weight, label_variance}) {
    archive.require(sum >= 0.0);
  }
}

void ForecastJudge::Horizon::carry(core::StateArchive& archive) {
  archive(judged, waiting, learned, beyond, moved_square, moved_weight, aged, last_judged);
  for (const double sum : {moved_square, moved_weight, aged}) archive.require(sum >= 0.0);
}

// ------------------------------------------------------------------------------------------- judge

ForecastJudge::ForecastJudge(double shortest_horizon_s, std::size_t dimension,
                             std::size_t capacity) {
  horizons_.reserve(kHorizons);
  for (std::size_t k = 0; k < kHorizons; ++k) {
    const double age_s = shortest_horizon_s * kHorizonRatios[k];
    horizons_.push_back({age_s, {dimension, capacity}, {dimension, capacity}});
  }
  place_horizons();
}

void ForecastJudge::place_horizons() noexcept {
  for (std::size_t k = 0; k < kHorizons; ++k) table_.horizon_s[k] = kMeanAge * horizons_[k].age_s;
}

void ForecastJudge::judge(const JudgedLabel& label) noexcept {
  for (std::size_t k = 0; k < kHorizons; ++k) {
    Horizon& horizon = horizons_[k];
    const bool aged = horizon.waiting.holds() &&
                      core::seconds(label.time - horizon.waiting.time) >= horizon.age_s;
    if (aged) {
      std::swap(horizon.judged, horizon.waiting);
      horizon.waiting.time = core::kNever;
    }
    const DriftModel& model = horizon.judged;
    // After a pause an old model says nothing of this horizon any more.
    const bool in_age =
        model.holds() && core::seconds(label.time - model.time) <= kOldestJudged * horizon.age_s;
    const bool is_time =
        horizon.last_judged == core::kNever ||
        core::seconds(label.time - horizon.last_judged) >= kJudgedEvery * horizon.age_s;
    if (model.trained && in_age && is_time) judge(k, label);
  }
}

void ForecastJudge::judge(std::size_t k, const JudgedLabel& label) noexcept {
  const DriftModel& model = horizons_[k].judged;
  const bool beyond = !model.has_learned_near(label.features);
  Experience& seen = beyond ? horizons_[k].beyond : horizons_[k].learned;
  const double predicted = model.predict(label.features);
  const double change = predicted - model.predicted_held_radps;
  const double level = model.predicted_held_radps - model.held_radps;
  const double held_error = label.drift_radps - model.held_radps;
  const double model_error = label.drift_radps - predicted;
  const double most_moved = table_.largest_change_radps[k];
  const double error =
      held_error - std::clamp(seen.weights.change * change + seen.weights.level * level,
                              -most_moved, most_moved);

  // The first label is no more of a window than any other.
  const double since_last_s = horizons_[k].last_judged == core::kNever
                                  ? kJudgedEvery * horizons_[k].age_s
                                  : core::seconds(label.time - horizons_[k].last_judged);
  horizons_[k].last_judged = label.time;
  const double window = std::clamp(since_last_s / (kMeanAge * horizons_[k].age_s), 1e-6, 1.0);
  const auto fade = [&](double& sum, double windows) { sum *= std::exp(-window / windows); };

  fade(seen.error_scale, kScaleWindows);
  fade(seen.scale_windows, kScaleWindows);
  seen.error_scale +=
      window * (held_error * held_error + std::max(label.variance, kSmallestVariance));
  seen.scale_windows += window;
  const double weight = window * seen.scale_windows / seen.error_scale;

  const double kept = std::exp(-window / kMemoryWindows);
  for (double* sum : {&seen.windows, &seen.change_change, &seen.change_level, &seen.level_level,
                      &seen.change_error, &seen.level_error, &seen.forecast_loss, &seen.held_loss,
                      &seen.model_loss}) {
    *sum *= kept;
  }
  seen.windows += window;
  seen.change_change += weight * change * change;
  seen.change_level += weight * change * level;
  seen.level_level += weight * level * level;
  seen.change_error += weight * change * held_error;
  seen.level_error += weight * level * held_error;
  seen.forecast_loss += weight * error * error;
  seen.held_loss += weight * held_error * held_error;
  seen.model_loss += weight * model_error * model_error;

  const double memory = std::max(kVarianceWindows, kVarianceLabels * window);
  for (double* sum :
       {&seen.forecast_square, &seen.held_square, &seen.square_weight, &seen.label_variance}) {
    fade(*sum, memory);
  }
  seen.forecast_square += window * error * error;
  seen.held_square += window * held_error * held_error;
  seen.label_variance += window * label.variance;
  seen.square_weight += window;

  Horizon& horizon = horizons_[k];
  fade(horizon.moved_square, kLongMemoryWindows);
  fade(horizon.moved_weight, kLongMemoryWindows);
  fade(horizon.aged, kLongMemoryWindows);
  horizon.moved_square += window * held_error * held_error;
  horizon.moved_weight += window;
  horizon.aged += window * core::seconds(label.time - model.time);
  table_.horizon_s[k] = std::clamp(horizon.aged / horizon.moved_weight, horizon.age_s,
                                   kOldestMeanAge * horizon.age_s);
  table_.largest_change_radps[k] =
      kLargestChangeInRms * std::sqrt(horizon.moved_square / horizon.moved_weight);

  auto& entries = beyond ? table_.beyond : table_.learned;
  const double prior = k > 0 ? entries[k - 1].weights.change : 0.0;
  // In units of the forecast's own error, so that a clear relation is not held back: a prior with
  // standard deviations of 1 against errors that are one and the same for some windows.
  const double ridge =
      (k > 0 ? kPriorWindows : kPriorWindowsOfShortest) * seen.forecast_loss / seen.windows;
  seen.weights = likeliest_weights({seen.change_change, seen.change_level, seen.level_level,
                                    seen.change_error, seen.level_error},
                                   ridge, prior);
  const double leeway = entries[k].weights.are_proved() ? kLossRatioToLeave : 1.0;
  const double most = leeway * (beyond ? kLargestLossRatioBeyond : kLargestLossRatio);
  const double most_of_model = leeway * (beyond ? kLargestLossRatioBeyond : kLargestModelLossRatio);
  const bool proved = seen.windows >= (beyond ? kWindowsToProveBeyond : kWindowsToProve) &&
                      seen.forecast_loss <= most * seen.held_loss &&
                      seen.model_loss <= most_of_model * seen.held_loss;
  entries[k] = trust_of(seen, proved);
}

ForecastTrust ForecastJudge::trust_of(const Experience& seen, bool proved) noexcept {
  const double label_variance = seen.label_variance / seen.square_weight;
  // The label's own noise is not the drift's; what is left can't be known better than a minute of
  // labels measures it.
  const auto drift_variance = [&](double square) {
    return std::max(square / seen.square_weight - label_variance, label_variance / kVarianceLabels);
  };
  ForecastTrust trust;
  if (proved) trust.weights = seen.weights;
  trust.held_variance = drift_variance(seen.held_square);
  trust.forecast_variance = proved ? drift_variance(seen.forecast_square) : trust.held_variance;
  return trust;
}

void ForecastJudge::keep(const DriftModel& model) noexcept {
  for (Horizon& horizon : horizons_) {
    if (!horizon.waiting.holds()) horizon.waiting = model;
  }
}

void ForecastJudge::restart() noexcept {
  for (Horizon& horizon : horizons_) {
    horizon.judged.time = horizon.waiting.time = core::kNever;
    horizon.last_judged = core::kNever;
  }
}

void ForecastJudge::reset() noexcept {
  restart();
  for (Horizon& horizon : horizons_) {
    horizon.learned = horizon.beyond = {};
    horizon.moved_square = horizon.moved_weight = horizon.aged = 0.0;
  }
  table_ = {};
  place_horizons();
}

}  // namespace zerodrift::compensation
