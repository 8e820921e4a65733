// SPDX-License-Identifier: Apache-2.0
#include "services/zerodrift/doubts.h"

#include <cstdio>

namespace zerodrift::services {

void print_doubts(const std::vector<measurement::Doubt>& doubts) {
  for (const std::string& line : measurement::lines_of(doubts))
    std::printf("doubtful: %s\n", line.c_str());
}

nlohmann::ordered_json doubts_json(const std::vector<measurement::Doubt>& doubts) {
  auto json = nlohmann::ordered_json::array();
  for (const measurement::Doubt& doubt : doubts) {
    json.push_back({{"kind", measurement::name(doubt.kind)},
                    {"record", doubt.record},
                    {"column", doubt.column},
                    {"text", doubt.text}});
  }
  return json;
}

std::string possible_cause(const std::vector<measurement::Doubt>& doubts) {
  return doubts.empty() ? "" : "; doubtful: " + doubts.front().text;
}

}  // namespace zerodrift::services
