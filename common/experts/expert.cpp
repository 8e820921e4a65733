// SPDX-License-Identifier: Apache-2.0
#include "common/experts/expert.h"

#include "common/experts/thermal_basis.h"

namespace zerodrift::experts {

std::string_view name(Expert expert) {
  switch (expert) {
    case Expert::kHold: return "hold";
    case Expert::kRandomWalk: return "random-walk";
    case Expert::kTrend: return "trend";
    case Expert::kLinear: return "linear";
    case Expert::kCubic: return "cubic";
    case Expert::kLagged: return "lagged";
    case Expert::kShupe: return "shupe";
    case Expert::kOnlineSvr: return "online-svr";
  }
  return "unknown";
}

KalmanBankOptions bank_options(Expert expert) {
  std::vector<std::size_t> terms;
  switch (expert) {
    case Expert::kHold:
    case Expert::kRandomWalk:
    case Expert::kOnlineSvr: break;
    case Expert::kTrend: return {.slopes = SlopeModel::kDamped};
    case Expert::kLinear: terms = {kTemperature, kTemperatureRate}; break;
    case Expert::kLagged: terms = {kTemperature, kTemperatureSquared}; break;
    case Expert::kCubic:
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

}  // namespace zerodrift::experts
