// SPDX-License-Identifier: Apache-2.0
// The check of /metrics sees what promtool would: each text here breaks one rule.
#include "tests/support/exposition_format.h"

#include <gtest/gtest.h>

#include <string>

namespace zerodrift::test_support {
namespace {

std::string gauge(const std::string& name, const std::string& rest) {
  return "# HELP " + name + " Words that tell of " + name + ".\n# TYPE " + name + " gauge\n" +
         name + rest;
}

const std::string kHistogram =
    "# HELP a_seconds Some words more.\n# TYPE a_seconds histogram\na_seconds_count "
    "3\na_seconds_sum "
    "0.4\n"
    "a_seconds_bucket{le=\"0.1\"} 2\na_seconds_bucket{le=\"+Inf\"} 3\n";

TEST(ExpositionFormat, TakesWhatIsRight) {
  EXPECT_TRUE(exposition_problems(gauge("a", " 1\n")).empty());
  EXPECT_TRUE(exposition_problems(gauge("a", "{b=\"c\\\"d\",e=\"\"} -1.5e-3\n")).empty());
  EXPECT_TRUE(exposition_problems(kHistogram).empty());
}

TEST(ExpositionFormat, SeesEachFault) {
  const auto replaced = [](std::string text, const std::string& from, const std::string& to) {
    return text.replace(text.find(from), from.size(), to);
  };
  for (const std::string& bad :
       {gauge("a", " 1"),
        gauge("a", " one\n"),
        gauge("a", "{b=c} 1\n"),
        gauge("a", "{b=\"c} 1\n"),
        gauge("a", "{b=\"c\",b=\"d\"} 1\n"),
        gauge("a", "{le=\"1\"} 1\n"),
        gauge("a", "{quantile=\"1\"} 1\n"),
        gauge("a", " 1\na 2\n"),
        gauge("a", " 1\nb 2\n"),
        gauge("a", " 1\n") + gauge("b", " 1\n") + gauge("a", " 2\n"),
        gauge("a_total", " 1\n"),
        gauge("a_count", " 1\n"),
        gauge("a_milliseconds", " 1\n"),
        gauge("a_ms", " 1\n"),
        gauge("aB", " 1\n"),
        gauge("a_gauge", " 1\n"),
        std::string("# TYPE a gauge\na 1\n"),
        replaced(gauge("a", " 1\n"), "Words that tell of a.", "Words."),
        replaced(gauge("a", " 1\n"), "of a.", "of a"),
        replaced(gauge("a", " 1\n"), " gauge", " counter"),
        replaced(gauge("a", " 1\n"), "of a.", "of b.") + gauge("b", " 1\n"),
        replaced(kHistogram, "0.4", "NaN"),
        std::string("a 1\n"),
        replaced(kHistogram, "0.1\"} 2", "0.1\"} 4"),
        replaced(kHistogram, "count 3", "count 4"),
        replaced(kHistogram, "a_seconds_bucket{le=\"+Inf\"} 3\n", "")})
    EXPECT_FALSE(exposition_problems(bad).empty()) << bad;
}

}  // namespace
}  // namespace zerodrift::test_support
