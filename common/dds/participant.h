// SPDX-License-Identifier: Apache-2.0
// Participants, typed writers and readers. This folder is the only one that knows Fast DDS.
//
// Transport: UDPv4 only. Shared memory fails silently across containers and users, and data sharing
// loses samples (DECISIONS.md). Confined to the loopback interface unless interfaces are named.
#pragma once

#include <atomic>
#include <cstdint>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/DataWriterListener.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "common/dds/checked_type_support.h"
#include "common/dds/topics.h"

namespace zerodrift::dds {

// Start-up trouble with the middleware: one clear line.
class DdsError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct NetworkOptions {
  std::uint32_t domain = 0;  // 0..232
  std::vector<std::string>
      interfaces;  // IPv4 addresses to use; empty: 127.0.0.1 only, nothing leaves the machine
  std::vector<std::string> peers;  // IPv4 addresses of other hosts; used only with interfaces
};

// What the middleware noticed about an endpoint. Counts are totals since the endpoint was made.
struct EndpointEvent {
  enum class Kind : std::uint8_t {
    kIncompatibleQos,
    kSampleLost,
    kSampleRejected,
    kDeadlineMissed,
    kLivelinessLost
  };
  Kind kind;
  std::string_view topic;
  std::uint64_t count;
  std::string detail;
};
using EndpointObserver = std::function<void(const EndpointEvent&)>;

// Who sent a sample, and of which key. Compare only.
struct SampleOrigin {
  eprosima::fastrtps::rtps::GUID_t writer;
  eprosima::fastdds::dds::InstanceHandle_t instance;
};

class Participant {
 public:
  Participant(const std::string& name, const NetworkOptions& network);
  ~Participant();
  Participant(const Participant&) = delete;
  Participant& operator=(const Participant&) = delete;

 private:
  template <typename>
  friend class Writer;
  template <typename>
  friend class Reader;

  eprosima::fastdds::dds::Topic* topic(const TopicSpec& spec,
                                       eprosima::fastdds::dds::TypeSupport type);

  eprosima::fastdds::dds::DomainParticipant* participant_ = nullptr;
  eprosima::fastdds::dds::Publisher* publisher_ = nullptr;
  eprosima::fastdds::dds::Subscriber* subscriber_ = nullptr;
};

eprosima::fastdds::dds::DataWriterQos writer_qos(const TopicSpec& spec,
                                                 std::uint32_t ownership_strength);
eprosima::fastdds::dds::DataReaderQos reader_qos(const TopicSpec& spec);

namespace detail {

// Counts matches and passes on what went wrong; no sample passes here.
class WriterListener : public eprosima::fastdds::dds::DataWriterListener {
 public:
  WriterListener(std::string_view topic, EndpointObserver observer)
      : topic_(topic), observer_(std::move(observer)) {}
  void on_publication_matched(
      eprosima::fastdds::dds::DataWriter*,
      const eprosima::fastdds::dds::PublicationMatchedStatus& status) override {
    matched_.store(status.current_count, std::memory_order_release);
  }
  void on_offered_incompatible_qos(
      eprosima::fastdds::dds::DataWriter*,
      const eprosima::fastdds::dds::OfferedIncompatibleQosStatus& status) override;
  void on_offered_deadline_missed(
      eprosima::fastdds::dds::DataWriter*,
      const eprosima::fastdds::dds::OfferedDeadlineMissedStatus& status) override;
  void on_liveliness_lost(eprosima::fastdds::dds::DataWriter*,
                          const eprosima::fastdds::dds::LivelinessLostStatus& status) override;
  [[nodiscard]] int matched() const { return matched_.load(std::memory_order_acquire); }

 private:
  std::string_view topic_;
  EndpointObserver observer_;
  std::atomic<int> matched_{0};
};

class ReaderListener : public eprosima::fastdds::dds::DataReaderListener {
 public:
  ReaderListener(std::string_view topic, EndpointObserver observer)
      : topic_(topic), observer_(std::move(observer)) {}
  void on_subscription_matched(
      eprosima::fastdds::dds::DataReader*,
      const eprosima::fastdds::dds::SubscriptionMatchedStatus& status) override {
    matched_.store(status.current_count, std::memory_order_release);
    if (status.current_count_change < 0)
      on_writer_gone(iHandle2GUID(status.last_publication_handle));
  }
  void on_requested_incompatible_qos(
      eprosima::fastdds::dds::DataReader*,
      const eprosima::fastdds::dds::RequestedIncompatibleQosStatus& status) override;
  void on_requested_deadline_missed(
      eprosima::fastdds::dds::DataReader*,
      const eprosima::fastdds::dds::RequestedDeadlineMissedStatus& status) override;
  void on_sample_lost(eprosima::fastdds::dds::DataReader*,
                      const eprosima::fastdds::dds::SampleLostStatus& status) override;
  void on_sample_rejected(eprosima::fastdds::dds::DataReader*,
                          const eprosima::fastrtps::SampleRejectedStatus& status) override;
  [[nodiscard]] int matched() const { return matched_.load(std::memory_order_acquire); }

 private:
  virtual void on_writer_gone(const eprosima::fastrtps::rtps::GUID_t& writer) = 0;

  std::string_view topic_;
  EndpointObserver observer_;
  std::atomic<int> matched_{0};
};

}  // namespace detail

// One writer of one topic. write() is for one thread at a time.
template <typename Message>
class Writer {
 public:
  explicit Writer(Participant& participant, EndpointObserver observer = {},
                  std::uint32_t ownership_strength = 0)
      : publisher_(participant.publisher_),
        listener_(TopicOf<Message>::kSpec.name, std::move(observer)) {
    auto* topic =
        participant.topic(TopicOf<Message>::kSpec,
                          eprosima::fastdds::dds::TypeSupport(new CheckedTypeSupport<Message>));
    writer_ = publisher_->create_datawriter(
        topic, writer_qos(TopicOf<Message>::kSpec, ownership_strength), &listener_);
    if (writer_ == nullptr) {
      throw DdsError("dds: cannot create a writer for topic '" +
                     std::string(TopicOf<Message>::kSpec.name) + "'");
    }
  }
  ~Writer() { publisher_->delete_datawriter(writer_); }
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  // False: the middleware refused the sample.
  bool write(Message& message) noexcept { return writer_->write(&message); }

  // Readers matched now.
  [[nodiscard]] int matched() const { return listener_.matched(); }

  // True once every matched reader has received everything written. Not to be called from a
  // reader's callback: the acknowledgements arrive on that thread.
  bool wait_until_received(std::chrono::milliseconds at_most) {
    const eprosima::fastrtps::Duration_t duration(
        static_cast<std::int32_t>(at_most.count() / 1000),
        static_cast<std::uint32_t>(at_most.count() % 1000) * 1000000U);
    return writer_->wait_for_acknowledgments(duration) == ReturnCode_t::RETCODE_OK;
  }

 private:
  eprosima::fastdds::dds::Publisher* publisher_;
  detail::WriterListener listener_;
  eprosima::fastdds::dds::DataWriter* writer_ = nullptr;
};

// One reader of one topic. on_sample runs on the participant's receiving thread, one at a time, as
// samples arrive; on_gone runs on its discovery thread.
template <typename Message>
class Reader {
 public:
  using OnSample = std::function<void(const Message&, const SampleOrigin&)>;
  // A writer was deleted, or its process has not been heard of for the participants' lease. (Fast
  // DDS tells nothing of the kind a key at a time.)
  using OnGone = std::function<void(const eprosima::fastrtps::rtps::GUID_t& writer)>;

  Reader(Participant& participant, OnSample on_sample, EndpointObserver observer = {},
         OnGone on_gone = {})
      : subscriber_(participant.subscriber_),
        listener_(TopicOf<Message>::kSpec.name, std::move(observer), std::move(on_sample),
                  std::move(on_gone)) {
    auto* topic =
        participant.topic(TopicOf<Message>::kSpec,
                          eprosima::fastdds::dds::TypeSupport(new CheckedTypeSupport<Message>));
    reader_ =
        subscriber_->create_datareader(topic, reader_qos(TopicOf<Message>::kSpec), &listener_);
    if (reader_ == nullptr) {
      throw DdsError("dds: cannot create a reader for topic '" +
                     std::string(TopicOf<Message>::kSpec.name) + "'");
    }
  }
  ~Reader() { subscriber_->delete_datareader(reader_); }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;

  // Writers matched now.
  [[nodiscard]] int matched() const { return listener_.matched(); }

 private:
  class Listener final : public detail::ReaderListener {
   public:
    Listener(std::string_view topic, EndpointObserver observer, OnSample on_sample, OnGone on_gone)
        : ReaderListener(topic, std::move(observer)),
          on_sample_(std::move(on_sample)),
          on_gone_(std::move(on_gone)) {}
    void on_data_available(eprosima::fastdds::dds::DataReader* reader) override {
      eprosima::fastdds::dds::SampleInfo info;
      while (reader->take_next_sample(&message_, &info) == ReturnCode_t::RETCODE_OK) {
        if (!info.valid_data) continue;
        on_sample_(message_, {info.sample_identity.writer_guid(), info.instance_handle});
      }
    }

   private:
    void on_writer_gone(const eprosima::fastrtps::rtps::GUID_t& writer) override {
      if (on_gone_) on_gone_(writer);
    }

    OnSample on_sample_;
    OnGone on_gone_;
    Message message_{};
  };

  eprosima::fastdds::dds::Subscriber* subscriber_;
  Listener listener_;
  eprosima::fastdds::dds::DataReader* reader_ = nullptr;
};

}  // namespace zerodrift::dds
