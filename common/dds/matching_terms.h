// SPDX-License-Identifier: Apache-2.0
// What decides whether a writer and a reader match, and how that is worded.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/dds/topics.h"

namespace zerodrift::dds::detail {

// What matching compares, of a writer's offer or a reader's request.
struct Terms {
  int reliability = 0;  // the middleware's kinds: the larger the stronger
  int durability = 0;
  int liveliness = 0;
  int ownership = 0;
  std::int64_t deadline_ns = 0;
  std::int64_t lease_ns = 0;
};
enum class Policy : std::uint8_t { kReliability, kDurability, kDeadline, kLiveliness, kOwnership };
// The policies by which an offer does not meet a request (OMG DDS 1.4, 2.2.3).
std::vector<Policy> unmet(const Terms& offered, const Terms& requested);
Terms terms_of(const TopicSpec& spec);
// What of the terms a policy compares, in words.
std::string described(Policy policy, const Terms& terms);
const char* name(Policy policy);
// Of a duration in ns; "none" where it has no end.
std::string milliseconds(std::int64_t ns);
std::string liveliness(int kind);
std::string durability(int kind);

}  // namespace zerodrift::dds::detail
