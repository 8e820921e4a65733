// SPDX-License-Identifier: Apache-2.0
#include "common/evaluation/model_use.h"

#include <gtest/gtest.h>

namespace zerodrift::evaluation {
namespace {

// What a record is told that no model ever compensated, since holding foretold better.
std::string line_with(compensation::Scheme scheme) {
  ModelUse use;
  core::CompensatedSample sample;
  sample.raw.valid = {true, true, true};
  sample.rung.fill(core::Rung::kStationaryBias);
  sample.reason.fill(core::Reason::kModelWorseThanBias);
  use.add(sample);
  compensation::CompensationOptions options;
  options.scheme = scheme;
  return use.line_of_none("r.csv", options);
}

// Rule: what is in force already is nothing that would be right.
TEST(ModelUse, NamesTheStackOnlyWhereItIsNotInForce) {
  EXPECT_NE(line_with(compensation::Scheme::kOnlineSvr).find("what would be right: scheme stack"),
            std::string::npos);
  const std::string line = line_with(compensation::Scheme::kStack);
  EXPECT_EQ(line.find("scheme stack"), std::string::npos) << line;
  EXPECT_NE(line.find("what would be right: features that the drift goes by"), std::string::npos)
      << line;
}

}  // namespace
}  // namespace zerodrift::evaluation
