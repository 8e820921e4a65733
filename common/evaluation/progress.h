// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>

namespace zerodrift::evaluation {

// Called from time to time with what is being done and the share of it that is done, 0 to 1.
using Progress = std::function<void(const std::string& what, double share)>;

}  // namespace zerodrift::evaluation
