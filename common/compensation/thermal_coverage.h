// SPDX-License-Identifier: Apache-2.0
// Where an axis has learned, for people to see: its labels counted by temperature and by how that
// was changing. Whether a forecast counts as beyond what was learned is asked of the features
// themselves (regression/sample_domain.h).
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "common/core/state_archive.h"

namespace zerodrift::compensation {

class ThermalCoverage {
 public:
  // Temperatures in steps from the lowest on, where the first and last hold what is beyond.
  static constexpr double kLowestDegc = -60.0;
  static constexpr double kStepDegc = 5.0;
  static constexpr std::size_t kTemperatures = 36;
  // Between cooling fast, cooling, steady, warming and warming fast.
  static constexpr std::array<double, 4> kRateEdgesDegcPerMin{-0.5, -0.05, 0.05, 0.5};
  static constexpr std::size_t kRates = kRateEdgesDegcPerMin.size() + 1;
  // Labels by cell: those of the fastest cooling first, each row by temperature.
  using Labels = std::array<std::uint32_t, kRates * kTemperatures>;

  [[nodiscard]] static std::size_t cell_of(double degc, double degc_per_min) noexcept {
    const double step = (degc - kLowestDegc) / kStepDegc;
    const auto column =
        static_cast<std::size_t>(std::clamp(step, 0.0, static_cast<double>(kTemperatures - 1)));
    const auto row = static_cast<std::size_t>(
        std::upper_bound(kRateEdgesDegcPerMin.begin(), kRateEdgesDegcPerMin.end(), degc_per_min) -
        kRateEdgesDegcPerMin.begin());
    return row * kTemperatures + column;
  }

  void note(double degc, double degc_per_min) noexcept {
    std::uint32_t& labels = labels_[cell_of(degc, degc_per_min)];
    if (labels < std::numeric_limits<std::uint32_t>::max()) ++labels;
  }
  void reset() noexcept { labels_ = {}; }
  [[nodiscard]] const Labels& labels() const noexcept { return labels_; }

  // Its state (core/state_archive.h).
  void carry(core::StateArchive& archive) { archive(labels_); }

 private:
  Labels labels_{};
};

}  // namespace zerodrift::compensation
