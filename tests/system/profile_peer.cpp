// SPDX-License-Identifier: Apache-2.0
// profile_peer PROFILES DOMAIN SAMPLES: an application of others, which knows of the system the
// type and a file of deploy/profiles. Prints gyro, sequence number and applied drift of each
// sample; exit code 0 once it has so many.
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fastdds/dds/core/condition/WaitSet.hpp>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <string>

#include "idl/dds/compensated_ratePubSubTypes.h"

namespace {

using namespace eprosima::fastdds::dds;

int fail(const char* what) {
  std::fprintf(stderr, "profile_peer: %s\n", what);
  return 2;
}

std::uint64_t print_new(DataReader& reader) {
  std::uint64_t taken = 0;
  zerodrift::msg::CompensatedRate sample;
  SampleInfo info;
  while (reader.take_next_sample(&sample, &info) == ReturnCode_t::RETCODE_OK) {
    if (!info.valid_data) continue;
    ++taken;
    std::printf("%u %llu %a\n", sample.gyro_id(),
                static_cast<unsigned long long>(sample.sequence_number()),
                sample.applied_drift_radps()[0]);
  }
  return taken;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) return fail("expected PROFILES DOMAIN SAMPLES");
  const auto domain = static_cast<DomainId_t>(std::strtoul(argv[2], nullptr, 10));
  const std::uint64_t samples = std::strtoull(argv[3], nullptr, 10);

  auto* factory = DomainParticipantFactory::get_instance();
  if (factory->load_XML_profiles_file(argv[1]) != ReturnCode_t::RETCODE_OK)
    return fail("the file of profiles is not taken");
  auto* participant = factory->create_participant_with_profile(domain, "zerodrift");
  if (participant == nullptr) return fail("no participant of profile zerodrift");
  TypeSupport type(new zerodrift::msg::CompensatedRatePubSubType);
  type.register_type(participant, "zerodrift::msg::CompensatedRate");
  auto* topic = participant->create_topic("compensated_rate", "zerodrift::msg::CompensatedRate",
                                          TOPIC_QOS_DEFAULT);
  auto* subscriber = participant->create_subscriber(SUBSCRIBER_QOS_DEFAULT);
  auto* reader = subscriber->create_datareader_with_profile(topic, "compensated_rate");
  if (reader == nullptr) return fail("no reader of profile compensated_rate");

  WaitSet waiting;
  reader->get_statuscondition().set_enabled_statuses(StatusMask::data_available());
  waiting.attach_condition(reader->get_statuscondition());
  ConditionSeq active;
  for (std::uint64_t taken = 0; taken < samples; taken += print_new(*reader))
    waiting.wait(active, eprosima::fastrtps::Duration_t(1, 0));
  waiting.detach_condition(reader->get_statuscondition());
  participant->delete_contained_entities();
  factory->delete_participant(participant);
  return 0;
}
