// SPDX-License-Identifier: Apache-2.0
// Which rows of a record are samples of its rate.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>

#include "common/allan/sample_clock.h"
#include "common/core/integer_time.h"
#include "common/core/time.h"

namespace zerodrift::evaluation {

// Places rows among the samples of the rate, by the times of those that measure one. A row that
// measures none stands for a sample only where one is missing: tables that were joined by their
// times have rows of other quantities between two samples.
class SampleRows {
 public:
  struct Place {
    std::optional<core::SensorTime> step{};  // since the sample before
    std::uint64_t missing = 0;               // samples in that time
    std::uint64_t blank = 0;                 // of these, such as have a row
  };

  explicit SampleRows(double period_s) : period_s_(period_s) {}

  void pass_blank() { ++blank_; }
  Place place(core::SensorTime time) {
    Place place;
    if (previous_) {
      place.step = core::saturating_difference(time, *previous_);
      if (period_s_ > 0.0)
        place.missing = allan::missing_between(core::seconds(*place.step), period_s_);
      place.blank = std::min(blank_, place.missing);
    }
    previous_ = std::max(time, previous_.value_or(time));
    blank_ = 0;
    return place;
  }

 private:
  double period_s_;
  std::optional<core::SensorTime> previous_;
  std::uint64_t blank_ = 0;  // rows since then
};

}  // namespace zerodrift::evaluation
