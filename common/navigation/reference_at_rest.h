// SPDX-License-Identifier: Apache-2.0
// Whether true rates are against the stars, as a gyro's are: at rest they are then
// Earth's rate.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "common/core/axis.h"
#include "common/core/time.h"

namespace zerodrift::navigation {

// Of the first stop, body frame.
struct RestMeans {
  core::PerAxis<double> reference_radps{};
  // As latitude and true attitude give it when the stop begins: a wrong reference turns that
  // attitude from then on. 0 without a latitude.
  core::PerAxis<double> earth_radps{};
  // Standard deviation of the mean, by the scatter of the true rates about it.
  core::PerAxis<double> sigma_radps{};
};

class ReferenceAtRest {
 public:
  // A sample at rest. O(1). True: with it, means() are others.
  bool add(core::SensorTime time, const core::PerAxis<double>& reference_radps,
           const core::PerAxis<double>& earth_radps) noexcept;
  // A sample in motion. What was taken for rest within the last second may have been its beginning
  // and is left out.
  void move() noexcept;

  // Nothing before two seconds at rest.
  [[nodiscard]] std::optional<RestMeans> means() const noexcept;

 private:
  struct Sums {
    std::uint64_t count = 0;
    core::PerAxis<double> reference_radps{};
    core::PerAxis<double> squares{};

    void add(const Sums& other) noexcept;
  };

  Sums confirmed_;
  Sums held_;  // the second before the open one
  Sums open_;
  core::SensorTime open_since_{core::kNever};
  core::PerAxis<double> earth_radps_{};
  bool over_ = false;
};

// What of the setting decides what such means say.
struct RestSetting {
  core::PerAxis<bool> axes{};   // that have a reference
  bool latitude_known = false;  // to the filters
  bool earth_is_drift = false;  // the compensation takes Earth's rate off as drift
};

// Whether true rates with such means are those of the Earth in the attitude that is given, as far
// as their noise lets one say.
[[nodiscard]] bool are_earths(const RestMeans& means, const core::PerAxis<bool>& axes) noexcept;

// Why true rates with such means can't judge a heading; empty: they can.
[[nodiscard]] std::string objection(const RestMeans& means, const RestSetting& setting);

}  // namespace zerodrift::navigation
