// SPDX-License-Identifier: Apache-2.0
// Counter-based random numbers: the value is a pure function of (key, index), so that processes
// which simulate the same model share one truth without sharing state, and adding an effect to a
// model leaves the random numbers of all others untouched.
#pragma once

#include <cstdint>
#include <string_view>

namespace zerodrift::twin {

// One stream of independent standard normal numbers, addressed by index.
class NoiseStream {
 public:
  // The stream called `name` under `seed`. Names are hashed (FNV-1a, 64 bit).
  NoiseStream(std::uint64_t seed, std::string_view name) noexcept;

  // An independent stream derived from this one.
  [[nodiscard]] NoiseStream substream(std::uint64_t number) const noexcept;

  // Uniform in the open interval (0, 1), 53 bits. SplitMix64: Steele, Lea & Flood, OOPSLA 2014.
  [[nodiscard]] double uniform(std::uint64_t index) const noexcept;

  // Standard normal by inversion: one uniform a number, nothing rejected. About 10 ns.
  [[nodiscard]] double gaussian(std::uint64_t index) const noexcept;

 private:
  explicit NoiseStream(std::uint64_t key) noexcept : key_(key) {}

  std::uint64_t key_;
};

// Inverse of the standard normal distribution function for 0 < p < 1, relative accuracy 1e-16.
// Wichura, Algorithm AS 241 (PPND16), Applied Statistics 37 (1988).
[[nodiscard]] double inverse_normal(double p) noexcept;

}  // namespace zerodrift::twin
