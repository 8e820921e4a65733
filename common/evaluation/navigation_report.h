// SPDX-License-Identifier: Apache-2.0
// The result of `zerodrift navigate` as table, JSON and page.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "common/evaluation/navigation_run.h"
#include "common/report/html_document.h"
#include "common/report/table.h"

namespace zerodrift::evaluation {

// Whether compensation helped the heading and by what, or why that can't be said.
[[nodiscard]] std::string navigation_advice(const NavigationResult& result);
[[nodiscard]] report::Table navigation_table(const NavigationResult& result);
// What the figures depend on, in a sentence or two.
[[nodiscard]] std::string navigation_note(const NavigationRequest& request,
                                          const NavigationResult& result);
[[nodiscard]] nlohmann::ordered_json navigation_json(const NavigationResult& result);
[[nodiscard]] report::Document navigation_page(const NavigationRequest& request,
                                               const NavigationResult& result);

}  // namespace zerodrift::evaluation
