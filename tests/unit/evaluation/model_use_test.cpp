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

// Rule: the share is of samples that measured a rate, and so is the commonest reason. Before: a
// model that compensated every sample of a record of joined tables had half of them.
TEST(ModelUse, WhatMeasuredNothingIsNoSample) {
  core::CompensatedSample measured;
  measured.raw.valid = {true, false, true};
  measured.rung.fill(core::Rung::kStack);
  core::CompensatedSample of_temperature_alone;
  of_temperature_alone.reason.fill(core::Reason::kInvalidInput);
  ModelUse use;
  for (int k = 0; k < 3; ++k) {
    use.add(measured);
    use.add(of_temperature_alone);
    use.add(of_temperature_alone);
  }
  EXPECT_EQ(use.learned_share(core::Axis::kX), 1.0);

  ModelUse of_none;
  measured.rung.fill(core::Rung::kStationaryBias);
  measured.reason.fill(core::Reason::kInitialSet);
  of_none.add(measured);
  of_none.add(of_temperature_alone);
  of_none.add(of_temperature_alone);
  const std::string line = of_none.line_of_none("r.csv", {});
  EXPECT_NE(line.find(core::name(core::Reason::kInitialSet)), std::string::npos) << line;
}

}  // namespace
}  // namespace zerodrift::evaluation
