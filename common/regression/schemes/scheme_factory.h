// SPDX-License-Identifier: Apache-2.0
// The baseline schemes by name. The online SVR is not among them: it comes with the compensator.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string_view>

#include "common/regression/drift_scheme.h"
#include "common/regression/schemes/batch_svr.h"
#include "common/regression/schemes/krls_t.h"
#include "common/regression/schemes/persistence.h"
#include "common/regression/schemes/polynomial_scheme.h"
#include "common/regression/schemes/rbf_network.h"

namespace zerodrift::regression {

enum class SchemeKind : std::uint8_t {
  kNone = 0,
  kPersistence = 1,
  kPolynomial = 2,
  kRbf = 3,
  kSvr = 4,
  kKrlsT = 5,
};

inline constexpr std::array kAllSchemeKinds{SchemeKind::kNone,       SchemeKind::kPersistence,
                                            SchemeKind::kPolynomial, SchemeKind::kRbf,
                                            SchemeKind::kSvr,        SchemeKind::kKrlsT};

// none, persistence, polynomial, rbf, svr, krls-t.
[[nodiscard]] std::string_view name(SchemeKind kind);

// Only the part of the scheme that is made is read.
struct SchemeOptions {
  PersistenceOptions persistence{};
  PolynomialOptions polynomial{};
  RbfNetworkOptions rbf{};
  BatchSvrOptions svr{};
  KrlsTOptions krls_t{};
};

// Throws std::invalid_argument with the scheme's name and the validate() sentence of its options.
[[nodiscard]] std::unique_ptr<DriftScheme> make_scheme(SchemeKind kind,
                                                       const SchemeOptions& options = {});

}  // namespace zerodrift::regression
