// SPDX-License-Identifier: Apache-2.0
// The table of topics in docs/topics.md says what common/dds/topics.h does.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "common/dds/topics.h"

namespace zerodrift::dds {
namespace {

std::string row(const TopicSpec& spec) {
  std::ostringstream text;
  text << "| " << spec.name << " | "
       << (spec.reliability == Reliability::kReliable ? "reliable" : "best_effort") << " | "
       << spec.depth << " | "
       << (spec.durability == Durability::kTransientLocal ? "transient_local" : "volatile") << " | "
       << (spec.ownership == Ownership::kExclusive ? "exclusive" : "shared") << " | "
       << spec.heartbeat.count() << " | " << spec.lifespan.count() << " | " << spec.deadline.count()
       << " | " << spec.lease.count() << " |";
  return text.str();
}

std::vector<std::string> documented_rows() {
  std::ifstream file(std::string(ZERODRIFT_SOURCE_DIR) + "/docs/topics.md");
  std::vector<std::string> rows;
  bool within = false;
  for (std::string line; std::getline(file, line);) {
    if (line.rfind("| topic |", 0) == 0) {
      within = true;
      std::getline(file, line);  // the rule below the head
    } else if (within && line.rfind("|", 0) == 0) {
      rows.push_back(line);
    } else {
      within = false;
    }
  }
  return rows;
}

// Rule: tables in the documents come from the code.
TEST(TopicTable, ThePageListsEveryTopicAsTheCodeHasIt) {
  std::vector<std::string> expected;
  for (const auto& spec : kAllTopics) expected.push_back(row(spec));
  EXPECT_EQ(documented_rows(), expected);
}

}  // namespace
}  // namespace zerodrift::dds
