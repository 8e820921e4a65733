// SPDX-License-Identifier: Apache-2.0
#include "services/zerodrift/doubts.h"

#include <cstdio>

namespace zerodrift::services {

void print_doubts(const std::vector<measurement::Doubt>& doubts) {
  for (const std::string& line : measurement::lines_of(doubts))
    std::printf("doubtful: %s\n", line.c_str());
}

}  // namespace zerodrift::services
