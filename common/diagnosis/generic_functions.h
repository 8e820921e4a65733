// SPDX-License-Identifier: Apache-2.0
// What competes with the catalogue: smooth functions of each input, and products of two, that no
// physics stands behind. Where one of them explains what no effect of the catalogue does, something
// unknown is missing, and the function says what it depends on.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/core/axis.h"
#include "common/diagnosis/measured_series.h"
#include "common/twin/input_family.h"

namespace zerodrift::diagnosis {

enum class ChannelOrigin : std::uint8_t {
  kMeasured,
  kMeanOfFaces,  // of the coil's two, where nothing measures its middle
};

// A quantity that the gyro was exposed to and that moved.
struct InputChannel {
  std::string name;  // "temperature_coil", "temperature_rate_coil", "rate", "magnetic_x", "time"
  std::string unit;  // of the values
  std::vector<double> values{};
  ChannelOrigin origin = ChannelOrigin::kMeasured;
  twin::InputFamily family = twin::InputFamily::kNone;
};

struct GenericFunction {
  std::vector<std::string> depends_on{};  // one or two names
  // A product belongs to the input that is not a temperature: without it there is no effect.
  twin::InputFamily family = twin::InputFamily::kNone;
  // Each a set of columns: coarse and fine.
  std::vector<std::vector<std::vector<double>>> resolutions{};
};

// All channels that move. Rates are those of the reference about `axis` ("rate") and the others
// ("rate_y"). "temperature_coil" is the mean of the coil's two faces where no probe is called
// "coil".
[[nodiscard]] std::vector<InputChannel> moving_inputs(const MeasuredSeries& series,
                                                      core::Axis axis);

// Cubic B-splines with knots at quantiles for each channel (de Boor 1978; the constant is left to
// the model), for temperatures also with a knot each 1/24 of the range (soaks gather the
// quantiles), for the coil's also of other means of its faces, with a lag: what acts is inside; and
// for each pair the products u v, u² v, u v² of the channels scaled to [-1, 1].
[[nodiscard]] std::vector<GenericFunction> generic_functions(
    const std::vector<InputChannel>& channels, double interval_s);

enum class Knots : std::uint8_t { kQuantiles, kUniform };

// The spline basis alone: `intervals` + 3 functions that sum to 1 everywhere; fewer where the
// channel has fewer distinct values. O(values).
[[nodiscard]] std::vector<std::vector<double>> spline_basis(const std::vector<double>& values,
                                                            int intervals,
                                                            Knots spacing = Knots::kQuantiles);

}  // namespace zerodrift::diagnosis
