// SPDX-License-Identifier: Apache-2.0
// A topic as somebody uses it whose terms are other ones than ours.
#pragma once

#include "common/dds/topics.h"

namespace zerodrift::dds {

template <typename Message, TopicSpec (*change)(TopicSpec)>
struct OnOtherTerms : Message {};

template <typename Message, TopicSpec (*change)(TopicSpec)>
struct TopicOf<OnOtherTerms<Message, change>> {
  using TypeSupport = typename TopicOf<Message>::TypeSupport;
  static constexpr TopicSpec kSpec = change(TopicOf<Message>::kSpec);
};

constexpr TopicSpec with_best_effort(TopicSpec spec) {
  spec.reliability = Reliability::kBestEffort;
  return spec;
}
constexpr TopicSpec with_exclusive_ownership(TopicSpec spec) {
  spec.ownership = Ownership::kExclusive;
  return spec;
}

}  // namespace zerodrift::dds
