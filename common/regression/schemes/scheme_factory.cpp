// SPDX-License-Identifier: Apache-2.0
#include "common/regression/schemes/scheme_factory.h"

#include <stdexcept>

#include "common/regression/schemes/no_scheme.h"

namespace zerodrift::regression {

std::string_view name(SchemeKind kind) {
  switch (kind) {
    case SchemeKind::kNone:
      return "none";
    case SchemeKind::kPersistence:
      return "persistence";
    case SchemeKind::kPolynomial:
      return "polynomial";
    case SchemeKind::kRbf:
      return "rbf";
    case SchemeKind::kSvr:
      return "svr";
    case SchemeKind::kKrlsT:
      return "krls-t";
  }
  return "unknown";
}

std::unique_ptr<DriftScheme> make_scheme(SchemeKind kind, const SchemeOptions& options) {
  switch (kind) {
    case SchemeKind::kNone:
      return std::make_unique<NoScheme>();
    case SchemeKind::kPersistence:
      return std::make_unique<Persistence>(options.persistence);
    case SchemeKind::kPolynomial:
      return std::make_unique<PolynomialScheme>(options.polynomial);
    case SchemeKind::kRbf:
      return std::make_unique<RbfNetwork>(options.rbf);
    case SchemeKind::kSvr:
      return std::make_unique<BatchSvr>(options.svr);
    case SchemeKind::kKrlsT:
      return std::make_unique<KrlsT>(options.krls_t);
  }
  throw std::invalid_argument("scheme kind: no such scheme");
}

}  // namespace zerodrift::regression
