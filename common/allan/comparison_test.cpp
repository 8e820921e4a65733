// SPDX-License-Identifier: Apache-2.0
#include "common/allan/comparison_test.h"

#include <cmath>

#include "common/allan/chi_square.h"

namespace zerodrift::allan {
namespace {

bool says_something(const AllanPoint& p) {
  return p.degrees_of_freedom > 0.0 && std::isfinite(p.degrees_of_freedom) &&
         p.deviation_radps >= 0.0 && std::isfinite(p.deviation_radps);
}

}  // namespace

double larger_variance_p_value(const AllanPoint& first, const AllanPoint& second) noexcept {
  if (!says_something(first) || !says_something(second)) return 1.0;
  if (first.deviation_radps == 0.0) return 1.0;
  if (second.deviation_radps == 0.0) return 0.0;
  const double ratio = first.deviation_radps / second.deviation_radps;
  return f_upper_tail(ratio * ratio, first.degrees_of_freedom, second.degrees_of_freedom);
}

}  // namespace zerodrift::allan
