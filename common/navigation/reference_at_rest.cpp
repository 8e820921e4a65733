// SPDX-License-Identifier: Apache-2.0
#include "common/navigation/reference_at_rest.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "common/core/units.h"

namespace zerodrift::navigation {
namespace {

using core::kEarthRateRadps;

constexpr core::SensorTime kSecond{1'000'000'000};
// Of Earth's rate: nearer to it is it, with the errors of a reference and of the attitude given.
constexpr double kNear = 0.5;
// Of the whole of it, on axes that see less: a reference's own bias.
constexpr double kSmallest = 0.1;
// Without a latitude: what is of its size.
constexpr double kLeastSize = 0.25;
constexpr double kLargestSize = 2.0;
constexpr double kSigmas = 4.0;  // by which a mean has to be off

double norm(const core::PerAxis<double>& vector, const core::PerAxis<bool>& axes) {
  double squares = 0.0;
  for (std::size_t i = 0; i < core::kAxisCount; ++i)
    squares += axes[i] ? vector[i] * vector[i] : 0.0;
  return std::sqrt(squares);
}

double allowed(double earth_radps) {
  return std::max(kNear * earth_radps, kSmallest * kEarthRateRadps);
}

core::PerAxis<double> difference(const core::PerAxis<double>& a, const core::PerAxis<double>& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

std::string deg_h(double rate_radps) {
  std::array<char, 400> text{};  // for any double
  const auto end = std::to_chars(text.data(), text.data() + text.size(),
                                 core::deg_h_from_radps(rate_radps), std::chars_format::fixed, 1);
  return {text.data(), end.ptr};
}

// "x 8.7, y 5.0, z 11.2 deg/h"
std::string deg_h(const core::PerAxis<double>& vector, const core::PerAxis<bool>& axes) {
  std::string text;
  for (const core::Axis axis : core::kAxes) {
    const std::size_t i = core::index(axis);
    if (!axes[i]) continue;
    text += (text.empty() ? "" : ", ") + std::string(core::name(axis)) + " " + deg_h(vector[i]);
  }
  return text + " deg/h";
}

}  // namespace

void ReferenceAtRest::Sums::add(const Sums& other) noexcept {
  count += other.count;
  for (std::size_t i = 0; i < core::kAxisCount; ++i) {
    reference_radps[i] += other.reference_radps[i];
    squares[i] += other.squares[i];
  }
}

bool ReferenceAtRest::add(core::SensorTime time, const core::PerAxis<double>& reference_radps,
                          const core::PerAxis<double>& earth_radps) noexcept {
  if (over_) return false;
  if (confirmed_.count + held_.count + open_.count == 0) earth_radps_ = earth_radps;
  if (open_since_ == core::kNever) open_since_ = time;
  Sums sample{1, reference_radps, reference_radps};
  for (double& square : sample.squares) square *= square;
  open_.add(sample);
  if (time - open_since_ < kSecond) return false;
  confirmed_.add(held_);
  held_ = open_;
  open_ = {};
  open_since_ = core::kNever;
  return confirmed_.count > 0;
}

void ReferenceAtRest::move() noexcept {
  over_ = over_ || confirmed_.count > 0;
  held_ = open_ = {};
  open_since_ = core::kNever;
}

std::optional<RestMeans> ReferenceAtRest::means() const noexcept {
  if (confirmed_.count == 0) return std::nullopt;
  RestMeans means{confirmed_.reference_radps, earth_radps_};
  const auto n = static_cast<double>(confirmed_.count);
  for (std::size_t i = 0; i < core::kAxisCount; ++i) {
    double& mean = means.reference_radps[i];
    mean /= n;
    means.sigma_radps[i] = std::sqrt(std::max(0.0, confirmed_.squares[i] / n - mean * mean) / n);
  }
  return means;
}

bool are_earths(const RestMeans& means, const core::PerAxis<bool>& axes) noexcept {
  const double off = norm(difference(means.reference_radps, means.earth_radps), axes);
  return off <= allowed(norm(means.earth_radps, axes)) + kSigmas * norm(means.sigma_radps, axes);
}

std::string objection(const RestMeans& means, const RestSetting& setting) {
  const double reference = norm(means.reference_radps, setting.axes);
  const auto taken_off = [&](const char* cure) {
    return "the reference contains Earth's rate (" + deg_h(reference) +
           " deg/h at rest), which the compensation takes off as drift: " + cure;
  };
  if (!setting.latitude_known) {
    const bool is_earths =
        reference >= kLeastSize * kEarthRateRadps && reference <= kLargestSize * kEarthRateRadps;
    return setting.earth_is_drift && is_earths ? taken_off("give --latitude") : "";
  }
  const double earth = norm(means.earth_radps, setting.axes);
  if (are_earths(means, setting.axes)) {
    return setting.earth_is_drift && earth > allowed(earth)
               ? taken_off("give a --config with earth_rate: {mode: unknown}")
               : "";
  }
  if (reference < kNear * earth) {
    return "the reference at rest is " + deg_h(reference) + " deg/h, not Earth's rate of " +
           deg_h(earth) +
           ": it is against the Earth, a gyro's truth is against the stars "
           "(docs/records.md)";
  }
  return "the reference at rest is " + deg_h(means.reference_radps, setting.axes) +
         ", Earth's rate as given is " + deg_h(means.earth_radps, setting.axes) +
         ": its frame or unit, or --latitude, --heading or --frame, is wrong";
}

}  // namespace zerodrift::navigation
