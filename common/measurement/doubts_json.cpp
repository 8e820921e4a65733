// SPDX-License-Identifier: Apache-2.0
#include "common/measurement/doubts_json.h"

namespace zerodrift::measurement {

nlohmann::ordered_json doubts_json(const std::vector<Doubt>& doubts) {
  auto json = nlohmann::ordered_json::array();
  for (const Doubt& doubt : doubts) {
    json.push_back({{"kind", name(doubt.kind)},
                    {"record", doubt.record},
                    {"column", doubt.column},
                    {"text", doubt.text}});
  }
  return json;
}

std::string possible_cause(const std::vector<Doubt>& doubts) {
  return doubts.empty() ? "" : "; doubtful: " + doubts.front().text;
}

}  // namespace zerodrift::measurement
