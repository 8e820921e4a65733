// SPDX-License-Identifier: Apache-2.0
// A type support for bytes that anybody may have sent.
#pragma once

#include <exception>

#include "common/dds/topics.h"

namespace zerodrift::dds {

// The generated type supports let exceptions out for some malformed payloads (an unknown
// encapsulation, Fast DDS issue 3422), which would end the process from a thread of the middleware,
// and take sequences and strings beyond their bounds. Here both are payloads that can't be read:
// the middleware drops the sample.
template <typename Message>
class CheckedTypeSupport final : public TopicOf<Message>::TypeSupport {
 public:
  bool deserialize(eprosima::fastrtps::rtps::SerializedPayload_t* payload, void* data) override {
    if (payload->length > this->m_typeSize) return false;
    try {
      return TopicOf<Message>::TypeSupport::deserialize(payload, data);
    } catch (const std::exception&) {
      return false;
    }
  }
};

}  // namespace zerodrift::dds
