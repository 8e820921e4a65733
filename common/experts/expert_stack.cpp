// SPDX-License-Identifier: Apache-2.0
#include "common/experts/expert_stack.h"

#include <algorithm>
#include <cmath>

#include "common/experts/thermal_basis.h"

namespace zerodrift::experts {
namespace {

constexpr double kHoldCredit = 1.0;  // nats
constexpr double kMemoryHorizons = 8.0;
constexpr double kFewestLabels = 30.0;  // that a memory of one ahead is made of
constexpr double kNormalQuantile = 1.959963984540054;
constexpr double kCovered = 0.95;

}  // namespace

std::string_view name(Expert expert) {
  switch (expert) {
    case Expert::kHold:
      return "hold";
    case Expert::kRandomWalk:
      return "random-walk";
    case Expert::kTrend:
      return "trend";
    case Expert::kLinear:
      return "linear";
    case Expert::kCubic:
      return "cubic";
    case Expert::kLagged:
      return "lagged";
    case Expert::kShupe:
      return "shupe";
    case Expert::kOnlineSvr:
      return "online-svr";
  }
  return "unknown";
}

KalmanBankOptions bank_options(Expert expert) {
  std::vector<std::size_t> terms;
  switch (expert) {
    case Expert::kHold:
    case Expert::kRandomWalk:
    case Expert::kOnlineSvr:
      break;
    case Expert::kTrend:
      return {.slopes = SlopeModel::kDamped};
    case Expert::kLinear:
      terms = {kTemperature, kTemperatureRate};
      break;
    case Expert::kCubic:
      terms = {kTemperature, kTemperatureRate, kTemperatureSquared, kTemperatureCubed,
               kTemperatureTimesRate};
      break;
    case Expert::kLagged:
      terms = {kTemperature, kTemperatureSquared};
      break;
    case Expert::kShupe:
      terms = {kTemperature, kTemperatureRate, kTemperatureSquared, kTemperatureCubed,
               kTemperatureTimesRate};
      break;
  }
  if (expert == Expert::kLagged || expert == Expert::kShupe) {
    for (std::size_t i = 0; i < kMemoryTimesS.size(); ++i) terms.push_back(kFirstMemory + i);
  }
  return {.terms = terms};
}

void Hold::learn(const Labelled& label) {
  while (!held_.empty() && held_.front().time_s <= label.time_s - kWindowS) held_.pop();
  held_.push_overwriting({label.time_s, label.drift});
  forecast_ = {.time_s = label.time_s};
  for (std::size_t i = 0; i < held_.size(); ++i)
    forecast_.level += held_[i].drift / static_cast<double>(held_.size());
}

ExpertStack::ExpertStack() {
  for (const Expert expert : kLinearExperts) {
    if (expert != Expert::kHold) banks_.emplace_back(bank_options(expert));
  }
  for (Horizon& horizon : horizons_) {
    horizon.weights[0] = 1.0;
    horizon.sorted.reserve(kErrors);
  }
}

const LinearForecast& ExpertStack::forecast(Expert expert) const noexcept {
  const auto k = static_cast<std::size_t>(expert);
  return k == 0 ? hold_.forecast() : banks_[k - 1].forecast();
}

void ExpertStack::learn(const Labelled& label, const Foretold& by_svr) {
  if (labels_ > 0) {
    const double step_s = label.time_s - time_s_;
    spacing_s_ = labels_ == 1 ? step_s : std::min(spacing_s_ + 0.1 * (step_s - spacing_s_), step_s);
    for (std::size_t h = 0; h < kHorizons; ++h) {
      auto& made = horizons_[h].made;
      // The newest one that is old enough; what is older still is of no use any more.
      while (made.size() > 1 && label.time_s - made[1].mean.linear.time_s >= kHorizonsS[h])
        made.pop();
      if (!made.empty() && label.time_s - made.front().mean.linear.time_s >= kHorizonsS[h])
        judge(h, made.front(), label, by_svr[h]);
    }
  }
  hold_.learn(label);
  for (KalmanBank& bank : banks_) bank.learn(label);
  time_s_ = label.time_s;
  ++labels_;
  for (std::size_t h = 0; h < kHorizons; ++h) weigh(h);
  for (std::size_t h = 0; h < kHorizons; ++h) keep(h);
}

void ExpertStack::judge(std::size_t h, const Snapshot& made, const Labelled& label,
                        std::optional<double> by_svr) {
  Horizon& horizon = horizons_[h];
  const double memory_s = kMemoryHorizons * std::max(kHorizonsS[h], kFewestLabels * spacing_s_);
  const double kept = std::exp(-spacing_s_ / memory_s);
  horizon.count = kept * horizon.count + 1.0;
  constexpr std::size_t kSvr = kLinearExperts.size();
  for (std::size_t k = 0; k < kSvr; ++k) {
    const double error = label.drift - made.expert[k].at(label.time_s, label.basis);
    horizon.squares[k] = kept * horizon.squares[k] + error * error;
  }
  // As long as the SVR says nothing it holds.
  const double error =
      by_svr ? label.drift - *by_svr : label.drift - made.expert[0].at(label.time_s, label.basis);
  horizon.squares[kSvr] = kept * horizon.squares[kSvr] + error * error;
  note_error(h, std::abs(label.drift - made.mean.at(label.time_s, label.basis, by_svr)));
}

void ExpertStack::note_error(std::size_t h, double error) {
  Horizon& horizon = horizons_[h];
  auto& sorted = horizon.sorted;
  // Overlapping errors say the same again and again: enough of them for twenty horizons.
  const double most =
      std::clamp(20.0 * kHorizonsS[h] / spacing_s_, 40.0, static_cast<double>(kErrors));
  while (static_cast<double>(horizon.errors.size()) + 1.0 > most) {
    sorted.erase(std::lower_bound(sorted.begin(), sorted.end(), horizon.errors.front()));
    horizon.errors.pop();
  }
  horizon.errors.push_overwriting(error);
  sorted.insert(std::upper_bound(sorted.begin(), sorted.end(), error), error);
  const auto n = static_cast<double>(sorted.size());
  horizon.half_width = sorted[static_cast<std::size_t>(
      std::clamp(std::ceil(kCovered * (n + 1.0)) - 1.0, 0.0, n - 1.0))];
}

void ExpertStack::weigh(std::size_t h) {
  Horizon& horizon = horizons_[h];
  if (horizon.count > 0.0) {
    const double independent =
        1.0 + (h == 0 ? 0.5 * horizon.count : horizon.count * spacing_s_ / kHorizonsS[h]);
    std::array<double, kExperts> logs{};
    for (std::size_t k = 0; k < kExperts; ++k)
      logs[k] = -0.5 * independent * std::log(std::max(horizon.squares[k], 1e-300));
    logs[0] += kHoldCredit;
    const double most = *std::max_element(logs.begin(), logs.end());
    double sum = 0.0;
    for (std::size_t k = 0; k < kExperts; ++k) sum += horizon.weights[k] = std::exp(logs[k] - most);
    for (double& weight : horizon.weights) weight /= sum;
  } else if (h > 0) {
    horizon.weights = horizons_[h - 1].weights;
  }
  horizon.mean = {.linear = {.time_s = time_s_}, .svr_share = horizon.weights.back()};
  const double linear = std::max(1.0 - horizon.weights.back(), 1e-12);
  for (const Expert expert : kLinearExperts) {
    horizon.mean.linear.add(horizon.weights[static_cast<std::size_t>(expert)] / linear,
                            forecast(expert));
  }
}

void ExpertStack::keep(std::size_t h) {
  Horizon& horizon = horizons_[h];
  const auto& made = horizon.made;
  if (!made.empty() && time_s_ - made.back().mean.linear.time_s <
                           kHorizonsS[h] / static_cast<double>(kSnapshots - 1))
    return;
  Snapshot snapshot;
  for (const Expert expert : kLinearExperts)
    snapshot.expert[static_cast<std::size_t>(expert)] = forecast(expert);
  snapshot.mean = horizon.mean;
  horizon.made.push_overwriting(snapshot);
}

// Ages between two horizons: linear in the logarithm.
ExpertStack::Between ExpertStack::between(double age_s) const noexcept {
  const auto of = [this](std::size_t h) {
    return h == 0 ? std::clamp(spacing_s_, 1e-3, 0.5 * kHorizonsS[1]) : kHorizonsS[h];
  };
  if (age_s <= of(0)) return {0, 0, 0.0};
  std::size_t h = 1;
  while (h + 1 < kHorizons && age_s > of(h)) ++h;
  const double share = std::log(age_s / of(h - 1)) / std::log(of(h) / of(h - 1));
  return {h - 1, h, std::clamp(share, 0.0, 1.0)};
}

std::array<double, kExperts> ExpertStack::shares(double age_s) const noexcept {
  const auto [lower, upper, share] = between(age_s);
  std::array<double, kExperts> out{};
  for (std::size_t k = 0; k < kExperts; ++k) {
    out[k] = (1.0 - share) * horizons_[lower].weights[k] + share * horizons_[upper].weights[k];
  }
  return out;
}

ExpertStack::Prediction ExpertStack::predict(double time_s, const Basis& basis,
                                             std::optional<double> by_svr) const noexcept {
  if (!knows()) return {};
  const auto [lower, upper, share] = between(time_s - time_s_);
  const Horizon& a = horizons_[lower];
  const Horizon& b = horizons_[upper];
  Prediction made;
  made.drift =
      (1.0 - share) * a.mean.at(time_s, basis, by_svr) + share * b.mean.at(time_s, basis, by_svr);
  if (a.half_width >= 0.0 && b.half_width >= 0.0) {
    const double width = ((1.0 - share) * a.half_width + share * b.half_width) / kNormalQuantile;
    made.variance = width * width;
  }
  return made;
}

}  // namespace zerodrift::experts
