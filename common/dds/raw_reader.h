// SPDX-License-Identifier: Apache-2.0
// Samples with the bytes that came over the wire, encapsulation header included: what a recorder
// keeps. Nothing is encoded anew.
#pragma once

#include <cstddef>
#include <cstring>
#include <functional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "common/dds/participant.h"

namespace zerodrift::dds {

using Bytes = std::span<const char>;

// Who wrote a sample, and which of its samples it was: a writer's first is number 1.
struct WireOrigin {
  eprosima::fastrtps::rtps::GUID_t writer;
  std::uint64_t number;
  bool is_repeat;  // another writer's copy came before (repeat_filter.h)
};

// A sample as the middleware hands it to a raw reader.
template <typename Message>
struct RawSample {
  Message message{};
  std::vector<char> payload{};
};

// As CheckedTypeSupport; keeps the payload beside what it says. Only for reading.
template <typename Message>
class RawTypeSupport final : public TopicOf<Message>::TypeSupport {
  using Generated = typename TopicOf<Message>::TypeSupport;

 public:
  bool serialize(void*, eprosima::fastrtps::rtps::SerializedPayload_t*) override { return false; }
  bool deserialize(eprosima::fastrtps::rtps::SerializedPayload_t* payload, void* data) override {
    auto& sample = *static_cast<RawSample<Message>*>(data);
    if (!checked_.deserialize(payload, &sample.message)) return false;
    const auto* begin = reinterpret_cast<const char*>(payload->data);
    sample.payload.assign(begin, begin + payload->length);
    return true;
  }
  bool getKey(void* data, eprosima::fastrtps::rtps::InstanceHandle_t* handle,
              bool force_md5) override {
    return instance_of<Message>(&static_cast<RawSample<Message>*>(data)->message, handle,
                                force_md5);
  }
  void* createData() override { return new RawSample<Message>; }
  void deleteData(void* data) override { delete static_cast<RawSample<Message>*>(data); }
  bool is_bounded() const override { return Generated::is_bounded(); }
  bool is_plain() const override { return false; }

 private:
  CheckedTypeSupport<Message> checked_;
};

// What a payload with its encapsulation header says; false where it is none of this type.
template <typename Message>
[[nodiscard]] bool decode(Bytes payload, Message& message) {
  CheckedTypeSupport<Message> type;
  eprosima::fastrtps::rtps::SerializedPayload_t wire(static_cast<std::uint32_t>(payload.size()));
  if (payload.empty()) return false;
  std::memcpy(wire.data, payload.data(), payload.size());
  wire.length = static_cast<std::uint32_t>(payload.size());
  return type.deserialize(&wire, &message);
}

// The payload as a writer would send it, with its encapsulation header.
template <typename Message>
[[nodiscard]] std::string encode(Message& message) {
  typename TopicOf<Message>::TypeSupport type;
  eprosima::fastrtps::rtps::SerializedPayload_t wire(
      static_cast<std::uint32_t>(type.getSerializedSizeProvider(&message)()));
  if (!type.serialize(&message, &wire)) throw DdsError("dds: a message that cannot be serialised");
  return {reinterpret_cast<const char*>(wire.data), wire.length};
}

// As Reader; the payload stays as it came. A participant has either typed or raw endpoints of a
// topic: raw ones need a participant of their own, in which nobody writes these topics.
template <typename Message>
class RawReader {
 public:
  // All arguments are valid during the call. Every copy of a sample is given out.
  using OnSample = std::function<void(const Message&, Bytes payload, const WireOrigin&)>;

  using OnMatched = std::function<void(const eprosima::fastrtps::rtps::GUID_t& writer)>;

  RawReader(Participant& participant, OnSample on_sample, EndpointObserver observer = {},
            OnMatched on_matched = {})
      : RawReader(participant, TopicOf<Message>::kSpec, std::move(on_sample), std::move(observer),
                  std::move(on_matched)) {}
  // With another spec of the same topic, e.g. without what was written before. The spec is the
  // caller's and outlives the reader.
  RawReader(Participant& participant, const TopicSpec& spec, OnSample on_sample,
            EndpointObserver observer = {}, OnMatched on_matched = {})
      : subscriber_(participant.subscriber({})),
        listener_(participant.discovery_, spec, std::move(observer), std::move(on_sample),
                  std::move(on_matched)) {
    reader_ = participant.make_reader(
        *subscriber_, spec, eprosima::fastdds::dds::TypeSupport(new RawTypeSupport<Message>),
        listener_);
  }
  ~RawReader() { subscriber_->delete_datareader(reader_); }
  RawReader(const RawReader&) = delete;
  RawReader& operator=(const RawReader&) = delete;

  // Writers matched now.
  [[nodiscard]] int matched() const { return listener_.matched(); }

 private:
  class Listener final : public detail::ReaderListener {
   public:
    Listener(detail::Discovery& discovery, const TopicSpec& spec, EndpointObserver observer,
             OnSample on_sample, OnMatched on_matched)
        : ReaderListener(discovery, spec, std::move(observer)),
          on_sample_(std::move(on_sample)),
          on_matched_(std::move(on_matched)) {}
    void on_subscription_matched(
        eprosima::fastdds::dds::DataReader* reader,
        const eprosima::fastdds::dds::SubscriptionMatchedStatus& status) override {
      if (status.current_count_change > 0 && on_matched_)
        on_matched_(eprosima::fastrtps::rtps::iHandle2GUID(status.last_publication_handle));
      ReaderListener::on_subscription_matched(reader, status);
    }
    void on_data_available(eprosima::fastdds::dds::DataReader* reader) override {
      eprosima::fastdds::dds::SampleInfo info;
      while (reader->take_next_sample(&sample_, &info) == ReturnCode_t::RETCODE_OK) {
        if (!info.valid_data) continue;
        clean_texts(sample_.message);
        const auto writer = info.sample_identity.writer_guid();
        on_sample_(sample_.message, sample_.payload,
                   {writer, info.sample_identity.sequence_number().to64long(),
                    repeats_.is_repeat(sample_.message, writer)});
      }
    }

   private:
    void on_writer_gone(const eprosima::fastrtps::rtps::GUID_t&, Departure) override {}

    OnSample on_sample_;
    OnMatched on_matched_;
    RawSample<Message> sample_;
    RepeatFilter<Message> repeats_;
  };

  eprosima::fastdds::dds::Subscriber* subscriber_;
  Listener listener_;
  eprosima::fastdds::dds::DataReader* reader_ = nullptr;
};

}  // namespace zerodrift::dds
