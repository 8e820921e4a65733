// SPDX-License-Identifier: Apache-2.0
// The baseline schemes by name. The online SVR is not among them: it comes with the compensator.
#pragma once

#include <memory>
#include <span>
#include <string_view>

#include "common/regression/drift_scheme.h"
#include "common/regression/schemes/batch_svr.h"
#include "common/regression/schemes/krls_t.h"
#include "common/regression/schemes/persistence.h"
#include "common/regression/schemes/polynomial_scheme.h"
#include "common/regression/schemes/rbf_network.h"

namespace zerodrift::regression {

// Only the part of the scheme that is made is read.
struct SchemeOptions {
  PersistenceOptions persistence{};
  PolynomialOptions polynomial{};
  RbfNetworkOptions rbf{};
  BatchSvrOptions svr{};
  KrlsTOptions krls_t{};
};

struct Baseline {
  std::string_view name;
  // Throws std::invalid_argument with the scheme's name and the validate() sentence of its options.
  std::unique_ptr<DriftScheme> (*make)(const SchemeOptions& options);
};

// Each name once.
[[nodiscard]] std::span<const Baseline> baselines();
// Throws std::invalid_argument where there is no such baseline.
[[nodiscard]] std::unique_ptr<DriftScheme> make_scheme(std::string_view name,
                                                       const SchemeOptions& options = {});

}  // namespace zerodrift::regression
