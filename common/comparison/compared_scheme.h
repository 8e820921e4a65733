// SPDX-License-Identifier: Apache-2.0
// All schemes by name, behind one interface: the baselines of common/regression/schemes, and the
// compensation's own learner with its forecast.
#pragma once

#include <array>
#include <memory>
#include <string>
#include <string_view>

#include "common/compensation/options.h"
#include "common/regression/drift_scheme.h"
#include "common/regression/schemes/initial_set.h"

namespace zerodrift::comparison {

inline constexpr auto kSchemeNames = std::to_array<std::string_view>(
    {"none", "persistence", "polynomial", "rbf", "svr", "krls-t", "online-svr", "stack",
     "random-walk", "trend", "linear", "cubic", "lagged", "shupe"});
// Of all of them, for people: "none, persistence, ...".
[[nodiscard]] std::string listed_schemes();

// A new scheme. `initial` says when the schemes of batch training (rbf, svr) are trained. Throws
// std::invalid_argument with one line: an unknown name, or a scheme whose features are missing.
[[nodiscard]] std::unique_ptr<regression::DriftScheme> make_compared_scheme(
    std::string_view name, const compensation::CompensationOptions& options,
    const regression::InitialSetOptions& initial);

}  // namespace zerodrift::comparison
