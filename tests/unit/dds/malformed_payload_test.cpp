// SPDX-License-Identifier: Apache-2.0
// Anybody in the domain may write a payload that is no message. It is dropped, and what comes after
// it is heard.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <vector>

#include "common/dds/checked_type_support.h"
#include "common/dds/participant.h"
#include "tests/unit/dds/test_domain.h"

namespace zerodrift::dds {
namespace {

using eprosima::fastrtps::rtps::SerializedPayload_t;

template <typename Message>
std::vector<std::uint8_t> payload_of(Message message) {
  typename TopicOf<Message>::TypeSupport type;
  SerializedPayload_t payload(type.getSerializedSizeProvider(&message)());
  EXPECT_TRUE(type.serialize(&message, &payload));
  return {payload.data, payload.data + payload.length};
}

template <typename Message>
bool is_read(const std::vector<std::uint8_t>& bytes) {
  SerializedPayload_t payload(static_cast<std::uint32_t>(bytes.size()));
  std::copy(bytes.begin(), bytes.end(), payload.data);
  payload.length = static_cast<std::uint32_t>(bytes.size());
  Message message;
  return CheckedTypeSupport<Message>().deserialize(&payload, &message);
}

TEST(MalformedPayload, OfAnUnknownEncapsulationIsRefused) {
  auto bytes = payload_of(msg::AngularRate());
  EXPECT_TRUE(is_read<msg::AngularRate>(bytes));
  for (const int kind : {0x04, 0x7F, 0xFF}) {
    bytes[1] = static_cast<std::uint8_t>(kind);
    EXPECT_FALSE(is_read<msg::AngularRate>(bytes)) << kind;
  }
  bytes = payload_of(msg::AngularRate());
  bytes[0] = 1;
  EXPECT_FALSE(is_read<msg::AngularRate>(bytes));
}

TEST(MalformedPayload, CutAnywhereIsRefused) {
  msg::ServiceStatus status;
  status.service("compensation");
  status.metrics().resize(2);
  const auto bytes = payload_of(status);
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_FALSE(is_read<msg::ServiceStatus>(
        {bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size)}))
        << size;
  }
}

TEST(MalformedPayload, WithMoreThanTheTypesBoundIsRefused) {
  msg::AllanReport report;
  report.since_start().resize(160);
  report.rolling().resize(160);
  EXPECT_TRUE(is_read<msg::AllanReport>(payload_of(report)));
  report.since_start().resize(161);
  EXPECT_FALSE(is_read<msg::AllanReport>(payload_of(report)));
}

// Writes what it is given in place of the type's own form.
class WrongRate final : public msg::AngularRatePubSubType {
 public:
  explicit WrongRate(std::atomic<bool>& wrong) : wrong_(wrong) {}
  bool serialize(void* data, SerializedPayload_t* payload) override {
    if (!msg::AngularRatePubSubType::serialize(data, payload)) return false;
    if (wrong_) payload->data[1] = 0x7F;
    return true;
  }

 private:
  std::atomic<bool>& wrong_;
};

// Rule: a sample that can't be read costs that sample and nothing else: not the process, not the
// samples behind it.
TEST(MalformedPayload, EndsNoReaderAndHidesNoSampleBehindIt) {
  namespace fdds = eprosima::fastdds::dds;
  const TestDomain domain(106);
  Participant there("reader", domain.network());
  std::atomic<std::uint64_t> newest{0};
  std::atomic<std::uint64_t> received{0};
  Reader<msg::AngularRate> reader(there, [&](const msg::AngularRate& message, const SampleOrigin&) {
    ++received;
    newest = message.sequence_number();
  });

  // A participant of the project, for its network; its writer is made by hand.
  Participant here("writer", domain.network());
  auto* participant = fdds::DomainParticipantFactory::get_instance()
                          ->lookup_participants(domain.network().domain)
                          .back();
  std::atomic<bool> wrong{false};
  fdds::TypeSupport type(new WrongRate(wrong));
  ASSERT_EQ(type.register_type(participant), ReturnCode_t::RETCODE_OK);
  auto* topic = participant->create_topic(std::string(kAngularRate.name), type.get_type_name(),
                                          fdds::TOPIC_QOS_DEFAULT);
  ASSERT_NE(topic, nullptr);
  auto* publisher = participant->create_publisher(fdds::PUBLISHER_QOS_DEFAULT);
  auto* writer = publisher->create_datawriter(topic, writer_qos(kAngularRate));
  ASSERT_NE(writer, nullptr);
  const auto readers = [&] {
    fdds::PublicationMatchedStatus status;
    writer->get_publication_matched_status(status);
    return status.current_count;
  };
  ASSERT_TRUE(eventually([&] { return reader.matched() == 1 && readers() == 1; }));

  msg::AngularRate message;
  message.gyro_id(1);
  for (std::uint64_t sequence = 1; sequence <= 9; ++sequence) {
    wrong = sequence % 3 == 2;
    message.sequence_number(sequence);
    EXPECT_TRUE(writer->write(&message));
  }
  EXPECT_TRUE(eventually([&] { return newest == 9; })) << newest;
  EXPECT_EQ(received, 6U);

  publisher->delete_datawriter(writer);
  participant->delete_publisher(publisher);
  participant->delete_topic(topic);
}

}  // namespace
}  // namespace zerodrift::dds
