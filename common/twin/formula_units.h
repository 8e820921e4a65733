// SPDX-License-Identifier: Apache-2.0
// The unit of a part of a formula, as far as it is known.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "common/twin/temperature_point.h"

namespace zerodrift::twin {

inline constexpr double kLongestLagS = 1e5;

class FormulaUnit {
 public:
  [[nodiscard]] static FormulaUnit none() { return FormulaUnit(Kind::kKnown); }
  [[nodiscard]] static FormulaUnit of_number() { return FormulaUnit(Kind::kNumber); }
  [[nodiscard]] static FormulaUnit of_parameter() { return FormulaUnit(Kind::kOpen); }
  // Of an input in the order of formula_inputs().
  [[nodiscard]] static FormulaUnit of_input(std::size_t input) {
    FormulaUnit unit(Kind::kKnown);
    unit.exponents_[base_of(input)] = 1;
    return unit;
  }

  [[nodiscard]] FormulaUnit times(const FormulaUnit& other) const { return combined(other, 1); }
  [[nodiscard]] FormulaUnit over(const FormulaUnit& other) const { return combined(other, -1); }
  [[nodiscard]] FormulaUnit to_the(int exponent) const {
    FormulaUnit unit = *this;
    for (int& e : unit.exponents_) e *= exponent;
    return unit;
  }
  [[nodiscard]] FormulaUnit per_second() const {
    FormulaUnit unit = *this;
    --unit.exponents_[kSecond];
    return unit;
  }
  // Of the sum of both; empty where they contradict each other.
  [[nodiscard]] std::optional<FormulaUnit> beside(const FormulaUnit& other) const {
    if (kind_ == Kind::kKnown && other.kind_ == Kind::kKnown)
      return exponents_ == other.exponents_ ? std::optional(*this) : std::nullopt;
    if (kind_ == Kind::kKnown) return *this;
    if (other.kind_ == Kind::kKnown) return other;
    return kind_ == Kind::kNumber ? other : *this;
  }
  [[nodiscard]] bool may_be_none() const {
    return kind_ != Kind::kKnown || exponents_ == Exponents{};
  }
  // The largest exponent, whatever its sign.
  [[nodiscard]] int highest_power() const {
    int highest = 0;
    for (const int e : exponents_) highest = std::max(highest, e < 0 ? -e : e);
    return highest;
  }
  [[nodiscard]] bool is_temperature() const {
    Exponents one{};
    one[kDegc] = 1;
    return kind_ == Kind::kKnown && exponents_ == one;
  }

  // "degC uT^2 / s", "no unit".
  [[nodiscard]] std::string text() const {
    static constexpr std::array<const char*, kBases> kNames{"degC", "uT", "m/s^2", "deg/s",
                                                            "g",    "mA", "V",     "s"};
    std::string above;
    std::string below;
    for (std::size_t i = 0; i < kBases; ++i) {
      if (exponents_[i] == 0) continue;
      std::string& side = exponents_[i] > 0 ? above : below;
      const int power = exponents_[i] > 0 ? exponents_[i] : -exponents_[i];
      side += (side.empty() ? "" : " ") + std::string(kNames[i]);
      if (power > 1) side += "^" + std::to_string(power);
    }
    if (above.empty() && below.empty()) return "no unit";
    if (above.empty()) above = "1";
    return below.empty() ? above : above + " / " + below;
  }

 private:
  enum class Kind : std::uint8_t {
    kKnown,
    kNumber,  // that of what it is added to; none as a factor
    kOpen,    // whichever a parameter brings
  };
  static constexpr std::size_t kBases = 8;
  static constexpr std::size_t kDegc = 0;
  static constexpr std::size_t kSecond = 7;
  using Exponents = std::array<int, kBases>;

  explicit FormulaUnit(Kind kind) : kind_(kind) {}

  [[nodiscard]] static std::size_t base_of(std::size_t input) {
    constexpr std::size_t kOfVectors = 3;
    if (input < kTemperaturePointCount) return kDegc;
    const std::size_t other = input - kTemperaturePointCount;
    if (other < 3 * kOfVectors) return 1 + other / kOfVectors;
    return 1 + kOfVectors + (other - 3 * kOfVectors);
  }

  [[nodiscard]] FormulaUnit combined(const FormulaUnit& other, int sign) const {
    if (kind_ == Kind::kOpen || other.kind_ == Kind::kOpen) return of_parameter();
    FormulaUnit unit = *this;
    if (other.kind_ == Kind::kKnown) unit.kind_ = Kind::kKnown;
    for (std::size_t i = 0; i < kBases; ++i) unit.exponents_[i] += sign * other.exponents_[i];
    return unit;
  }

  Kind kind_;
  Exponents exponents_{};
};

}  // namespace zerodrift::twin
