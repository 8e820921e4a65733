// SPDX-License-Identifier: Apache-2.0
// Each line of the catalogue keeps to Prometheus' conventions, whether a service writes it or not.
#include "services/console/metric_catalogue.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "tests/support/exposition_format.h"

namespace zerodrift::services {
namespace {

std::vector<MetricFact> all_facts() {
  std::vector<MetricFact> all(metric::kOfConsole.begin(), metric::kOfConsole.end());
  for (const StatusFact& fact : status_facts())
    if (fact.metric.name != nullptr) all.push_back(fact.metric);
  return all;
}

const char* type_name(MetricKind kind) {
  switch (kind) {
    case MetricKind::kCounter: return "counter";
    case MetricKind::kGauge: return "gauge";
    case MetricKind::kHistogram: return "histogram";
  }
  return "";
}

TEST(MetricCatalogue, PassesTheLintAsAWhole) {
  std::string text;
  for (const MetricFact& fact : all_facts()) {
    const std::string name = fact.name;
    text +=
        "# HELP " + name + ' ' + fact.help + "\n# TYPE " + name + ' ' + type_name(fact.kind) + '\n';
  }
  EXPECT_EQ(test_support::exposition_problems(text), std::vector<std::string>{});
}

TEST(MetricCatalogue, ANameEndsWithItsUnitInBase) {
  for (const StatusFact& fact : status_facts()) {
    if (fact.metric.name == nullptr) continue;
    const auto units = base_units();
    const auto unit = std::find_if(units.begin(), units.end(),
                                   [&](const BaseUnit& one) { return one.written == fact.unit; });
    ASSERT_NE(unit, units.end()) << fact.member << ": " << fact.unit;
    std::string name = fact.metric.name;
    if (name.ends_with("_total")) name.resize(name.size() - std::string("_total").size());
    EXPECT_TRUE(name.starts_with("zerodrift_") && name.ends_with(unit->words)) << name;
  }
}

TEST(MetricCatalogue, EveryMemberIsFoundOnceItsPlaceholdersHaveWords) {
  const ServedMember* share = find_served("share_random_walk_z", "1");
  ASSERT_NE(share, nullptr);
  EXPECT_EQ(share->labels, (MetricLabels{{"axis", "z"}, {"expert", "random_walk"}}));
  EXPECT_EQ(find_served("share_nobody_z", "1"), nullptr);
  for (const StatusFact& fact : status_facts()) {
    EXPECT_EQ(find_served(std::string(fact.member), std::string(fact.unit)) == nullptr,
              fact.member.find('{') != std::string_view::npos)
        << fact.member;
  }
}

}  // namespace
}  // namespace zerodrift::services
