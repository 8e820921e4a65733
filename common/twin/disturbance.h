// SPDX-License-Identifier: Apache-2.0
// What a person adds to a running source, to see what the system makes of it: never part of a
// model.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/axis.h"
#include "common/core/samples.h"
#include "common/core/time.h"
#include "common/twin/random.h"

namespace zerodrift::twin {

enum class DisturbanceKind : std::uint8_t {
  kStep,   // a constant is added to the rate
  kNoise,  // white noise is added: magnitude = standard deviation of a sample
  kStuck,  // the rate stays as it is
  kGap,    // no sample is given out; sequence numbers go on
};

struct Disturbance {
  DisturbanceKind kind = DisturbanceKind::kStep;
  core::PerAxis<bool> axes{};
  double magnitude_radps = 0.0;  // kStep, kNoise
  double duration_s = 60.0;
};

// "kind:axis:magnitude[:time]": kind step, noise (magnitude in deg/h), stuck or gap (magnitude
// 0); axis x, y, z or xyz, for a gap xyz; a time as core::parse_time_s() takes it, 1 ms to a day, a
// minute without. Throws std::invalid_argument with one line.
[[nodiscard]] Disturbance parse_disturbance(std::string_view text);

// Those that act at the moment, over each other. One thread.
class Disturber {
 public:
  static constexpr std::size_t kMost = 16;

  // Noise is a function of `seed` and a sample's sequence number.
  explicit Disturber(std::uint64_t seed) : noise_(seed, "disturbance") {}

  // From the next sample on. False: kMost act already.
  bool begin(const Disturbance& disturbance);
  void clear() noexcept { acting_.clear(); }

  enum class Delivery : std::uint8_t { kGive, kWithhold };
  // Changes the sample (rates in rad/s). O(acting).
  [[nodiscard]] Delivery apply(core::AngularRateSample& sample);
  [[nodiscard]] std::size_t acting() const noexcept { return acting_.size(); }

 private:
  struct Acting {
    Disturbance what{};
    std::uint64_t number = 0;               // counts up; each has noise of its own
    std::optional<core::SensorTime> end{};  // known from the first sample on
    core::PerAxis<double> held{};
  };
  void disturb(const Acting& acting, core::AngularRateSample& sample) const noexcept;

  NoiseStream noise_;
  std::vector<Acting> acting_;
  std::uint64_t begun_ = 0;
};

}  // namespace zerodrift::twin
