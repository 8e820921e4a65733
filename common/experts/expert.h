// SPDX-License-Identifier: Apache-2.0
// The experts by name, and what each of the linear ones is made of.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "common/experts/kalman_bank.h"

namespace zerodrift::experts {

enum class Expert : std::uint8_t {
  kHold,
  kRandomWalk,
  kTrend,
  kLinear,
  kCubic,
  kLagged,
  kShupe,
  kOnlineSvr,
};
inline constexpr std::array kLinearExperts{Expert::kHold,   Expert::kRandomWalk, Expert::kTrend,
                                           Expert::kLinear, Expert::kCubic,      Expert::kLagged,
                                           Expert::kShupe};
inline constexpr std::size_t kSvr = kLinearExperts.size();  // place of the one behind them
inline constexpr std::size_t kExperts = kSvr + 1;
// From this one on they map the temperature; those before it know the time alone.
inline constexpr auto kFirstMap = static_cast<std::size_t>(Expert::kLinear);
// hold, random-walk, trend, linear, cubic, lagged, shupe, online-svr.
[[nodiscard]] std::string_view name(Expert expert);
[[nodiscard]] KalmanBankOptions bank_options(Expert expert);  // of the linear ones but kHold

}  // namespace zerodrift::experts
