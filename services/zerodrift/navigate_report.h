// SPDX-License-Identifier: Apache-2.0
// The result of `zerodrift navigate` as table, JSON and page.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "common/report/html_document.h"
#include "common/report/table.h"
#include "services/zerodrift/navigate_run.h"

namespace zerodrift::services {

[[nodiscard]] report::Table navigation_table(const NavigateResult& result);
// What the figures depend on, in a sentence or two.
[[nodiscard]] std::string navigation_note(const NavigateRequest& request,
                                          const NavigateResult& result);
[[nodiscard]] nlohmann::ordered_json navigation_json(const NavigateResult& result);
[[nodiscard]] report::Document navigation_page(const NavigateRequest& request,
                                               const NavigateResult& result);

}  // namespace zerodrift::services
