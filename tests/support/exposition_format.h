// SPDX-License-Identifier: Apache-2.0
// Prometheus' text format 0.0.4 and what `promtool check metrics` says of names, as far as they
// concern gauges, counters and histograms; and that a help text is a sentence of its metric's own.
#pragma once

#include <string>
#include <vector>

namespace zerodrift::test_support {

// One line each; empty where a scrape takes the text as it is and the lint has nothing to say.
[[nodiscard]] std::vector<std::string> exposition_problems(const std::string& text);

}  // namespace zerodrift::test_support
