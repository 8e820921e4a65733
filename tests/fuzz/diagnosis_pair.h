// SPDX-License-Identifier: Apache-2.0
// A record and a model of a gyro that an owner could bring, or somebody who means harm, made up
// from a seed: short and sparse records, lost and impossible readings, constant columns, too few
// digits, turns without a reference; models with coefficients, wild ones, and with kinds only.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/twin/model.h"

namespace zerodrift::fuzz {

struct DiagnosisPair {
  std::string record;      // CSV
  std::string validation;  // CSV; mostly empty, which is none
  twin::Model model;
};

// Equal seeds give equal pairs.
[[nodiscard]] DiagnosisPair diagnosis_pair(std::uint64_t seed);

}  // namespace zerodrift::fuzz
