// SPDX-License-Identifier: Apache-2.0
#include "common/regression/schemes/scheme_factory.h"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <string>

#include "common/regression/schemes/no_scheme.h"

namespace zerodrift::regression {
namespace {

using Made = std::unique_ptr<DriftScheme>;
using Options = const SchemeOptions&;

constexpr std::array kBaselines{
    Baseline{"none", [](Options) -> Made { return std::make_unique<NoScheme>(); }},
    Baseline{"persistence",
             [](Options o) -> Made { return std::make_unique<Persistence>(o.persistence); }},
    Baseline{"polynomial",
             [](Options o) -> Made { return std::make_unique<PolynomialScheme>(o.polynomial); }},
    Baseline{"rbf", [](Options o) -> Made { return std::make_unique<RbfNetwork>(o.rbf); }},
    Baseline{"svr", [](Options o) -> Made { return std::make_unique<BatchSvr>(o.svr); }},
    Baseline{"krls-t", [](Options o) -> Made { return std::make_unique<KrlsT>(o.krls_t); }},
};

}  // namespace

std::span<const Baseline> baselines() {
  return kBaselines;
}

std::unique_ptr<DriftScheme> make_scheme(std::string_view name, const SchemeOptions& options) {
  const auto found = std::find_if(kBaselines.begin(), kBaselines.end(),
                                  [&](const Baseline& baseline) { return baseline.name == name; });
  if (found == kBaselines.end())
    throw std::invalid_argument("scheme: found '" + std::string(name) + "', expected a baseline's");
  return found->make(options);
}

}  // namespace zerodrift::regression
