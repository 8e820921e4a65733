// SPDX-License-Identifier: Apache-2.0
// What the hot topics could be, to be measured side by side.
#include "tests/bench/measured_hop.h"

namespace zerodrift::dds {
namespace {

namespace fdds = eprosima::fastdds::dds;
using WriterQos = fdds::DataWriterQos;
using ReaderQos = fdds::DataReaderQos;
using eprosima::fastrtps::Duration_t;

Duration_t milliseconds(std::uint32_t ms) {
  return {0, ms * 1000000U};
}

// --- single changes

void no_deadline(WriterQos& writer, ReaderQos& reader) {
  writer.deadline().period = eprosima::fastrtps::c_TimeInfinite;
  reader.deadline().period = eprosima::fastrtps::c_TimeInfinite;
}

template <std::uint32_t kMs>
void deadline(WriterQos& writer, ReaderQos& reader) {
  writer.deadline().period = milliseconds(kMs);
  reader.deadline().period = milliseconds(kMs);
}

template <std::uint32_t kMs>
void lease(WriterQos& writer, ReaderQos& reader) {
  writer.liveliness().kind = fdds::MANUAL_BY_TOPIC_LIVELINESS_QOS;
  writer.liveliness().lease_duration = milliseconds(kMs);
  writer.liveliness().announcement_period = milliseconds(kMs / 2);
  reader.liveliness() = writer.liveliness();
}

void best_effort(WriterQos& writer, ReaderQos& reader) {
  writer.reliability().kind = fdds::BEST_EFFORT_RELIABILITY_QOS;
  reader.reliability().kind = fdds::BEST_EFFORT_RELIABILITY_QOS;
}

template <std::uint32_t kMs>
void heartbeat(WriterQos& writer, ReaderQos&) {
  writer.reliable_writer_qos().times.heartbeatPeriod = milliseconds(kMs);
}

template <std::uint32_t kMs>
void suppression(WriterQos& writer, ReaderQos&) {
  writer.reliable_writer_qos().times.nackSupressionDuration = milliseconds(kMs);
}

template <std::uint32_t kMs>
void response_delay(WriterQos&, ReaderQos& reader) {
  reader.reliable_reader_qos().times.heartbeatResponseDelay = milliseconds(kMs);
}

// A history that is always full: one key, 200 samples.
void full_history(WriterQos& writer, ReaderQos& reader) {
  for (auto* limits : {&writer.resource_limits(), &reader.resource_limits()}) {
    limits->max_instances = 1;
    limits->max_samples_per_instance = 200;
    limits->max_samples = 200;
    limits->allocated_samples = 200;
  }
  writer.history().depth = 200;
  reader.history().depth = 200;
}

void no_piggyback(WriterQos& writer, ReaderQos&) {
  writer.reliable_writer_qos().disable_heartbeat_piggyback = true;
}

template <std::uint32_t kMs>
void no_positive_acks(WriterQos& writer, ReaderQos& reader) {
  writer.reliable_writer_qos().disable_positive_acks.enabled = true;
  writer.reliable_writer_qos().disable_positive_acks.duration = milliseconds(kMs);
  reader.reliable_reader_qos().disable_positive_ACKs.enabled = true;
}

void best_effort_reader(WriterQos&, ReaderQos& reader) {
  reader.reliability().kind = fdds::BEST_EFFORT_RELIABILITY_QOS;
}

// Needs payloads of fixed size, of which a process maps all.
void data_sharing(WriterQos& writer, ReaderQos& reader) {
  full_history(writer, reader);
  writer.data_sharing().automatic();
  reader.data_sharing().automatic();
  writer.endpoint().history_memory_policy = eprosima::fastrtps::rtps::PREALLOCATED_MEMORY_MODE;
  reader.endpoint().history_memory_policy = eprosima::fastrtps::rtps::PREALLOCATED_MEMORY_MODE;
}

// --- together

using Change = void (*)(WriterQos&, ReaderQos&);

// Reliable, no deadline, heartbeat and suppression 5 ms, whatever topics.h says; then the changes.
template <Change... kChanges>
void reliable(WriterQos& writer, ReaderQos& reader) {
  no_deadline(writer, reader);
  heartbeat<5>(writer, reader);
  suppression<5>(writer, reader);
  (kChanges(writer, reader), ...);
}

}  // namespace

const std::vector<HopAlternative>& hop_alternatives() {
  constexpr auto kUdp = HopTransport::kUdp;
  // clang-format off
  static const std::vector<HopAlternative> kAll{
      {"best-effort",       "best effort, no deadline: what the others are compared with", kUdp, reliable<best_effort>},
      {"topic",             "angular_rate as topics.h and writer_qos() have it", kUdp, nullptr},
      {"reliable",          "reliable, no deadline, heartbeat 5 ms, nack suppression 5 ms", kUdp, reliable<>},
      {"suppression-0",     "reliable; nack suppression 0: a timer runs out with every sample", kUdp, reliable<suppression<0>>},
      {"suppression-2",     "reliable; nack suppression 2 ms", kUdp, reliable<suppression<2>>},
      {"suppression-20",    "reliable; nack suppression 20 ms", kUdp, reliable<suppression<20>>},
      {"heartbeat-2",       "reliable; heartbeat and nack suppression 2 ms", kUdp, reliable<heartbeat<2>, suppression<2>>},
      {"heartbeat-20",      "reliable; heartbeat and nack suppression 20 ms", kUdp, reliable<heartbeat<20>, suppression<20>>},
      {"response-5",        "reliable; heartbeats answered after 5 ms", kUdp, reliable<response_delay<5>>},
      {"no-acks",           "reliable; no positive acknowledgements, samples kept 100 ms", kUdp, reliable<no_positive_acks<100>>},
      {"full-history",      "reliable; keep last 200 of one key: a heartbeat with every sample", kUdp, reliable<full_history>},
      {"full-no-piggyback", "reliable; keep last 200 of one key, no piggybacked heartbeats", kUdp, reliable<full_history, no_piggyback>},
      {"deadline",          "reliable; deadline 100 ms", kUdp, reliable<deadline<100>>},
      {"best-deadline",     "best effort; deadline 100 ms", kUdp, reliable<best_effort, deadline<100>>},
      {"lease",             "reliable; liveliness MANUAL_BY_TOPIC, lease 20 ms", kUdp, reliable<lease<20>>},
      {"best-reader",       "reliable writer, best-effort reader: nothing is repaired", kUdp, reliable<best_effort_reader>},
      {"shm-best-effort",   "shared-memory transport, best effort", HopTransport::kSharedMemory, reliable<best_effort>},
      {"shm",               "shared-memory transport, reliable", HopTransport::kSharedMemory, reliable<>},
      {"sharing-best",      "data sharing without a key, best effort", HopTransport::kDataSharing, reliable<best_effort, data_sharing>},
      {"sharing",           "data sharing without a key, reliable", HopTransport::kDataSharing, reliable<data_sharing>},
  };
  // clang-format on
  return kAll;
}

const HopAlternative& hop_alternative(std::string_view name) {
  for (const auto& alternative : hop_alternatives()) {
    if (alternative.name == name) return alternative;
  }
  throw DdsError("dds: no alternative is called '" + std::string(name) + "'");
}

}  // namespace zerodrift::dds
