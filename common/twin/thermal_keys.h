// SPDX-License-Identifier: Apache-2.0
// The thermal plant's parameters by the names that they have in a model file.
#pragma once

#include <array>

#include "common/twin/model.h"

namespace zerodrift::twin {

struct ThermalKey {
  const char* name;  // ends in the unit
  double ThermalParameters::*value;
  bool may_be_zero = false;  // others are above 0
};

inline constexpr std::array kThermalKeys{
    ThermalKey{"case_capacity_j_per_k", &ThermalParameters::case_capacity_j_per_k},
    ThermalKey{"coil_outer_capacity_j_per_k", &ThermalParameters::coil_outer_capacity_j_per_k},
    ThermalKey{"coil_inner_capacity_j_per_k", &ThermalParameters::coil_inner_capacity_j_per_k},
    ThermalKey{"board_capacity_j_per_k", &ThermalParameters::board_capacity_j_per_k},
    ThermalKey{"chamber_case_w_per_k", &ThermalParameters::chamber_case_w_per_k},
    ThermalKey{"case_coil_outer_w_per_k", &ThermalParameters::case_coil_outer_w_per_k},
    ThermalKey{"coil_outer_inner_w_per_k", &ThermalParameters::coil_outer_inner_w_per_k},
    ThermalKey{"case_board_w_per_k", &ThermalParameters::case_board_w_per_k},
    ThermalKey{"board_power_w", &ThermalParameters::board_power_w, true}};

}  // namespace zerodrift::twin
