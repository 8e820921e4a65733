// SPDX-License-Identifier: Apache-2.0
// A report such as the tools make, with every kind of block: noise with closed forms, so that the
// same numbers come out everywhere.
#pragma once

#include "common/report/html_document.h"

namespace zerodrift::report {

// sigma(tau) of white noise, bias instability and rate random walk, raw and compensated, with 95 %
// bands, slope guides and reading points.
[[nodiscard]] Chart allan_chart();

// Raw and compensated drift over 5 h, `samples` each, with one spike.
[[nodiscard]] Chart drift_chart(std::size_t samples);

[[nodiscard]] Document example_document();

}  // namespace zerodrift::report
