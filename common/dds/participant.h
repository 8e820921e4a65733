// SPDX-License-Identifier: Apache-2.0
// Participants, typed writers and readers. This folder is the only one that knows Fast DDS.
//
// Transport: UDPv4 only. Shared memory fails silently across containers and users, and data sharing
// loses samples (DECISIONS.md). Confined to the loopback interface unless interfaces are named.
#pragma once

#include <atomic>
#include <chrono>
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
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "common/core/samples.h"
#include "common/dds/checked_type_support.h"
#include "common/dds/clean_texts.h"
#include "common/dds/dds_error.h"
#include "common/dds/discovery.h"
#include "common/dds/repeat_filter.h"
#include "common/dds/security.h"
#include "common/dds/topics.h"

namespace zerodrift::dds {

// A participant tells the others that it is there this often; who hears nothing for the lease
// forgets it. One that stood still for as long has not forgotten them, and of Fast DDS 2.9.1 the
// two then may never match again.
inline constexpr std::chrono::seconds kAnnouncementPeriod{2};
inline constexpr std::chrono::seconds kParticipantLease{20};

enum class Transport : std::uint8_t {
  kUdp,
  kSharedMemory  // between processes of this computer; UDP to others, and for discovery
};

struct NetworkOptions {
  std::uint32_t domain = 0;  // 0..232
  std::vector<std::string>
      interfaces;  // IPv4 addresses to use; empty: 127.0.0.1 only, nothing leaves the machine
  std::vector<std::string> peers;        // IPv4 addresses of other hosts; used only with interfaces
  std::filesystem::path security_dir{};  // keys and certificates; empty: no security
  Transport transport = Transport::kUdp;
  // "IPv4" or "IPv4:port" of each discovery server, the same list in the same order in every
  // process; empty: participants look for each other.
  std::vector<std::string> discovery_servers{};
  std::optional<std::size_t> serves{};  // is itself the server of this place in the list
};

// Endpoints meet where they share a partition; "" is that of endpoints that name none.
using Partitions = std::vector<std::string>;

class Participant {
 public:
  Participant(const std::string& name, const NetworkOptions& network);
  ~Participant();
  Participant(const Participant&) = delete;
  Participant& operator=(const Participant&) = delete;

  // Reports what the middleware noticed since the last call, each event to its endpoint's observer,
  // or to `otherwise` where it has none. Observers run here and nowhere else: an endpoint's trouble
  // never holds up its samples. Not from a reader's callback.
  void report_events(const EndpointObserver& otherwise = {}) { discovery_.report(otherwise); }
  // What was refused since the last call: malformed datagrams, and with security much more. As
  // report_events().
  std::vector<SecurityNotice> take_security_notices();
  // Others take part with certificates only, and this participant has none. Any thread.
  [[nodiscard]] bool lacks_certificate() const { return security_->lacks_certificate(); }
  [[nodiscard]] bool is_secured() const noexcept { return is_secured_; }
  // With security: others are here who are proving who they are. Any thread.
  [[nodiscard]] bool awaits_proof() const { return security_->awaits_proof(); }
  // When the oldest datagram came (steady_ns()) that a receiving thread is still busy with, the
  // callbacks of its samples among it; none: all wait for datagrams. Any thread.
  [[nodiscard]] std::optional<std::int64_t> busy_since_ns() const {
    return security_->busy_since_ns();
  }
  // The others' endpoints on this system's topics. Any thread.
  [[nodiscard]] std::vector<RemoteEndpoint> remote_endpoints(std::size_t at_most) {
    return discovery_.remote_endpoints(at_most);
  }
  [[nodiscard]] std::size_t counterparts(std::string_view topic, Direction ours) {
    return discovery_.counterparts(topic, ours);
  }
  // The writer is one of this participant's. Any thread.
  [[nodiscard]] bool is_own(const eprosima::fastrtps::rtps::GUID_t& writer) const {
    return writer.guidPrefix == participant_->guid().guidPrefix;
  }
  // How far discovery has come. Any thread.
  [[nodiscard]] Acquaintance acquaintance() { return discovery_.acquaintance(); }

 private:
  template <typename>
  friend class Writer;
  template <typename, typename>
  friend class Reader;
  template <typename>
  friend class RawReader;

  eprosima::fastdds::dds::Topic* topic(const TopicSpec& spec,
                                       eprosima::fastdds::dds::TypeSupport type);
  // Made when first asked for.
  eprosima::fastdds::dds::Publisher* publisher(const Partitions& partitions);
  eprosima::fastdds::dds::Subscriber* subscriber(const Partitions& partitions);
  // Throw DdsError where the middleware makes none.
  eprosima::fastdds::dds::DataWriter* make_writer(
      eprosima::fastdds::dds::Publisher& publisher, const TopicSpec& spec,
      const eprosima::fastdds::dds::TypeSupport& type,
      eprosima::fastdds::dds::DataWriterListener& listener);
  eprosima::fastdds::dds::DataReader* make_reader(
      eprosima::fastdds::dds::Subscriber& subscriber, const TopicSpec& spec,
      const eprosima::fastdds::dds::TypeSupport& type,
      eprosima::fastdds::dds::DataReaderListener& listener);
  // ": <reason>" where security refused something just now, else empty.
  [[nodiscard]] std::string refusal() const;

  detail::Discovery discovery_;              // outlives the participant, whose listener it is
  std::shared_ptr<SecurityWatch> security_;  // so does this, in front of it
  bool is_secured_ = false;
  eprosima::fastdds::dds::DomainParticipant* participant_ = nullptr;
  std::mutex groups_mutex_;
  std::map<Partitions, eprosima::fastdds::dds::Publisher*> publishers_;
  std::map<Partitions, eprosima::fastdds::dds::Subscriber*> subscribers_;
};

// How a writer went: one that only fell silent may be standing still, and write again.
enum class Departure : std::uint8_t {
  kSilent,  // it wrote nothing for the topic's lease
  kLeft     // it was deleted, or its process gave no sign for the participants' lease
};

// A reader that a writer met: what is written from now on comes to it. The discovery thread.
using OnMet = std::function<void(const eprosima::fastrtps::rtps::GUID_t& reader)>;

eprosima::fastdds::dds::DataWriterQos writer_qos(const TopicSpec& spec);
eprosima::fastdds::dds::DataReaderQos reader_qos(const TopicSpec& spec);

namespace detail {

// False where a missed deadline says nothing: samples that come at the pace of their consumers, and
// those of a gyro that is slower than the topic's deadline.
template <typename Message>
bool deadline_applies(const Message& message) noexcept {
  if constexpr (requires { message.clock_source(); }) {
    const auto source = static_cast<core::ClockSource>(message.clock_source());
    if (core::is_paced_by_consumers(source)) return false;
  }
  if constexpr (requires { message.interval_s(); }) {
    constexpr std::chrono::duration<double> kDeadline = TopicOf<Message>::kSpec.deadline;
    return 2.0 * message.interval_s() <= kDeadline.count();
  }
  return true;
}

template <typename Message>
constexpr std::uint32_t gyro_of([[maybe_unused]] const Message& message) noexcept {
  if constexpr (requires { message.gyro_id(); }) return message.gyro_id();
  return 0;
}

// Counts matches and passes on what went wrong; no sample passes here.
class WriterListener : public eprosima::fastdds::dds::DataWriterListener {
 public:
  WriterListener(Discovery& discovery, const TopicSpec& spec, EndpointObserver observer,
                 OnMet on_met)
      : discovery_(discovery),
        endpoint_(spec, Direction::kWriter, std::move(observer)),
        on_met_(std::move(on_met)) {
    discovery_.enter(endpoint_);
  }
  ~WriterListener() override { discovery_.leave(endpoint_); }
  void on_publication_matched(
      eprosima::fastdds::dds::DataWriter*,
      const eprosima::fastdds::dds::PublicationMatchedStatus& status) override {
    const auto reader = eprosima::fastrtps::rtps::iHandle2GUID(status.last_subscription_handle);
    if (is_foreign(reader)) foreign_.store(true);
    count(reader, status);
    if (on_met_ && status.current_count_change > 0) on_met_(reader);
  }
  void on_offered_incompatible_qos(
      eprosima::fastdds::dds::DataWriter*,
      const eprosima::fastdds::dds::OfferedIncompatibleQosStatus& status) override;
  void on_liveliness_lost(eprosima::fastdds::dds::DataWriter*,
                          const eprosima::fastdds::dds::LivelinessLostStatus& status) override;
  [[nodiscard]] int matched() const { return matched_.load(std::memory_order_acquire); }
  [[nodiscard]] bool met_all() const {
    return matched() >= static_cast<int>(discovery_.matchable(endpoint_.spec, Direction::kWriter));
  }
  [[nodiscard]] bool met_foreign() const { return foreign_.load(); }
  // Before each sample; the writing thread.
  void note_write(bool deadline_applies) noexcept {
    endpoint_.written.note(steady_ns(), deadline_applies, endpoint_.spec.deadline);
  }

 private:
  // Of another vendor's middleware: the first two bytes of a GUID name it (RTPS 2.2, 9.3.1.5).
  static bool is_foreign(const eprosima::fastrtps::rtps::GUID_t& guid) {
    return guid.guidPrefix.value[0] != eprosima::fastrtps::rtps::c_VendorId_eProsima[0] ||
           guid.guidPrefix.value[1] != eprosima::fastrtps::rtps::c_VendorId_eProsima[1];
  }
  // A reader is known to the discovery before it is matched, and may be forgotten before it is
  // unmatched.
  void count(const eprosima::fastrtps::rtps::GUID_t& reader,
             const eprosima::fastdds::dds::PublicationMatchedStatus& status) {
    const std::lock_guard lock(fellows_mutex_);
    if (status.current_count_change < 0) fellows_.erase(reader);
    if (status.current_count_change > 0 && discovery_.is_in_partition(reader))
      fellows_.insert(reader);
    matched_.store(status.current_count - static_cast<int>(fellows_.size()),
                   std::memory_order_release);
  }

  Discovery& discovery_;
  Endpoint endpoint_;
  OnMet on_met_;
  std::mutex fellows_mutex_;
  std::set<eprosima::fastrtps::rtps::GUID_t> fellows_;  // matched, and in partitions
  std::atomic<int> matched_{0};
  std::atomic<bool> foreign_{false};
};

class ReaderListener : public eprosima::fastdds::dds::DataReaderListener {
 public:
  ReaderListener(Discovery& discovery, const TopicSpec& spec, EndpointObserver observer)
      : discovery_(discovery), endpoint_(spec, Direction::kReader, std::move(observer)) {
    endpoint_.deadlines = &deadlines_;
    discovery_.enter(endpoint_);
  }
  ~ReaderListener() override { discovery_.leave(endpoint_); }
  void on_subscription_matched(
      eprosima::fastdds::dds::DataReader*,
      const eprosima::fastdds::dds::SubscriptionMatchedStatus& status) override;
  void on_liveliness_changed(
      eprosima::fastdds::dds::DataReader*,
      const eprosima::fastdds::dds::LivelinessChangedStatus& status) override;
  void on_requested_incompatible_qos(
      eprosima::fastdds::dds::DataReader*,
      const eprosima::fastdds::dds::RequestedIncompatibleQosStatus& status) override;
  void on_sample_lost(eprosima::fastdds::dds::DataReader*,
                      const eprosima::fastdds::dds::SampleLostStatus& status) override;
  void on_sample_rejected(eprosima::fastdds::dds::DataReader*,
                          const eprosima::fastrtps::SampleRejectedStatus& status) override;
  [[nodiscard]] int matched() const { return matched_.load(std::memory_order_acquire); }

 protected:
  WriterDeadlines& deadlines() noexcept { return deadlines_; }

 private:
  virtual void on_writer_gone(const eprosima::fastrtps::rtps::GUID_t& writer,
                              Departure departure) = 0;

  Discovery& discovery_;
  WriterDeadlines deadlines_;
  Endpoint endpoint_;
  std::mutex silent_mutex_;
  std::set<eprosima::fastrtps::rtps::GUID_t> silent_;  // matched, and said to be gone
  std::atomic<int> matched_{0};
};

}  // namespace detail

// One writer of one topic. write() is for one thread at a time.
template <typename Message>
class Writer {
 public:
  explicit Writer(Participant& participant, EndpointObserver observer = {},
                  const Partitions& partitions = {}, OnMet on_met = {})
      : Writer(participant, TopicOf<Message>::kSpec, std::move(observer), partitions,
               std::move(on_met)) {}
  // On a topic whose name the user chose. The spec is the caller's and outlives the writer.
  Writer(Participant& participant, const TopicSpec& spec, EndpointObserver observer,
         const Partitions& partitions = {}, OnMet on_met = {})
      : publisher_(participant.publisher(partitions)),
        listener_(participant.discovery_, spec, std::move(observer), std::move(on_met)) {
    writer_ = participant.make_writer(
        *publisher_, spec, eprosima::fastdds::dds::TypeSupport(new CheckedTypeSupport<Message>),
        listener_);
  }
  // Empties the history first: Fast DDS 2.9 goes on sending heartbeats while it releases what is
  // kept, and one that meets released samples looks for holes between their numbers, which are 0:
  // for good, with the writer's mutex held (DECISIONS.md).
  ~Writer() {
    std::size_t removed = 0;
    writer_->clear_history(&removed);
    publisher_->delete_datawriter(writer_);
  }
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  // False: the middleware refused the sample.
  bool write(Message& message) noexcept {
    if constexpr (TopicOf<Message>::kSpec.deadline.count() > 0)
      listener_.note_write(detail::deadline_applies(message));
    return writer_->write(&message);
  }

  // Readers matched now, but for those in partitions, in which instances read each other.
  [[nodiscard]] int matched() const { return listener_.matched(); }
  // All readers that have announced themselves are matched, which with security takes a while, but
  // for those in partitions. Not for the data path.
  [[nodiscard]] bool met_all() const { return listener_.met_all(); }
  // A reader of another vendor's middleware was matched once.
  [[nodiscard]] bool met_foreign() const { return listener_.met_foreign(); }

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

// One reader of one topic. What it gives out has clean texts (clean_texts.h). on_sample runs on the
// participant's receiving thread, one at a time, as samples arrive; on_gone runs on its discovery
// thread. Of the same sample from several writers the first is given out, or with `EveryCopy` each.
template <typename Message, typename Filter = RepeatFilter<Message>>
class Reader {
 public:
  using OnSample = std::function<void(const Message&, const SampleOrigin&)>;
  // A writer that fell silent and then leaves is reported twice. (Fast DDS reports nothing of the
  // kind a key at a time.)
  using OnGone =
      std::function<void(const eprosima::fastrtps::rtps::GUID_t& writer, Departure departure)>;

  Reader(Participant& participant, OnSample on_sample, EndpointObserver observer = {},
         OnGone on_gone = {}, const Partitions& partitions = {})
      : Reader(participant, TopicOf<Message>::kSpec, std::move(on_sample), std::move(observer),
               std::move(on_gone), partitions) {}
  // On a topic whose name the user chose. The spec is the caller's and outlives the reader.
  Reader(Participant& participant, const TopicSpec& spec, OnSample on_sample,
         EndpointObserver observer = {}, OnGone on_gone = {}, const Partitions& partitions = {})
      : subscriber_(participant.subscriber(partitions)),
        listener_(participant.discovery_, spec, std::move(observer), std::move(on_sample),
                  std::move(on_gone)) {
    reader_ = participant.make_reader(
        *subscriber_, spec, eprosima::fastdds::dds::TypeSupport(new CheckedTypeSupport<Message>),
        listener_);
  }
  ~Reader() { subscriber_->delete_datareader(reader_); }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;

  // Writers matched now.
  [[nodiscard]] int matched() const { return listener_.matched(); }

 private:
  class Listener final : public detail::ReaderListener {
   public:
    Listener(detail::Discovery& discovery, const TopicSpec& spec, EndpointObserver observer,
             OnSample on_sample, OnGone on_gone)
        : ReaderListener(discovery, spec, std::move(observer)),
          on_sample_(std::move(on_sample)),
          on_gone_(std::move(on_gone)) {}
    void on_data_available(eprosima::fastdds::dds::DataReader* reader) override {
      eprosima::fastdds::dds::SampleInfo info;
      while (reader->take_next_sample(&message_, &info) == ReturnCode_t::RETCODE_OK) {
        if (!info.valid_data) continue;
        clean_texts(message_);
        const SampleOrigin origin{info.sample_identity.writer_guid(), info.instance_handle,
                                  info.sample_identity.sequence_number().to64long()};
        if constexpr (TopicOf<Message>::kSpec.deadline.count() > 0)
          deadlines().note(origin, detail::gyro_of(message_), detail::deadline_applies(message_),
                           TopicOf<Message>::kSpec.deadline);
        if (!repeats_.is_repeat(message_, origin.writer)) on_sample_(message_, origin);
      }
    }

   private:
    void on_writer_gone(const eprosima::fastrtps::rtps::GUID_t& writer,
                        Departure departure) override {
      if (on_gone_) on_gone_(writer, departure);
    }

    OnSample on_sample_;
    OnGone on_gone_;
    Message message_{};
    Filter repeats_;
  };

  eprosima::fastdds::dds::Subscriber* subscriber_;
  Listener listener_;
  eprosima::fastdds::dds::DataReader* reader_ = nullptr;
};

}  // namespace zerodrift::dds
