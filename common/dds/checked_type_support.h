// SPDX-License-Identifier: Apache-2.0
// A type support for bytes that anybody may have sent, and for any number of threads.
#pragma once

#include <exception>

#include "common/dds/topics.h"

namespace zerodrift::dds {

// Which instance a message belongs to. A generated type support makes the handle in a buffer and a
// digest of its own, and the middleware has one type support for all readers and writers of a
// participant: their threads wrote over each other's key, and a sample got the handle of another
// instance or of none (ThreadSanitizer; TypeSupport.HandlesOfThreadsBesideEachOtherAreRight). So
// each thread has its own, made with its first message.
template <typename Message>
bool instance_of(void* message, eprosima::fastrtps::rtps::InstanceHandle_t* handle,
                 bool force_md5) {
  thread_local typename TopicOf<Message>::TypeSupport own;
  return own.getKey(message, handle, force_md5);
}

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
  bool getKey(void* data, eprosima::fastrtps::rtps::InstanceHandle_t* handle,
              bool force_md5) override {
    return instance_of<Message>(data, handle, force_md5);
  }
};

}  // namespace zerodrift::dds
