// SPDX-License-Identifier: Apache-2.0
// What a recorder knows of each topic: the type of its messages, whether one that does not arrive
// is lost, and whether its source waits until it was taken.
#pragma once

#include <cstdint>

#include "common/core/samples.h"
#include "common/dds/topics.h"
#include "common/recording/record_queue.h"

namespace zerodrift::recording {

template <typename Message>
consteval std::uint32_t topic_index() {
  for (std::uint32_t i = 0; i < dds::kAllTopics.size(); ++i) {
    if (dds::kAllTopics[i].name == dds::TopicOf<Message>::kSpec.name) return i;
  }
  throw "a message that is not in AllMessages";
}

// Events from now on: what is kept for late joiners is old news, and its stamps are of other
// clocks.
constexpr dds::TopicSpec kNewEvents = [] {
  dds::TopicSpec spec = dds::kEvent;
  spec.durability = dds::Durability::kVolatile;
  return spec;
}();

// Of a topic that keeps the newest alone, what was replaced before it was read is no loss.
constexpr bool loses_nothing(const dds::TopicSpec& spec) {
  return spec.reliability == dds::Reliability::kReliable && spec.depth > 1;
}

template <typename Message>
MessageRole pace_of(const Message& message) {
  if constexpr (requires {
                  message.clock_source();
                  message.interval_s();
                }) {
    if (core::is_paced_by_consumers(static_cast<core::ClockSource>(message.clock_source())))
      return MessageRole::kPaced;
  }
  return MessageRole::kPlain;
}

}  // namespace zerodrift::recording
