// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <stdexcept>
#include <string>

namespace zerodrift::testing {

// The key that validate() names first, where what is made with these options refuses them.
template <typename Made, typename Options>
std::string wrong_key(const Options& options) {
  EXPECT_THROW(Made{options}, std::invalid_argument);
  const std::string problem = options.validate().value_or("");
  return problem.substr(0, problem.find_first_of(": "));
}

}  // namespace zerodrift::testing
