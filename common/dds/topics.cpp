// SPDX-License-Identifier: Apache-2.0
#include "common/dds/topics.h"

namespace zerodrift::dds {
namespace {

constexpr bool names_are_unique() {
  for (std::size_t i = 0; i < kAllTopics.size(); ++i) {
    for (std::size_t j = i + 1; j < kAllTopics.size(); ++j) {
      if (kAllTopics[i].name == kAllTopics[j].name) return false;
    }
  }
  return true;
}
static_assert(names_are_unique(), "every topic needs a name of its own");

}  // namespace
}  // namespace zerodrift::dds
